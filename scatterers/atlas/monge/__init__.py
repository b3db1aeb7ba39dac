"""Atlas of graphs over tangent planes, for bodies of any genus."""
