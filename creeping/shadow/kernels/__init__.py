"""Compiled steps of a shadow line, from a mesh to the arcs that launch rays."""
