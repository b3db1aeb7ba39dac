"""Coordinates of the unit tangent bundle in which maps are stored and composed."""
