"""Compiled level of a body of pieces, each a quintic tensor-product B-spline; see `scatterers.pieces.selection`.

Voxels have programs in postfix order: the number of a piece asks for its F, -1 takes the larger of the last two values,
-2 the smaller; -3 takes the last one where a.x > b, else the one before, a (3) and b standing behind it. Importing this
module imports numba.

Parameters: origin of the voxels (3), 1/side, their numbers along the axes (3), where the table of voxels begins, where
that of the pieces does; the table gives for each voxel the place of its program, which stands behind its length; that
of the pieces gives the place of the parameters of each spline.

Also here: what stands in programs of bodies of pieces, which `scatterers.pieces.selection` shares with the compiled
level.
"""

import numpy as np
from numba import njit

from scatterers.kernels.compiled import OPTIONS
from scatterers.kernels.tensor import second_derivatives, value_and_gradient

LARGER, SMALLER, BESIDES = -1, -2, -3
"""Of the last two values, in a program; the last names a plane."""
MOST_PIECES = 8
"""Values that a program holds at a time."""
FIRST = 9
"""Parameters before the tables."""


@njit(**OPTIONS)
def _place(x, origin, per_side, count):  # type: ignore[no-untyped-def]
    """Voxel along one axis, the nearest for a point outside."""
    # comparisons with NaN are false, so a NaN lands in voxel 0 and no undefined cast is made
    g = (x - origin) * per_side
    g = g if g > 0.0 else 0.0
    return int(g if g < count - 1.0 else count - 1.0)


@njit(**OPTIONS)
def chosen(x, y, z, parameters):  # type: ignore[no-untyped-def]
    """Number of the piece whose F is that of the body at a point."""
    cell = _place(x, parameters[0], parameters[3], parameters[4])
    cell = cell * int(parameters[5]) + _place(y, parameters[1], parameters[3], parameters[5])
    cell = cell * int(parameters[6]) + _place(z, parameters[2], parameters[3], parameters[6])
    entry = int(parameters[int(parameters[7]) + cell])
    length, number = int(parameters[entry]), int(parameters[entry + 1])
    if length == 1:
        return number
    pieces, height = int(parameters[8]), 0
    values, numbers = np.empty(MOST_PIECES), np.empty(MOST_PIECES, np.int64)
    k, end = entry + 1, entry + 1 + length
    while k < end:
        token = int(parameters[k])
        k += 1
        if token >= 0:
            own = parameters[int(parameters[pieces + token]) :]
            values[height], numbers[height] = value_and_gradient(x, y, z, own)[0], token
            height += 1
            continue
        height -= 1
        if token == BESIDES:
            last = parameters[k] * x + parameters[k + 1] * y + parameters[k + 2] * z > parameters[k + 3]
            k += 4
        else:
            last = (values[height] > values[height - 1]) == (token == LARGER)
        if last:
            values[height - 1], numbers[height - 1] = values[height], numbers[height]
    return numbers[0]


def evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block of points."""
    pieces = int(parameters[8])
    for i in range(points.shape[1]):
        x = points[0, i], points[1, i], points[2, i]
        number = chosen(*x, parameters)
        found = second_derivatives(*x, parameters[int(parameters[pieces + number]) :])
        values[i] = found[0]
        for k in range(3):
            gradients[k, i] = found[1 + k]
        for k in range(6):
            hessians[k, i] = found[4 + k]


evaluate.operations = 1400.0  # type: ignore[attr-defined]


@njit(cache=True)
def numbers(points, found, parameters):  # type: ignore[no-untyped-def]
    """Fill the numbers of the pieces at points (n, 3)."""
    for i in range(len(points)):
        found[i] = chosen(points[i, 0], points[i, 1], points[i, 2], parameters)
