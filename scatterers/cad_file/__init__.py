"""CAD files through gmsh, in a process of its own."""
