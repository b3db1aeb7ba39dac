"""The geodesic flow on the unit tangent bundle and its phase maps; knows bodies, not waves."""
