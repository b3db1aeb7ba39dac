"""Places where the state of shadow lines may change: cusps and crossings of their pictures along q.

Projected along the incident direction q a line is a plane curve: of a point source by the stereographic projection of
the sphere of directions, which takes curves that cross to curves that cross and that of a plane wave for its limit. It
has a cusp where kappa_n(q) = 0, since T is along q there, and visibility changes only at cusps and, where two of its
parts cross, on the one behind (the larger x.d, or R).

    plane wave      u = e.x,               v = f.x,               depth x.d
    point source    u = e.y/(1 + a.y),     v = f.y/(1 + a.y),     depth R,     y = q/|q|,  dy = w (T - (T.y) y)/|q|

with e, f across d, or across the axis a of the picture.

Sources: [K84]; Derivations, R10.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.shadow.curves import Curves

MOST = 64
"""Most crossings of a line. With more, two curves coincide in the picture, and crossings mean nothing."""


class Breaks(NamedTuple):
    """Breaks of lines.

    Attributes
    ----------
    curve, place : (k,)
        Of each break, in order.
    extreme : (n, 4)
        Outermost nodes of the picture of each line, which nothing hides; -1 where a point source stands among the
        body, so that no picture has all of it inside.
    certain : (n,)
        Whether no pair of breaks can lie hidden between neighbouring nodes, and no curves lie upon each other.
    """

    curve: IntArray
    place: FloatArray
    extreme: IntArray
    certain: BoolArray


def breaks_of(curves: Curves, box: FloatArray) -> Breaks:
    """Breaks of lines; ``box`` (2, 3), L, holds the body."""
    where, at, hidden = _cusps(curves)
    picture, extreme = _picture(curves, box)
    more, there, upon = _crossings(curves, picture)
    curve, place = np.concatenate([where, more]), np.concatenate([at, there])
    # a place may have come round
    place = np.where(place >= curves.number[curve], place - curves.number[curve], place)
    order = np.lexsort((place, curve))
    return Breaks(curve[order], place[order], extreme, ~(hidden | upon))


def _cusps(curves: Curves) -> tuple[IntArray, FloatArray, BoolArray]:
    """Zeros of kappa_n(q): curves (k,), places (k,), and lines (n,) with some that may be hidden.

    Hidden are pairs of zeros between neighbours: an extremum nearer to 0 than half its second difference, or two
    changes in neighbouring cells.
    """
    a, after = curves.curvature, curves.after
    b = a[after]
    before = np.empty_like(a)
    before[after] = a
    changes = (a > 0) != (b > 0)
    turns = ((before - a) * (b - a) > 0) & ((before > 0) == (a > 0)) & (np.abs(a) < 0.5 * np.abs(before - 2 * a + b))
    unsure = np.where(changes, changes[after], turns)
    hidden = np.zeros(len(curves.waves), dtype=bool)
    hidden[curves.line[curves.own[unsure]]] = True
    node = np.flatnonzero(changes)
    where = curves.own[node]
    cell = node - curves.first[where]
    # the Illinois rule: an end that is kept twice has its value halved
    low, high, last = np.zeros(len(node)), np.ones(len(node)), np.zeros(len(node))
    at_low, at_high, u = a[node], b[node], np.zeros(len(node))
    u[at_high == 0] = 1.0
    for _ in range(40 if len(node) else 0):
        open_ = (high - low > 1e-13) & (at_low != 0) & (at_high != 0)
        if not open_.any():
            break
        u = np.where(open_, (low * at_high - high * at_low) / np.where(open_, at_high - at_low, 1.0), u)
        value = curves.values_at(a[:, None], where, cell + u)[:, 0]
        up = (value > 0) == (at_high > 0)
        at_low = np.where(open_ & up & (last == 1), 0.5 * at_low, np.where(open_ & ~up, value, at_low))
        at_high = np.where(open_ & ~up & (last == -1), 0.5 * at_high, np.where(open_ & up, value, at_high))
        low, high = np.where(open_ & ~up, u, low), np.where(open_ & up, u, high)
        last = np.where(up, 1, -1)
    return where, cell + u, hidden


class Picture(NamedTuple):
    """Lines seen along q: (u, v) (m, 2), their change along the line (m, 2), and the depth (m,) of the nodes."""

    seen: FloatArray
    slope: FloatArray
    depth: FloatArray


def _picture(curves: Curves, box: FloatArray) -> tuple[Picture, IntArray]:
    """Picture of lines, and the outermost nodes (n, 4) of each."""
    n, m = len(curves.waves), len(curves.points)
    firsts = [*curves.first[np.searchsorted(curves.line, np.arange(n))].tolist(), m]
    axes, apart = curves.waves[:, :3].copy(), np.ones(n, dtype=bool)
    for of in np.flatnonzero(curves.waves[:, 3]):
        axes[of], apart[of] = _axis_of(curves.points[firsts[of] : firsts[of + 1]], curves.waves[of], box)
    e = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    e -= np.sum(e * axes, axis=1, keepdims=True) * axes
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    frames = np.stack([e, np.cross(axes, e)], axis=2)
    seen, slope, depth = np.empty((m, 2)), np.empty((m, 2)), np.empty(m)
    extreme = np.empty((n, 4), np.int64)
    # line by line: a product of matrices depends on the number of rows
    for row in range(n):
        own, axis, across, w = slice(firsts[row], firsts[row + 1]), axes[row], frames[row], curves.waves[row, 3]
        x, T = curves.points[own], curves.tangents[own]
        if w:
            q = curves.waves[row, :3] + w * x
            norm = np.linalg.norm(q, axis=1, keepdims=True)
            y = q / norm
            dy = w * (T - np.sum(T * y, axis=1, keepdims=True) * y) / norm
            share = 1 / (1 + y @ axis)[:, None]
            seen[own], depth[own] = share * (y @ across), norm[:, 0] / w
            slope[own] = share * (dy @ across - seen[own] * (dy @ axis)[:, None])
        else:
            seen[own], slope[own], depth[own] = x @ across, T @ across, x @ axis
        extreme[row, :2], extreme[row, 2:] = seen[own].argmin(axis=0), seen[own].argmax(axis=0)
    extreme += np.array(firsts[:-1])[:, None]
    extreme[~apart] = -1
    return Picture(seen, slope, depth), extreme


def _axis_of(x: FloatArray, wave: FloatArray, box: FloatArray) -> tuple[FloatArray, bool]:
    """Axis (3,) of the picture of a point source, and whether all of the body is on its side.

    It points to the middle of the body if all of its box is ahead; else, of that and the six along the coordinates, it
    is the one whose opposite, the point at infinity of the picture, is furthest from the line.
    """
    middle = wave[:3] + wave[3] * box.mean(axis=0)
    square = float(middle @ middle)
    tried = np.concatenate([middle[None] / np.sqrt(square + 1e-290), np.eye(3), -np.eye(3)])
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    if square > 0 and np.all((wave[:3] + wave[3] * corners) @ tried[0] > 0):
        return tried[0], True
    q = wave[:3] + wave[3] * x
    nearest = np.min(1 + (q / np.linalg.norm(q, axis=1, keepdims=True)) @ tried.T, axis=0)
    # towards a middle next to the source there is no direction
    nearest[0] = nearest[0] if square > 0.5e-6 else -1.0
    return tried[np.argmax(nearest)], False


def _crossings(curves: Curves, picture: Picture) -> tuple[IntArray, FloatArray, BoolArray]:
    """Crossings of the pictures of lines: curves (k,) and places (k,) of the parts behind, and lines (n,) with MOST."""
    from creeping.shadow.kernels.crossings import crossings

    pairs, count = np.empty((len(curves.waves), MOST, 2), np.int64), np.empty(len(curves.waves), np.int64)
    crossings(picture.seen, curves.first, curves.number, curves.line, pairs, count)
    i, m = pairs[(np.arange(MOST) < count[:, None]) & (count[:, None] <= MOST)].T
    upon = count > MOST
    if not len(i):
        return i, np.zeros(0), upon
    own, other = curves.own[i], curves.own[m]
    one, two = _solved(curves, picture, i, m)
    behind = picture.depth[i] > picture.depth[m]
    where = np.where(behind, own, other)
    return where, np.where(behind, one, two) % curves.number[where], upon


def _turn(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _solved(curves: Curves, picture: Picture, i: IntArray, m: IntArray) -> tuple[FloatArray, FloatArray]:
    """Places (k,), (k,) at which parts cross near the chords after nodes i and m; of the chords where that fails.

    Newton's method on the cubics between nodes, which do not leave their cell by much, and then on the polynomials.
    """
    curve = np.stack([curves.own[i], curves.own[m]])
    h, base = curves.spacing[curve][..., None], np.stack([i, m]) - curves.first[curve]
    rows = np.concatenate([picture.seen, picture.slope], axis=1)

    def newton(places: FloatArray, values: FloatArray, slopes: FloatArray) -> FloatArray:
        gap, determinant = values[1] - values[0], _turn(slopes[0], slopes[1])
        step = np.stack([_turn(gap, slopes[1]), _turn(gap, slopes[0])]) / np.where(
            determinant == 0, np.inf, determinant
        )
        return np.asarray(places + np.clip(step, -1, 1))

    def cubics(places: FloatArray) -> tuple[FloatArray, FloatArray]:
        cell = np.floor(places).astype(np.int64)
        p, q = rows[curves.nodes_at(curve, cell)], rows[curves.nodes_at(curve, cell + 1)]
        u = (places - cell)[..., None]
        v, s, t = 1 - u, h * p[..., 2:], h * q[..., 2:]
        p, q = p[..., :2], q[..., :2]
        value = v * v * (1 + 2 * u) * p + u * u * (3 - 2 * u) * q + u * v * (v * s - u * t)
        return value, 6 * u * v * (q - p) + v * (v - 2 * u) * s + u * (u - 2 * v) * t

    def polynomials(places: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = curves.values_at(rows, curve.ravel(), places.ravel()).reshape(*places.shape, 4)
        return found[..., :2], h * found[..., 2:]

    at = rows[np.stack([i, m]), :2]
    chords = picture.seen[curves.after[np.stack([i, m])]] - at
    start = places = newton(base.astype(float), at, chords)
    for _ in range(8):
        places = newton(places, *cubics(places))
    # the crossing of the cubics may lie in a cell next to that of the chords
    near = np.all(np.abs(places - start) < 2, axis=0)
    best = np.where(near, places, start)
    for _ in range(3):
        best = newton(best, *polynomials(best))
    one, two = np.where(near, best, start)
    return one, two
