"""Exact bodies of smooth pieces: of revolution, and what is chosen by an expression."""
