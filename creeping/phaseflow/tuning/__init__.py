"""The choice of what meets a tolerance: horizon, grid and degree of a map, or direct integration."""
