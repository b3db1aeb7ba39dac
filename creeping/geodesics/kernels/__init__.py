"""Compiled right-hand sides, steps and quadratures along geodesics."""
