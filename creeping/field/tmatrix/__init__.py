"""T-matrices: what a body scatters of every incident wave at once."""
