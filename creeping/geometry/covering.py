"""A body as surfaces that polynomials on the unit square make: what the tiles of its integral equation are cut from.

A coarse mesh of quadrilaterals and triangles (`creeping.geometry.coarse_mesh`) is brought onto the body, Lobatto's
points of each by each: those of a side first, onto the piece on both sides of it, or onto the crease between two
pieces, once for both; then those inside, which start from Coons's surface through the sides,

    x(u, v) = (1 - u) x(0, v) + u x(1, v) + (1 - v) x(u, 0) + v x(u, 1) - bilinear through the corners.

So surfaces of neighbours meet without a gap. A triangle is a square whose side u = 0 is one point: its tip, where it
has one. A smooth body's squares are those of its charts, where these cover it once (``tiling``). A square that is not
the body to POSITION and NORMAL, or as well as a fitted body is known, is halved.

Sources: [C67], [BT04]; Derivations, B14.
"""

from dataclasses import replace

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.geometry.coarse_mesh import CoarseMesh, coarse_meshes, tip_vertices
from creeping.geometry.patches import DEGREE, ENDS, Patches, lobatto, on_squares
from creeping.geometry.piecewise import is_piecewise, nearest_crease, pieces_of
from creeping.geometry.quadrature import nearest_points
from creeping.geometry.surface import Surface, memo, size

POSITION, NORMAL = 2e-6, 3e-4
"""What squares may be off the body, in its sizes, and their normals, radians."""
WORST = 1e-3
"""What the worst of them may be off the body, in its sizes."""
ROUNDS, TURNS, PARTS = 5, 2.0, 2
"""Times that a square is parted at most, and ratio of the turns of its normal from which it is along one side; and
parts along a side of a chart before."""
BETTER = 0.5
"""What may be amiss of a part over what was of the whole: else it is not parted again."""
WELL, CLOSED = 1e-5, 1e-6
"""What squares may be off the body, in its sizes, and the integral of n over them, as a share of the area: more counts
against a mesh."""
STEEP, NEWTON = 0.2, 20
"""Sine of the angle between x_u and x_v, at least: less counts against a mesh; and steps onto a crease."""


def patches_of(body: Surface) -> Patches:
    """Squares that cover a body, cached.

    Raises
    ------
    SurfaceError
        If no mesh of squares is the body.

    Examples
    --------
    >>> import scatterers as sc
    >>> patches = patches_of(sc.Cylinder(1.0, 2.0))
    >>> bool(patches.off.max() < 1e-5), bool(patches.edges.any())
    (True, True)
    """
    found: Patches | str = memo(body, "patches", lambda: _made(body))
    if isinstance(found, str):
        raise SurfaceError(found)
    return found


def _made(body: Surface) -> Patches | str:
    """The squares, or why there are none."""
    ground, best, least = _Ground(body), None, np.inf
    charts = () if is_piecewise(body) else getattr(body, "tiling", ())
    if charts:
        # parts of the unit squares of charts that cover a body once, parted until they are the body
        t, done = lobatto(DEGREE), []
        for chart in charts:
            low = np.stack(np.meshgrid(*[np.arange(PARTS) / PARTS] * 2), axis=-1).reshape(-1, 2)
            high = low + 1 / PARTS
            for turn in range(ROUNDS + 1):
                u, v = (low[:, axis, None] + (high - low)[:, axis, None] * t for axis in (0, 1))
                grid = np.broadcast_arrays(u[:, :, None], v[:, None, :])
                current = _smooth(chart.point(np.stack(grid, axis=-1)))
                off, _, good = ground.misfit(current)
                poor = ~good & (turn < ROUNDS)
                done.append(replace(current, off=off)[~poor])
                if not np.any(poor):
                    break
                low, high = _halves(low[poor], high[poor], _long(current[poor]))
        found = Patches.joined(done)
        if np.max(found.off) < WORST * ground.size:
            return found
    failure: Exception | None = None
    if hasattr(body, "squares"):
        vertices, places, corners, pieces = body.squares(lobatto(DEGREE))
        return _refined(ground, CoarseMesh(vertices, corners, pieces, places))
    for mesh in coarse_meshes(body):
        try:
            if isinstance(mesh, SurfaceError):
                raise mesh
            found = _refined(ground, mesh)
        except (SurfaceError, ValueError) as error:
            # coarser ones come first
            failure = failure or error
            continue
        # the fewest squares that are the body; where none are, those that are nearest to it
        amiss = max(found.off.max() / (WELL * ground.size), found.gap / CLOSED, 1.0) / min(found.angle, STEEP)
        if len(found.off) * amiss**2 < least:
            best, least = found, len(found.off) * amiss**2
        if not is_piecewise(body):
            break
    return best or f"no mesh of squares covers the body: {failure}"


def _refined(ground: "_Ground", mesh: "CoarseMesh") -> Patches:
    """Squares of a mesh, parted until they are the body."""
    current = _first(ground, mesh)
    done, before = [], np.full(len(current.off), np.inf)
    for turn in range(ROUNDS + 1):
        off, amiss, good = ground.misfit(current)
        # what is amiss along a side that a neighbour has too stays with the parts
        poor = ~good & ~(amiss > BETTER * before) & (turn < ROUNDS)
        done.append(replace(current, off=off)[~poor])
        if not np.any(poor):
            break
        current = _parted(ground, replace(current, off=amiss)[poor])
        before = current.off
    made = Patches.joined(done)
    wrong = np.flatnonzero(~(made.off < WORST * ground.size))
    if len(wrong):
        worst = wrong[np.argmax(np.nan_to_num(made.off[wrong], nan=np.inf))]
        raise SurfaceError(
            f"{len(wrong)} of {len(made.off)} squares of the body are not on it (worst near "
            f"{np.array2string(made.places[worst].mean(axis=(0, 1)), precision=3)}): its integral equation has no mesh"
        )
    return made


class _Ground:
    """The pieces of a body, to bring points onto them."""

    def __init__(self, body: Any) -> None:
        self.body, self.size = body, size(body)
        self.pieces = list(pieces_of(body)) if is_piecewise(body) else [body]
        self.creases = body.creases if is_piecewise(body) else ()
        second = getattr(body, "coarse_fit", None)
        self.second = [] if second is None else list(pieces_of(second)) if is_piecewise(body) else [second]

    def onto(self, points: FloatArray, pieces: IntArray) -> FloatArray:
        """The nearest points (n, 3) of the pieces with these numbers (n,)."""
        out = np.array(points)
        for number in np.unique(pieces):
            mine = pieces == number
            found = nearest_points(self.pieces[number], points[mine])[0]
            # next to a tip the nearest point may be on another sheet
            near = np.linalg.norm(found - points[mine], axis=1) < 0.25 * self.size
            out[mine] = np.where(near[:, None], found, points[mine])
        return out

    def onto_both(self, points: FloatArray, first: int, second: int) -> FloatArray:
        """Points (n, 3) brought onto two pieces at once, by least steps."""
        x = np.array(points)
        for _ in range(NEWTON):
            rows, values = [], []
            for number in (first, second):
                gradient = self.pieces[number].gradient(x)
                length = np.linalg.norm(gradient, axis=1)
                rows.append(gradient / length[:, None])
                values.append(self.pieces[number].level(x) / length)
            J, F = np.stack(rows, axis=1), np.stack(values, axis=1)
            if np.max(np.abs(F), initial=0.0) < 1e-14 * self.size:
                break
            step = np.linalg.solve(J @ np.swapaxes(J, 1, 2) + 1e-12 * np.eye(2), F[..., None])
            x = x - (np.swapaxes(J, 1, 2) @ step)[..., 0]
        return x

    def misfit(self, patches: Patches) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Distance of squares from the body, L, what is amiss of them, and whether they may stay: (m,) each."""
        q = patches.places.shape[1] - 1
        # the same of mirrored squares
        between = 0.5 * (lobatto(q)[1:] + lobatto(q)[:-1])[[0, 2, -3, -1]]
        at = np.broadcast_to(between, (len(patches.places), len(between)))
        x, along, across = on_squares(patches.places, at, at)
        n = np.cross(along, across)
        n /= np.linalg.norm(n, axis=-1, keepdims=True)
        # off and turned, and what of both is not known of the body: it differs on another fit
        found = np.zeros((4, *x.shape[:3]))
        for number in np.unique(patches.pieces):
            mine = patches.pieces == number
            found[0, mine], own = _distance(self.pieces[number], x[mine])
            found[1, mine] = np.linalg.norm(np.cross(n[mine], own), axis=-1)
            if self.second:
                other, its = _distance(self.second[number], x[mine])
                found[2:, mine] = other - found[0, mine], np.linalg.norm(its - own, axis=-1)
        off, turned, unknown, doubt = np.max(np.abs(found), axis=(2, 3))
        least = POSITION * self.size
        amiss = np.maximum(off / least, turned / NORMAL)
        return off, amiss, (off < np.maximum(unknown, least)) & (turned < np.maximum(doubt, NORMAL))


def _distance(piece: Any, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance of points from a piece, L, and its normal there."""
    slope = piece.gradient(x)
    length = np.linalg.norm(slope, axis=-1)
    return piece.level(x) / length, slope / length[..., None]


def _first(ground: _Ground, mesh: CoarseMesh) -> Patches:
    """Squares of a mesh."""
    t = lobatto(DEGREE)
    m = len(mesh.corners)
    ends = np.stack([mesh.corners[:, side] for side in ENDS], axis=1)
    low = np.sort(ends.reshape(-1, 2), axis=1)
    pairs, numbers = np.unique(low, axis=0, return_inverse=True)
    numbers = numbers.ravel()
    owner = np.repeat(mesh.pieces, 4)
    least, most = np.full(len(pairs), np.iinfo(np.int64).max), np.full(len(pairs), -1)
    np.minimum.at(least, numbers, owner)
    np.maximum.at(most, numbers, owner)
    a, b = mesh.vertices[pairs[:, 0]], mesh.vertices[pairs[:, 1]]
    lines = a[:, None] + t[:, None] * (b - a)[:, None]
    inside = lines[:, 1:-1]
    edge = np.zeros(len(pairs), dtype=bool)
    long = pairs[:, 0] != pairs[:, 1]
    # edges are known by the two pieces that share them
    apart = int(np.sum(np.bincount(numbers)[long] != 2))
    if apart or any(crease.kind == "edge" and len(set(crease.pieces)) == 1 for crease in ground.creases):
        raise SurfaceError(
            f"{apart} sides of the body's squares are not shared by two, or a piece has an edge with itself"
        )
    plain = long & (least == most)
    if mesh.places is None:
        inside[plain] = ground.onto(inside[plain].reshape(-1, 3), np.repeat(least[plain], DEGREE - 1)).reshape(
            -1, DEGREE - 1, 3
        )
    for one, two in np.unique(np.stack([least, most], axis=1)[long & (least != most)], axis=0):
        mine = np.flatnonzero(long & (least == one) & (most == two))
        sides = np.broadcast_to([one, two], (len(mine), 2))
        crease = nearest_crease(ground.body, 0.5 * (a + b)[mine], sides)[0]
        for number in np.unique(crease):
            rows = mine[crease == number]
            edge[rows] = ground.body.creases[number].kind == "edge"
            if mesh.places is None:
                inside[rows] = _on_crease(ground, ground.body.creases[number], lines[rows], int(one), int(two))[:, 1:-1]
    backward = (ends[..., 0] > ends[..., 1])[..., None, None]
    places = mesh.places
    if places is None:
        lines[:, 1:-1] = inside
        along = lines[numbers].reshape(m, 4, DEGREE + 1, 3)
        places = _coons(np.where(backward, along[:, :, ::-1], along))
        places[:, 1:-1, 1:-1] = _onto_within(ground, places, mesh.pieces)
    pointed = mesh.corners[:, 0] == mesh.corners[:, 3]
    tip = tip_vertices(ground.body, mesh.vertices)[mesh.corners[:, 0]] & pointed
    spans = np.where(backward[..., 0], [1.0, 0.0], [0.0, 1.0])
    sides = numbers.reshape(m, 4)
    return Patches(places, mesh.pieces, edge[sides], sides, spans, pointed, tip, np.zeros(m))


def _coons(sides: FloatArray) -> FloatArray:
    """Coons's surface (m, n, n, 3) through the sides u = 0, u = 1, v = 0, v = 1 (m, 4, n, 3)."""
    t = lobatto(sides.shape[2] - 1)
    u, v = t[:, None, None], t[None, :, None]
    left, right, low, high = (sides[:, number] for number in range(4))
    ruled = (1 - u) * left[:, None] + u * right[:, None] + (1 - v) * low[:, :, None] + v * high[:, :, None]
    a, b, c, d = (part[:, None, None] for part in (low[:, 0], low[:, -1], high[:, -1], high[:, 0]))
    return np.asarray(ruled - ((1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d))


def _onto_within(ground: _Ground, places: FloatArray, pieces: IntArray) -> FloatArray:
    """Points inside squares, brought onto their pieces."""
    inside = places[:, 1:-1, 1:-1]
    numbers = np.repeat(pieces, inside.shape[1] * inside.shape[2])
    return ground.onto(np.ascontiguousarray(inside).reshape(-1, 3), numbers).reshape(inside.shape)


def _on_crease(ground: _Ground, crease: Any, lines: FloatArray, one: int, two: int) -> FloatArray:
    """Points (m, n, 3) between the ends of chords of a crease between two pieces, on it."""
    if crease.kind == "edge":
        found = ground.onto_both(lines.reshape(-1, 3), one, two).reshape(lines.shape)
        chord = np.linalg.norm(lines[:, -1] - lines[:, 0], axis=1)[:, None]
        if np.all(np.linalg.norm(found - lines, axis=2) < 0.5 * chord):
            return found
    start = _along(np.asarray(crease.points, dtype=float), lines)
    return ground.onto(start.reshape(-1, 3), np.full(start.shape[0] * start.shape[1], one)).reshape(lines.shape)


def _along(points: FloatArray, lines: FloatArray) -> FloatArray:
    """Points along a curve (n, 3) between the places next to the ends of chords (m, q + 1, 3)."""
    from scipy.interpolate import CubicSpline
    from scipy.spatial import cKDTree

    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    closed = np.linalg.norm(points[-1] - points[0]) < 1e-9 * s[-1]
    if closed:
        points = np.concatenate([points[:-1], points[:1]])
    curve = CubicSpline(s, points, bc_type="periodic" if closed else "not-a-knot")
    tree, ends = cKDTree(points), []
    for x in (lines[:, 0], lines[:, -1]):
        at = s[tree.query(x)[1]]
        for _ in range(8):
            away, slope = x - curve(at), curve(at, 1)
            at = at + np.sum(away * slope, axis=1) / np.sum(slope**2, axis=1)
        ends.append(at)
    start, along = ends[0], ends[1] - ends[0]
    if closed:
        along = along - s[-1] * np.round(along / s[-1])
    return np.asarray(curve(start[:, None] + along[:, None] * lobatto(lines.shape[1] - 1)))


def _halves(low: FloatArray, high: FloatArray, along: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Boxes (m, 2) halved along one or both axes (m, 2): corners (k, 2) of the parts."""
    parts = []
    for right in (False, True):
        for upper in (False, True):
            # the other half of what is not halved is itself
            there = (along[:, 0] | (not right)) & (along[:, 1] | (not upper))
            a, b, half = low[there], high[there], along[there]
            middle = 0.5 * (a + b)
            last = np.array([right, upper])
            parts.append((np.where(half & last, middle, a), np.where(half & ~last, middle, b)))
    first, second = zip(*parts, strict=True)
    return np.concatenate(first), np.concatenate(second)


def _smooth(places: FloatArray) -> Patches:
    """Squares (m, q + 1, q + 1, 3) of a smooth body."""
    m = len(places)
    none, zero = np.zeros((m, 4), dtype=bool), np.zeros(m, dtype=np.int64)
    spans = np.zeros((m, 4, 2))
    return Patches(places, zero, none, np.zeros((m, 4), dtype=np.int64), spans, none[:, 0], none[:, 0], np.zeros(m))


def _long(patches: Patches) -> BoolArray:
    """Whether squares are to be halved along u and v (m, 2): where they turn most, or along both."""
    at = lobatto(DEGREE)
    _, along, across = on_squares(patches.places, *(np.broadcast_to(at[1:-1], (len(patches.off), DEGREE - 1)),) * 2)
    n = np.cross(along, across)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    u, v = (np.linalg.norm(np.diff(n, axis=axis), axis=-1).sum(axis=axis).max(axis=1) for axis in (1, 2))
    return np.stack([v <= TURNS * u, u <= TURNS * v], axis=1)


def _parted(ground: _Ground, patches: Patches) -> Patches:
    """Squares halved along the sides over which they turn more, or along both, and brought onto the body again.

    Each has ``off`` of the one that it is a part of.
    """
    halved, parts = _long(patches), []
    for which, mine in enumerate((~halved[:, 1], ~halved[:, 0], np.all(halved, axis=1))):
        mine = np.flatnonzero(mine)
        some = patches[mine]
        for right in (None,) if which == 1 else (False, True):
            for upper in (None,) if which == 0 else (False, True):
                parts += [_half(ground, some, right, upper)] if len(mine) else []
    return Patches.joined(parts)


def _half(ground: _Ground, patches: Patches, right: bool | None, upper: bool | None) -> Patches:
    """Halves of squares along u, u > 1/2 if ``right``, or whole if None; likewise along v."""
    t, m = lobatto(DEGREE), len(patches.off)
    u, v = (t if part is None else 0.5 * (t + part) for part in (right, upper))
    x = on_squares(patches.places, *(np.broadcast_to(part, (m, len(t))) for part in (u, v)))[0]
    pointed = patches.pointed & (right is not True)
    x[pointed, 0] = patches.places[pointed, :1, 0]
    inner = np.array([right is True, right is False, upper is True, upper is False])
    edges = patches.edges & ~inner
    for side in np.flatnonzero(inner if is_piecewise(ground.body) else np.ones(4, dtype=bool)):
        free = np.flatnonzero(~(pointed & (side == 0)))
        rows = (x[:, 0], x[:, -1], x[:, :, 0], x[:, :, -1])[side]
        middle = rows[free][:, 1:-1]
        numbers = np.repeat(patches.pieces[free], DEGREE - 1)
        rows[free[:, None], np.arange(1, DEGREE)] = ground.onto(middle.reshape(-1, 3), numbers).reshape(middle.shape)
    x[:, 1:-1, 1:-1] = _onto_within(ground, x, patches.pieces)
    spans = patches.spans.copy()
    for part, lanes in ((upper, [0, 1]), (right, [2, 3])):
        if part is not None:
            spans[:, lanes, 0 if part else 1] = patches.spans[:, lanes].mean(axis=2)
    return Patches(x, patches.pieces, edges, patches.sides, spans, pointed, patches.tips & pointed, patches.off)
