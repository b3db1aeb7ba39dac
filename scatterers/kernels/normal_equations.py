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
def subtract_roughness(weight, shape, c, out):  # type: ignore[no-untyped-def]
    """Subtract w D^T D c from out, D the fourth differences along each axis in turn, of coefficients as above."""
    stride_y = shape[2]
    stride_x = shape[1] * stride_y
    for i in range(shape[0]):
        for j in range(shape[1]):
            row = i * stride_x + j * stride_y
            for k in range(shape[2]):
                at = row + k
                if i + 4 < shape[0]:
                    _fourth(weight, at, stride_x, c, out)
                if j + 4 < shape[1]:
                    _fourth(weight, at, stride_y, c, out)
                if k + 4 < shape[2]:
                    _fourth(weight, at, 1, c, out)


@njit(cache=True, nogil=True, inline="always", **OPTIONS)
def _fourth(weight, at, step, c, out):  # type: ignore[no-untyped-def]
    far, near, middle = c[at] + c[at + 4 * step], c[at + step] + c[at + 3 * step], c[at + 2 * step]
    rough = weight * (far - 4.0 * near + 6.0 * middle)
    out[at] -= rough
    out[at + step] += 4.0 * rough
    out[at + 2 * step] -= 6.0 * rough
    out[at + 3 * step] += 4.0 * rough
    out[at + 4 * step] -= rough
