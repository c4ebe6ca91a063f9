"""Friction laws: what a mesh asks of its friction, and the laws that answer."""
