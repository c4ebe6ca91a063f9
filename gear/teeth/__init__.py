"""Teeth: pairs of wheels, their geometry, and how their teeth engage."""
