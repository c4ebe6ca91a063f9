"""Exact periodic orbits, continuous and sampled."""
