"""A page on which the incidence is turned by hand, and shadow line, rays, iso-phase curves and field follow."""
