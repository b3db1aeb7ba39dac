"""Parts of a body's creases that belong to a shadow line: there the line goes on, but launches no creeping ray.

Seen along d, the outline runs along a convex edge where it is lit on one side only,

    (n_i.d < 0) != (n_j.d < 0),

and a piece that lies edge-on, n.d = 0, counts as dark. Between the points of a crease the edge is the cubic with their
tangents e = n_i x n_j/|.|.

Sources: Derivations, R6.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.geometry.surface import size
from creeping.shadow.piece_curves import EDGE_ON

PROBE = 1e-4
"""Distance from an edge, in body sizes, at which F tells a convex one from a concave one."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_GAUSS, _WEIGHTS = 0.5 * (_NODES + 1), 0.5 * _WEIGHTS


class EdgePart(NamedTuple):
    """Part of an edge that the shadow line runs along.

    Attributes
    ----------
    crease : int
        Number of the crease.
    points : (n, 3), L
    length : float, L
    """

    crease: int
    points: FloatArray
    length: float


def parts_on_edges(body: Any, pieces: tuple[Any, ...], direction: FloatArray) -> tuple[EdgePart, ...]:
    """Parts of convex edges that are lit on one side only, of all edges in turn."""
    found: list[EdgePart] = []
    for number, crease in enumerate(body.creases):
        if crease.kind != "edge":
            continue
        x = np.asarray(crease.points, dtype=float)
        sides = [pieces[k] for k in crease.pieces]
        n = [unit_normals(side, x) for side in sides]
        runs = _runs(x, edge_tangents(x, *n), convex(body, x, *n), sides, direction)
        found += [
            EdgePart(number, np.concatenate([run[0][0][:1], *(p[0][1:] for p in run)]), float(sum(p[1] for p in run)))
            for run in runs
        ]
    return tuple(found)


def unit_normals(piece: Any, x: FloatArray) -> FloatArray:
    """Normals of a piece (n, 3)."""
    gradient = piece.gradient(x)
    return np.asarray(gradient / np.linalg.norm(gradient, axis=1, keepdims=True))


def edge_tangents(x: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Unit tangents e of an edge along its points (n, 3), from the normals on either side."""
    closed = len(x) > 3 and np.array_equal(x[0], x[-1])
    ahead, behind = np.roll(x, -1, axis=0), np.roll(x, 1, axis=0)
    if closed:
        ahead[-1], behind[0] = x[1], x[-2]
    else:
        ahead[-1], behind[0] = x[-1], x[0]
    chord = ahead - behind
    chord /= np.linalg.norm(chord, axis=1, keepdims=True)
    e = np.cross(first, second)
    sine = np.linalg.norm(e, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        e = e / sine * np.sign(np.sum(e * chord, axis=1, keepdims=True))
    # where the normals nearly agree, or the polyline is too coarse to say which way, the chord must do
    return np.where((sine > 1e-6) & (np.sum(e * chord, axis=1, keepdims=True) > 0.5), e, chord)


def convex(body: Any, x: FloatArray, first: FloatArray, second: FloatArray) -> BoolArray:
    """Whether an edge is convex at its points (n,): F > 0 on both sides across the mean normal."""
    across = first - second
    across = PROBE * size(body) * across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    return np.asarray((body.level(x + across) > 0) & (body.level(x - across) > 0))


def _runs(
    x: FloatArray, e: FloatArray, is_convex: BoolArray, sides: list[Any], direction: FloatArray
) -> list[list[tuple[FloatArray, float]]]:
    """Runs of the parts of one edge on the line, each the ends (2, 3) and the length of parts one after the other."""
    s = [unit_normals(side, x) @ direction + EDGE_ON for side in sides]
    runs: list[list[tuple[FloatArray, float]]] = []
    for k in np.flatnonzero(is_convex[:-1] & is_convex[1:]):
        ends = x[k : k + 2], e[k : k + 2]
        cuts = [_cut(*ends, side, direction) for side, v in zip(sides, s, strict=True) if (v[k] < 0) != (v[k + 1] < 0)]
        shares = [0.0, *sorted(cuts), 1.0]
        for low, high in pairwise(shares):
            middle = _cubic(*ends, np.array([0.5 * (low + high)]))
            one, two = (unit_normals(side, middle)[0] @ direction < -EDGE_ON for side in sides)
            if one == two or not high > low:
                continue
            part = _cubic(*ends, np.array([low, high])), _length(*ends, low, high)
            if runs and _meet(runs[-1][-1], part):
                runs[-1].append(part)
            else:
                runs.append([part])
    if len(runs) > 1 and _meet(runs[-1][-1], runs[0][0]):
        runs[0] = runs.pop() + runs[0]
    return runs


def _meet(before: tuple[FloatArray, float], after: tuple[FloatArray, float]) -> bool:
    return bool(np.linalg.norm(before[0][-1] - after[0][0]) <= 1e-9 * (before[1] + after[1]))


def _cut(x: FloatArray, e: FloatArray, side: Any, direction: FloatArray) -> float:
    """Share of a segment at which n.d of one side changes its sign."""
    low, high = 0.0, 1.0
    dark = unit_normals(side, x[:1])[0] @ direction >= -EDGE_ON
    for _ in range(45):
        middle = 0.5 * (low + high)
        same = (unit_normals(side, _cubic(x, e, np.array([middle])))[0] @ direction >= -EDGE_ON) == dark
        low, high = (middle, high) if same else (low, middle)
    return 0.5 * (low + high)


def _cubic(x: FloatArray, e: FloatArray, u: FloatArray) -> FloatArray:
    """Points at shares u (n,) of the cubic between two points with unit tangents: (n, 3), L."""
    h, v = float(np.linalg.norm(x[1] - x[0])), u[:, None]
    at = (1 - v) ** 2 * (1 + 2 * v) * x[0] + v**2 * (3 - 2 * v) * x[1]
    return np.asarray(at + h * v * (1 - v) * ((1 - v) * e[0] - v * e[1]))


def _length(x: FloatArray, e: FloatArray, low: float, high: float) -> float:
    """Length of the cubic from a share to another, L."""
    u = (low + (high - low) * _GAUSS)[:, None]
    chord, h = x[1] - x[0], float(np.linalg.norm(x[1] - x[0]))
    slope = 6 * u * (1 - u) * chord + h * ((1 - u) * (1 - 3 * u) * e[0] + u * (3 * u - 2) * e[1])
    return float((high - low) * np.sum(_WEIGHTS * np.linalg.norm(slope, axis=1)))
