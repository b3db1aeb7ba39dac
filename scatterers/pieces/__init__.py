"""Bodies of smooth pieces that meet in edges, joints and tips."""
