"""Physical optics of the lit tiles of a body: what its facets and curved pieces reflect, and the shadow they cast.

    f = -(ik/4π) ∫ [(1 + R) n.r + (1 - R) n.d] e^{ik(d - r).x} dS     over lit ground, R of a plane at its cos θᵢ = -n.d
    f = (ik/2π) [V - (V.r) r],  V = ∫ n e^{ik(d - r).x} dS x (d x E)   of a conductor

On curved ground n.r is replaced by (2w - 1) n.d, w = 1 in the forward lobe and 0 elsewhere: they agree at specular
points and ahead, and n.d has no jump at the shadow line, where the current of a hard body does not stop.

Each tile is a flat triangle, over which the phase is linear: with phases u and v of two corners relative to the third,

    ∫ e^{iφ} dS = 2A e^{iφ0} (g(u) - g(v))/(i(u - v)),    g(x) = (e^{ix} - 1)/(ix)    (`kernels.triangle_waves`).

The same integral serves a specular point, a flat facet as a whole, the rim of a facet and the forward lobe. Its error
on curved ground is of the next order, κ/(k cos³θᵢ) of each tile's contribution.

Sources: [KLS56]; Derivations, F13.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.polarisation import spherical_frame
from creeping.field.reflected import plane_reflection
from creeping.geometry.creased import Tiles, is_convex, pieces_of, tiles_of
from creeping.geometry.curvature import curvature_norms
from creeping.geometry.surface import size
from creeping.kernels.threads import in_threads
from creeping.shadow.occlusion import occluded
from creeping.storage.memory import within_budget

SAG = 0.1
"""k h² κ of a tile: its phase then errs by a hundredth of a radian on average, in backscatter."""
LONGEST, SHORTEST = 0.1, 2e-3
"""Longest and shortest sides of tiles, in body sizes."""
SLIVERS = 16.0
"""Tiles, in units of what squares of their side would be, from which on they are taken for slivers."""
USUAL = 0.95
"""Share of the area whose curvature the sides go by: next to a tip it is without bound."""
OUTWARD = 1e-6
"""Distance from the body, in its sizes, at which a tile is asked whether the wave comes to it."""
EACH, SHARES = 3e-8, {"least": 8, "multiple": 4}
"""Seconds that a tile takes in one direction, and how directions are shared among threads."""
FLAT = 1e-6
"""Curvature, in inverse sizes, below which a tile is flat."""


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
    """Share of the body's size that tiles may have as sides; one of few, so that frequencies share them."""
    coarse = tiles_of(body, LONGEST)
    bound = _curvatures(body, coarse, coarse.corners.mean(axis=1))
    order = np.argsort(bound)
    covered = np.cumsum(coarse.areas[order])
    usual = float(bound[order][min(np.searchsorted(covered, USUAL * covered[-1]), len(order) - 1)])
    side = np.sqrt(SAG / (wavenumber * max(usual, 1e-3 / size(body)))) / size(body)
    return float(np.clip(2 ** (np.floor(2 * np.log2(side)) / 2), SHORTEST, LONGEST))


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
        above = middles[asked] + (OUTWARD + share**2) * size(body) * n[lit][asked]
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
    if len(tiles.areas) < SLIVERS * float(tiles.areas.sum()) / side**2:
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
    from creeping.field.kernels.triangle_waves import triangle_waves

    corners = np.ascontiguousarray(corners)
    a, b, c = np.moveaxis(corners, 1, 0)
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)[:, None]
    # the kernel knows no complex weights
    columns = np.ascontiguousarray(doubled * np.concatenate([weights.real, weights.imag], axis=1))
    q, out = wavenumber * vectors, np.empty((len(vectors), 2, columns.shape[1]))
    seconds = EACH * len(corners)
    in_threads(lambda part: triangle_waves(corners, q[part], columns, out[part]), len(q), seconds=seconds, **SHARES)
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
