"""Compiled normal equations of a quintic tensor-product B-spline; importing this module imports numba.

Sources: Derivations, B6.
"""

from numba import njit

from scatterers.kernels.compiled import OPTIONS
from scatterers.kernels.tensor import contract_first, scatter


@njit(cache=True, nogil=True, **OPTIONS)
def accumulate(places, values, slopes, weights, shape, c, out):  # type: ignore[no-untyped-def]
    """Add A^T W (b - A c) to out; returns (b - A c)^T W (b - A c).

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
    three axes are (9, nx + ny + nz), from four below the diagonal to four above it; `spline.roughness.fourth_bands`.
    """
    nx, ny, nz = shape[0], shape[1], shape[2]
    stride_y = nz
    stride_x = ny * stride_y
    along_z = bands[:, nx + ny :]
    for i in range(nx):
        for j in range(ny):
            first, last = ranges[i * ny + j, 0], ranges[i * ny + j, 1]
            if last <= first:
                continue
            start = i * stride_x + j * stride_y + first
            into = out[start : start + last - first]
            _subtract(weight, bands[:, i], i, nx, stride_x, start, c, into)
            _subtract(weight, bands[:, nx + j], j, ny, stride_y, start, c, into)
            # bands are those of the middle but for four rows at the ends
            low, high = min(max(first, 4), last), max(min(last, nz - 4), first)
            for k in range(first, last):
                if low <= k < high:
                    continue
                for s in range(max(-4, -k), min(5, nz - k)):
                    into[k - first] -= weight * along_z[s + 4, k] * c[start + k - first + s]
            if high > low:
                at, middle = start + low - first, along_z[:, low]
                _subtract_around(weight, middle, 1, at, c, into[low - first : high - first])


@njit(nogil=True, **OPTIONS)
def _subtract(weight, bands, i, n, stride, start, c, out):  # type: ignore[no-untyped-def]
    """Subtract the sum of w bands[s + 4] c of the rows s = -4 .. 4 further along an axis of n, where they are."""
    if 4 <= i < n - 4:
        _subtract_around(weight, bands, stride, start, c, out)
        return
    for s in range(max(-4, -i), min(5, n - i)):
        b = weight * bands[s + 4]
        x = c[start + s * stride : start + s * stride + len(out)]
        for k in range(len(out)):
            out[k] -= b * x[k]


@njit(nogil=True, **OPTIONS)
def _subtract_around(weight, bands, stride, start, c, out):  # type: ignore[no-untyped-def]
    """The same away from the ends of an axis, where bands are symmetric; of few rows at a time, as vectors ask for."""
    n = len(out)
    w0, w1, w2, w3, w4 = (weight * bands[4], weight * bands[5], weight * bands[6], weight * bands[7], weight * bands[8])
    middle = c[start : start + n]
    a, b = c[start - stride : start - stride + n], c[start + stride : start + stride + n]
    d, e = c[start - 2 * stride : start - 2 * stride + n], c[start + 2 * stride : start + 2 * stride + n]
    for k in range(n):
        out[k] = out[k] - w0 * middle[k] - w1 * (a[k] + b[k]) - w2 * (d[k] + e[k])
    a, b = c[start - 3 * stride : start - 3 * stride + n], c[start + 3 * stride : start + 3 * stride + n]
    d, e = c[start - 4 * stride : start - 4 * stride + n], c[start + 4 * stride : start + 4 * stride + n]
    for k in range(n):
        out[k] = out[k] - w3 * (a[k] + b[k]) - w4 * (d[k] + e[k])
