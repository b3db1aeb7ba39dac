"""How exact bodies and fields are, and whether stated errors cover the true ones."""
