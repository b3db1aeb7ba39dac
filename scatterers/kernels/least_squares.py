"""Compiled least squares: the normal equations of a quintic tensor-product B-spline, and osculating jets.

One modified Gram-Schmidt orthogonalisation, with columns ordered by degree, gives the jets of degree 2, 4 and 6: the
leading columns span the lower ones; see `scatterers.triangles.jets`. Importing this module imports numba.

Sources: [CP05]; Derivations, B5 and B6.
"""

import math
from pathlib import Path

import numpy as np
from numba import njit

from creeping.kernels.cache import discard_stale
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


TERMS = 27
"""Monomials of degree 1 to 6."""
REORDERED = {"cache": True, "error_model": "numpy", "fastmath": {"contract", "reassoc"}}
CURVATURE = 5
"""Terms of degree 1 and 2."""
RIDGE = 2e-4
"""Least singular value, relative to terms of size 1, at which a combination of terms still counts."""
WEAK = 0.02
"""Part of a column that is new against its predecessors, below which more neighbours are asked."""


discard_stale(Path(__file__).parents[1], every=True)


@njit(**REORDERED)
def _frame(normal, frame):  # type: ignore[no-untyped-def]
    """Right-handed orthonormal rows, the last one the normal."""
    x, y, z = normal
    # [Duff et al., Building an orthonormal basis, revisited, JCGT 6 (2017)]: no division by zero anywhere
    sign = 1.0 if z >= 0.0 else -1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    frame[0, 0], frame[0, 1], frame[0, 2] = 1.0 + sign * x * x * a, sign * b, -sign * x
    frame[1, 0], frame[1, 1], frame[1, 2] = b, sign + y * y * a, -y
    frame[2, 0], frame[2, 1], frame[2, 2] = x, y, z


@njit(**REORDERED)
def _columns(vertices, centre, near, count, frame, columns, height, weight):  # type: ignore[no-untyped-def]
    """Fill the weighted monomials (27, count), heights and weights; return the radius."""
    radius = 0.0
    for i in range(count):
        x = vertices[near[i], 0] - vertices[centre, 0]
        y = vertices[near[i], 1] - vertices[centre, 1]
        z = vertices[near[i], 2] - vertices[centre, 2]
        for row in range(2):
            columns[row, i] = x * frame[row, 0] + y * frame[row, 1] + z * frame[row, 2]
        height[i] = x * frame[2, 0] + y * frame[2, 1] + z * frame[2, 2]
        weight[i] = x * x + y * y + z * z
        radius = max(radius, weight[i])
    radius = math.sqrt(radius)
    for i in range(count):
        weight[i] = math.exp(-2.0 * weight[i] / (radius * radius))
        height[i] *= weight[i] / radius
        u, v = columns[0, i] / radius, columns[1, i] / radius
        first, length = 0, 2
        columns[0, i], columns[1, i] = u * weight[i], v * weight[i]
        for _ in range(5):
            # degree d + 1 from degree d: all by u, the last also by v
            for j in range(length):
                columns[first + length + j, i] = u * columns[first + j, i]
            columns[first + 2 * length, i] = v * columns[first + length - 1, i]
            first, length = first + length, length + 1
    return radius


@njit(**REORDERED)
def _solve(columns, height, count, triangle, projection, squares):  # type: ignore[no-untyped-def]
    """Orthogonalise, project the heights, keep their squared remainders after degree 2, 4, 6; return the least pivot.

    Rows below the data, RIDGE times the identity, bound the combinations of terms that the points leave open. They
    spare slopes and second derivatives, of which no such combination consists and which they would shrink.
    """
    weakest = 1.0
    for j in range(TERMS):
        for i in range(TERMS):
            columns[j, count + i] = RIDGE if i == j and j >= CURVATURE else 0.0
        height[count + j] = 0.0
    for j in range(TERMS):
        # entries of the ridge beyond j are still zero
        rows = count + j + 1
        whole = 0.0
        for i in range(rows):
            whole += columns[j, i] * columns[j, i]
        for k in range(j):
            product = 0.0
            for i in range(rows):
                product += columns[k, i] * columns[j, i]
            for i in range(rows):
                columns[j, i] -= product * columns[k, i]
            triangle[k, j] = product
        rest = 0.0
        for i in range(rows):
            rest += columns[j, i] * columns[j, i]
        pivot = math.sqrt(rest)
        weakest = min(weakest, pivot / math.sqrt(whole))
        product = 0.0
        for i in range(rows):
            columns[j, i] /= pivot
            product += columns[j, i] * height[i]
        for i in range(rows):
            height[i] -= product * columns[j, i]
        triangle[j, j], projection[j] = pivot, product
        if j == 4 or j == 13 or j == 26:
            total = 0.0
            for i in range(count):
                total += height[i] * height[i]
            squares[0 if j == 4 else 1 if j == 13 else 2] = total
    return weakest


@njit(**REORDERED)
def _back(triangle, projection, terms, result):  # type: ignore[no-untyped-def]
    """Coefficients of the first ``terms`` monomials."""
    for j in range(terms - 1, -1, -1):
        value = projection[j]
        for k in range(j + 1, terms):
            value -= triangle[j, k] * result[k]
        result[j] = value / triangle[j, j]


@njit(**REORDERED)
def fit(vertices, guess, near, counts, usual, frames, radii, coefficients, residuals, lower):  # type: ignore[no-untyped-def]
    """Jets of all vertices with ``counts`` > 0, in frames whose third row is the fitted normal of the first pass.

    The first ``usual`` neighbours are used, up to ``counts`` while these leave a term open. ``lower`` gets the first
    five coefficients of degree 4, ``residuals`` (n, 3) weighted root mean squares.
    """
    most = near.shape[1]
    columns, height, weight = np.empty((TERMS, most + TERMS)), np.empty(most + TERMS), np.empty(most)
    triangle, projection = np.zeros((TERMS, TERMS)), np.empty(TERMS)
    squares, quartic = np.empty(3), np.empty(14)
    for k in range(len(vertices)):
        normal = guess[k].copy()
        _frame(normal, frames[k])
        count = min(counts[k], usual)
        turn = 0
        while count > 0 and turn < 2:
            _frame(normal, frames[k])
            radius = _columns(vertices, k, near[k], count, frames[k], columns, height, weight)
            weakest = _solve(columns, height, count, triangle, projection, squares)
            if weakest < WEAK and count < counts[k]:
                count, turn = min(count + count // 4, counts[k]), 0
                continue
            _back(triangle, projection, TERMS, coefficients[k])
            if turn == 0:
                u, v = coefficients[k, 0], coefficients[k, 1]
                length = math.sqrt(1.0 + u * u + v * v)
                for i in range(3):
                    normal[i] = (frames[k, 2, i] - u * frames[k, 0, i] - v * frames[k, 1, i]) / length
            turn += 1
        if count == 0:
            continue
        radii[k] = radius
        total = 0.0
        for i in range(count):
            total += weight[i] * weight[i]
        for i in range(3):
            residuals[k, i] = radius * math.sqrt(squares[i] / total)
        _back(triangle, projection, 14, quartic)
        for i in range(5):
            lower[k, i] = quartic[i]
