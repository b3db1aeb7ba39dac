"""Charts of bodies: sphere maps of star-shaped ones, graphs over tangent planes of any other."""
