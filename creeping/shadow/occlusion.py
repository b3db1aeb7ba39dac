"""Which parts of the shadow line launch creeping rays: attached, occluded, concave.

    kappa_n(d) = d.Hd/|grad F|
    concave:   kappa_n(d) <= 0, the incident ray touches from inside
    occluded:  kappa_n(d) > 0 and F(x - t d) < 0 for some t > 0, the incident ray is stopped before
    attached:  the rest

F along the backward ray starts with F = 0, F' = 0, F'' = d.Hd, so behind a convex point it first rises; it enters the
body where an interior local minimum is negative. The state changes at zeros of kappa_n(d) and where such a minimum
is 0.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.surface import Surface, size
from creeping.shadow.panels import PanelCurve
from creeping.shadow.status import ATTACHED, CONCAVE, OCCLUDED, STATUSES

SAMPLES = 1024
"""Equally spaced samples of a curve, beside the Gauss points of its panels."""
RAY_SAMPLES = 192
"""Samples of F from the point to where its backward ray leaves the box."""
HALVINGS = 38


class Arcs(NamedTuple):
    """Splitting of a closed curve: arc k runs from ``starts[k]`` to the next start with ``codes[k]`` in `STATUSES`."""

    starts: FloatArray
    codes: IntArray
    length: float

    def of(self, arclength: FloatArray) -> IntArray:
        """Codes at arclengths in [0, length): (m,)."""
        return np.asarray(self.codes[np.searchsorted(self.starts, arclength, side="right") - 1])

    def listed(self) -> tuple[tuple[float, float, str], ...]:
        """Arcs (start, end, status); the end passes the length where the arc wraps."""
        if len(self.codes) == 1:
            return ((0.0, self.length, STATUSES[self.codes[0]]),)
        ends = np.append(self.starts[1:], self.starts[0] + self.length)
        return tuple((float(a), float(b), STATUSES[c]) for a, b, c in zip(self.starts, ends, self.codes, strict=True))


def incident_curvature(body: Surface, points: FloatArray, direction: FloatArray) -> FloatArray:
    """kappa_n(d) = d.Hd/|grad F|: (..., 3) -> (...), 1/L."""
    along = np.einsum("...ij,i,j->...", body.hessian(points), direction, direction)
    return np.asarray(along / np.linalg.norm(body.gradient(points), axis=-1))


def split_arcs(curve: PanelCurve) -> Arcs:
    """Split a closed curve at its changes of state, each located to rounding.

    Parameters
    ----------
    curve : PanelCurve

    Returns
    -------
    Arcs
    """
    length = curve.length
    s = np.concatenate([np.arange(SAMPLES) * (length / SAMPLES), curve.gauss_arclengths])
    s = np.unique(s[(s >= 0) & (s < length)])
    convex = _convex(curve, s)
    s, convex = _with_touching(curve, s, convex)
    changes = np.flatnonzero(convex != np.roll(convex, -1))
    low, high = s[changes], np.append(s[1:], s[0] + length)[changes]
    roots = _bisect(lambda t: _convex(curve, t), convex[changes], low, high)
    # a state next to a zero of kappa_n may last for less than a sample
    margin = 1e-3 * np.minimum(roots - low, high - roots)
    beside = np.mod(np.concatenate([roots - margin, roots + margin]), length)
    s = np.unique(np.concatenate([s, beside]))
    codes = np.where(_convex(curve, s), ATTACHED, CONCAVE)
    rays = codes == ATTACHED
    codes[rays & _at(rays, _occluded(curve, s[rays]))] = OCCLUDED
    changes = np.flatnonzero(codes != np.roll(codes, -1))
    if not len(changes):
        return Arcs(np.zeros(1), codes[:1], length)
    low, high = s[changes], np.append(s[1:], s[0] + length)[changes]
    after = np.roll(codes, -1)[changes]
    starts = np.empty(len(changes))
    cusp = (codes[changes] == CONCAVE) | (after == CONCAVE)
    starts[cusp] = _bisect(lambda t: _convex(curve, t), codes[changes][cusp] != CONCAVE, low[cusp], high[cusp])
    hidden = codes[changes][~cusp] == OCCLUDED
    starts[~cusp] = _bisect(lambda t: _occluded(curve, t), hidden, low[~cusp], high[~cusp])
    starts = np.mod(starts, length)
    order = np.argsort(starts)
    return Arcs(starts[order], after[order], length)


def _convex(curve: PanelCurve, s: FloatArray) -> BoolArray:
    return np.asarray(incident_curvature(curve.body, curve.at(s), curve.direction) > 0)


def _occluded(curve: PanelCurve, s: FloatArray) -> BoolArray:
    return occluded(curve.body, curve.at(s), curve.direction)


def _at(mask: BoolArray, values: BoolArray) -> BoolArray:
    full = np.zeros(len(mask), dtype=bool)
    full[mask] = values
    return full


def _with_touching(curve: PanelCurve, s: FloatArray, convex: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Add samples at extrema of kappa_n that point to zero: a pair of zeros may lie between two samples."""
    kappa = incident_curvature(curve.body, curve.at(s), curve.direction)
    before, after = np.roll(kappa, 1), np.roll(kappa, -1)
    near = (np.abs(kappa) <= np.abs(before)) & (np.abs(kappa) <= np.abs(after))
    near &= (before * kappa > 0) & (after * kappa > 0) & (np.arange(len(s)) % (len(s) - 1) > 0)
    k = np.flatnonzero(near)
    if not len(k):
        return s, convex
    # vertex of the parabola through three samples
    p, q = s[k] - s[k - 1], s[k + 1] - s[k]
    left, right = (kappa[k] - before[k]) / p, (after[k] - kappa[k]) / q
    bend = (right - left) / (p + q)
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = s[k] - 0.5 * (left * q + right * p) / (p + q) / bend
    inside = (vertex > s[k - 1]) & (vertex < s[k + 1])
    s = np.unique(np.concatenate([s, vertex[inside]]))
    return s, _convex(curve, s)


def _bisect(
    state: Callable[[FloatArray], BoolArray], at_low: BoolArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Arclengths between low and high at which a state leaves its value at low: (m,)."""
    if not len(low):
        return np.zeros(0)
    low, high = low.copy(), high.copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same = state(middle) == at_low
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(0.5 * (low + high))


def occluded(body: Surface, points: FloatArray, direction: FloatArray, reach: FloatArray | float = np.inf) -> BoolArray:
    """Whether the backward ray x - t d, 0 < t < reach, enters the body: points (n, 3), d (3,) or (n, 3) -> (n,).

    It leaves a point along the normal's side, or touches there from a convex side.
    """
    if not len(points):
        return np.zeros(0, dtype=bool)
    box = np.asarray(body.bounds, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        exits = np.where(direction > 0, (points - box[0]) / direction, (points - box[1]) / direction)
    # a point on the face of the box, or just beyond it by rounding, has nothing behind
    inside = np.maximum(np.min(np.where(direction != 0, exits, np.inf), axis=1), 1e-3 * size(body))
    limit: FloatArray = np.minimum(inside, np.asarray(reach, dtype=float))
    t = limit[:, None] * (np.arange(1, RAY_SAMPLES + 2) / RAY_SAMPLES)
    direction = np.broadcast_to(direction, points.shape)
    F = body.level(points[:, None] - t[..., None] * direction[:, None])
    hit = np.asarray(np.any(F < 0, axis=1))
    ray, j = np.nonzero((F[:, 1:-1] < F[:, :-2]) & (F[:, 1:-1] <= F[:, 2:]) & ~hit[:, None])
    if len(ray):
        step = limit[ray] / RAY_SAMPLES
        deepest = _minima(body, points[ray], direction[ray], t[ray, j + 1], step)
        hit[ray[deepest < 0]] = True
    return hit


def _minima(body: Surface, points: FloatArray, direction: FloatArray, t: FloatArray, step: FloatArray) -> FloatArray:
    """Least F along the backward rays near t, by Newton on its derivative within one step: (m,)."""
    start = t
    for _ in range(6):
        x = points - t[:, None] * direction
        slope = -np.sum(body.gradient(x) * direction, axis=1)
        bend = np.einsum("mij,mi,mj->m", body.hessian(x), direction, direction)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.where(bend > 0, -slope / bend, -np.sign(slope) * 0.25 * step)
        t = np.clip(t + move, start - step, start + step)
    return np.asarray(body.level(points - t[:, None] * direction))
