"""What stands in programs of bodies of pieces, which `scatterers.pieces.selection` shares with the compiled level."""

LARGER, SMALLER, BESIDES = -1, -2, -3
"""Of the last two values, in a program; the last names a plane."""
MOST_PIECES = 8
"""Values that a program holds at a time."""
FIRST = 9
"""Parameters before the tables."""
