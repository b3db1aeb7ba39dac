"""Where rays leave the shadow line: arcs that launch, positions on them, and new positions where rays part.

A position is (arc, arclength) with the arclength unwrapped, so that it grows along an arc that crosses the start of its
closed curve; the point is that of the arclength modulo the curve's length.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.geometry.surface import Surface
from creeping.shadow.line import ShadowLine


class Arc(NamedTuple):
    """Part of one curve of the shadow line whose rays are neighbours; ``closed`` if it is the whole curve."""

    curve: int
    start: float
    end: float
    closed: bool


def launching_arcs(line: ShadowLine, *, every: bool) -> list[Arc]:
    """Attached arcs of the line, or its whole curves."""
    arcs = []
    for index, curve in enumerate(line.curves):
        if every:
            arcs.append(Arc(index, 0.0, curve.length, True))
            continue
        for start, end, status in curve.arcs:
            if status == "attached":
                arcs.append(Arc(index, start, end, len(curve.arcs) == 1))
    return arcs


def position_statuses(line: ShadowLine, arcs: list[Arc], arc: IntArray, arclength: FloatArray) -> list[str]:
    """Status of the line at each position: (n,)."""
    found = []
    for k, s in zip(arc, arclength, strict=True):
        curve = line.curves[arcs[k].curve]
        holding = [status for start, end, status in curve.arcs if (s - start) % curve.length < end - start]
        # rounding may leave a position between two arcs: then it is of neither side, and concave launches nothing
        found.append(holding[0] if holding else "concave")
    return found


def launch_positions(line: ShadowLine, arcs: list[Arc], n_rays: int | None) -> tuple[IntArray, FloatArray]:
    """Arc numbers and arclengths of the first rays: (n,), (n,).

    Rays are evenly spaced on each arc, half a spacing from its ends, where kappa_n or the illumination stops. Without
    ``n_rays`` the spacing is that of the line's points.
    """
    lengths = np.array([arc.end - arc.start for arc in arcs])
    if n_rays is None:
        spacing = [line.curves[arc.curve].length / len(line.curves[arc.curve].points) for arc in arcs]
        counts = np.maximum(1, np.round(lengths / np.array(spacing)).astype(int)) if arcs else np.zeros(0, dtype=int)
    else:
        counts = _shares(lengths, n_rays)
    arc = np.repeat(np.arange(len(arcs)), counts)
    parts = []
    for k, count in enumerate(counts):
        offset = 0.0 if arcs[k].closed else 0.5
        parts.append(arcs[k].start + lengths[k] * (np.arange(count) + offset) / max(count, 1))
    return arc.astype(np.int64), np.concatenate(parts) if parts else np.zeros(0)


def _shares(lengths: FloatArray, total: int) -> IntArray:
    """Whole numbers of at least one in proportion to the lengths, of the given sum (or one each if that is more)."""
    if not len(lengths):
        return np.zeros(0, dtype=np.int64)
    exact = lengths / lengths.sum() * max(total, len(lengths))
    counts = np.maximum(1, np.floor(exact)).astype(np.int64)
    while counts.sum() < total:
        counts[np.argmax(exact - counts)] += 1
    while counts.sum() > max(total, len(lengths)):
        counts[np.argmax(np.where(counts > 1, counts - exact, -np.inf))] -= 1
    return np.asarray(counts)


def parting_positions(
    points: FloatArray, arcs: list[Arc], arc: IntArray, arclength: FloatArray, gap: float
) -> tuple[IntArray, FloatArray]:
    """Positions half-way between neighbours that come to part by more than ``gap``: (m,), (m,).

    ``points`` (rays, steps, 3) are in the order of the positions: by arc, then by arclength.
    """
    new_arc, new_arclength = [], []
    for k, one in enumerate(arcs):
        mine = np.flatnonzero(arc == k)
        if len(mine) < 2:
            continue
        following = np.roll(mine, -1)
        after = arclength[following].copy()
        after[-1] += one.end - one.start
        if not one.closed:
            mine, following, after = mine[:-1], following[:-1], after[:-1]
        apart = np.max(np.linalg.norm(points[following] - points[mine], axis=-1), axis=-1)
        # below a spacing of rounding size more rays would tell nothing
        wide = (apart > gap) & (after - arclength[mine] > 1e-9 * (one.end - one.start))
        new_arc.append(np.full(int(wide.sum()), k, dtype=np.int64))
        new_arclength.append(0.5 * (arclength[mine] + after)[wide])
    if not new_arc:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    return np.concatenate(new_arc), np.concatenate(new_arclength)


def line_tangents(body: Surface, points: FloatArray, direction: FloatArray) -> FloatArray:
    """Unit tangents grad F x Hd/|.| of n.d = 0 at its points: (n, 3) -> (n, 3)."""
    tangent = np.cross(body.gradient(points), body.hessian(points) @ direction)
    return np.asarray(tangent / np.linalg.norm(tangent, axis=-1, keepdims=True))
