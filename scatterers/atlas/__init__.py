"""Charts and atlases of bodies."""
