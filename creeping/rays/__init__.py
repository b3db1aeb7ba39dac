"""Shadow lines, fans of creeping rays and their iso-phase curves; of wavenumbers only how long rays have to be."""
