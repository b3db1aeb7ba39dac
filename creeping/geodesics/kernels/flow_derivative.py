"""Derivative of the geodesic flow for a block of rays, and the way back onto T1Q.

    x' = c p,   p' = -c kappa_n n - grad_T c,   kappa_n = p.Hp/|grad F|
    M' = [[I_1', I_2'], [-G I_1, -G I_2]],   M = [[I_1, I_2], [I_1', I_2']],  M(0) = 1, det M = 1
    A' = c max(kappa_n, 0)^(2/3)

grad_T c is the part of grad c across p and n. G is the curvature of the metric ds/c. A body enters as the address of
its block evaluator (see `creeping.geometry.surface.Compiled`), so kernels compile once for all bodies.
Arrays of a block are component by component, each of BLOCK numbers. Evaluators are called where rays are traced, with
views that are made once, and what takes their results from there on takes addresses: making a view, or telling a
function of an array, takes as long as the arithmetic.

Also here: compiled twin of `states.bundle_states`: points and directions of a caller are checked and put onto T1Q.

Sources: Derivations, R1, R3 and R13.
"""

import math

import numpy as np
from numba import carray, njit

from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.kernels.exponential import adjugate_form, second_form
from creeping.kernels.vectors import LANES, load, loads, pointer, root, spread, store

_three, _four, _six = (loads(rows, BLOCK) for rows in (3, 4, 6))


@njit(**options)
def derivative(weighted, lanes, y, g, w, k):
    """Derivative of a block of states at y, of 6, 10 or 11 lanes, the matrix by columns, to k.

    Arrays are given by their addresses: from g on are F, grad F and the Hessian at x as the body's evaluator fills
    them, ten rows; from w on those of the speed, if it is weighted.
    """
    for i in range(0, BLOCK, LANES):
        px, py, pz = _three(y, 3 * BLOCK + i)
        gx, gy, gz = _three(g, BLOCK + i)
        xx, yy, zz, yz, xz, xy = _six(g, 4 * BLOCK + i)
        turn = -second_form(px, py, pz, xx, yy, zz, yz, xz, xy) / (gx * gx + gy * gy + gz * gz)
        _store_three(k, i, px, py, pz)
        _store_three(k, 3 * BLOCK + i, turn * gx, turn * gy, turn * gz)
    if lanes > 6:
        _gaussian_curvature(g, k)
    if lanes > 10:
        _attenuation_rate(g, k)
    if weighted:
        _add_weight(y, k, g, w, lanes)
    if lanes > 6:
        for i in range(0, BLOCK, LANES):
            curvature = load(k, 7 * BLOCK + i)
            m11, m21, m12, m22 = _four(y, 6 * BLOCK + i)
            _store_three(k, 6 * BLOCK + i, m21, -curvature * m11, m22)
            store(k, 9 * BLOCK + i, -curvature * m12)


@njit(**options)
def _store_three(k, at, x, y, z):
    store(k, at, x)
    store(k, at + BLOCK, y)
    store(k, at + 2 * BLOCK, z)


@njit(**options)
def _gaussian_curvature(g, k):
    """Put K = (grad F.adj(H) grad F)/|grad F|^4 into row 7 of k, which is free until the Jacobi lanes are filled."""
    for i in range(0, BLOCK, LANES):
        gx, gy, gz = _three(g, BLOCK + i)
        xx, yy, zz, yz, xz, xy = _six(g, 4 * BLOCK + i)
        square = gx * gx + gy * gy + gz * gz
        store(k, 7 * BLOCK + i, adjugate_form(gx, gy, gz, xx, yy, zz, yz, xz, xy) / (square * square))


@njit(**options)
def _attenuation_rate(g, k):
    """Put max(kappa_n, 0)^(2/3) into row 10 of k; p' = -kappa_n n is in rows 3 to 5."""
    for i in range(0, BLOCK, LANES):
        gx, gy, gz = _three(g, BLOCK + i)
        kx, ky, kz = _three(k, 3 * BLOCK + i)
        store(k, 10 * BLOCK + i, -(kx * gx + ky * gy + kz * gz) / root(gx * gx + gy * gy + gz * gz))
    two_thirds(carray(pointer(k, 10 * BLOCK), (BLOCK,)), 1.0)


@njit(**options)
def two_thirds(values, factor):
    """Replace each value v (n,), n <= BLOCK, by factor max(v, 0)^(2/3), to rounding.

    v^(-1/3) by Newton steps y <- y (4 - v y^3)/3 from the exponent and mantissa divided by -3 as one integer; no call
    of pow, which does not vectorise.
    """
    bits = values.view(np.int64)
    guess = np.empty(BLOCK, np.int64)
    root = guess.view(np.float64)
    for i in range(values.shape[0]):
        # 0x553e... is (4/3) of the bits of 1.0, tuned for the smallest first error
        guess[i] = 6142571428571428864 - np.int64(bits[i] * 0.3333333333333333)
    for i in range(values.shape[0]):
        v = values[i] if values[i] > 1e-30 else 1.0
        y = root[i] if values[i] > 1e-30 else 1.0
        y *= (4.0 - v * y * y * y) * (1 / 3)
        y *= (4.0 - v * y * y * y) * (1 / 3)
        y *= (4.0 - v * y * y * y) * (1 / 3)
        y *= (4.0 - v * y * y * y) * (1 / 3)
        values[i] = factor * v * y if values[i] > 1e-30 else 0.0


@njit(**options)
def _add_weight(y, k, g, w, lanes):
    """Turn the plain derivative into that of the weighted flow."""
    for i in range(0, BLOCK, LANES):
        px, py, pz = _three(y, 3 * BLOCK + i)
        gx, gy, gz = _three(g, BLOCK + i)
        inverse = spread(1.0) / root(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
        cx, cy, cz = _three(w, BLOCK + i)
        c = load(w, i)
        along_n = cx * nx + cy * ny + cz * nz
        along_p = cx * px + cy * py + cz * pz
        _store_three(k, i, c * px, c * py, c * pz)
        turned = 3 * BLOCK + i
        kx, ky, kz = _three(k, turned)
        _store_three(
            k,
            turned,
            c * kx - cx + along_n * nx + along_p * px,
            c * ky - cy + along_n * ny + along_p * py,
            c * kz - cz + along_n * nz + along_p * pz,
        )
        if lanes > 6:
            xx, yy, zz, yz, xz, xy = _six(g, 4 * BLOCK + i)
            nhn = second_form(nx, ny, nz, xx, yy, zz, yz, xz, xy)
            cxx, cyy, czz, cyz, cxz, cxy = _six(w, 4 * BLOCK + i)
            nsn = second_form(nx, ny, nz, cxx, cyy, czz, cyz, cxz, cxy)
            laplacian = cxx + cyy + czz - nsn - (xx + yy + zz - nhn) * inverse * along_n
            tangential = cx * cx + cy * cy + cz * cz - along_n * along_n
            gauss = load(k, 7 * BLOCK + i)
            store(k, 7 * BLOCK + i, c * c * gauss + c * laplacian - tangential)
        if lanes > 10:
            store(k, 10 * BLOCK + i, c * load(k, 10 * BLOCK + i))


@njit(**options)
def project_block(z, lanes, g, y):
    """One Newton step of x onto F = 0 and p onto the tangent plane there, from z to y; addresses as above, y may be z.

    With d the distance from F = 0 in body sizes, errors of d^2 are left of both: grad F is carried along by H.
    """
    for i in range(0, BLOCK, LANES):
        gx, gy, gz = _three(g, BLOCK + i)
        xx, yy, zz, yz, xz, xy = _six(g, 4 * BLOCK + i)
        step = load(g, i) / (gx * gx + gy * gy + gz * gz)
        x1, x2, x3 = _three(z, i)
        _store_three(y, i, x1 - step * gx, x2 - step * gy, x3 - step * gz)
        nx = gx - step * (xx * gx + xy * gy + xz * gz)
        ny = gy - step * (xy * gx + yy * gy + yz * gz)
        nz = gz - step * (xz * gx + yz * gy + zz * gz)
        px, py, pz = _three(z, 3 * BLOCK + i)
        lean = (px * nx + py * ny + pz * nz) / (nx * nx + ny * ny + nz * nz)
        px, py, pz = px - lean * nx, py - lean * ny, pz - lean * nz
        norm = spread(1.0) / root(px * px + py * py + pz * pz)
        _store_three(y, 3 * BLOCK + i, px * norm, py * norm, pz * norm)
    for i in range(6 * BLOCK, lanes * BLOCK, LANES):
        store(y, i, load(z, i))


@njit(**entry_options)
def enter(level, level_par, points, directions, off, close, least, out):
    """States (n, 6) of points and directions (n, 3); returns how many of them cannot be taken.

    That are points not finite or farther than ``off``, L, from the body, and directions not finite, zero, or with a
    tangential part below ``least`` of them. Newton steps end at distances of ``close``, L, of each point on its own.
    """
    n, refused = points.shape[0], 0
    x, geometry = aligned(3, BLOCK), aligned(10, BLOCK)
    value, gx, gy, gz = geometry[0], geometry[1], geometry[2], geometry[3]
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(3):
                x[k, i] = points[start + min(i, count - 1), k]
        # at most 8 Newton steps, as of `geometry.surface.project`
        for step in range(9):
            level(x, value, geometry[1:4], geometry[4:], level_par)
            moving = 0
            for i in range(count):
                square = gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i]
                distance = abs(value[i]) / math.sqrt(square)
                if step == 0 and not distance <= off:
                    refused += 1
                if step < 8 and not distance <= close:
                    moving += 1
                    part = value[i] / square
                    x[0, i] -= part * gx[i]
                    x[1, i] -= part * gy[i]
                    x[2, i] -= part * gz[i]
            for i in range(count, BLOCK):
                for k in range(3):
                    x[k, i] = x[k, count - 1]
            if moving == 0:
                break
        for i in range(count):
            px, py, pz = directions[start + i, 0], directions[start + i, 1], directions[start + i, 2]
            # of a length whose square may be beyond the floating-point numbers
            longest = max(abs(px), abs(py), abs(pz))
            px, py, pz = px / longest, py / longest, pz / longest
            length = math.sqrt(px * px + py * py + pz * pz)
            along = (px * gx[i] + py * gy[i] + pz * gz[i]) / (gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i])
            px, py, pz = px - along * gx[i], py - along * gy[i], pz - along * gz[i]
            tangent = math.sqrt(px * px + py * py + pz * pz)
            if not (tangent >= least * length and longest < math.inf):
                refused += 1
            for k in range(3):
                out[start + i, k] = x[k, i]
            out[start + i, 3], out[start + i, 4], out[start + i, 5] = px / tangent, py / tangent, pz / tangent
    return refused
