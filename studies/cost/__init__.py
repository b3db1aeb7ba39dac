"""What rays, maps, sweeps and fields cost, and how exact they are for it."""
