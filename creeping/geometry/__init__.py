"""The body F = 0 and the sphere of directions; no rays."""
