"""Constants that the quintic spline and the radial map over it share with their compiled twins."""

import numpy as np

# w_j(t) = sum_m POWERS[m, j] t^m
POWERS = (
    np.array(
        [
            [1, 26, 66, 26, 1, 0],
            [-5, -50, 0, 50, 5, 0],
            [10, 20, -60, 20, 10, 0],
            [-10, 20, 0, -20, 10, 0],
            [5, -20, 30, -20, 5, 0],
            [-1, 5, -10, 10, -5, 1],
        ]
    )
    / 120
)
# degree of the spine's polynomials
DEGREE = 6
# how far the polynomials go, in halves of the range they are fitted to: slanted tips pass between the grid's edges
REACH = 1.5
# where values stand in the flat parameters: shape, origin and 1/spacing of the grid from 0 on, then those of a radial
# map: centre, half axes, axis of the spine with the middle and 1/half of its range (0 for no spine), shifts along x, y
# and z, box of the sheared grid about the centre; behind them the coefficients
CENTRE, HALF_AXES, AXIS, MIDDLE, PER_HALF, SHIFTS = 9, 12, 15, 16, 17, 18
BOX = SHIFTS + 3 * (DEGREE + 1)
HEADER = BOX + 6
# lanes that the kernels load beyond the last row
OVERREAD = 2
# cells by which the polynomial of the last cell is continued beyond the grid
BEYOND = 1.0
# iterations of the search for a radius
ITERATIONS = 60
# a Newton step this small, relative to the radius, leaves an error below rounding
SMALL = 1e-8
