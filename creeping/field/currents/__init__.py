"""Currents of the whole body, and what they radiate."""
