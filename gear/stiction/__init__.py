"""Which contacts hold and which let go, of all that are at rest together."""
