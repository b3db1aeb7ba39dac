"""Special functions of diffraction by smooth bodies: Airy, Fock and Pekeris."""
