"""Families of orbits over a parameter, and where hunting ends."""
