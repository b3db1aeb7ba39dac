"""Flat faces of a mesh with few triangles: those in one plane are joined, and their outline is cut into others.

Triangles that hang together and lie in one plane are a face. Of the corners of its outline those stay where three faces
meet, or where the outline turns; each face is then cut into triangles by its ears, with its holes joined to the outline
by bridges first.

Sources: [M75] for the ears, [E02] for the bridges.
"""

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geometry.patches import PLANE, Triangles, sides_of, turns_of
from creeping.geometry.triangulation import Triangulation, connected

MOST = 500
"""Corners of a face's outline at most: ears take the square of them."""
BULGE = 1e-6
"""How far corners of a face may be from its plane, over its extent: rounding of what is written in single precision."""


def with_whole_faces(body: Any) -> Triangles | None:
    """The same body, ``vertices`` (n, 3) and ``triangles`` (t, 3), by fewer triangles; None where there are not fewer.

    And where a face cannot be cut: of all faces or of none.

    Examples
    --------
    >>> import trimesh
    >>> box = trimesh.creation.box().subdivide().subdivide()
    >>> found = with_whole_faces(Triangles(box.vertices, box.faces, False))
    >>> len(box.faces), len(found.triangles)
    (192, 12)
    """
    vertices, triangles = np.asarray(body.vertices), np.asarray(body.triangles)
    # number of the face of each triangle (t,)
    _, number = sides_of(triangles)
    turned, beside = turns_of(vertices, triangles, number)
    face = connected(len(triangles), beside[turned < PLANE])[1]
    if 4 * face.max(initial=0) > len(triangles):
        return None
    outlines = _outlines(triangles, face)
    if outlines is None:
        return None
    # which vertices (n,) stay: where other than two faces meet, or outlines turn
    met, turns = np.zeros(len(vertices), dtype=int), np.zeros(len(vertices), dtype=bool)
    for loops in outlines:
        for loop in loops:
            back, ahead = (vertices[np.roll(loop, -step)] - vertices[loop] for step in (-1, 1))
            across = np.linalg.norm(np.cross(-back, ahead), axis=1)
            turns[loop] |= np.arctan2(across, np.sum(-back * ahead, axis=1)) > PLANE
            met[loop] += 1
    stays = np.asarray((met > 0) & (turns | (met != 2)))
    found: list[IntArray] = []
    each = np.split(triangles[np.argsort(face, kind="stable")], np.cumsum(np.bincount(face))[:-1])
    for own, loops in zip(each, outlines, strict=True):
        a, b, c = np.moveaxis(vertices[own], 1, 0)
        total = np.sum(np.cross(b - a, c - a), axis=0)
        normal, corners = np.asarray(total / np.linalg.norm(total)), vertices[np.unique(own)]
        # neighbours in one plane may bend together
        bulges = np.ptp((corners - corners.mean(axis=0)) @ normal) > BULGE * np.max(np.ptp(corners, axis=0))
        cut = None if bulges else _cut(vertices, [loop[stays[loop]] for loop in loops], normal)
        if cut is None:
            return None
        found.append(cut)
    made = np.concatenate(found)
    used, renumbered = np.unique(made, return_inverse=True)
    whole = Triangles(vertices[used], renumbered.reshape(-1, 3), bool(getattr(body, "tessellated", False)))
    area, before = (Triangulation(*one).area for one in ((whole.vertices, whole.triangles), (vertices, triangles)))
    closed = np.all(np.bincount(sides_of(whole.triangles)[1].ravel()) == 2)
    return whole if np.isclose(area, before, rtol=1e-6) and closed and len(made) < len(triangles) else None


def _outlines(triangles: IntArray, face: IntArray) -> list[list[IntArray]] | None:
    """Loops of each face's outline, the face on their left; None if an outline meets itself."""
    _, number = sides_of(triangles)
    starts, ends = triangles[:, [1, 2, 0]].ravel(), triangles[:, [2, 0, 1]].ravel()
    sides, owner = number.ravel(), np.repeat(face, 3)
    inner = np.zeros(sides.max() + 1, dtype=bool)
    order = np.argsort(sides, kind="stable").reshape(-1, 2)
    inner[sides[order[:, 0]]] = owner[order[:, 0]] == owner[order[:, 1]]
    found: list[list[IntArray]] = [[] for _ in range(face.max() + 1)]
    onward: list[dict[int, int]] = [{} for _ in found]
    for at in np.flatnonzero(~inner[sides]).tolist():
        own = onward[owner[at]]
        if int(starts[at]) in own:
            return None
        own[int(starts[at])] = int(ends[at])
    for loops, own in zip(found, onward, strict=True):
        while own:
            first, step = next(iter(own.items()))
            loop = [first]
            del own[first]
            while step != first:
                loop.append(step)
                step = own.pop(step)
            loops.append(np.array(loop))
    return found


def _cut(vertices: FloatArray, loops: list[IntArray], normal: FloatArray) -> IntArray | None:
    """Triangles (t, 3) of a face between loops; None if it has too many corners, or no ear."""
    if sum(map(len, loops)) > MOST or min(map(len, loops)) < 3:
        return None
    along = np.linalg.svd(normal[None])[2][1]
    flat = vertices @ np.stack([along, np.cross(normal, along)], axis=1)
    areas = [_turning(flat[loop]) for loop in loops]
    if sum(area > 0 for area in areas) != 1:
        return None
    outer = loops[int(np.argmax(areas))].tolist()
    holes = [loop.tolist() for loop, area in zip(loops, areas, strict=True) if area <= 0]
    holes = sorted(holes, key=lambda one: -np.max(flat[one, 0]))
    for number, hole in enumerate(holes):
        outer = _bridged(flat, outer, hole, holes[number + 1 :])
    return _ears(flat, outer)


def _turning(outline: FloatArray) -> float:
    """Twice the area within an outline (n, 2), positive counter-clockwise."""
    x, y = outline.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _bridged(flat: FloatArray, outer: list[int], hole: list[int], others: list[list[int]]) -> list[int]:
    """The outline with a hole, joined by a bridge from the hole's rightmost corner to the nearest one it sees."""
    start = int(np.argmax(flat[hole, 0]))
    hole = hole[start:] + hole[:start]
    at, p = flat[outer], flat[hole[0]]
    before, after = np.roll(at, 1, axis=0), np.roll(at, -1, axis=0)
    loops = [flat[loop] for loop in (outer, hole, *others)]
    starts, ends = np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    for number in np.argsort(np.linalg.norm(at - p, axis=1), kind="stable").tolist():
        a, q, c = before[number], at[number], after[number]
        # where another bridge ends q stands twice: the bridge leaves within the face
        left, right = _side(a, q, p) > 0, _side(q, c, p) > 0
        if not ((left and right) if _side(a, q, c) > 0 else (left or right)):
            continue
        # a side with an end at p or q hides neither
        apart = np.all([np.any(end != one, axis=1) for end in (starts, ends) for one in (p, q)], axis=0)
        across = _side(p, q, starts) * _side(p, q, ends) <= 0
        crossed = across & (_side(starts, ends, p) * _side(starts, ends, q) <= 0) & apart
        if not np.any(crossed):
            return [*outer[: number + 1], *hole, hole[0], *outer[number:]]
    return outer + hole


def _side(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Twice the area of triangles abc, positive counter-clockwise."""
    u, v = b - a, c - a
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _ears(flat: FloatArray, outline: list[int]) -> IntArray | None:
    """Triangles (t, 3) of an outline: of the ears there are, the one with the largest least angle is cut first."""
    left, found = list(outline), []
    while len(left) > 3:
        here = np.array(left)
        a, b, c = flat[np.roll(here, 1)], flat[here], flat[np.roll(here, -1)]
        area = _side(a, b, c)
        longest = np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
        shape = area / longest
        for number in np.argsort(-shape, kind="stable").tolist():
            if shape[number] <= PLANE:
                return None
            corners = here[[number - 1, number, (number + 1) % len(here)]]
            others = flat[np.setdiff1d(here, corners)]
            p, q, r = flat[corners]
            inside = (_side(p, q, others) >= 0) & (_side(q, r, others) >= 0) & (_side(r, p, others) >= 0)
            if not np.any(inside):
                break
        else:
            return None
        found.append(corners)
        left.pop(number)
    found.append(np.array(left))
    return np.stack(found)
