"""Elasticity laws: tooth springs, backlash around them, and errors of the teeth."""
