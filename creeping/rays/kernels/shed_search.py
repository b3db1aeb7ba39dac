"""Compiled search on fans: where rays leave towards observers r, and where they cross their horizons n.r = 0.

Between the carried states x and J are quintics through value, slope and second derivative at both ends,

    x'' = -kappa_n n,   J'' = -K J,

close enough to tell cells apart; what is found there is refined on rays traced for it. A fan is sampled once for all
observers of its incidence.

Sources: Derivations, R12 and R14.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from creeping.kernels.block import copy
from creeping.kernels.block import strict_options as options
from creeping.kernels.exponential import adjugate_form, second_form

PARTS = 4
"""Samples of a step."""


class Sample(NamedTuple):
    """Where in a sample what is: n, b = n x p, p, dn/ds, J, J' and kappa_n."""

    n: int = 0
    b: int = 3
    p: int = 6
    turn: int = 9
    J: int = 12
    rate: int = 13
    kappa: int = 14


AT = Sample()


def quintic_weights(step: float) -> np.ndarray:
    """Weights of value, slope and second derivative at both ends of a step, for the value and slope at its samples.

    (PARTS, 2, 6)
    """
    powers = np.arange(6)
    derivative = np.diag(powers[1:], 1).astype(float)
    values = np.vander([0.0, 1.0], 6, increasing=True)
    ends = np.concatenate([np.stack([v, v @ derivative, v @ derivative @ derivative]) for v in values])
    inverse = np.linalg.inv(ends)
    u = np.vander(np.arange(PARTS) / PARTS, 6, increasing=True)
    scale = np.tile([1.0, step, step**2], 2)
    return np.ascontiguousarray(np.stack([u @ inverse * scale, u @ derivative @ inverse * scale / step], axis=1))


@njit(**options)
def _sample(level, level_par, weights, states, first, work, fine, J):
    """Fill fine (6, m), x and x', and J (2, m), J and J', at PARTS samples of each step from the first; states (K, 10).

    Returns whether kappa_n > 0 at the states before, and kappa_n at the launch point.
    """
    K = states.shape[0]
    m = (K - 1 - first) * PARTS + 1
    x, g = work[: 3 * K].reshape(3, K), work[3 * K : 13 * K].reshape(10, K)
    for k in range(K):
        for axis in range(3):
            x[axis, k] = states[k, axis]
    level(x, g[0], g[1:4], g[4:], level_par)
    bend, second, alive, launched = np.empty((3, K)), np.empty(K), True, 0.0
    for k in range(K):
        px, py, pz = states[k, 3], states[k, 4], states[k, 5]
        gx, gy, gz = g[1, k], g[2, k], g[3, k]
        xx, yy, zz, yz, xz, xy = g[4, k], g[5, k], g[6, k], g[7, k], g[8, k], g[9, k]
        square = gx * gx + gy * gy + gz * gz
        along = second_form(px, py, pz, xx, yy, zz, yz, xz, xy)
        if k <= first:
            alive &= along > 0.0
        if k == 0:
            launched = along / math.sqrt(square)
        bend[0, k], bend[1, k], bend[2, k] = -along / square * gx, -along / square * gy, -along / square * gz
        second[k] = -adjugate_form(gx, gy, gz, xx, yy, zz, yz, xz, xy) / (square * square) * states[k, 6]
    for k in range(first, K - 1):
        for part in range(PARTS):
            i = (k - first) * PARTS + part
            w0, w1, w2, w3, w4, w5 = weights[part, 0]
            v0, v1, v2, v3, v4, v5 = weights[part, 1]
            for axis in range(3):
                x0, p0, q0 = states[k, axis], states[k, 3 + axis], bend[axis, k]
                x1, p1, q1 = states[k + 1, axis], states[k + 1, 3 + axis], bend[axis, k + 1]
                fine[axis, i] = w0 * x0 + w1 * p0 + w2 * q0 + w3 * x1 + w4 * p1 + w5 * q1
                fine[3 + axis, i] = v0 * x0 + v1 * p0 + v2 * q0 + v3 * x1 + v4 * p1 + v5 * q1
            x0, p0, q0 = states[k, 6], states[k, 7], second[k]
            x1, p1, q1 = states[k + 1, 6], states[k + 1, 7], second[k + 1]
            J[0, i] = w0 * x0 + w1 * p0 + w2 * q0 + w3 * x1 + w4 * p1 + w5 * q1
            J[1, i] = v0 * x0 + v1 * p0 + v2 * q0 + v3 * x1 + v4 * p1 + v5 * q1
    for axis in range(6):
        fine[axis, m - 1] = states[K - 1, axis]
    J[0, m - 1], J[1, m - 1] = states[K - 1, 6], states[K - 1, 7]
    return alive, launched


@njit(**options)
def sample_fan(level, level_par, weights, states, arc, first, samples, alive, work):
    """Fill samples (rays, 15, m) of a fan from step ``first`` on, and alive (rays,); returns the mean rho^(1/3).

    ``alive`` says whether kappa_n > 0 at the states up to ``first``. states (rays, K, 10); the mean is over the launch
    points.
    """
    K = states.shape[1]
    m = (K - 1) * PARTS + 1
    roots, launched = 0.0, 0
    skipped = first * PARTS
    n = m - skipped
    J = np.empty((2, m))
    flat = work[13 * K :]
    fine, g = flat[: 6 * n].reshape(6, n), flat[6 * m : 6 * m + 10 * n].reshape(10, n)
    for ray in range(states.shape[0]):
        if not arc[ray] < 1e9:
            continue
        alive[ray], kappa = _sample(level, level_par, weights, states[ray], first, work, fine, J)
        if kappa > 0.0:
            roots += (1.0 / kappa) ** (1 / 3)
            launched += 1
        level(fine[:3], g[0], g[1:4], g[4:], level_par)
        out = samples[ray]
        for i in range(n):
            gx, gy, gz = g[1, i], g[2, i], g[3, i]
            px, py, pz = fine[3, i], fine[4, i], fine[5, i]
            inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
            nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
            hx = (g[4, i] * px + g[9, i] * py + g[8, i] * pz) * inverse
            hy = (g[9, i] * px + g[5, i] * py + g[7, i] * pz) * inverse
            hz = (g[8, i] * px + g[7, i] * py + g[6, i] * pz) * inverse
            along = nx * hx + ny * hy + nz * hz
            s = skipped + i
            out[AT.n, s], out[AT.n + 1, s], out[AT.n + 2, s] = nx, ny, nz
            out[AT.b, s], out[AT.b + 1, s] = ny * pz - nz * py, nz * px - nx * pz
            out[AT.b + 2, s] = nx * py - ny * px
            out[AT.p, s], out[AT.p + 1, s], out[AT.p + 2, s] = px, py, pz
            out[AT.turn, s], out[AT.turn + 1, s] = hx - along * nx, hy - along * ny
            out[AT.turn + 2, s] = hz - along * nz
            out[AT.J, s], out[AT.rate, s] = J[0, i], J[1, i]
            out[AT.kappa, s] = px * hx + py * hy + pz * hz
    return roots / launched if launched else 1.0


@njit(**options)
def seek(step, samples, certain, arc, closed, r, back, skipped, early, along, cells, inside, heights, crossings, at):
    """Cells in which rays leave towards r, and where rays cross the horizon.

    Parameters
    ----------
    step : float
        Time between states.
    samples, certain : (rays, 15, m), (rays,)
        See `sample_fan`; the first ``skipped`` of a ray are not there.
    arc, closed : (rays,)
        Number of each ray's arc, not finite where there is no ray, and 1 if the arc is a whole curve.
    r : (3,)
    back : bool
        Whether crossings are wanted.
    early, along : float
        Time and p.r from which a crossing counts for chi.
    cells, inside : (n, 3) of int, (n, 2), filled
        Both rays of a cell and the sample before; fractions of the cell at which the heights, bilinear, vanish.
    heights : (rays, 3, m), work space
        n.r, b.r and p.r at the samples.
    crossings, at : (n,), (n, 2), filled
        Rays that cross with p.r > 0, the times, and p.r there.

    Returns
    -------
    cells, crossings : int
        -1 if there is no room.
    chi : float
        Least |J|/(|J| + rho |J'|) over the crossings that count, 0 without any.
    """
    m = samples.shape[2]
    h = step / PARTS
    found = crossed = 0
    least, any_ = 1.0, False
    for ray in range(arc.shape[0]):
        if not arc[ray] < 1e9:
            continue
        one, height = samples[ray], heights[ray]
        # no p.r is so small: cells with such corners are passed over
        height[2, :skipped] = -2.0
        for row in range(3):
            for i in range(skipped, m):
                height[row, i] = one[3 * row, i] * r[0] + one[3 * row + 1, i] * r[1] + one[3 * row + 2, i] * r[2]
        if not back:
            continue
        alive = certain[ray]
        for i in range(skipped, m):
            alive &= one[AT.kappa, i] > 0.0
            if i == skipped or not (height[0, i] * height[0, i - 1] < 0.0 and height[2, i] > 0.0):
                continue
            before, now = height[0, i - 1], height[0, i]
            slope = one[AT.turn, i - 1] * r[0] + one[AT.turn + 1, i - 1] * r[1] + one[AT.turn + 2, i - 1] * r[2]
            after = one[AT.turn, i] * r[0] + one[AT.turn + 1, i] * r[1] + one[AT.turn + 2, i] * r[2]
            u = before / (before - now)
            for _ in range(3):
                value, rate = _cubic(before, h * slope, now, h * after, u)
                u = min(max(u - value / rate, 0.0), 1.0) if rate != 0.0 else u
            if crossed == crossings.shape[0]:
                return -1, -1, 0.0
            crossings[crossed], at[crossed, 0], at[crossed, 1] = ray, (i - 1 + u) * h, height[2, i]
            crossed += 1
            if alive and height[2, i] > along and (i - 1 + u) * h > early:
                spread, rate = _cubic(one[AT.J, i - 1], h * one[AT.rate, i - 1], one[AT.J, i], h * one[AT.rate, i], u)
                curved = one[AT.kappa, i - 1] + u * (one[AT.kappa, i] - one[AT.kappa, i - 1])
                least = min(least, abs(spread) / (abs(spread) + abs(rate) / h / curved))
                any_ = True
    for ray in range(arc.shape[0]):
        if not arc[ray] < 1e9:
            continue
        after = ray + 1
        if after == arc.shape[0] or not arc[after] == arc[ray]:
            if closed[ray] != 1.0:
                continue
            after = ray
            while after > 0 and arc[after - 1] == arc[ray]:
                after -= 1
        one, two = heights[ray], heights[after]
        for i in range(m - 1):
            if not (one[2, i] > 0.0 or two[2, i + 1] > 0.0) or min(one[2, i], two[2, i]) < -1.5:
                continue
            if _mixed(one[0], two[0], i) and _mixed(one[1], two[1], i):
                if found == cells.shape[0]:
                    return -1, -1, 0.0
                cells[found, 0], cells[found, 1], cells[found, 2] = ray, after, i
                inside[found, 0], inside[found, 1] = _bilinear(one, two, i)
                found += 1
    return found, crossed, least if any_ else 0.0


@njit(**options)
def _cubic(a, p, b, q, u):
    """Value and slope at u in [0, 1] of the cubic with values a, b and slopes p, q at its ends."""
    v = 1.0 - u
    value = v * v * (1.0 + 2.0 * u) * a + u * u * (3.0 - 2.0 * u) * b + u * v * (v * p - u * q)
    return value, 6.0 * u * v * (b - a) + v * (v - 2.0 * u) * p + u * (u - 2.0 * v) * q


@njit(**options)
def _mixed(one, two, i):
    """Whether the corners of a cell have not all one sign."""
    some = (one[i] > 0.0) + (one[i + 1] > 0.0) + (two[i] > 0.0) + (two[i + 1] > 0.0)
    return 0 < some < 4


@njit(**options)
def _bilinear(one, two, i):
    """Fractions (across the rays, along them) of a cell where both bilinear heights vanish, held in the cell."""
    u = v = 0.5
    for _ in range(4):
        f0, f1, g0, g1 = one[0, i], two[0, i], one[1, i], two[1, i]
        fa, fb = f0 + u * (f1 - f0), one[0, i + 1] + u * (two[0, i + 1] - one[0, i + 1])
        ga, gb = g0 + u * (g1 - g0), one[1, i + 1] + u * (two[1, i + 1] - one[1, i + 1])
        f, fv, fu = fa + v * (fb - fa), fb - fa, (1 - v) * (f1 - f0) + v * (two[0, i + 1] - one[0, i + 1])
        g, gv, gu = ga + v * (gb - ga), gb - ga, (1 - v) * (g1 - g0) + v * (two[1, i + 1] - one[1, i + 1])
        determinant = fu * gv - fv * gu
        if determinant == 0.0:
            return 0.5, 0.5
        u = min(max(u - (f * gv - fv * g) / determinant, 0.0), 1.0)
        v = min(max(v - (fu * g - f * gu) / determinant, 0.0), 1.0)
    return u, v


@njit(**options)
def seek_all(
    level, level_par, step, weights, states, arcs, closed, observers, back, early, along, most, crossings, found,
    places, crossed, chi, roots
):  # fmt: skip
    """`seek` for incidences (n) with observers (n, m, 3) each, numbered through.

    found (f, 4) is filled with observers and cells, places (f, 2) with the fractions in them, crossed (c, 4) with
    observers, rays, times and p.r, chi (n, m), and roots (n,) with the mean root radius. Returns the numbers of cells
    and crossings, -1 where room ran out.
    """
    n, rays = arcs.shape
    K, many = states.shape[2], observers.shape[1]
    m = (K - 1) * PARTS + 1
    heights, samples = np.empty((rays, 3, m)), np.empty((rays, 15, m))
    alive, work = np.empty(rays, np.bool_), np.empty(13 * K + 16 * m)
    cells, inside = np.empty((most, 3), np.int64), np.empty((most, 2))
    ray_of, times = np.empty(crossings, np.int64), np.empty((crossings, 2))
    total = passed = 0
    for row in range(n):
        # steps that no observer looks at are passed over
        first = K - 2
        for ray in range(rays):
            if not arcs[row, ray] < 1e9:
                continue
            for o in range(many):
                k, r = 0, observers[row, o]
                while k < first:
                    at = states[row, ray, k + 1]
                    # a step turns a ray by about a radian at most
                    if at[3] * r[0] + at[4] * r[1] + at[5] * r[2] >= -0.5:
                        break
                    k += 1
                first = min(first, k)
            if first == 0:
                break
        roots[row] = sample_fan(level, level_par, weights, states[row], arcs[row], first, samples, alive, work)
        for o in range(many):
            a, b, chi[row, o] = seek(
                step, samples, alive, arcs[row], closed[row], observers[row, o], back[row, o], first * PARTS, early,
                along, cells, inside, heights, ray_of, times,
            )  # fmt: skip
            if a < 0 or total + a > found.shape[0] or passed + b > crossed.shape[0]:
                return -1, -1
            for k in range(a):
                found[total + k, 0] = row * many + o
                copy(cells[k], found[total + k, 1:])
                copy(inside[k], places[total + k])
            for k in range(b):
                crossed[passed + k, 0], crossed[passed + k, 1] = row * many + o, ray_of[k]
                copy(times[k], crossed[passed + k, 2:])
            total += a
            passed += b
    return total, passed
