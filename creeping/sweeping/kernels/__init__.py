"""Compiled sums over the nodes of a stencil."""
