"""Planes and quadrics that a mesh is made of, and which of its vertices each holds.

Where curvature jumps, jets of degree 4 and 6 disagree (`scatterers.triangles.quality`); what lies between is taken in
connected parts, and each must lie on one plane or quadric Q_k = 0, which then holds all vertices joined to it that lie
on it. With Q'' the size of its second derivatives, a point is off it by

    2 |Q| / (|grad Q| + sqrt(|grad Q|^2 + 2 |Q''| |Q|)),

|Q|/|grad Q| but at the tip of a cone, where Q has no slope.

Sources: Derivations, B13.
"""

import numpy as np
from numpy.typing import NDArray

from scatterers.pieces.patch import Closeness, Patch, polynomial_patch
from scatterers.triangles.jets import angle_weighted_normals
from scatterers.triangles.topology import components, edges_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
FEWEST = 40
"""Vertices of a part that is known well enough to be taken for a quadric: a quadric has 9 numbers."""
FEWEST_NOISY = 100
"""The same of vertices with noise: no fewer tell it from a surface whose curvature varies a little."""
DETERMINED = 12
"""Vertices of a narrow part between others that are."""
NOISE = 2.0
"""Distance within which a quadric holds vertices, in the largest of those that it was fitted to."""
MOST = 2000
"""Vertices that a quadric is fitted to at first."""
TRIES = 20
"""Places at which no quadric is found until it is believed that there is none."""
ROUNDS = 12
"""Times that a quadric is fitted again to all that it holds."""
TIPS, NEARLY = 100, 100.0
"""Vertices that may be tips, and their distance in that within which others are held: Q changes with its square."""
STEEP = 1e-3
"""Slope of a quadric, relative to the median, below which it has no normal: the tip of a cone."""


class Sheet:
    """A plane or quadric, how near to it a vertex is its own, and where it has a normal."""

    def __init__(self, patch: Patch, points: FloatArray, close: Closeness) -> None:
        self.spline = patch.fine
        self.bend = float(np.linalg.norm(self.spline.hessian(points[:1])[0]))
        self.tolerance = max(close.most, NOISE * float(np.max(self.off(points))))

    def off(self, x: FloatArray) -> FloatArray:
        """Distance (n,) of points (n, 3) from it, of second order: at the tip of a cone it has no slope."""
        value, gradient = self.spline.value_and_gradient(x)
        slope = np.linalg.norm(gradient, axis=1)
        return np.asarray(2 * np.abs(value) / (slope + np.sqrt(slope**2 + 2 * self.bend * np.abs(value)) + 1e-300))

    def normals(self, x: FloatArray) -> FloatArray:
        """Outward normals (n, 3) at points (n, 3); 0 where there is none."""
        gradient = self.spline.gradient(x)
        slope = np.linalg.norm(gradient, axis=1, keepdims=True)
        # the slope is 1 in the median
        return np.where(slope > STEEP, gradient / np.maximum(slope, 1e-300), 0.0)


def sheets_of(
    vertices: FloatArray, normals: FloatArray, ends: IntArray, clean: BoolArray, size: float, noise: float
) -> tuple[list[Sheet], BoolArray]:
    """Planes and quadrics, and which vertices each holds (n, k); none if a part of the mesh lies on none."""
    from scipy.spatial import cKDTree

    n = len(vertices)
    sheets: list[Sheet] = []
    held = np.zeros((n, 0), dtype=bool)
    close, fewest = Closeness.of(size, noise), FEWEST_NOISY if noise else FEWEST
    tree, tries = cKDTree(vertices), 0
    while True:
        left = clean & ~held.any(axis=1)
        if np.sum(left) < fewest:
            break
        at = np.flatnonzero(left)
        # what is farthest from all that is not
        distance = np.full(len(at), size) if left.all() else cKDTree(vertices[~left]).query(vertices[at])[0]
        seed = int(at[np.argmax(distance)])
        near = np.asarray(tree.query(vertices[seed], np.minimum(len(at), MOST))[1])
        near = near[np.linalg.norm(vertices[near] - vertices[seed], axis=1) <= distance.max()]
        if len(near) < fewest:
            break
        found = None
        # jumps show in some of the vertices only
        while found is None and len(near) >= fewest:
            found = _grown(vertices, normals, ends, near, seed, close, fewest)
            near = near[: len(near) // 2]
        if found is None:
            # it is next to a joint, or on no quadric
            tries += 1
            if tries == TRIES:
                return [], held
            clean = clean.copy()
            clean[tree.query(vertices[seed], fewest)[1]] = False
            continue
        if found[1].all():
            return [], held
        sheets.append(found[0])
        held = np.column_stack([held, found[1]])
    return sheets, _with_tips(vertices, ends, held, sheets)


def _grown(
    vertices: FloatArray, normals: FloatArray, ends: IntArray, core: IntArray, seed: int, close: Closeness, fewest: int
) -> tuple[Sheet, BoolArray] | None:
    """The plane or quadric through vertices with these numbers, and all that it holds, joined to one of them (n,)."""
    held = np.zeros(len(vertices), dtype=bool)
    sheet = None
    for _ in range(ROUNDS):
        patch = polynomial_patch(vertices[core], normals[core], close)
        if patch is None:
            break
        sheet = Sheet(patch, vertices[core], close)
        on = np.asarray(sheet.off(vertices) <= sheet.tolerance)
        parts = _parts(len(vertices), ends, on)
        mine = on & (parts == parts[seed])
        if not mine[seed] or mine.sum() <= held.sum():
            break
        held = mine
        # not those at its border: there a jet sees the other side
        border = np.unique(ends[held[ends].sum(axis=1) == 1])
        inner = held.copy()
        inner[border] = False
        core = np.flatnonzero(inner)
        if len(core) < fewest:
            break
    return None if sheet is None or held.sum() < fewest else (sheet, held)


def _with_tips(vertices: FloatArray, ends: IntArray, held: BoolArray, sheets: list[Sheet]) -> BoolArray:
    """What sheets hold, with vertices that none holds among neighbours that one holds, nearly: tips of cones."""
    for vertex in np.flatnonzero(~held.any(axis=1))[:TIPS].tolist():
        beside = ends[(ends == vertex).any(axis=1)]
        beside = beside[beside != vertex]
        for k, sheet in enumerate(sheets):
            if held[beside, k].all() and sheet.off(vertices[vertex : vertex + 1])[0] < NEARLY * sheet.tolerance:
                held[vertex, k] = True
    return held


def with_narrow(
    vertices: FloatArray, triangles: IntArray, ends: IntArray, held: BoolArray, sheets: list[Sheet], close: Closeness
) -> tuple[list[Sheet], BoolArray]:
    """Sheets with those through parts so narrow that no vertex of theirs is clean."""
    left = np.asarray(~held.any(axis=1))
    if not left.any():
        return sheets, held
    label, normals = _parts(len(vertices), ends, left), angle_weighted_normals(vertices, triangles)
    for part in np.unique(label[left]):
        some = np.flatnonzero(left & (label == part))
        patch = polynomial_patch(vertices[some], normals[some], close) if len(some) >= DETERMINED else None
        if patch is not None:
            sheet = Sheet(patch, vertices[some], close)
            on = np.asarray(sheet.off(vertices) <= sheet.tolerance)
            parts = _parts(len(vertices), ends, on)
            mine = on & (parts == parts[some[0]])
            sheets, held = [*sheets, sheet], np.column_stack([held, mine])
    return sheets, held


def with_between(
    vertices: FloatArray, triangles: IntArray, held: BoolArray, sheets: list[Sheet], open_: BoolArray, close: Closeness
) -> tuple[list[Sheet], BoolArray]:
    """Sheets with those through triangles at edges (e,) whose ends no sheet and no joint connects."""
    edges = edges_of(triangles)
    lost = np.flatnonzero(open_[edges.number].reshape(-1, 3).any(axis=1))
    order = np.argsort(edges.number, kind="stable").reshape(-1, 2) // 3
    place = np.full(len(triangles), -1)
    place[lost] = np.arange(len(lost))
    joined = place[order]
    joined = joined[np.all(joined >= 0, axis=1)]
    label = components(len(lost), joined[:, 0], joined[:, 1])[1]
    more = []
    for part in range(int(label.max()) + 1):
        used, local = np.unique(triangles[lost[label == part]], return_inverse=True)
        x = vertices[used]
        patch = polynomial_patch(x, angle_weighted_normals(x, local.reshape(-1, 3)), close)
        if patch is not None:
            sheets = [*sheets, Sheet(patch, x, close)]
            mine = np.zeros(len(vertices), dtype=bool)
            mine[used] = True
            more.append(mine)
    return sheets, np.column_stack([held, *more])


def _parts(count: int, ends: IntArray, some: BoolArray) -> IntArray:
    """Connected parts (n,) of some of the vertices; the others are parts of their own."""
    kept = ends[some[ends].all(axis=1)]
    return components(count, kept[:, 0], kept[:, 1])[1]
