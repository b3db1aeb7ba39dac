"""Compiled parts of the geometry."""
