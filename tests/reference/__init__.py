"""Exact fields to judge the asymptotic code by: series, residue sums, fundamental solutions; nothing of `creeping`."""
