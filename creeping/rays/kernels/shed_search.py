"""Compiled search on the fans of a sweep: where rays leave towards r, and where they cross the horizon n.r = 0.

Between the carried states x and J are quintics through value, slope and second derivative at both ends,

    x'' = -kappa_n n,   J'' = -K J,

close enough to tell cells apart; what is found there is refined on rays traced for it.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options

PARTS = 4
"""Samples of a step."""
AWAY = -0.5
"""p.r at the end of a step up to which it is passed over; a step turns a ray by about a radian at most."""


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
        along = px * px * xx + py * py * yy + pz * pz * zz + 2 * (py * pz * yz + px * pz * xz + px * py * xy)
        if k <= first:
            alive &= along > 0.0
        if k == 0:
            launched = along / math.sqrt(square)
        bend[0, k], bend[1, k], bend[2, k] = -along / square * gx, -along / square * gy, -along / square * gz
        gauss = gx * gx * (yy * zz - yz * yz) + gy * gy * (xx * zz - xz * xz) + gz * gz * (xx * yy - xy * xy)
        gauss += 2 * (gy * gz * (xy * xz - xx * yz) + gx * gz * (xy * yz - yy * xz) + gx * gy * (xz * yz - zz * xy))
        second[k] = -gauss / (square * square) * states[k, 6]
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
def seek(level, level_par, step, weights, states, arc, closed, r, early, along, cells, inside, heights, crossings, at):
    """Cells in which rays leave towards r, and where rays cross the horizon.

    Parameters
    ----------
    step, weights
        Time between states, and `quintic_weights` of it.
    states : (rays, K, 10)
    arc, closed : (rays,)
        Number of each ray's arc, not finite where there is no ray, and 1 if the arc is a whole curve.
    r : (3,)
    early, along : float
        Time and p.r from which a crossing counts for χ.
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
    χ, root : float
        Least |J|/(|J| + ρ|J'|) over crossings, 0 without any; mean of ρ^(1/3) over launch points, 1 without any.
    """
    K = states.shape[1]
    m = (K - 1) * PARTS + 1
    work, flat, J = np.empty(13 * K), np.empty(16 * m), np.empty((2, m))
    found = crossed = launched = 0
    least, any_, roots = 1.0, False, 0.0
    for ray in range(arc.shape[0]):
        if not arc[ray] < 1e9:
            continue
        # rays start away from r: what goes on doing so is passed over
        first = 0
        while first < K - 2 and _ahead(states[ray, first + 1], r) < AWAY:
            first += 1
        skipped = first * PARTS
        n = m - skipped
        fine, g = flat[: 6 * n].reshape(6, n), flat[6 * m : 6 * m + 10 * n].reshape(10, n)
        alive, kappa = _sample(level, level_par, weights, states[ray], first, work, fine, J)
        if kappa > 0.0:
            roots += (1.0 / kappa) ** (1 / 3)
            launched += 1
        # no p.r is so small: cells with such corners are passed over
        heights[ray, 2, :skipped] = -2.0
        level(fine[:3], g[0], g[1:4], g[4:], level_par)
        before = last = 0.0
        for i in range(n):
            gx, gy, gz = g[1, i], g[2, i], g[3, i]
            px, py, pz = fine[3, i], fine[4, i], fine[5, i]
            inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
            nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
            height = nx * r[0] + ny * r[1] + nz * r[2]
            heights[ray, 0, skipped + i] = height
            heights[ray, 1, skipped + i] = (
                (ny * pz - nz * py) * r[0] + (nz * px - nx * pz) * r[1] + (nx * py - ny * px) * r[2]
            )
            ahead = px * r[0] + py * r[1] + pz * r[2]
            heights[ray, 2, skipped + i] = ahead
            kappa = px * px * g[4, i] + py * py * g[5, i] + pz * pz * g[6, i]
            kappa = (kappa + 2 * (py * pz * g[7, i] + px * pz * g[8, i] + px * py * g[9, i])) * inverse
            alive &= kappa > 0.0
            if i > 0 and height * before < 0.0 and ahead > 0.0:
                h = step / PARTS
                slope, after = _height_rate(g, fine, i - 1, r), _height_rate(g, fine, i, r)
                u = before / (before - height)
                for _ in range(3):
                    value, rate = _cubic(before, h * slope, height, h * after, u)
                    u = min(max(u - value / rate, 0.0), 1.0) if rate != 0.0 else u
                if crossed == crossings.shape[0]:
                    return -1, -1, 0.0, 1.0
                crossings[crossed], at[crossed, 0], at[crossed, 1] = ray, (skipped + i - 1 + u) * h, ahead
                crossed += 1
                if alive and ahead > along and (skipped + i - 1 + u) * h > early:
                    spread, rate = _cubic(J[0, i - 1], h * J[1, i - 1], J[0, i], h * J[1, i], u)
                    curved = last + u * (kappa - last)
                    least = min(least, abs(spread) / (abs(spread) + abs(rate) / h / curved))
                    any_ = True
            last = kappa
            before = height
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
                    return -1, -1, 0.0, 1.0
                cells[found, 0], cells[found, 1], cells[found, 2] = ray, after, i
                inside[found, 0], inside[found, 1] = _bilinear(one, two, i)
                found += 1
    return found, crossed, least if any_ else 0.0, roots / launched if launched else 1.0


@njit(**options)
def _cubic(a, p, b, q, u):
    """Value and slope at u in [0, 1] of the cubic with values a, b and slopes p, q at its ends."""
    v = 1.0 - u
    value = v * v * (1.0 + 2.0 * u) * a + u * u * (3.0 - 2.0 * u) * b + u * v * (v * p - u * q)
    return value, 6.0 * u * v * (b - a) + v * (v - 2.0 * u) * p + u * (u - 2.0 * v) * q


@njit(**options)
def _height_rate(g, fine, i, r):
    """Rate of n.r along a ray at a sample: r.Hp and n.Hp over |grad F|."""
    px, py, pz = fine[3, i], fine[4, i], fine[5, i]
    hx = g[4, i] * px + g[9, i] * py + g[8, i] * pz
    hy = g[9, i] * px + g[5, i] * py + g[7, i] * pz
    hz = g[8, i] * px + g[7, i] * py + g[6, i] * pz
    square = g[1, i] * g[1, i] + g[2, i] * g[2, i] + g[3, i] * g[3, i]
    normal = (g[1, i] * hx + g[2, i] * hy + g[3, i] * hz) / square
    height = g[1, i] * r[0] + g[2, i] * r[1] + g[3, i] * r[2]
    return (r[0] * hx + r[1] * hy + r[2] * hz - normal * height) / math.sqrt(square)


@njit(**options)
def _ahead(state, r):
    return state[3] * r[0] + state[4] * r[1] + state[5] * r[2]


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
    level,
    level_par,
    step,
    weights,
    states,
    arcs,
    closed,
    observers,
    early,
    along,
    most,
    crossings,
    found,
    places,
    crossed,
    summary,
):
    """`seek` for incidences (n): found (f, 4) rows and cells, places (f, 2) in them.

    crossed (c, 4) is filled with rows, rays, times and p.r, summary (n, 2) with χ and the mean root radius. Returns the
    numbers of cells and crossings, -1 where room ran out.
    """
    n, rays = arcs.shape
    m = (states.shape[2] - 1) * PARTS + 1
    heights = np.empty((rays, 3, m))
    cells, inside = np.empty((most, 3), np.int64), np.empty((most, 2))
    ray_of, at = np.empty(crossings, np.int64), np.empty((crossings, 2))
    total = passed = 0
    for row in range(n):
        a, b, summary[row, 0], summary[row, 1] = seek(
            level,
            level_par,
            step,
            weights,
            states[row],
            arcs[row],
            closed[row],
            observers[row],
            early,
            along,
            cells,
            inside,
            heights,
            ray_of,
            at,
        )
        if a < 0 or total + a > found.shape[0] or passed + b > crossed.shape[0]:
            return -1, -1
        for k in range(a):
            found[total + k, 0] = row
            found[total + k, 1:] = cells[k]
            places[total + k] = inside[k]
        for k in range(b):
            crossed[passed + k, 0], crossed[passed + k, 1] = row, ray_of[k]
            crossed[passed + k, 2:] = at[k]
        total += a
        passed += b
    return total, passed
