"""Compiled S D S of a grid, S from values at nodes to coefficients of B-splines; see `scatterers.spline.cardinal`.

B = L diag(d) L^T along each axis, L with ones on its diagonal and two bands below it: S takes a sweep down and one up,
x_i - l_i x_(i-1) - m_i x_(i-2), then x_i/d_i - l_(i+1) x_(i+1) - m_(i+2) x_(i+2). The axes commute, so S D S takes
three passes over the grid, of slabs that stay in the cache: the last two axes; the first one, D, the first one; the
last two. In between the last two axes are exchanged, so that every sweep takes whole rows at a time.
Factors are (3, n): l, m and 1/d. Importing this module imports numba.

Sources: Derivations, B6.
"""

import numpy as np
from numba import njit

from scatterers.kernels.compiled import OPTIONS

TILE = 8
"""Rows exchanged at a time."""


@njit(cache=True, nogil=True, **OPTIONS)
def twice(values, damping, wanted, first, second, third, work, out):  # type: ignore[no-untyped-def]
    """Fill out (nx, ny, nz) with S (D S values) where wanted, else zero.

    Values, zero where they are not wanted, and ``wanted`` have its shape; the numbers ``damping`` of D, and the numbers
    that are worked on, have (nx, nz, ny).
    """
    nx, ny, nz = values.shape
    filled = np.zeros(nx, np.bool_)
    plane, slab = np.empty((ny, nz)), np.empty((nx, ny))
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                plane[j, k] = values[i, j, k]
                filled[i] |= values[i, j, k] != 0.0
        if filled[i]:
            _solve(second, plane)
            _exchange(plane, work[i])
            _solve(third, work[i])
        else:
            work[i] = 0.0
    for k in range(nz):
        for i in range(nx):
            slab[i] = work[i, k]
        _solve(first, slab)
        for i in range(nx):
            for j in range(ny):
                slab[i, j] *= damping[i, k, j]
        _solve(first, slab)
        for i in range(nx):
            work[i, k] = slab[i]
    for i in range(nx):
        # nothing is wanted where no value is
        if not filled[i]:
            out[i] = 0.0
            continue
        _solve(third, work[i])
        _exchange(work[i], plane)
        _solve(second, plane)
        for j in range(ny):
            for k in range(nz):
                out[i, j, k] = plane[j, k] if wanted[i, j, k] else 0.0


@njit(**OPTIONS)
def _exchange(x, out):  # type: ignore[no-untyped-def]
    """Fill out (m, n) with x (n, m) transposed."""
    n, m = x.shape
    tiles = n // TILE
    for tile in range(tiles):
        j = tile * TILE
        for k in range(m):
            for b in range(TILE):
                out[k, j + b] = x[j + b, k]
    for j in range(tiles * TILE, n):
        for k in range(m):
            out[k, j] = x[j, k]


@njit(**OPTIONS)
def _solve(factors, x):  # type: ignore[no-untyped-def]
    """S along the first axis of x (n, m), n >= 2, in place."""
    n, m = x.shape
    for k in range(m):
        x[1, k] = x[1, k] - factors[0, 1] * x[0, k]
    for i in range(2, n):
        near, far = factors[0, i], factors[1, i]
        row, before, second = x[i], x[i - 1], x[i - 2]
        for k in range(m):
            row[k] = row[k] - near * before[k] - far * second[k]
    for k in range(m):
        x[n - 1, k] *= factors[2, n - 1]
        x[n - 2, k] = x[n - 2, k] * factors[2, n - 2] - factors[0, n - 1] * x[n - 1, k]
    for step in range(2, n):
        i = n - 1 - step
        near, far, scale = factors[0, i + 1], factors[1, i + 2], factors[2, i]
        row, before, second = x[i], x[i + 1], x[i + 2]
        for k in range(m):
            row[k] = row[k] * scale - near * before[k] - far * second[k]
