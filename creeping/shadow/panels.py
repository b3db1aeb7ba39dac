"""A smooth curve {F = 0, grad F.q = 0}, closed or open, in panels, exact at every arclength.

q is where the wave travels, d of a plane wave (`creeping.geometry.incident`).

On the panel from a to b with chord c = b - a, the curve is a graph over the chord, u in [-1, 1]:

    F(x) = 0,   grad F(x).q = 0,   c.(x - (a + b)/2 - u c/2) = 0,
    ds/du = |c|^2 / (2 T.c),       T = grad F x Hq / |.|.

x and ds/du are polynomials through Gauss points of u; panels are halved until the polynomials are exact to rounding, so
they shrink where the curve turns fast and the length needs no resampling.

Sources: Derivations, R7.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from creeping._typing import BoolArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.incident import spherical, travel
from creeping.geometry.surface import Surface, jet, size
from creeping.shadow.curves import moved_onto_lines, tangents_at

ORDER = 16
"""Gauss points of a panel."""
LENGTH_TOLERANCE = 1e-12
"""Last coefficients of a panel's arclength, relative to the curve."""
_U, _WEIGHTS = legendre.leggauss(ORDER)
# values at the Gauss points -> Legendre coefficients, exact for polynomials below the order
_TO_COEFFICIENTS = (legendre.legvander(_U, ORDER - 1) * _WEIGHTS[:, None] * (np.arange(ORDER) + 0.5)).T


def newton_step(body: Surface, wave: FloatArray, points: FloatArray, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Newton step for {F = 0, G = 0}, G = grad F.q - w F, at right angles to an axis, and the tangent: (n, 3), (n, 3).

    grad G = Hq, and inverse rows of (grad F, Hq, axis) are cross products over the determinant axis.(grad F x Hq).
    """
    F, gradient, hessian = jet(body, points)
    q = travel(wave, points)
    Hq = (hessian @ q[..., None])[..., 0]
    G = np.sum(gradient * q, axis=-1)
    if spherical(wave):
        G = G - wave[..., 3] * F
    W = _crossed(gradient, Hq)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        step = -(F[..., None] * _crossed(Hq, axis) + G[..., None] * _crossed(axis, gradient))
        step /= np.sum(W * axis, axis=-1, keepdims=True)
        tangent = W / np.linalg.norm(W, axis=-1, keepdims=True)
    return step, tangent


def _crossed(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of (n, 3): a third of numpy's time where points are few."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


@dataclass(frozen=True, eq=False, repr=False)
class PanelCurve:
    """Curve in panels.

    Attributes
    ----------
    body, wave : Surface, (3,) or (4,)
    nodes : (p, 3), L
        First points of the panels.
    shape : (p, ORDER, 3), L
        Legendre coefficients of x(u).
    speed : (p, ORDER), L
        Legendre coefficients of ds/du.
    closed : bool
    """

    body: Surface
    wave: FloatArray
    nodes: FloatArray
    shape: FloatArray
    speed: FloatArray
    closed: bool = True

    @property
    def breaks(self) -> FloatArray:
        """Arclengths of the ends of the panels: (p + 1,), L."""
        # the integral of P_j over [-1, 1] is 2 for j = 0 and 0 otherwise
        return np.concatenate([[0.0], np.cumsum(2 * self.speed[:, 0])])

    @property
    def length(self) -> float:
        """Length, L."""
        return float(self.breaks[-1])

    def at(self, arclength: FloatArray) -> FloatArray:
        """Points at any arclength: (m,) -> (m, 3), L; modulo the length, of an open curve no further than its ends."""
        breaks = self.breaks
        s = np.asarray(arclength, dtype=float)
        s = np.mod(s, breaks[-1]) if self.closed else np.clip(s, 0.0, breaks[-1])
        panel = np.clip(np.searchsorted(breaks, s, side="right") - 1, 0, len(self.nodes) - 1)
        offset = s - breaks[panel]
        integral = legendre.legint(self.speed, lbnd=-1, axis=1)[panel]
        speed = self.speed[panel]
        u = offset / speed[:, 0] - 1
        for _ in range(12):
            V = legendre.legvander(u, ORDER)
            step = (np.sum(V * integral, axis=1) - offset) / np.sum(V[:, :-1] * speed, axis=1)
            u = np.clip(u - step, -1, 1)
            if np.all(np.abs(step) < 1e-15):
                break
        points = np.einsum("mk,mkc->mc", legendre.legvander(u, ORDER - 1), self.shape[panel])
        return moved_onto_lines(self.body, self.wave, points, reach=1e-6 * size(self.body), steps=2).points


def fit_panels(
    body: Surface,
    wave: FloatArray,
    nodes: FloatArray,
    spacing: FloatArray,
    *,
    closed: bool = True,
    most: int = 20_000,
) -> PanelCurve:
    """Panels of the curve through ordered nodes.

    Parameters
    ----------
    body, wave : Surface, (3,) or (4,)
    nodes : (k, 3), L
        Points of the curve, running along T, up to swaps of neighbours closer than ``spacing``.
    spacing : (k,), L
        Size of the mesh at the nodes.
    closed : bool
        Whether the curve goes on from the last node to the first; else these are its ends.
    most : int
        Panels after which it is given up.

    Returns
    -------
    PanelCurve

    Raises
    ------
    SingularIncidenceError
        If a panel cannot be made exact: the curve turns within rounding of a crossing.
    """
    if closed:
        nodes = _forward_nodes(body, wave, nodes, spacing)
    tangents = tangents_at(body, wave, nodes)
    count = len(nodes)
    last = count if closed else count - 1
    chords = np.linalg.norm(np.roll(nodes, -1, axis=0) - nodes, axis=1)[:last]
    tolerance = LENGTH_TOLERANCE * max(float(chords.sum()), 0.1 * size(body))
    keys = _first_breaks(tangents, last)
    # a panel end is its place in the ring of nodes; halving takes a node of the ring while there is one between
    known = {float(k): (nodes[k % count], tangents[k % count]) for k in range(last + 1)}
    todo = [(float(a), float(b)) for a, b in pairwise(keys)]
    done: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []
    while todo:
        # points and tangents of the first ends, then of the second
        ends = [np.array(part) for end in (0, 1) for part in zip(*(known[pair[end]] for pair in todo), strict=True)]
        a, _, b, _ = ends
        shape, speed, good = _fit(body, wave, ends, tolerance)
        done += [(todo[i][0], a[i], shape[i], speed[i]) for i in np.flatnonzero(good)]
        bad = np.flatnonzero(~good)
        halves = []
        for i in bad:
            low, high = todo[i]
            # a whole number strictly between them, or their mean if there is none
            first, after = np.floor(low) + 1, np.ceil(high) - 1
            middle = float((first + after) // 2) if first <= after else (low + high) / 2
            if middle not in known:
                with np.errstate(divide="ignore", invalid="ignore"):
                    guess = _hermite([of[i : i + 1] for of in ends], np.zeros(1))[0]
                found = moved_onto_lines(body, wave, guess, reach=0.3 * float(np.linalg.norm(b[i] - a[i])), steps=8)
                known[middle] = found.points[0], found.tangents[0]
            halves += [(low, middle), (middle, high)]
        if len(done) + len(halves) > most or (
            len(bad) and np.min(np.linalg.norm(b - a, axis=1)[bad]) < 1e-11 * size(body)
        ):
            raise SingularIncidenceError(
                f"the shadow line cannot be followed at {len(bad)} places, first near "
                f"{np.round(a[bad[0]], 6).tolist()}; it turns too sharply there: perturb the direction, or move the "
                "source, by say 1e-3",
                points=a[bad],
                distance=0.0,
            )
        todo = halves
    done.sort(key=lambda panel: panel[0])
    first, shape, speed = (np.array([panel[k] for panel in done]) for k in (1, 2, 3))
    return PanelCurve(body, wave, first, shape, speed, closed)


def _forward_nodes(body: Surface, wave: FloatArray, nodes: FloatArray, spacing: FloatArray) -> FloatArray:
    """Drop nodes that lie behind, or less than a quarter of a mesh edge before, the last one kept."""
    tangents = tangents_at(body, wave, nodes)
    kept = [0]
    for k in range(1, len(nodes)):
        if (nodes[k] - nodes[kept[-1]]) @ tangents[kept[-1]] > 0.25 * min(spacing[k], spacing[kept[-1]]):
            kept.append(k)
    while len(kept) > 4 and (nodes[0] - nodes[kept[-1]]) @ tangents[kept[-1]] <= 0.25 * spacing[kept[-1]]:
        kept.pop()
    return nodes[kept]


def _first_breaks(tangents: FloatArray, last: int) -> list[int]:
    """Ring numbers, 0 to ``last``, at which panels start: 0.6 rad of turning apart, eight panels if there are nodes."""
    cosine = np.clip(np.sum(tangents * np.roll(tangents, -1, axis=0), axis=1), -1, 1)[:last]
    turned = np.concatenate([[0.0], np.cumsum(np.arccos(cosine))])
    panels = int(np.clip(np.ceil(turned[-1] / 0.6), min(8, last), last))
    keys = np.searchsorted(turned, np.linspace(0, turned[-1], panels + 1)[1:-1])
    return [0, *np.unique(np.clip(keys, 1, last - 1)).tolist(), last]


def _fit(
    body: Surface, wave: FloatArray, ends: list[FloatArray], tolerance: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Coefficients of x and ds/du of panels from a to b, of ends (a, Ta, b, Tb), and whether they are exact."""
    a, Ta, b, Tb = ends
    # smallest T.c/|c| on a panel: tangents within 53 degrees of the chord
    least = 0.6
    chord = b - a
    long = np.linalg.norm(chord, axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        axis = np.repeat(chord / long[:, None], ORDER, axis=0)
        points = _hermite(ends, _U).reshape(-1, 3)
    reach = np.repeat(0.2 * long, ORDER)
    good_ends = np.minimum(np.sum(Ta * chord, axis=1), np.sum(Tb * chord, axis=1)) > least * long
    step = np.zeros_like(points)
    for _ in range(7):
        step, _ = newton_step(body, wave, points, axis)
        with np.errstate(divide="ignore", invalid="ignore"):
            points = points + step * np.minimum(1.0, reach / np.linalg.norm(step, axis=1))[:, None]
    _, tangent = newton_step(body, wave, points, axis)
    aligned = np.sum(tangent * axis, axis=1).reshape(-1, ORDER)
    moved = np.linalg.norm(step, axis=1).reshape(-1, ORDER)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speed = (0.5 * long[:, None] / aligned) @ _TO_COEFFICIENTS.T
        shape = np.einsum("jk,pkc->pjc", _TO_COEFFICIENTS, points.reshape(-1, ORDER, 3))
        tail = np.sum(np.abs(speed[:, -3:]), axis=1)
        # the ends are known apart from the polynomial: a jump to another branch shows there
        miss = np.maximum(
            np.linalg.norm(shape.sum(axis=1) - b, axis=1),
            np.linalg.norm((shape * (-1.0) ** np.arange(ORDER)[:, None]).sum(axis=1) - a, axis=1),
        )
        good = good_ends & np.all(aligned > least, axis=1) & np.all(moved < 1e-8 * long[:, None], axis=1)
        good &= (tail < tolerance) & (miss < 1e-7 * long)
    return shape, speed, np.asarray(good)


def _hermite(ends: list[FloatArray], u: FloatArray) -> FloatArray:
    """Cubic over the chords with the tangents of the ends: (p, 3) and (k,) -> (p, k, 3)."""
    a, Ta, b, Tb = ends
    c = (b - a)[:, None]
    square = np.sum(c * c, axis=-1, keepdims=True)
    bumps = []
    for tangent in (Ta, Tb):
        T = tangent[:, None]
        along = np.sum(T * c, axis=-1, keepdims=True)
        # a tangent across the chord says nothing about a graph over it
        bumps.append(np.where(along > 0.2 * np.sqrt(square), 0.5 * (square / along * T - c), 0.0))
    v = u[:, None]
    bump = bumps[0] * (1 - v) ** 2 * (1 + v) / 4 - bumps[1] * (1 + v) ** 2 * (1 - v) / 4
    return np.asarray(0.5 * (a + b)[:, None] + 0.5 * v * c + bump)
