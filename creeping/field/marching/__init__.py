"""Waves along rays of any curvature, by marching the boundary layer."""
