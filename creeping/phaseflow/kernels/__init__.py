"""Compiled look-up and composition of maps."""
