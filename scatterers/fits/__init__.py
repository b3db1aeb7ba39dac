"""Bodies fitted to points and normals: quintic tensor-product splines, one for each smooth piece."""
