"""Bodies given by an expression: parsing, search of the body, singular points."""
