"""Margins and sensitivities of a loop."""
