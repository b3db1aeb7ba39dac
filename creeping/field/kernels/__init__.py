"""Compiled sums over the currents of a body."""
