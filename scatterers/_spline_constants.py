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
# values that stand before the coefficients in the flat parameters: shape, origin, 1/spacing, centre, half axes
HEADER = 15
# lanes that the kernels load beyond the last row
OVERREAD = 2
# cells by which the polynomial of the last cell is continued beyond the grid
BEYOND = 1.0
# iterations of the search for a radius
ITERATIONS = 60
# a Newton step this small, relative to the radius, leaves an error below rounding
SMALL = 1e-8
