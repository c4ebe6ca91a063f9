"""Pictures of results; the only room of this package that draws."""
