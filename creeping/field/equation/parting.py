"""How squares of a body are parted into tiles for a wavenumber.

Squares are parted until their sides are no longer than SIDE wavelengths, and their normals turn by no more than TURN.
Next to an edge, where currents go like a broken power of the distance, there is a strip of CUT of their width, parted
along the edge at the same places on both faces; next to a tip they are cut twice.

Sources: [DR84, sec. 2.7]; Derivations, F36.
"""

from itertools import pairwise

import numpy as np

from creeping._typing import FloatArray
from creeping.field.boundary import Boundary
from creeping.field.equation.tiles import POINTS, Tiles
from creeping.geometry.patches import DEGREE, Patches, lobatto, on_squares

SIDE = 0.82
"""Longest sides of tiles, in wavelengths."""
TURN = 0.52
"""Angle by which the normal turns along a side, radians, at most: currents are no smoother than the body."""
VARYING = 0.5
"""Share of sides and turns where the admittance varies."""
SLACK = 0.1
"""Share of a tile by which tiles may be too long before there is one more."""
CUT = 0.1
"""Width of the tile next to an edge or tip, over that of the one it is cut from."""
WIDE, WIDE_CUT = 1.0, 0.5
"""Side and cut of coarse tiles: far fields of cylinders err by 0.005 to 0.03 % of the largest amplitude."""
NEXT = ((0, 2, 0), (0, 3, 1), (1, 2, 0), (1, 3, 1), (2, 0, 0), (2, 1, 1), (3, 0, 0), (3, 1, 1))
"""Of sides, the sides that meet them, and at which of their ends."""


def tiles_of(patches: Patches, wavenumber: float, boundary: Boundary, *, coarse: bool = False) -> Tiles:
    """Tiles of a body's squares for a wavenumber, 1/L, and a boundary; ``coarse`` ones have fewer nodes.

    An admittance that varies is known at nodes alone, so these are closer.
    """
    share = VARYING if boundary.varies else 1.0
    if coarse:
        return tiles_for(patches, wavenumber, side=share * WIDE, turn=share * TURN, p=POINTS - 1, cut=WIDE_CUT)
    return tiles_for(patches, wavenumber, side=share * SIDE, turn=share * TURN, cut=CUT)


def tiles_for(
    patches: Patches,
    wavenumber: float,
    *,
    side: float = SIDE,
    turn: float = TURN,
    p: int = POINTS,
    cut: float = CUT,
    lacks: tuple[float, float] = (0.0, 0.0),
) -> Tiles:
    """Tiles of a body's squares for a wavenumber, 1/L, of sides and turns no longer than these."""
    steps = _parts(patches, side * 2 * np.pi / wavenumber, turn)
    along = _edge_breaks(patches, steps, cut)
    boxes = [
        _boxes(patches, number, [lane[number] for lane in steps], along, cut) for number in range(len(patches.off))
    ]
    owner = np.repeat(np.arange(len(boxes)), [len(box) for box in boxes])
    every = np.concatenate([np.array(box) for box in boxes])
    low, high, edges = every[:, [0, 2]], every[:, [1, 3]], every[:, 4:]
    places = patches.places[owner]

    t = lobatto(DEGREE)
    u, v = (low[:, axis, None] + (high - low)[:, axis, None] * t for axis in (0, 1))
    shapes = on_squares(places, u, v)[0]
    return Tiles.of(shapes, p, edges, lacks=lacks)


def _parts(patches: Patches, longest: float, most: float) -> tuple[FloatArray, FloatArray]:
    """How many tiles each step between Lobatto's places asks for, along u (m, q, q + 1) and along v (m, q + 1, q)."""
    at = np.broadcast_to(lobatto(DEGREE), (len(patches.off), DEGREE + 1))
    _, along, across = on_squares(patches.places, at, at)
    n = np.cross(along, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        n /= np.linalg.norm(n, axis=-1, keepdims=True)
    n[patches.pointed, 0] = n[patches.pointed, 1]
    lanes = []
    for axis in (1, 2):
        step, turn = (np.linalg.norm(np.diff(part, axis=axis), axis=-1) for part in (patches.places, n))
        lanes.append(np.maximum(step / longest, turn / most))
    return lanes[0], lanes[1]


def _edge_breaks(patches: Patches, steps: tuple[FloatArray, FloatArray], cut: float) -> dict[int, FloatArray]:
    """Where tiles on both sides of each edge are parted along it, 0 to 1, and cut next to corners of either.

    Were they not the same on both sides, what one side lacks of the broken power of the distance would not be what the
    other one lacks, and the difference would be a line source on the edge.
    """
    ends: dict[int, list[float]] = {}
    corners: dict[int, set[float]] = {}
    lengths: dict[int, float] = {}
    for number, side in np.argwhere(patches.edges).tolist():
        key, span = int(patches.sides[number, side]), patches.spans[number, side]
        ends.setdefault(key, []).extend(span)
        lane = (steps[1][number, 0], steps[1][number, -1], steps[0][number, :, 0], steps[0][number, :, -1])[side]
        lengths[key] = max(lengths.get(key, 0.0), float(lane.sum()) / abs(span[1] - span[0]))
        for mine, other, end in NEXT:
            if mine == side and patches.edges[number, other]:
                corners.setdefault(key, set()).add(float(span[end]))
    out = {}
    for key, given in ends.items():
        at = np.unique(np.round([0.0, 1.0, *given], 12))
        counts = np.maximum(1, np.ceil(lengths[key] * np.diff(at) - SLACK)).astype(int)
        if len(counts) == 1 and counts[0] == 1 and len(corners.get(key, ())) == 2:
            counts[0] = 2
        parts = [np.linspace(a, b, n + 1) for a, b, n in zip(at[:-1], at[1:], counts, strict=True)]
        breaks = np.unique(np.concatenate(parts))
        for corner in corners.get(key, ()):
            place = int(np.argmin(np.abs(breaks - corner)))
            beside = [breaks[j] for j in (place - 1, place + 1) if 0 <= j < len(breaks)]
            breaks = np.union1d(breaks, [corner + cut * (one - corner) for one in beside])
        out[key] = breaks
    return out


def _boxes(
    patches: Patches, number: int, steps: list[FloatArray], along: dict[int, FloatArray], share: float
) -> list[tuple[float, ...]]:
    """Parts (u0, u1, v0, v1) of a square and their ``edges``: strips parted as the edges are, and what is left."""
    edges, t = patches.edges[number], lobatto(DEGREE)
    counts = [max(1, int(np.ceil(float(steps[axis].sum(axis=axis).max()) - SLACK))) for axis in (0, 1)]
    breaks: dict[int, FloatArray] = {}
    for side in range(4):
        if not edges[side]:
            continue
        start, end = patches.spans[number, side]
        local = (along[int(patches.sides[number, side])] - start) / (end - start)
        breaks[side] = np.unique(np.clip(np.sort(local[(local > -1e-9) & (local < 1 + 1e-9)]), 0.0, 1.0))
    # strips are as wide as the edges that they end at are cut
    widths = np.zeros(4)
    for side in breaks:
        axis = 0 if side < 2 else 1
        meeting = [other for other in breaks if (other < 2) != (side < 2)]
        cut = share / max(counts[axis], 2 if edges[2 * axis] and edges[2 * axis + 1] else 1)
        if meeting:
            its = breaks[meeting[0]]
            cut = float(its[1] if side % 2 == 0 else 1 - its[-2])
        widths[side] = cut
    a, b, c, d = widths[0], 1 - widths[1], widths[2], 1 - widths[3]
    out: list[tuple[float, ...]] = []
    for side, v in breaks.items():
        key, (start, end) = float(patches.sides[number, side]), patches.spans[number, side]
        if side < 2:
            across, on_edge = (0.0, a) if side == 0 else (b, 1.0), v
        else:
            across = (0.0, c) if side == 2 else (d, 1.0)
            on_edge = np.union1d([a, b], v[(v > a + 1e-9) & (v < b - 1e-9)])
        for one, two in pairwise(on_edge):
            where = key, float(side), start + one * (end - start), start + two * (end - start)
            out.append((*across, one, two, *where) if side < 2 else (one, two, *across, *where))
    u = _between(a, b, counts[0])
    if patches.tips[number]:
        u = np.union1d(u, u[1] * share ** np.arange(1.0, 3.0))
    wide = steps[1].sum(axis=1)
    for u0, u1 in pairwise(u):
        inside = (t >= u0) & (t <= u1)
        most = max(float(np.max(wide[inside], initial=0.0)), *np.interp([u0, u1], t, wide))
        v = _between(c, d, max(1, int(np.ceil(most - SLACK))))
        out += [(u0, u1, v0, v1, *(-1.0,) * 4) for v0, v1 in pairwise(v)]
    return out


def _between(low: float, high: float, count: int) -> FloatArray:
    """Places from low to high, with those of ``count`` equal parts of 0 to 1 between them."""
    at = np.arange(1, count) / count
    return np.concatenate([[low], at[(at > low + 1e-9) & (at < high - 1e-9)], [high]])
