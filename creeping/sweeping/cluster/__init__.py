"""Sweeps over many processes or machines."""
