"""Fields between ports, antennas and places on a body, by the geodesics between them."""
