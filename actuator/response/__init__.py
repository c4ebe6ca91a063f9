"""Frequency responses, stiffness and bench tests by simulation."""
