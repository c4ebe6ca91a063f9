"""Gains from a specification, and what becomes of them over tolerances."""
