"""Compiled fans of geodesics from ports: what is carried along them, and where they pass other ports.

Rays m = 0 ... R - 1 leave at angles 2 pi m/R and are known at arclengths s = k h, k = -BEHIND ... Behind its port a
ray is the opposite one, run backwards. Between the nodes everything is a polynomial of degree 5 in angle and in s.

    A = int kappa^(2/3) ds,   A_theta = int (2/3) kappa^(-1/3) (J2 T' + 2 J2' T) ds,   A_0 the same of J1
    g = kappa^(1/3) A_theta/J2
    int kappa^(4/3) [1/60 - (2/45) B - rho^2 (g^2/4 - (2/3) g T + (2/5) T^2)] ds
    int kappa^(4/3) [1/10 + r/4 - B/60 - (3/20) rho^2 T^2] ds
    int kappa^(2/3) [-1/12 + r/3 - (5/18) rho^2 T^2] ds
    int kappa^(-2/3) (kappa kappa_t - T^2) ds

with T = b.Hp/|grad F|, b = n x p, r = rho kappa_t, B = rho rho'' - (2/3) rho'^2. A_theta is the change of A with the
direction of launch, A_0 with its place along b; T' = d/ds T is by Codazzi the change of kappa across the ray.

Sources: [C76]; Derivations, R1 and F25.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from creeping.kernels.block import copy
from creeping.kernels.block import strict_options as options
from creeping.rays.kernels.quantities import curvatures_along, polynomial_weights
from creeping.rays.quantities import SHARPEST, STEEPEST

BEHIND = 2
"""Nodes that polynomials take before an interval, and one more behind it: six with its own."""
GUARD = 7
"""Steps traced beyond the last interval: three for its polynomial, one for each integral, two for derivatives."""


class Lanes(NamedTuple):
    """Where in a lane what is: x and p come first, and the integrals take PARTS."""

    J2: int = 6
    rate: int = 7
    M11: int = 8
    angle: int = 9
    """Phi of (J2, J2')."""
    kappa: int = 10
    T: int = 11
    B: int = 12
    integrals: int = 13
    across: int = 18
    """kappa_t."""
    turning: int = 19
    """A_theta."""
    moving: int = 20
    """A_0."""


LANE = Lanes()
LANES, PARTS = 21, 5
"""Their number, and that of the integrals."""
START = 3
"""Of the port itself: kappa, T and B."""


@njit(**options)
def port_fan(level, level_par, step, scale, squares, states, lanes, last):
    """Fill lanes (R, K, LANES) of a port's fan, and the last node (R,) up to which kappa > 0 on each ray.

    Parameters
    ----------
    step, scale : float, L
        h, and the unit of length in the angle phi.
    squares : float
        Factor of the term in g^2: 1, or 0 where sums over neighbouring rays bring it in.
    states : (R, J, 10)
        x, p and M of each ray at s = 0, h, 2h ...; R is even, and K = J + BEHIND - 4.
    """
    rays, J = states.shape[0], states.shape[1]
    half, count = rays // 2, J - 4
    x, g, normals = np.empty((3, J)), np.empty((10, J)), np.empty((3, J))
    kappa, across, torsion = np.empty((rays, J)), np.empty((rays, J)), np.empty((rays, J))
    for ray in range(rays):
        curvatures_along(level, level_par, states[ray], x, g, kappa[ray], across[ray], torsion[ray], normals)
    rates = np.empty((8, J))
    leaning, moving = np.empty(J), np.empty(J)
    for ray in range(rays):
        opposite = (ray + half) % rays
        line = lanes[ray]
        last[ray] = count - 1
        for k in range(count + 2):
            curves = kappa[ray], kappa[opposite], across[ray], torsion[ray], torsion[opposite]
            _rates(curves, states[ray], step, k, rates)
            if not kappa[ray, k] > 0.0 and k <= last[ray]:
                last[ray] = k - 1
        leaning[0] = moving[0] = 0.0
        for k in range(count):
            leaning[k + 1] = leaning[k] + _stretch(rates, 4, k, step, k > 0)
            moving[k + 1] = moving[k] + _stretch(rates, 6, k, step, k > 0)
        for k in range(count + 1):
            _add_torsion(kappa[ray, k], torsion[ray, k], leaning[k], states[ray, k, 8], squares, k, rates)
        for k in range(count):
            to = line[BEHIND + k]
            for axis in range(6):
                to[axis] = states[ray, k, axis]
            to[LANE.J2], to[LANE.rate], to[LANE.M11] = states[ray, k, 8], states[ray, k, 9], states[ray, k, 6]
            turned = math.atan2(to[LANE.J2], scale * to[LANE.rate])
            before = line[BEHIND + k - 1, LANE.angle] if k > 0 else 0.0
            to[LANE.angle] = turned + 2 * math.pi * math.floor((before - turned) / (2 * math.pi) + 0.5)
            to[LANE.kappa], to[LANE.T] = kappa[ray, k], torsion[ray, k]
            to[LANE.B], to[LANE.across] = rates[3, k], across[ray, k]
            to[LANE.turning], to[LANE.moving] = leaning[k], moving[k]
            for q in range(PARTS):
                row = (0, 1, 2, 7, 5)[q]
                so_far = line[BEHIND + k - 1, LANE.integrals + q] if k > 0 else 0.0
                to[LANE.integrals + q] = so_far + (_stretch(rates, row, k - 1, step, k > 1) if k > 0 else 0.0)
    for ray in range(rays):
        opposite = lanes[(ray + half) % rays]
        for k in range(1, BEHIND + 1):
            to, source = lanes[ray, BEHIND - k], opposite[BEHIND + k]
            copy(source, to)
            for lane in range(3, 6):
                to[lane] = -source[lane]
            to[LANE.J2], to[LANE.angle], to[LANE.turning] = -source[LANE.J2], -source[LANE.angle], -source[LANE.turning]
            for q in range(PARTS):
                to[LANE.integrals + q] = -source[LANE.integrals + q]


@njit(**options)
def _rates(curves, states, step, k, rates):
    """At node k the integrands of A, of both exponents without g, B, and those of A_theta, K, A_0 and the spreading."""
    kappa, kappa_back, across, torsion, torsion_back = curves
    before, behind = kappa[k - 1] if k > 0 else kappa_back[1], kappa[k - 2] if k > 1 else kappa_back[2 - k]
    slope = (8 * (kappa[k + 1] - before) - (kappa[k + 2] - behind)) / (12 * step)
    bend = (16 * (kappa[k + 1] + before) - 30 * kappa[k] - kappa[k + 2] - behind) / (12 * step * step)
    before, behind = torsion[k - 1] if k > 0 else torsion_back[1], torsion[k - 2] if k > 1 else torsion_back[2 - k]
    twist = (8 * (torsion[k + 1] - before) - (torsion[k + 2] - behind)) / (12 * step)
    if not kappa[k] > 0.0:
        for row in range(8):
            rates[row, k] = 0.0
        return
    rho = 1.0 / kappa[k]
    rate = min(max(-slope * rho * rho, -STEEPEST), STEEPEST)
    varies = min(max(-bend * rho**3 + 2 * (slope * rho * rho) ** 2, -SHARPEST), SHARPEST)
    varies = min(max(varies - 2 / 3 * rate * rate, -SHARPEST), SHARPEST)
    root = kappa[k] ** (1 / 3)
    t = (torsion[k] * rho) ** 2
    rates[0, k] = root * root
    rates[1, k] = root**4 * (1 / 60 - 2 / 45 * varies)
    rates[2, k] = root**4 * (0.1 + 0.25 * across[k] * rho - varies / 60 - 0.15 * t)
    rates[3, k] = varies
    rates[5, k] = (kappa[k] * across[k] - torsion[k] ** 2) / (root * root)
    rates[4, k] = 2 / 3 / root * (states[k, 8] * twist + 2 * states[k, 9] * torsion[k])
    rates[6, k] = 2 / 3 / root * (states[k, 6] * twist + 2 * states[k, 7] * torsion[k])
    rates[7, k] = root * root * (across[k] * rho / 3 - 1 / 12 - 5 / 18 * t)


@njit(**options)
def _add_torsion(kappa, torsion, leaning, spreading, squares, k, rates):
    """Complete the first exponent's integrand by g."""
    if kappa > 0.0:
        root, g = kappa ** (1 / 3), 4 / 3 * torsion
        if k > 0 and spreading != 0.0:
            g = root * leaning / spreading
        # as of |rho'|, |rho rho''| and |B|: beyond, the expansion has no meaning
        g = min(max(g, -1.5 * kappa), 1.5 * kappa)
        rates[1, k] -= (0.25 * squares * g * g - 2 / 3 * g * torsion + 0.4 * torsion * torsion) * root**4 / kappa**2


@njit(**options)
def _stretch(rates, row, k, step, central):
    """Integral of a row over the step from node k on."""
    if central:
        f0, f1, f2, f3 = rates[row, k - 1], rates[row, k], rates[row, k + 1], rates[row, k + 2]
        return step / 24 * (13 * (f1 + f2) - f0 - f3)
    f0, f1, f2 = rates[row, k], rates[row, k + 1], rates[row, k + 2]
    return step / 12 * (5 * f0 + 8 * f1 - f2)


@njit(**options)
def _sum(lanes, m, k, aside, along, first, many, out):
    """Sums of so many lanes from the first, around cell (m, k), by weights (6,) in angle and in s."""
    for lane in range(many):
        out[lane] = 0.0
    for i in range(aside.shape[0]):
        ray = lanes[(m + i - BEHIND) % lanes.shape[0]]
        for j in range(along.shape[0]):
            weight = aside[i] * along[j]
            for lane in range(many):
                out[lane] += weight * ray[k + j, first + lane]


@njit(**options)
def _refined(lanes, matrix, m, k, target, place, w, work):
    """Newton's method for x(angle, s) = target from the place (2,), in cells from node (m, k); returns success."""
    point, along, aside = work[0], work[1], work[2]
    for _ in range(12):
        if not (abs(place[0] - 0.5) < 1.5 and abs(place[1] - 0.5) < 1.5):
            return False
        for axis in range(2):
            polynomial_weights(matrix, place[axis], 1.0, w[axis])
        _sum(lanes, m, k, w[0, 0], w[1, 0], 0, 3, point)
        _sum(lanes, m, k, w[0, 0], w[1, 1], 0, 3, along)
        _sum(lanes, m, k, w[0, 1], w[1, 0], 0, 3, aside)
        aa = ab = bb = ea = eb = 0.0
        for axis in range(3):
            e = target[axis] - point[axis]
            aa += aside[axis] * aside[axis]
            ab += aside[axis] * along[axis]
            bb += along[axis] * along[axis]
            ea += e * aside[axis]
            eb += e * along[axis]
        det = aa * bb - ab * ab
        if not det > 0.0:
            return False
        first, second = (bb * ea - ab * eb) / det, (aa * eb - ab * ea) / det
        longest = max(abs(first), abs(second))
        if longest > 0.7:
            first, second = 0.7 * first / longest, 0.7 * second / longest
        place[0] += first
        place[1] += second
        if longest < 1e-11:
            return True
    return False


@njit(**options)
def passed(lanes, last, matrices, ports, order, along, after, pad, folds, owner, found):
    """Where the fan passes ports (n, 3) of numbers above ``after``; returns how many passages there are.

    One that lies on the border of cells may be found in each of them, and where rays merge several times in one.

    Parameters
    ----------
    lanes, last
        Of `port_fan`.
    matrices : (6, 6) x 2
        `polynomial_matrix` of the nodes around a cell, and of the four nearest of them.
    order, along : (n,), int
        Numbers of ports by their coordinate of number ``along``.
    pad : float, L
        How far from where rays merge a port counts as close to it.
    folds : (2, n)
        Least A at which rays merge close to each port, and of those that pass close to it where they have ended; inf at
        first.
    owner, found : (most,), (most, LANES + START + 3)
        Number of the port, and of each passage the angle in rays, s in steps, the lanes there, those of the port
        itself, and how far polynomials of degree 3 differ in x, L; past ``most`` only counted.
    """
    rays, count = lanes.shape[0], lanes.shape[1]
    most, total, sorted_ = len(owner), 0, ports[order, along]
    w, work, place, middle = np.empty((2, 3, 6)), np.empty((3, 3)), np.empty(2), np.empty(3)
    for m in range(rays):
        one, two = lanes[m], lanes[(m + 1) % rays]
        for k in range(BEHIND, count - BEHIND - 1):
            radius = 0.0
            for axis in range(3):
                middle[axis] = 0.25 * (one[k, axis] + one[k + 1, axis] + two[k, axis] + two[k + 1, axis])
            for corner in range(4):
                at = (one[k], one[k + 1], two[k], two[k + 1])[corner]
                radius = max(radius, math.sqrt(_square(at, middle)))
            least = min(min(one[k, LANE.J2], one[k + 1, LANE.J2]), min(two[k, LANE.J2], two[k + 1, LANE.J2]))
            most_ = max(max(one[k, LANE.J2], one[k + 1, LANE.J2]), max(two[k, LANE.J2], two[k + 1, LANE.J2]))
            dead = k + 1 - BEHIND > min(last[m], last[(m + 1) % rays])
            folded = least < 0.0 < most_ and k > BEHIND and not dead
            # of a cell, in radii of the ball through its corners
            reach = 1.3 * radius
            wide = reach + pad if folded else reach
            number = np.searchsorted(sorted_, middle[along] - wide)
            while number < len(ports) and sorted_[number] <= middle[along] + wide:
                j = order[number]
                number += 1
                square = _square(ports[j], middle)
                if j <= after or square > wide * wide:
                    continue
                if dead or folded:
                    row = 1 if dead else 0
                    folds[row, j] = min(folds[row, j], one[k, LANE.integrals])
                if dead or square > reach * reach:
                    continue
                # two rays may pass a port in a cell in which neighbours cross: from all its corners
                for start in range(4 if folded else 1):
                    place[0], place[1] = (start % 2) * 1.0, (start // 2) * 1.0
                    if not folded:
                        place[0] = place[1] = 0.5
                    if not _refined(lanes, matrices[0], m, k - BEHIND, ports[j], place, w, work):
                        continue
                    if not (-1e-6 < place[0] < 1 + 1e-6 and -1e-6 < place[1] < 1 + 1e-6):
                        continue
                    if total < most:
                        owner[total], found[total, 0], found[total, 1] = j, m + place[0], k - BEHIND + place[1]
                        _read(lanes, matrices, m, k - BEHIND, place, w, found[total, 2:])
                    total += 1
    return total


@njit(**options)
def _square(x, y):
    """Square of the distance of two points."""
    return (x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2 + (x[2] - y[2]) ** 2


@njit(**options)
def _read(lanes, matrices, m, k, place, w, out):
    """All lanes at a place of cell (m, k), those of the port, and the difference of polynomials."""
    for axis in range(2):
        polynomial_weights(matrices[0], place[axis], 1.0, w[axis])
    _sum(lanes, m, k, w[0, 0], w[1, 0], 0, LANES, out)
    # at the port itself
    w[1, 1, 1:], w[1, 1, 0] = 0.0, 1.0
    _sum(lanes, m, BEHIND, w[0, 0], w[1, 1, :1], LANE.kappa, START, out[LANES:])
    coarse = np.zeros(3)
    for axis in range(2):
        polynomial_weights(matrices[1], place[axis], 1.0, w[axis])
    _sum(lanes, m, k, w[0, 0], w[1, 0], 0, 3, coarse)
    out[LANES + START] = math.sqrt(_square(coarse, out))
