"""Compiled parts of shadow lines: nodes on a mesh, steps onto the line, crossings of pictures."""
