"""Compiled functions of the bodies; the only room that imports numba at module level."""
