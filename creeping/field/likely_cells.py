"""Cells of a fan on a body with creases in which a ray towards r is likely: of the others no ray need be traced.

A cell lies between two rays and two times; the search on the fan has it where n.r and b.r have both signs at its
corners. Where rays part at a tip such cells are many; most have no place where both heights vanish, or p = -r there.
With both heights bilinear in the cell, the place is one step of Newton's method from the nearest one in the cell; it is
likely up to MARGIN cells outside, where p.r, held in the cell, is above AHEAD. Between rays that have parted, one on
either side of a tip, nothing is bilinear: neighbours are parted where they are

    |x_2 - x_1| > max(GAP size, SPREAD |J| spacing)

apart, and what would come to such a cell counts as lost, as does what would come between a ray that has ended at a tip
and a neighbour that goes on. Elsewhere r is no farther from the nearest p of the corners than REACH times what they are
from each other. Where the place tells nothing, next to a tip and where both heights are as good as parallel, a cell is
likely if r is nearer than FARTHEST to a corner's p, and where r is nearer than BESIDE in any case.

Sources: Derivations, R12.
"""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geodesics.states import M11, P, X
from creeping.geometry.creased import tips_of
from creeping.geometry.surface import size

MARGIN = 1.0
"""How far outside a cell a place may be: its rays are parted by that much or the search gives them up soon."""
GAP, SPREAD = 0.2, 3.0
"""Fans are refined to gaps of 0.1; J tells how far rays of coarser ones part where no tip parts them."""
AHEAD = 0.8
"""p.r of a place, of unit vectors between the corners, above which rays leave towards r and not past it."""
REACH, FARTHEST = 0.6, 0.4
"""Distance of r from the nearest p of a cell, in the largest one of two of them: 1/√3 at most within a triangle. And
the one from which on a search would lead nowhere."""
BESIDE, WILD = 0.1, 8.0
"""Distance of r from the nearest p below which a cell is tried wherever its bilinear functions vanish: next to a tip
they bend. And the distance of that place, in cells, beyond which it tells nothing: they are parallel."""
TIP = 0.03
"""Distance from a tip, in body sizes, within which places tell nothing either, however dense the fan: rays turn there
faster than samples of them tell."""


def likely_found(
    body: Any,
    states: FloatArray,
    ends: FloatArray,
    spacing: FloatArray,
    parts: int,
    step: float,
    incidence: IntArray,
    found: IntArray,
    directions: FloatArray,
    places: FloatArray,
) -> BoolArray:
    """`likely_cells` of several incidences: states (n, rays, K, lanes), cells (m, 4) as the search numbers them.

    ``ends`` (n, rays, 2) has the time at which each ray ends, and the number of the crease, as lanes have them.
    """
    rays, long = found[:, 1:3], step / parts
    begin, end = (found[:, 3] + places[:, 1]) * long, ends[incidence[:, None], rays, 0]
    at_tip = np.isin(ends[incidence[:, None], rays, 1], tips_of(body)[0])
    # an edge ends rays one after the other, a tip one of them alone
    until = np.fmin(np.max(end, axis=1), np.min(np.where(at_tip, end, np.inf), axis=1))
    likely = begin <= until + long
    for number in np.unique(incidence[likely]):
        mine = np.flatnonzero(likely & (incidence == number))
        row, ray, after, sample = found[mine].T
        rays, seen = np.stack([ray, after], axis=1), (directions[row], places[mine], spacing[number, ray])
        likely[mine] = likely_cells(body, states[number], rays, sample, parts, step, *seen)
    return np.asarray(likely)


def likely_cells(
    body: Any,
    states: FloatArray,
    rays: IntArray,
    sample: IntArray,
    parts: int,
    step: float,
    observers: FloatArray,
    places: FloatArray,
    spacing: FloatArray,
) -> BoolArray:
    """Whether a ray towards its observer is likely in each cell (n,).

    Parameters
    ----------
    body : CreasedSurface
    states : (rays, K, 7 or more)
        At equal steps.
    rays : (n, 2)
        Of each cell.
    sample : (n,)
        First of both samples of each, ``parts`` of them a step.
    parts, step : int, float
    observers : (n, 3)
    places : (n, 2)
        Nearest fractions of the cell, across the rays and along them.
    spacing : (n,), L
        Share of the line that the first ray stands for.
    """
    n = len(sample)
    if not n:
        return np.zeros(0, dtype=bool)
    corner = np.stack([sample, sample + 1], axis=1)[:, None].repeat(2, axis=1)
    owner = rays[:, :, None].repeat(2, axis=2)
    x, p = _between(states, owner.reshape(-1), corner.reshape(-1), parts, step)
    g = np.asarray(body.gradient(x))
    with np.errstate(all="ignore"):
        normal = g / np.linalg.norm(g, axis=1, keepdims=True)
        p = p / np.linalg.norm(p, axis=1, keepdims=True)
        r = np.repeat(observers, 4, axis=0)
        f, h, ahead = (np.sum(v * r, axis=1).reshape(n, 2, 2) for v in (normal, np.cross(normal, p), p))
        u, v = places.T
        (f0, fu, fv), (h0, hu, hv) = _bilinear(f, u, v), _bilinear(h, u, v)
        determinant = fu * hv - fv * hu
        u1, v1 = u - (f0 * hv - fv * h0) / determinant, v - (fu * h0 - f0 * hu) / determinant
        corners_of = p.reshape(n, 4, 3)
        apart = np.linalg.norm(corners_of - observers[:, None], axis=2).min(axis=1)
        wide = np.linalg.norm(corners_of[:, :, None] - corners_of[:, None], axis=3).max(axis=(1, 2))
        off = np.maximum(np.abs(u1 - 0.5), np.abs(v1 - 0.5))
        bent = (off > WILD) | (_from_tips(body, x).reshape(n, 4).min(axis=1) < TIP * size(body))
        near = (off <= 0.5 + MARGIN) | bent | (apart <= BESIDE)
        reach = np.where(bent, FARTHEST, np.minimum(REACH * wide, FARTHEST))
        towards = _bilinear(ahead, np.clip(u1, 0, 1), np.clip(v1, 0, 1))[0] > AHEAD
        corners, J = x.reshape(n, 2, 2, 3), states[rays, np.minimum(sample // parts, states.shape[1] - 1)[:, None], M11]
        one = parted(body, corners[:, 0], corners[:, 1], np.max(np.abs(J), axis=1)[:, None], spacing[:, None])
        # where nothing can be told, a cell is likely
        return np.asarray(((near & towards & (apart <= reach)) | ~np.isfinite(u1 + v1)) & ~np.any(one, axis=1))


def _from_tips(body: Any, x: FloatArray) -> FloatArray:
    """Distances of points (n, 3) from the nearest tip, L."""
    tips = tips_of(body)[1]
    if not len(tips):
        return np.full(len(x), np.inf)
    return np.asarray(np.min(np.linalg.norm(x[:, None] - tips, axis=2), axis=1))


def parted(body: Any, x: FloatArray, other: FloatArray, spreading: FloatArray, spacing: FloatArray) -> BoolArray:
    """Whether neighbours at points (..., 3), L, with J and spacing (...), go on either side of a tip."""
    gap = np.linalg.norm(x - other, axis=-1)
    return np.asarray(gap > np.maximum(GAP * size(body), SPREAD * np.abs(spreading) * spacing))


def _between(
    states: FloatArray, ray: IntArray, sample: IntArray, parts: int, step: float
) -> tuple[FloatArray, FloatArray]:
    """x and x' of rays at samples (n,), of the cubics between their states."""
    k = np.minimum(sample // parts, states.shape[1] - 2)
    u = ((sample - k * parts) / parts)[:, None]
    a, b = states[ray, k], states[ray, k + 1]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[:, X] + u**2 * (3 - 2 * u) * b[:, X]
    x = ends + step * u * (1 - u) * ((1 - u) * a[:, P] - u * b[:, P])
    slope = 6 * u * (1 - u) * (b[:, X] - a[:, X]) / step
    return x, slope + (1 - u) * (1 - 3 * u) * a[:, P] + u * (3 * u - 2) * b[:, P]


def _bilinear(c: FloatArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value and slopes at (u, v) of what is c (n, 2, 2) at the corners."""
    low, high = c[:, 0, 0] + v * (c[:, 0, 1] - c[:, 0, 0]), c[:, 1, 0] + v * (c[:, 1, 1] - c[:, 1, 0])
    along = (1 - u) * (c[:, 0, 1] - c[:, 0, 0]) + u * (c[:, 1, 1] - c[:, 1, 0])
    return low + u * (high - low), high - low, along
