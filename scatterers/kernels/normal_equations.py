"""Compiled normal equations of a quintic tensor-product B-spline; importing this module imports numba.

Sources: Derivations, B6.
"""

from numba import njit

from scatterers.kernels.compiled import OPTIONS
from scatterers.kernels.tensor import contract_first, scatter


@njit(cache=True, nogil=True, **OPTIONS)
def accumulate(places, values, slopes, weights, shape, c, out):  # type: ignore[no-untyped-def]
    """Add A^T W (b - A c) to out; returns (b - A c)^T W (b - A c). The numpy twin is `spline.fitting.accumulate_numpy`.

    Rows of A are f and its three slopes at places (m, 3) in cells, where the six coefficients of an axis begin at
    floor(place); b are values (m,) and slopes (m, 3), W the weights of values and of slopes. Coefficients c and out
    are flat, C-ordered of the shape, with `OVERREAD` numbers behind.
    """
    stride_y = shape[2]
    stride_x = shape[1] * stride_y
    total = 0.0
    for i in range(places.shape[0]):
        i0, i1, i2 = int(places[i, 0]), int(places[i, 1]), int(places[i, 2])
        tx, ty, tz = places[i, 0] - i0, places[i, 1] - i1, places[i, 2] - i2
        start = i0 * stride_x + i1 * stride_y + i2
        f, fx, fy, fz = contract_first(c, start, stride_x, stride_y, tx, ty, tz)
        r, rx, ry, rz = values[i] - f, slopes[i, 0] - fx, slopes[i, 1] - fy, slopes[i, 2] - fz
        total += weights[0] * r * r + weights[1] * (rx * rx + ry * ry + rz * rz)
        residual = (weights[0] * r, weights[1] * rx, weights[1] * ry, weights[1] * rz)
        scatter(out, start, stride_x, stride_y, tx, ty, tz, residual)
    return total


@njit(cache=True, nogil=True, **OPTIONS)
def subtract_roughness(weight, shape, ranges, bands, c, out):  # type: ignore[no-untyped-def]
    """Subtract w D^T D c from out, D the fourth differences along each axis in turn, of coefficients as above.

    Only in ``ranges`` (nx ny, 2) of k, one for each row of coefficients along the last axis. Bands of D^T D along the
    three axes are (9, nx + ny + nz), from four below the diagonal to four above it; `spline.fitting.fourth_bands`.
    """
    nx, ny, nz = shape[0], shape[1], shape[2]
    stride_y = nz
    stride_x = ny * stride_y
    for i in range(nx):
        for j in range(ny):
            first, last = ranges[i * ny + j, 0], ranges[i * ny + j, 1]
            if last <= first:
                continue
            row = i * stride_x + j * stride_y
            for s in range(-4, 5):
                if 0 <= i + s < nx:
                    _subtract(weight * bands[s + 4, i], row + s * stride_x, row, first, last, c, out)
                if 0 <= j + s < ny:
                    _subtract(weight * bands[s + 4, nx + j], row + s * stride_y, row, first, last, c, out)
                for k in range(max(first, -s), min(last, nz - s)):
                    out[row + k] -= weight * bands[s + 4, nx + ny + k] * c[row + k + s]


@njit(cache=True, nogil=True, inline="always", **OPTIONS)
def _subtract(weight, source, row, first, last, c, out):  # type: ignore[no-untyped-def]
    for k in range(first, last):
        out[row + k] -= weight * c[source + k]
