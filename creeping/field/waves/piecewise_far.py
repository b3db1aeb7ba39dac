"""The far field of a body with edges, joints and tips: creeping rays on its pieces, physical optics, and what is lost.

    f = (1 - w) f_rays + Σ over smooth parts of [u f_optics + (1 - u) f_specular]

with w of the forward lobe as in `creeping.field.waves.far_rays`. A smooth part is what hangs together by joints; u is
1, but w where the part has specular points and all stand clear of its creases (`creeping.rays.specular`). f_optics
(`creeping.field.waves.piecewise_far`) holds facets, specular points next to edges, and the forward lobe. The error adds
in squares, besides what is beyond the second order of each ray and specular point,

    edges      1/(2π) |∫ e^{ik(d - r).x} dl|        lit or part of the outline, and their parts
    line       1/(2π) |∫ min[κ/(k (1 - d.r)²), (kρ)^(1/3)] e^{ik(d - r).x} dl|, of a conductor |d x r|/(1 - d.r) more
    ends       1/(2π) |Σ 2 e^(-ξ Im τ) |J|^(1/2) h e^{ik(d.x0 + s - r.x)}|       rays that end at edges and tips
    tips       1/(4k) each lit one
    joints     3/2 |f_optics - f_specular| of parts with joints, where specular points serve; a conductor's as if soft
    optics     its next order, κ/(k cos³θᵢ) of each tile

An incremental length of edge radiates about 1/(2π) beside what physical optics has of it, but next to shadow
boundaries; the current of physical optics starts with a kink at the line, whose end-point contribution is the first
under ``line``; the second is the wave of the penumbra, ahead. That of a conductor starts with a jump, of a current
along d, which sends nothing along d. Between the faces of a concave edge the wave is reflected more than once: that is
left out, and so is everything shed by an edge and scattered again.

Also here: physical optics of the lit tiles of a body: what its facets and curved pieces reflect, and the shadow they
cast.

    f = -(ik/4π) ∫ [(1 + R) n.r + (1 - R) n.d] e^{ik(d - r).x} dS     over the lit side, R of a plane at its cos θᵢ =
    -n.d f = (ik/2π) [V - (V.r) r],  V = ∫ n e^{ik(d - r).x} dS x (d x E)   of a conductor

On curved surfaces n.r is replaced by (2w - 1) n.d, w = 1 in the forward lobe and 0 elsewhere: they agree at specular
points and ahead, and n.d has no jump at the shadow line, where the current of a hard body does not stop.

Each tile is a flat triangle, over which the phase is linear: with phases u and v of two corners relative to the third,

    ∫ e^{iφ} dS = 2A e^{iφ0} (g(u) - g(v))/(i(u - v)),    g(x) = (e^{ix} - 1)/(ix)    (`kernels.bounce.triangle_waves`).

The same integral gives a specular point, a flat facet as a whole, the rim of a facet and the forward lobe. Its error
on curved surfaces is of the next order, κ/(k cos³θᵢ) of each tile's contribution.

Sources: [LK59], [KLS56]; [KLS56]; Derivations, F3 and F13.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import SOFT, Boundary, BoundaryLike, fock_scale, modes_of, scalar_boundaries
from creeping.field.results.far_result import FarField, spherical_frame
from creeping.field.waves.far_geometry import FarGeometry, far_geometry
from creeping.field.waves.far_rays import Parts
from creeping.field.waves.likely_cells import parted
from creeping.field.waves.reflected import plane_reflection
from creeping.geometry.curvature import curvature_norms
from creeping.geometry.piecewise import Tiles, is_convex, pieces_of, tiles_of
from creeping.geometry.surface import memo, size
from creeping.kernels.threads import in_threads
from creeping.rays.ends import AT_CREASES, RayStatus
from creeping.rays.fan import RayFan
from creeping.rays.specular import SpecularPoints, smooth_parts, specular_on_pieces, stand_clear
from creeping.shadow.attachment import occluded
from creeping.shadow.piecewise import convex, unit_normals
from creeping.storage.memory import within_budget

MATTERS = 0.25
"""Share of the field from which what is left out makes a direction unresolved."""
OUTWARD = 1e-4
"""Distance from an edge or tip, in body sizes, at which it is asked whether the wave comes to it."""
SAG = 0.1
"""k h² κ of a tile: its phase then errs by a hundredth of a radian on average, in backscatter."""
FLAT = 1e-6
"""Curvature, in inverse sizes, below which a tile is flat, and a ray that seems to detach goes along a generator."""


def piecewise_far_field(fan: RayFan, r: FloatArray, k: float, boundary: BoundaryLike, order: int) -> FarField:
    """Far field of a fan in unit directions r (m, 3), by rays and physical optics."""
    kinds = scalar_boundaries(boundary)
    parts = PiecewiseParts(fan, far_geometry(fan, r), kinds, k, order)
    for number, kind in enumerate(kinds):
        parts.add(number, kind)
    return parts.field(boundary)


class PiecewiseParts(Parts):
    """Parts of the field of one incidence, and what each may be off."""

    names = ("creeping", "reflected")

    def __init__(
        self, fan: RayFan, geometry: FarGeometry, kinds: tuple[Boundary, ...], wavenumber: float, order: int
    ) -> None:
        self._begin(geometry, kinds, wavenumber, order)
        self.fan = fan
        r, m, body = geometry.directions, len(geometry.directions), fan.body
        typical = np.sqrt(tiles_of(body, 0.1).areas.sum() / (8 * np.pi))
        edges, facing = _edges(fan, r, wavenumber)
        # hidden ground, and faces that see each other, have waves that are nowhere in particular
        self.dark = np.hypot(geometry.unserved * typical, facing * typical)
        ended = np.max([_ended(fan, r, wavenumber, kind) for kind in kinds], axis=0)
        between = max(_between(fan, wavenumber, kind) for kind in kinds)
        lost = [
            edges,
            ended,
            between * np.ones(m),
            tip_waves(fan, wavenumber) * np.ones(m),
            (1 - self.in_forward) * self.ended,
        ]
        self.specular = []
        side = side_of_tiles(body, wavenumber)
        # frequencies share them
        tiles = memo(fan, f"lit tiles {side:g}", lambda: lit_tiles(body, fan.line.direction, side))
        for part in smooth_parts(body):
            clear, points = _clear_points(body, part, fan.line.direction, r, wavenumber)
            share = np.where(clear, self.in_forward, 1.0)
            if points is not None:
                self.specular.append((points, (1 - share)[points.observer]))
            optics = optics_field(tiles.on(part), r, wavenumber, kinds, self.in_forward)
            if len(part) > 1 and points is not None:
                kind, scalar = kinds[0], optics
                if self.vector:
                    kind, scalar = SOFT, optics_field(tiles.on(part), r, wavenumber, (SOFT,), self.in_forward)
                lost.append(1.5 * (1 - share) * np.abs(scalar.values - self._leading(points, kind)))
            self.reflected += share.reshape(-1, *(1,) * (self.creeping.ndim - 1)) * optics.values
            lost += [share * optics.next_order, share * _line(fan, part, r, wavenumber, self.vector)]
        self.left_out = np.sqrt(np.sum(np.square(lost), axis=0))

    def add(self, number: int, kind: Boundary) -> None:
        """Add the creeping rays and the specular points of one scalar problem."""
        self._add_rays(number, kind, (1 - self.in_forward)[self.geometry.shed.observer])
        for points, by in self.specular:
            self._add_specular(number, kind, points, by)

    def _leading(self, points: SpecularPoints, kind: Boundary) -> ComplexArray:
        """What specular points are in physical optics of a scalar problem, all of each (m,)."""
        path = points.path(self.incident[points.observer], self.geometry.directions)
        turns = np.sum(points.principal < 0, axis=1)
        phase = self.wavenumber * path - 0.5 * np.pi * turns
        mirror = 0.5 / np.sqrt(np.abs(np.prod(points.principal, axis=1)))
        out = np.zeros(len(self.geometry.directions), dtype=complex)
        np.add.at(out, points.observer, mirror * plane_reflection(points.cosine, kind) * np.exp(1j * phase))
        return out

    def unresolved(self) -> BoolArray:
        """Directions in which what is left out matters (m,)."""
        total = np.abs(self.creeping + self.reflected)
        largest = total.max(axis=tuple(range(1, total.ndim)), initial=0.0)
        lost = np.hypot(np.hypot(self.left_out, self.failing_size), self.dark)
        return np.asarray(~(lost <= MATTERS * largest))

    def methods(self) -> np.ndarray[Any, np.dtype[np.str_]]:
        """The one word for all of it (m,)."""
        return np.full(len(self.left_out), "rays+optics", dtype="<U16")


def _clear_points(
    body: Any, part: tuple[int, ...], direction: FloatArray, observers: FloatArray, k: float
) -> tuple[BoolArray, SpecularPoints | None]:
    """Whether specular points alone serve for a smooth part of the body in each direction (m,), and those that do."""
    found = specular_on_pieces(body, part, direction, observers)
    number, clear = np.zeros(len(observers), dtype=int), np.zeros(len(observers), dtype=int)
    for points in found:
        np.add.at(number, points.observer, 1)
        np.add.at(clear, points.observer[stand_clear(body, points, k)], 1)
    serve = (number > 0) & (number == clear)
    kept = [points[serve[points.observer]] for points in found]
    kept = [points for points in kept if len(points.points)]
    return serve, SpecularPoints.joined(kept) if kept else None


def _edges(fan: RayFan, observers: FloatArray, k: float) -> tuple[FloatArray, float]:
    """Waves of lit edges and of edges on the outline (m,), L, and the share of concave lit ones in the outline."""
    body: Any = fan.body
    d, pieces = fan.line.direction, pieces_of(body)
    whole, parts, facing = np.zeros(len(observers), dtype=complex), np.zeros(len(observers)), 0.0
    for crease in body.creases:
        if crease.kind != "edge":
            continue
        x = _refined(np.asarray(crease.points, dtype=float), k)
        n = [unit_normals(pieces[number], x) for number in crease.pieces]
        outward = n[0] + n[1]
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
        lit = np.minimum(n[0] @ d, n[1] @ d) < 0
        lit &= ~occluded(body, x + OUTWARD * size(body) * outward, d)
        chords = np.linalg.norm(np.diff(x, axis=0), axis=1)
        middles, shining = 0.5 * (x[1:] + x[:-1]), (lit[1:] | lit[:-1])
        waves = np.exp(1j * k * (middles @ (d - observers).T)) * (chords * shining)[:, None]
        whole += waves.sum(axis=0)
        # stationary points of the phase stand apart: sixteen parts of an edge are added in squares too
        cuts = np.unique(np.linspace(0, len(waves), 17).astype(int))[:-1]
        parts += np.sum(np.abs(np.add.reduceat(waves, cuts, axis=0)) ** 2, axis=0)
        concave = ~(convex(body, x, *n)[1:]) & shining & (np.maximum(n[0] @ d, n[1] @ d) < 0)[1:]
        facing += float(np.sum(chords[concave]))
    outline = fan.line.length + sum(part.length for part in fan.line.on_edges)
    return np.hypot(np.abs(whole), np.sqrt(parts)) / (2 * np.pi), min(facing / outline if outline else 0.0, 1.0)


def _refined(x: FloatArray, k: float) -> FloatArray:
    """A polyline with chords of at most 1/k."""
    out = [x[:1]]
    for a, b in pairwise(x):
        count = max(1, int(np.ceil(k * np.linalg.norm(b - a))))
        out.append(a + (np.arange(1, count + 1) / count)[:, None] * (b - a))
    return np.concatenate(out)


def _line(fan: RayFan, part: tuple[int, ...], observers: FloatArray, k: float, jumps: bool) -> FloatArray:
    """What physical optics has wrong next to the line on a smooth part of the body (m,), L."""
    d, out = fan.line.direction, np.zeros(len(observers), dtype=complex)
    steep = np.maximum(1 - observers @ d, 1e-9)
    jump = np.linalg.norm(np.cross(observers, d), axis=1) / steep if jumps else 0.0
    for curve in fan.line.curves:
        for start, end, status in curve.arcs:
            if status != "attached" or curve.piece not in part:
                continue
            count = max(64, int(np.ceil(2 * k * (end - start))))
            s = start + (end - start) * (np.arange(count) + 0.5) / count
            x = curve.at(s)
            kappa = np.maximum(np.interp(np.mod(s, curve.length), curve.arclength, curve.curvature), 0.0)[:, None]
            with np.errstate(divide="ignore"):
                end_point = kappa / (k * steep**2) + jump
                size_of = np.minimum(end_point, np.cbrt(k / kappa))
            across = np.linalg.norm(np.cross(x - np.roll(x, 1, axis=0), d), axis=1)
            across[0] = across[1] if len(across) > 1 else 0.0
            out += np.sum(size_of * across[:, None] * np.exp(1j * k * (x @ (d - observers).T)), axis=0)
    return np.abs(out) / (2 * np.pi)


def _ended(fan: RayFan, observers: FloatArray, k: float, kind: Boundary) -> FloatArray:
    """What rays that end at edges and tips would give there (m,), L."""
    # those that cannot go on end as well, in the middle of a piece
    ended = np.isin(fan.status, (*AT_CREASES, RayStatus.NON_SMOOTH)) | _goes_straight(fan)
    if not np.any(ended):
        return np.zeros(len(observers))
    first = np.maximum(fan.curvature[ended, 0], 1e-300)
    decay = np.min(np.atleast_2d(modes_of(kind, fock_scale(k, first)).tau.imag), axis=-1)
    left = 2 * np.exp(-np.cbrt(k / 2) * fan.attenuation[ended, -1] * np.maximum(decay, 0.0))
    wave = left * np.sqrt(np.abs(fan.spreading[ended, -1])) * fan.spacing[ended]
    path = fan.eikonal[ended, 0] + fan.detachment[ended]
    phase = k * (path[:, None] - fan.points[ended, -1] @ observers.T)
    together = np.abs(np.sum(wave[:, None] * np.exp(1j * phase), axis=0))
    return np.asarray(np.hypot(together, np.sqrt(np.sum(wave**2))) / (2 * np.pi))


def _goes_straight(fan: RayFan) -> BoolArray:
    """Rays (rays,) that detach by rounding alone, where they come to a straight surface beyond a joint."""
    after = np.minimum(np.searchsorted(fan.travel_time, fan.detachment), len(fan.travel_time) - 1)
    bent = np.take_along_axis(fan.curvature, after[:, None], axis=1)[:, 0]
    return np.asarray((fan.status == RayStatus.DETACHED) & (bent > -FLAT / size(fan.body)))


def _between(fan: RayFan, k: float, kind: Boundary) -> float:
    """What rays between neighbours that a tip parts would give (m,), L: no search is made for them."""
    one = np.flatnonzero(fan.launched[1:] & fan.launched[:-1] & (np.diff(fan.arc_index) == 0))
    J = np.maximum(np.abs(fan.spreading[one]), np.abs(fan.spreading[one + 1]))
    apart = parted(fan.body, fan.points[one], fan.points[one + 1], J, fan.spacing[one, None])
    apart &= fan.travel_time < np.minimum(fan.detachment[one], fan.detachment[one + 1])[:, None]
    pair = np.flatnonzero(np.any(apart, axis=1))
    if not len(pair):
        return 0.0
    one, step = one[pair], np.argmax(apart[pair], axis=1)
    decay = np.min(np.atleast_2d(modes_of(kind, fock_scale(k, np.maximum(fan.curvature[one, 0], 1e-300))).tau.imag), -1)
    left = 2 * np.exp(-np.cbrt(k / 2) * fan.attenuation[one, step] * np.maximum(decay, 0.0))
    return float(np.sum(left * fan.spacing[one]) / (2 * np.pi))


def tip_waves(fan: RayFan, k: float) -> float:
    """Waves of the tips that the wave comes to, L."""
    body: Any = fan.body
    tips = np.array([np.ravel(c.points)[:3] for c in body.creases if c.kind == "tip"]).reshape(-1, 3)
    if not len(tips):
        return 0.0
    centre = np.mean(np.asarray(body.bounds, dtype=float), axis=0)
    out = tips - centre
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
    seen = ~occluded(body, tips + OUTWARD * size(body) * out, fan.line.direction)
    return float(np.sqrt(np.sum(seen)) / (4 * k))


class LitTiles(NamedTuple):
    """Lit triangles of an incidence.

    Attributes
    ----------
    direction : (3,)
    corners : (t, 3, 3), L
    normals : (t, 3)
        Of the body, at their middles.
    cosine : (t,)
        cos θᵢ > 0.
    curvature : (t,), 1/L
        Larger principal curvature.
    pieces : (t,)
        Number of the piece of each.
    scale : float, L
        Size of the body.
    """

    direction: FloatArray
    corners: FloatArray
    normals: FloatArray
    cosine: FloatArray
    curvature: FloatArray
    pieces: IntArray
    scale: float

    def on(self, pieces: tuple[int, ...]) -> "LitTiles":
        """Those of some pieces."""
        mine = np.isin(self.pieces, pieces)
        rows = self.corners[mine], self.normals[mine], self.cosine[mine], self.curvature[mine], self.pieces[mine]
        return LitTiles(self.direction, *rows, self.scale)


def side_of_tiles(body: Any, wavenumber: float) -> float:
    """Side of tiles over the body's size, rounded to a power of sqrt 2: frequencies share tiles."""
    shortest, longest = 2e-3, 0.1
    coarse = tiles_of(body, longest)
    bound = _curvatures(body, coarse, coarse.corners.mean(axis=1))
    order = np.argsort(bound)
    covered = np.cumsum(coarse.areas[order])
    # next to a tip curvature is without bound: that of 95 % of the area counts
    usual = float(bound[order][min(np.searchsorted(covered, 0.95 * covered[-1]), len(order) - 1)])
    side = np.sqrt(SAG / (wavenumber * max(usual, 1e-3 / size(body)))) / size(body)
    return float(np.clip(2 ** (np.floor(2 * np.log2(side)) / 2), shortest, longest))


def _curvatures(body: Any, tiles: Tiles, middles: FloatArray) -> FloatArray:
    out = np.zeros(len(middles))
    for number, piece in enumerate(pieces_of(body)):
        mine = np.flatnonzero(tiles.pieces == number)
        out[mine] = curvature_norms(piece, middles[mine])
    return out


def lit_tiles(body: Any, direction: FloatArray, share: float) -> LitTiles:
    """The tiles that the wave comes to, of sides of a share of the body's size (`side_of_tiles`)."""
    tiles = tiles_of(body, share)
    within_budget(1000.0 * len(tiles.corners), f"{len(tiles.corners)} tiles of the body", "lower the wavenumber")
    n = tiles.normals.mean(axis=1)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    lit = np.flatnonzero(n @ direction < 0)
    middles = tiles.corners[lit].mean(axis=1)
    if not is_convex(body):
        asked, of = _representatives(tiles, lit, middles, share * size(body))
        above = middles[asked] + (1e-6 + share**2) * size(body) * n[lit][asked]
        free = ~occluded(body, above, direction)[of]
        lit, middles = lit[free], middles[free]
    some = Tiles(tiles.corners[lit], tiles.normals[lit], tiles.pieces[lit])
    curvature = _curvatures(body, some, middles)
    return LitTiles(direction, some.corners, n[lit], -n[lit] @ direction, curvature, some.pieces, size(body))


def _representatives(tiles: Tiles, lit: IntArray, middles: FloatArray, side: float) -> tuple[IntArray, IntArray]:
    """Numbers of the lit tiles that are asked for all, and which of them stands for each.

    Each for itself, unless slivers of a long mesh make many more tiles than their sides would: then one a cube.
    """
    each = np.arange(len(lit))
    if len(tiles.areas) < 16 * float(tiles.areas.sum()) / side**2:
        return each, each
    cell = np.column_stack([tiles.pieces[lit], np.floor(middles / side).astype(np.int64)])
    _, first, of = np.unique(cell, axis=0, return_index=True, return_inverse=True)
    return first, of.ravel()


def phase_sums(corners: FloatArray, vectors: FloatArray, wavenumber: float, weights: FloatArray) -> ComplexArray:
    """Sums over triangles (t, 3, 3) of weights (t, w) times ∫ e^{ik q.x} dS, for vectors q (m, 3): (m, w).

    Examples
    --------
    >>> square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=float)
    >>> found = phase_sums(square, np.array([[2.0, 0, 0]]), 3.0, np.ones((2, 1)))[0, 0]
    >>> bool(abs(found - (np.exp(6j) - 1) / 6j) < 1e-14)
    True
    """
    from creeping.field.kernels.bounce import triangle_waves

    corners = np.ascontiguousarray(corners)
    a, b, c = np.moveaxis(corners, 1, 0)
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)[:, None]
    # the kernel knows no complex weights
    columns = np.ascontiguousarray(doubled * np.concatenate([weights.real, weights.imag], axis=1))
    q, out = wavenumber * vectors, np.empty((len(vectors), 2, columns.shape[1]))
    in_threads(lambda part: triangle_waves(corners, q[part], columns, out[part]), len(q), least=8, multiple=4)
    sums = out[:, 0] + 1j * out[:, 1]
    width = weights.shape[1]
    return np.asarray(sums[:, :width] + 1j * sums[:, width:])


class OpticsField(NamedTuple):
    """What lit tiles give: the field (m,) or (m, 2, 2), L, and the size of its next order (m,), L."""

    values: ComplexArray
    next_order: FloatArray


def optics_field(
    tiles: LitTiles, observers: FloatArray, wavenumber: float, boundary: tuple[Boundary, ...], in_forward: FloatArray
) -> OpticsField:
    """Field of lit tiles in directions r (m, 3): of a scalar boundary, or of a conductor's two.

    ``in_forward`` (m,) is w, 1 in the forward lobe and 0 outside it.
    """
    k, n, d = wavenumber, tiles.normals, tiles.direction
    vectors = d - observers
    # near grazing the next order stops growing where the transition region begins
    least = np.cbrt(2 * tiles.curvature / k)
    later = np.minimum(tiles.curvature / (k * np.maximum(tiles.cosine, np.maximum(least, 1e-12)) ** 3), 1.0)
    if len(boundary) == 2:
        sums = phase_sums(tiles.corners, vectors, k, np.concatenate([n, later[:, None] * n], axis=1))
        received = spherical_frame(d[None])[0]
        sent = spherical_frame(observers)
        fields = []
        for N in (sums[:, :3], sums[:, 3:]):
            V = np.stack([np.cross(N, np.cross(d, E)) for E in received], axis=-1)
            fields.append(0.5j * k / np.pi * np.einsum("moc,mci->moi", sent, V))
        return OpticsField(fields[0], np.max(np.abs(fields[1]), axis=(1, 2)))
    R = plane_reflection(tiles.cosine, boundary[0])
    flat, cosine = tiles.curvature < FLAT / tiles.scale, tiles.cosine
    mirror, shadow = np.where(flat, 1 + R, 0.0)[:, None] * n, -((1 - R) * cosine)[:, None]
    bent = -(np.where(flat, 0.0, 1 + R) * cosine)[:, None]
    weights = np.concatenate([mirror, shadow, bent], axis=1)
    sums = phase_sums(tiles.corners, vectors, k, np.concatenate([weights, later[:, None] * weights], axis=1))
    turned = 2 * in_forward - 1
    values, next_ = (
        -0.25j * k / np.pi * (np.sum(part[:, :3] * observers, axis=1) + part[:, 3] + turned * part[:, 4])
        for part in (sums[:, :5], sums[:, 5:])
    )
    return OpticsField(np.asarray(values), np.abs(next_))
