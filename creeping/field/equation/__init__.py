"""The integral equation of a body between the nodes of tiles, edges and tips included."""
