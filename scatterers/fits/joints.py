"""Joints in a mesh: curves where the curvature jumps while the normal does not, found between planes and quadrics.

Planes and quadrics Q_k = 0 are found first. Only if they hold all vertices of the mesh is there a joint at all: a
surface whose curvature merely varies is on no quadric. On either side of a joint of i and j, s across it,

    Q_i - Q_j = (kappa_i - kappa_j) s^2/2,    n_i - n_j = (kappa_i - kappa_j) s t,

t across: the normals, not the values, change sign. Of an edge of the mesh that goes across, (n_i - n_j).t = 0 gives the
point of the joint on it; the mesh is cut there, so that each triangle is one quadric's and joints are edges.

Also here: planes and quadrics that a mesh is made of, and which of its vertices each holds.

Where curvature jumps, jets of degree 4 and 6 disagree (`scatterers.triangles.quality`); what lies between is taken in
connected parts, and each must lie on one plane or quadric Q_k = 0, which then holds all vertices joined to it that lie
on it. With Q'' the size of its second derivatives, a point is off it by

    2 |Q| / (|grad Q| + sqrt(|grad Q|^2 + 2 |Q''| |Q|)),

|Q|/|grad Q| but at the tip of a cone, where Q has no slope.

Sources: Derivations, B13.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.fits.patch import TIP, Closeness, Patch, polynomial_patch, second_order
from scatterers.triangles.jets import angle_weighted_normals
from scatterers.triangles.topology import components, cut, edges_of, flat_normals

SMOOTH = 0.02
"""Angle between the normals of two quadrics, radians, up to which they may join there without an edge."""


class Sheet:
    """A plane or quadric, how near to it a vertex is its own, and where it has a normal."""

    def __init__(self, patch: Patch, points: FloatArray, close: Closeness) -> None:
        self.spline = patch.fine
        self.bend = float(np.linalg.norm(self.spline.hessian(points[:1])[0]))
        self.tolerance = close.most

    def off(self, x: FloatArray) -> FloatArray:
        """Distance (n,) of points (n, 3) from it, of second order: at the tip of a cone it has no slope."""
        value, gradient = self.spline.value_and_gradient(x)
        return second_order(value, np.linalg.norm(gradient, axis=1), self.bend)

    def normals(self, x: FloatArray) -> FloatArray:
        """Outward normals (n, 3) at points (n, 3); 0 where there is none."""
        gradient = self.spline.gradient(x)
        slope = np.linalg.norm(gradient, axis=1, keepdims=True)
        # the slope is 1 in the median
        return np.where(slope > TIP, gradient / np.maximum(slope, 1e-300), 0.0)


def sheets_of(
    vertices: FloatArray, normals: FloatArray, ends: IntArray, clean: BoolArray, size: float, noise: float
) -> tuple[list[Sheet], BoolArray]:
    """Planes and quadrics, and which vertices each holds (n, k); none if a part of the mesh lies on none."""
    from scipy.spatial import cKDTree

    n = len(vertices)
    sheets: list[Sheet] = []
    held = np.zeros((n, 0), dtype=bool)
    # a quadric has 9 numbers; fewer vertices with noise do not tell it from a surface whose curvature varies a little
    close, fewest = Closeness.of(size, noise), 100 if noise else 40
    tree = cKDTree(vertices)
    while True:
        left = clean & ~held.any(axis=1)
        if np.sum(left) < fewest:
            break
        at = np.flatnonzero(left)
        # what is farthest from all that is not
        distance = np.full(len(at), size) if left.all() else cKDTree(vertices[~left]).query(vertices[at])[0]
        seed = int(at[np.argmax(distance)])
        # 2000 at first
        near = np.asarray(tree.query(vertices[seed], np.minimum(len(at), 2000))[1])
        near = near[np.linalg.norm(vertices[near] - vertices[seed], axis=1) <= distance.max()]
        if len(near) < fewest:
            break
        found = None
        # jumps show in some of the vertices only
        while found is None and len(near) >= fewest:
            found = _grown(vertices, normals, ends, near, seed, close, fewest)
            near = near[: len(near) // 2]
        # on no quadric, or on one alone
        if found is None or found[1].all():
            return [], held
        sheets.append(found[0])
        held = np.column_stack([held, found[1]])
    return sheets, held


def _grown(
    vertices: FloatArray, normals: FloatArray, ends: IntArray, core: IntArray, seed: int, close: Closeness, fewest: int
) -> tuple[Sheet, BoolArray] | None:
    """The plane or quadric through vertices with these numbers, and all that it holds, joined to one of them (n,)."""
    held = np.zeros(len(vertices), dtype=bool)
    sheet = None
    for _ in range(12):
        patch = polynomial_patch(vertices[core], normals[core], close)
        if patch is None:
            break
        sheet = Sheet(patch, vertices[core], close)
        mine = _on(sheet, vertices, ends, seed)
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


def _on(sheet: Sheet, vertices: FloatArray, ends: IntArray, seed: int) -> BoolArray:
    """Vertices (n,) that a sheet holds, joined to one of them."""
    on = np.asarray(sheet.off(vertices) <= sheet.tolerance)
    parts = _parts(len(vertices), ends, on)
    return np.asarray(on & (parts == parts[seed]))


def _parts(count: int, ends: IntArray, some: BoolArray) -> IntArray:
    """Connected parts (n,) of some of the vertices; the others are parts of their own."""
    kept = ends[some[ends].all(axis=1)]
    return components(count, kept[:, 0], kept[:, 1])[1]


@dataclass(frozen=True, eq=False)
class Jointed:
    """A mesh that is cut along its joints.

    Attributes
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    sharp, level : (e,) bool
        Edges, in the order of `scatterers.triangles.topology.edges_of`, at which pieces meet with different normals and
        with equal ones.
    noise : float
        That the vertices were taken to have, L.
    """

    vertices: FloatArray
    triangles: IntArray
    sharp: BoolArray
    level: BoolArray
    noise: float = 0.0

    @property
    def on_joints(self) -> int:
        """Vertices on joints."""
        return len(np.unique(edges_of(self.triangles).ends[self.level]))


def jointed(
    vertices: FloatArray, triangles: IntArray, normals: FloatArray, clean: BoolArray, noise: float = 0.0
) -> Jointed | None:
    """The mesh (n, 3), L, and (m, 3), cut along its joints; None if it has none, or is not all planes and quadrics.

    Parameters
    ----------
    normals : (n, 3)
        Of the jets at the vertices.
    clean : (n,) bool
        Vertices about which nothing speaks against a smooth surface.
    noise : float
        Of the vertices, L; 0 where they are exact to single precision.
    """
    size = 0.5 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    close = Closeness.of(size, noise)
    edges = edges_of(triangles)
    ends = edges.ends
    sheets, held = sheets_of(vertices, normals, ends, clean, size, noise)
    if not sheets:
        return None
    left = np.asarray(~held.any(axis=1))
    # parts so narrow that no vertex of theirs is clean
    label, around = _parts(len(vertices), ends, left), angle_weighted_normals(vertices, triangles)
    for number in np.unique(label[left]):
        part = np.flatnonzero(left & (label == number))
        patch = polynomial_patch(vertices[part], around[part], close)
        if patch is not None:
            sheets = [*sheets, Sheet(patch, vertices[part], close)]
            held = np.column_stack([held, _on(sheets[-1], vertices, ends, int(part[0]))])
    if not held.any(axis=1).all():
        return None
    found = _placed(vertices, ends, held, sheets)
    if found.open.any():
        # of long triangles from joint to joint no vertex is clean: those at edges whose ends nothing connects
        lost, beside = np.any(found.open[edges.number].reshape(-1, 3), axis=1), edges.sides // 3
        label = components(len(triangles), *beside[lost[beside].all(axis=1)].T)[1]
        for number in np.unique(label[lost]):
            used, local = np.unique(triangles[lost & (label == number)], return_inverse=True)
            x = vertices[used]
            patch = polynomial_patch(x, angle_weighted_normals(x, local.reshape(-1, 3)), close)
            if patch is not None:
                sheets = [*sheets, Sheet(patch, x, close)]
                held = np.column_stack([held, np.isin(np.arange(len(vertices)), used)])
        found = _placed(vertices, ends, held, sheets)
    if found.open.any() or len(sheets) < 2:
        return None
    corners, t = cut(found.points, triangles, found.edge, found.at)
    return _labelled(corners, t, found.held, sheets, noise)


@dataclass(frozen=True, eq=False)
class _Placed:
    """Vertices, those next to joints moved onto them, and where joints cut edges.

    Attributes
    ----------
    points : (n, 3), L
    edge, at : (c,) and (c, 3), L
        Edges that are cut, and where.
    held : (n + c, k) bool
        Which sheets hold the vertices and the cuts.
    open : (e,) bool
        Edges whose ends neither a sheet nor a joint connects.
    """

    points: FloatArray
    edge: IntArray
    at: FloatArray
    held: BoolArray
    open: BoolArray


def _placed(vertices: FloatArray, ends: IntArray, held: BoolArray, sheets: list[Sheet]) -> _Placed:
    points, held = vertices.copy(), held.copy()
    at: list[IntArray] = []
    places, keep = [], []
    meets = held[ends[:, 0]].T.astype(float) @ held[ends[:, 1]].astype(float)
    meets += meets.T
    done = np.zeros(len(ends), dtype=bool)
    for i, j in np.argwhere(np.triu(meets > 0, 1)).tolist():
        edge, a, b, where, x = _across(sheets[i], sheets[j], vertices, ends, held[:, i], held[:, j])
        # vertices at edges across the joint go to the sheet of their side, or are moved onto it, where both hold them
        ahead = np.concatenate([where, where - 1.0])
        order = np.argsort(np.abs(ahead), kind="stable")
        vertex, nearest = np.unique(np.concatenate([a, b])[order], return_index=True)
        ahead = ahead[order[nearest]]
        # near in parts of the edge, rather than that slivers are cut off
        on = np.abs(ahead) < 0.1
        points[vertex[on]] = x[order[nearest] % len(where)][on]
        held[np.ix_(vertex[on], (i, j))] = True
        both = held[vertex, i] & held[vertex, j] & ~on
        held[vertex[both], np.where(ahead[both] > 0, j, i)] = False
        apart = ~np.any(held[a] & held[b], axis=1) & held[a, i] & held[b, j] & (np.abs(where - 0.5) < 0.5)
        apart &= ~done[edge]
        done[edge[apart]] = True
        at.append(edge[apart])
        places.append(x[apart])
        new = np.zeros((int(apart.sum()), len(sheets)), dtype=bool)
        new[:, [i, j]] = True
        keep.append(new)
    # what a later pair has moved onto a joint is no longer apart
    still = ~np.any(held[ends[:, 0]] & held[ends[:, 1]], axis=1)
    edge = np.concatenate([np.zeros(0, np.int64), *at])
    kept = still[edge]
    x, new = np.concatenate([np.zeros((0, 3)), *places]), np.concatenate([held[:0], *keep])
    return _Placed(points, edge[kept], x[kept], np.concatenate([held, new[kept]]), still & ~done)


def _across(
    first: Sheet, second: Sheet, vertices: FloatArray, ends: IntArray, one: BoolArray, other: BoolArray
) -> tuple[IntArray, IntArray, IntArray, FloatArray, FloatArray]:
    """Edges (k,) from what the first sheet holds to what the second holds, a to b, and where on them their joint is.

    The places are in parts of the edge from a, also beyond its ends, with the points (k, 3) there.
    """
    # what may be left of (n_i - n_j).t, over its change along the edge
    found_to = 1e-6
    side = other.astype(int) - one.astype(int)
    mine = np.flatnonzero((one | other)[ends].all(axis=1) & (side[ends[:, 0]] != side[ends[:, 1]]))
    pair = ends[mine]
    turned = side[pair[:, 0]] > side[pair[:, 1]]
    a, b = np.where(turned, pair[:, 1], pair[:, 0]), np.where(turned, pair[:, 0], pair[:, 1])
    start, along = vertices[a], vertices[b] - vertices[a]

    def at(t: FloatArray) -> FloatArray:
        x = start + t[:, None] * along
        for _ in range(2):
            # on the joint both are 0
            for sheet in (first, second):
                value, gradient = sheet.spline.value_and_gradient(x)
                x = x - (value / np.maximum(np.sum(gradient**2, axis=1), TIP))[:, None] * gradient
        return x

    def turn(x: FloatArray) -> FloatArray:
        return np.asarray(np.sum((first.normals(x) - second.normals(x)) * along, axis=1))

    low, high = np.zeros(len(a)), np.ones(len(a))
    at_low, at_high = turn(start), turn(start + along)
    change = np.maximum(np.abs(at_high - at_low), 1e-300)
    for _ in range(6):
        # where it is found rounding is no slope
        more = np.abs(at_high) > 1e-3 * found_to * change
        slope = np.where(more & (at_high != at_low), at_high - at_low, np.inf)
        low, at_low, high = high, at_high, np.clip(high - at_high * (high - low) / slope, -1.0, 2.0)
        at_high = turn(at(high))
    x = at(high)
    length = np.linalg.norm(along, axis=1)
    found = np.abs(turn(x)) <= found_to * change
    for sheet in (first, second):
        found &= sheet.off(x) <= 2 * max(first.tolerance, second.tolerance)
    found &= np.abs(np.sum(first.normals(x) * second.normals(x), axis=1) - 1) < SMOOTH**2
    found &= np.linalg.norm(x - start, axis=1) < 3 * length
    return mine[found], a[found], b[found], high[found], x[found]


def _labelled(
    vertices: FloatArray, triangles: IntArray, held: BoolArray, sheets: list[Sheet], noise: float
) -> Jointed | None:
    """Which sheet each triangle lies on, and where these meet."""
    corners = vertices[triangles]
    flat = flat_normals(corners)[0]
    common = held[triangles].sum(axis=1)
    most = common.max(axis=1)
    lean = np.full((len(triangles), len(sheets)), -np.inf)
    for k, sheet in enumerate(sheets):
        # one triangle at a point where three meet may have no sheet of its own
        mine = np.flatnonzero(common[:, k] == most)
        lean[mine, k] = np.sum(sheet.normals(corners[mine].mean(axis=1)) * flat[mine], axis=1)
    label = np.argmax(lean, axis=1)
    edges = edges_of(triangles)
    sides = label[edges.sides // 3]
    meet = np.flatnonzero(sides[:, 0] != sides[:, 1])
    middle = vertices[edges.ends[meet]].mean(axis=1)
    normals = np.zeros((2, len(meet), 3))
    for side in (0, 1):
        for k, sheet in enumerate(sheets):
            mine = sides[meet, side] == k
            normals[side, mine] = sheet.normals(middle[mine])
    smooth = np.linalg.norm(normals[0] - normals[1], axis=1) < SMOOTH
    sharp, level = np.zeros(len(sides), dtype=bool), np.zeros(len(sides), dtype=bool)
    level[meet[smooth]], sharp[meet[~smooth]] = True, True
    return Jointed(vertices, triangles, sharp, level, noise) if level.any() else None
