"""Bench tests: steps, triangles, staircases, holding, rate, heat, free play."""
