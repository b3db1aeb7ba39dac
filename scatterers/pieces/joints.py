"""Joints in a mesh: curves where the curvature jumps while the normal does not, found between planes and quadrics.

Planes and quadrics Q_k = 0 are found first (`scatterers.pieces.quadric_sheets`). Only if they hold all vertices of the
mesh is there a joint at all: a surface whose curvature merely varies is on no quadric. On either side of a joint of i
and j, s across it,

    Q_i - Q_j = (kappa_i - kappa_j) s^2/2,    n_i - n_j = (kappa_i - kappa_j) s t,

t across: the normals, not the values, change sign. Of an edge of the mesh that goes across, (n_i - n_j).t = 0 gives the
point of the joint on it; the mesh is cut there, so that each triangle is one quadric's and joints are edges.

Sources: Derivations, B13.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scatterers.pieces.mesh_cuts import Cuts, cut
from scatterers.pieces.patch import Closeness
from scatterers.pieces.quadric_sheets import STEEP, Sheet, sheets_of, with_between, with_narrow
from scatterers.triangles.topology import edges_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
SMOOTH = 0.02
"""Angle between the normals of two quadrics, radians, up to which they may join there without an edge."""
SECANTS, FOUND = 6, 1e-6
"""Steps to the point of a joint on an edge, and what may be left of (n_i - n_j).t, over its change along the edge."""
SNAP = 0.1
"""Part of an edge within which a vertex is moved onto a joint, rather than that slivers are cut off."""


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
    ends = edges_of(triangles).ends
    sheets, held = sheets_of(vertices, normals, ends, clean, size, noise)
    if not sheets:
        return None
    sheets, held = with_narrow(vertices, triangles, ends, held, sheets, close)
    if not held.any(axis=1).all():
        return None
    found = _placed(vertices, ends, held, sheets)
    if found.open.any():
        # of long triangles from joint to joint no vertex is clean
        sheets, held = with_between(vertices, triangles, held, sheets, found.open, close)
        found = _placed(vertices, ends, held, sheets)
    if found.open.any() or len(sheets) < 2:
        return None
    corners, t, held = cut(found.points, triangles, found.held, found.cuts)
    return _labelled(corners, t, held, sheets, noise)


@dataclass(frozen=True, eq=False)
class _Placed:
    """Vertices, those next to joints moved onto them, and where joints cut edges.

    Attributes
    ----------
    points : (n, 3), L
    held : (n, k) bool
        Which sheets hold them.
    cuts : Cuts
    open : (e,) bool
        Edges whose ends neither a sheet nor a joint connects.
    """

    points: FloatArray
    held: BoolArray
    cuts: Cuts
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
        _take_sides(held, points, (i, j), (a, b), where, x)
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
    return _Placed(points, held, Cuts(edge[kept], x[kept], new[kept]), still & ~done)


def _across(
    first: Sheet, second: Sheet, vertices: FloatArray, ends: IntArray, one: BoolArray, other: BoolArray
) -> tuple[IntArray, IntArray, IntArray, FloatArray, FloatArray]:
    """Edges (k,) from what the first sheet holds to what the second holds, a to b, and where on them their joint is.

    The places are in parts of the edge from a, also beyond its ends, with the points (k, 3) there.
    """
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
                x = x - (value / np.maximum(np.sum(gradient**2, axis=1), STEEP))[:, None] * gradient
        return x

    def turn(x: FloatArray) -> FloatArray:
        return np.asarray(np.sum((first.normals(x) - second.normals(x)) * along, axis=1))

    low, high = np.zeros(len(a)), np.ones(len(a))
    at_low, at_high = turn(start), turn(start + along)
    change = np.maximum(np.abs(at_high - at_low), 1e-300)
    for _ in range(SECANTS):
        # where it is found rounding is no slope
        more = np.abs(at_high) > 1e-3 * FOUND * change
        slope = np.where(more & (at_high != at_low), at_high - at_low, np.inf)
        low, at_low, high = high, at_high, np.clip(high - at_high * (high - low) / slope, -1.0, 2.0)
        at_high = turn(at(high))
    x = at(high)
    length = np.linalg.norm(along, axis=1)
    found = np.abs(turn(x)) <= FOUND * change
    for sheet in (first, second):
        found &= sheet.off(x) <= 2 * max(first.tolerance, second.tolerance)
    found &= np.abs(np.sum(first.normals(x) * second.normals(x), axis=1) - 1) < SMOOTH**2
    found &= np.linalg.norm(x - start, axis=1) < 3 * length
    return mine[found], a[found], b[found], high[found], x[found]


def _take_sides(
    held: BoolArray,
    points: FloatArray,
    pair: tuple[int, int],
    ends: tuple[IntArray, IntArray],
    where: FloatArray,
    x: FloatArray,
) -> None:
    """Vertices at edges across a joint given to the sheet of their side, or moved onto it, where both hold them."""
    vertex, ahead = np.concatenate(ends), np.concatenate([where, where - 1.0])
    order = np.argsort(np.abs(ahead), kind="stable")
    vertex, nearest = np.unique(vertex[order], return_index=True)
    ahead, x = ahead[order[nearest]], x[order[nearest] % len(where)]
    on = np.abs(ahead) < SNAP
    points[vertex[on]] = x[on]
    held[np.ix_(vertex[on], pair)] = True
    both = held[vertex, pair[0]] & held[vertex, pair[1]] & ~on
    held[vertex[both], np.where(ahead[both] > 0, pair[1], pair[0])] = False


def _labelled(
    vertices: FloatArray, triangles: IntArray, held: BoolArray, sheets: list[Sheet], noise: float
) -> Jointed | None:
    """Which sheet each triangle lies on, and where these meet."""
    corners = vertices[triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
    common = held[triangles].sum(axis=1)
    most = common.max(axis=1)
    lean = np.full((len(triangles), len(sheets)), -np.inf)
    for k, sheet in enumerate(sheets):
        # one triangle at a point where three meet may have no sheet of its own
        mine = np.flatnonzero(common[:, k] == most)
        lean[mine, k] = np.sum(sheet.normals(corners[mine].mean(axis=1)) * flat[mine], axis=1)
    label = np.argmax(lean, axis=1)
    edges = edges_of(triangles)
    sides = label[np.argsort(edges.number, kind="stable").reshape(-1, 2) // 3]
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
