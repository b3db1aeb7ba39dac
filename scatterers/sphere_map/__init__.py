"""Maps from the unit sphere to star-shaped bodies."""
