"""Triangle meshes: files, topology, quality, osculating jets."""
