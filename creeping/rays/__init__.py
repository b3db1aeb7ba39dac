"""Shadow lines, fans of creeping rays and their iso-phase curves; knows nothing of wavenumbers."""
