"""Probability of hunting over tolerances."""
