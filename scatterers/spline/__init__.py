"""Quintic tensor-product splines F(x), and their fit to points and normals."""
