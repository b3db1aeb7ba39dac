"""Figures, each a function that draws it and tells what it measured."""
