"""Pieces of a body from its mesh: regions that fold back are parted, and each piece gets its own F.

A region of the mesh folds where two of its points are nearer than a few cells of the grid that is to hold F there and
their normals oppose each other, as the two sides of a wing whose nose is round: one F in space cannot have both. It is
parted by the axis nearest to the normals of its triangles. Pieces of one region are fitted to some triangles beyond
their borders as well, so that both know the seam.

Also here: what of a body of fitted pieces is not trusted: pieces, and points about which a piece does not follow the
body.

A piece is trusted if its F is nearly a distance at its points and meets them; a point, if the piece that stands for the
body there meets it, and a fit has about the normal of the triangles or faces that it was made from.

Also here: regions of a mesh that one quadric goes through are one: next to the tip of a cone triangles turn as at an
edge.

Of a region on a quadric Q = 0 creases are none where it meets itself, and small regions next to it belong to it if all
their vertices lie on Q = 0 and their triangles face along grad Q, but at the tip.

Sources: Derivations, B13.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Crease
from scatterers.fits.cloud import FitReport, PieceCloud, curvatures, differences, not_followed, rms
from scatterers.fits.patch import (
    SLIGHT,
    SPACING,
    TIP,
    Closeness,
    Patch,
    curved,
    divided,
    polynomial_patch,
    second_order,
    spline_patch,
    tip_of,
)
from scatterers.fits.selection import PieceSpace, piece_space, voxel_side
from scatterers.fits.solver import COARSER, SLOPES, SMOOTHING
from scatterers.fits.spline_pieces import Fit, SplinePieces
from scatterers.triangles.jets import FEWEST, Jets, angle_weighted_normals, osculating_jets
from scatterers.triangles.quality import BAD
from scatterers.triangles.regions import Regions
from scatterers.triangles.topology import components, flat_normals

MISSED = 1e-4
"""Distance in body sizes between a point and the level there, beyond which the level is not trusted about it."""


def astray(space: PieceSpace, patches: list[Patch], points: FloatArray, owner: IntArray, size: float) -> FloatArray:
    """Points (k, 3) that the level of the body misses by more than `MISSED` of its size."""
    number = space.numbers(points)
    wrong = np.flatnonzero(number != owner)
    missed = np.zeros(len(wrong))
    for k in np.unique(number[wrong]):
        mine = number[wrong] == k
        value, gradient = patches[k].fine.value_and_gradient(points[wrong[mine]])
        missed[mine] = np.abs(value) / np.linalg.norm(gradient, axis=1)
    return np.asarray(points[wrong[missed > MISSED * size]])


def rough(patch: Patch, points: FloatArray, size: float) -> bool:
    """Whether F of a patch is no distance at points of its piece, or misses them, or it is a speck of the body."""
    if float(np.max(np.ptp(points, axis=0))) < MISSED * size:
        return True
    if patch.kind != "spline":
        return False
    value, gradient = patch.fine.value_and_gradient(points)
    slope = np.linalg.norm(gradient, axis=1)
    # misfit and largest distance in spacings of the points
    if patch.misfit > 0.05 * patch.spacing or slope.min() < SLOPES[0] or slope.max() > SLOPES[1]:
        return True
    return bool(np.max(np.abs(value) / slope) > 0.5 * patch.spacing)


def fitted_pieces(cloud: PieceCloud, progress: Callable[[str], None]) -> Fit:
    """Both fits of the pieces of a closed mesh with known regions.

    The level is not trusted about points at which another piece stands for the body, that is not there: features are
    too fine for the voxels; nor at vertices at which a fit turns away from the normals of its triangles or faces: it
    does not follow them.
    """
    vertices, triangles = cloud.vertices, cloud.triangles
    size = 0.5 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    close = Closeness.of(size, cloud.noise)
    cloud = absorbed(cloud, close)
    piece = _parted(cloud, close)
    count = int(piece.max()) + 1
    patches, at_corners, doubted = [], np.empty((len(triangles), 3, 3)), [np.zeros((0, 3))]
    for number in range(count):
        progress(f"piece {number + 1} of {count}")
        own = np.flatnonzero(piece == number)
        # triangles of a piece and those of its region in four rings about it
        inside = piece == number
        for _ in range(4):
            touching = inside[cloud.regions.joined]
            inside[cloud.regions.joined[touching.any(axis=1)].ravel()] = True
        members = np.flatnonzero(inside)
        patch, corner_normals = _patch(cloud, members, own, close)
        patches.append(patch)
        at_corners[own] = corner_normals
        local, x, n = _known(cloud, members)
        # at the border of the members normals are one-sided
        inner = np.unique(local[np.isin(members, own)])
        if patch.kind == "spline":
            doubted.append(not_followed(patch.fine, x[inner], n[inner]))
    points, owner = _spread(vertices[triangles], at_corners, piece)
    creases = tuple(_judged(crease, patches) for crease in cloud.regions.creases(vertices, piece))
    creases += _tips(vertices, triangles, piece, patches)
    space = piece_space([patch.fine for patch in patches], points, owner, creases)
    lost = np.concatenate([astray(space, patches, points, owner, size), *doubted])
    untrusted = np.array([rough(patch, points[owner == k], size) for k, patch in enumerate(patches)])
    # from an edge on a piece is trusted at the distance of its points
    reach = np.where(untrusted, np.inf, [patch.spacing for patch in patches])
    parts = SplinePieces(space, lost, 1 / space.table[3], creases, vertices[triangles], at_corners, piece, reach)
    coarse = parts.with_splines([patch.coarse for patch in patches])
    return Fit(parts, coarse, _report(parts, patches, points, owner))


def _report(parts: SplinePieces, patches: list[Patch], samples: FloatArray, owner: IntArray) -> FitReport:
    """How well the pieces meet their points, and how their curvatures depend on the grid away from edges."""
    from scipy.spatial import cKDTree

    edges = [crease.points for crease in parts.creases if crease.kind == "edge"]
    off = cKDTree(np.concatenate(edges)).query(samples)[0] if edges else np.full(len(samples), np.inf)
    known = []
    for k, patch in enumerate(patches):
        points = samples[(owner == k) & (off > 2 * patch.spacing)]
        if len(points) and np.isfinite(parts.reach[k]):
            known.append((patch.fine, patch.coarse, points, patch.fine.gradient(points)))
    fitted = [patch for patch in patches if patch.kind == "spline"]
    spacing = float(np.median([patch.fine.spacing[0] for patch in fitted])) if fitted else 0.0
    shapes = [patch.fine.coefficients.shape for patch in fitted] or [(6, 6, 6)]
    return FitReport(
        points=len(samples),
        spacing=spacing,
        coarser_spacing=COARSER * spacing,
        nodes=tuple(n - 4 for n in max(shapes, key=math.prod)),
        misfit=rms(np.array([0.0, *(patch.misfit for patch in fitted)])),
        turn=rms(np.array([0.0, *(patch.turn for patch in fitted)])),
        noise=0.0,
        smoothing=SMOOTHING,
        **differences(known),
    )


def _judged(crease: Crease, patches: list[Patch]) -> Crease:
    """A joint across which the curvature does not jump either is a seam."""
    if crease.kind != "joint":
        return crease
    x = 0.5 * (crease.points[1:] + crease.points[:-1])
    along = np.diff(crease.points, axis=0)
    bends = []
    for number in crease.pieces:
        spline = patches[number].fine
        across = np.cross(spline.gradient(x), along)
        # across first, then along
        bends.append(curvatures(spline, x, across)[0][: len(x)])
    jump = float(np.median(np.abs(bends[0] - bends[1])))
    largest = float(np.median(np.max(np.abs(bends), axis=0)))
    # less than a tenth of the larger curvature is no jump, nor is what rounding leaves of parts of one plane
    return replace(crease, kind="seam") if jump <= max(0.1 * largest, 1e-6 / crease.length) else crease


def _tips(vertices: FloatArray, triangles: IntArray, piece: IntArray, patches: list[Patch]) -> tuple[Crease, ...]:
    """Tips of cones, where these are there: within the side of a triangle of a vertex."""
    found = []
    for number, patch in enumerate(patches):
        tip = tip_of(patch)
        if tip is None:
            continue
        corners = vertices[triangles[piece == number]]
        nearest = int(np.argmin(np.min(np.linalg.norm(corners - tip, axis=2), axis=1)))
        sides = np.linalg.norm(np.roll(corners[nearest], -1, axis=0) - corners[nearest], axis=1)
        # some meshes blunt their tips
        if np.min(np.linalg.norm(corners[nearest] - tip, axis=1)) < 2.0 * sides.max():
            found.append(Crease("tip", (number, number), tip[None]))
    return tuple(found)


def _spread(corners: FloatArray, normals: FloatArray, piece: IntArray) -> tuple[FloatArray, IntArray]:
    """Points (k, 3), L, all over the body, closer to each other than a voxel, and their pieces (k,)."""
    # triangles cut at a time
    share = 500
    box = np.stack([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))])
    side = voxel_side(box)
    points, owner = [], []
    for start in range(0, len(corners), share):
        some = slice(start, start + share)
        origin, place = divided(corners[some], 0.9 * side)
        x = curved(corners[some][origin], normals[some][origin], place.mean(axis=1))[0]
        # long triangles are cut into more than is needed
        code = np.column_stack([np.floor((x - box[0]) / side).astype(np.int64), piece[some][origin]])
        _, kept = np.unique(code, axis=0, return_index=True)
        points.append(x[kept])
        owner.append(piece[some][origin][kept])
    return np.concatenate(points), np.concatenate(owner)


def _parted(cloud: PieceCloud, close: Closeness) -> IntArray:
    """Piece of each triangle: its region, or a part of one that folds and is no quadric, which has both sides."""
    from scipy.spatial import cKDTree

    triangles, regions = cloud.triangles, cloud.regions
    corners = cloud.vertices[triangles]
    normal, area = flat_normals(corners)
    itself = np.zeros(regions.count, dtype=bool)
    sides = regions.number[regions.sides[regions.crease]]
    itself[sides[sides[:, 0] == sides[:, 1], 0]] = True
    piece = np.zeros(len(triangles), dtype=np.int64)
    count = 0
    for number in range(regions.count):
        own = np.flatnonzero(regions.number == number)
        folds = bool(itself[number])
        if not folds and len(own) > 1:
            # opposite normals within three spacings of the grid
            reach = 3.0 * SPACING * _spacing(corners[own])
            origin, place = divided(corners[own], max(reach, 0.02 * float(np.sqrt(2 * area[own].sum()))))
            tree = cKDTree(np.einsum("kj,kjc->kc", place.mean(axis=1), corners[own][origin]))
            pairs = own[origin][tree.query_pairs(reach, output_type="ndarray")]
            folds = bool(np.any(np.sum(normal[pairs[:, 0]] * normal[pairs[:, 1]], axis=1) < 0))
            folds = folds and polynomial_patch(*_known(cloud, own)[1:], close) is None
        if not folds:
            piece[own] = count
            count += 1
            continue
        parts = _by_axis(own, normal[own], regions)
        piece[own] = count + parts
        count += int(parts.max()) + 1
    return piece


def _by_axis(own: IntArray, normal: FloatArray, regions: Regions) -> IntArray:
    """Parts (k,) of triangles with these numbers: connected, and with the same axis nearest to their normals."""
    axis = np.argmax(np.abs(normal), axis=1)
    face = 2 * axis + (np.take_along_axis(normal, axis[:, None], 1)[:, 0] < 0)
    place = np.full(len(regions.number), -1)
    place[own] = np.arange(len(own))
    joined = place[regions.joined]
    joined = joined[np.all(joined >= 0, axis=1)]
    alike = joined[face[joined[:, 0]] == face[joined[:, 1]]]

    label = components(len(own), alike[:, 0], alike[:, 1])[1]
    # crumbs along the borders join the largest neighbour
    for _ in range(3):
        size = np.bincount(label)
        crumb = size[label] < max(8, 0.02 * len(own))
        step = joined[crumb[joined[:, 0]] != crumb[joined[:, 1]]]
        step = np.where(crumb[step[:, :1]], step, step[:, ::-1])
        step = step[np.argsort(size[label[step[:, 1]]], kind="stable")]
        into = dict(zip(label[step[:, 0]].tolist(), label[step[:, 1]].tolist(), strict=True))
        if not into:
            break
        label = np.array([into.get(k, k) for k in label.tolist()])
    return np.asarray(np.unique(label, return_inverse=True)[1].ravel(), dtype=np.int64)


def _spacing(corners: FloatArray) -> float:
    """Distance of the points that know a surface best: the shortest sides of its triangles, L."""
    return float(np.median(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).min(axis=1)))


def _known(cloud: PieceCloud, members: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Triangles with these numbers by their own vertices (n, 3), these, and outward normals there."""
    used, local = np.unique(cloud.triangles[members], return_inverse=True)
    local = local.reshape(-1, 3)
    x = cloud.vertices[used]
    if cloud.normals is None:
        return local, x, angle_weighted_normals(x, local)
    n = np.zeros_like(x)
    np.add.at(n, local.ravel(), cloud.normals[members].reshape(-1, 3))
    return local, x, n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)


def _corner_normals(patch: Patch, corners: FloatArray) -> FloatArray:
    """Normals of a plane or quadric at corners (m, 3, 3), those of the triangles at a tip."""
    gradient = patch.fine.gradient(corners.reshape(-1, 3)).reshape(-1, 3, 3)
    slope = np.linalg.norm(gradient, axis=2, keepdims=True)
    return np.where(
        slope > TIP * np.median(slope), gradient / np.maximum(slope, 1e-300), flat_normals(corners)[0][:, None]
    )


def _patch(cloud: PieceCloud, members: IntArray, own: IntArray, close: Closeness) -> tuple[Patch, FloatArray]:
    """F of a piece from its triangles and those next to it, and the normals at the corners of its own."""
    # points of a piece, enough to be known by, and the most
    enough, most = 400, 6_000
    local, x, n = _known(cloud, members)
    corners, exact = x[local], cloud.normals is not None
    mine = np.isin(members, own)
    polynomial = polynomial_patch(x, n, close)
    if polynomial is not None:
        return polynomial, _corner_normals(polynomial, corners[mine])
    side = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    jets = None if exact else _sound_jets(x, local, n)
    even = float(np.percentile(side, 90)) < 4 * float(np.percentile(side, 10))
    if (jets is not None or exact) and even and len(x) >= enough:
        n = n if jets is None else jets.normals
        return spline_patch(x, n, float(side.mean()), jets, local), n[local[mine]]
    # known from few vertices: points between them by curved triangles
    area = float(flat_normals(corners)[1].sum())
    edge = max(min(_spacing(corners), np.sqrt(area / enough)), np.sqrt(area / most))
    origin, place = divided(corners, 1.5 * edge)
    points, between = curved(corners[origin], n[local][origin], place.mean(axis=1))
    # long triangles leave points closer together along their short sides
    _, kept = np.unique(np.floor(points / edge).astype(np.int64), axis=0, return_index=True)
    points, between = points[kept], between[kept]
    return spline_patch(points, between, edge), n[local[mine]]


def _sound_jets(x: FloatArray, triangles: IntArray, normals: FloatArray) -> Jets | None:
    """Jets at the vertices of a piece, if most of them are sound."""
    if len(x) < 2 * FEWEST:
        return None
    jets = osculating_jets(x, triangles)
    corners = x[triangles]
    edge = float(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).mean())
    doubt = edge * np.abs(jets.principal4 - jets.principal).max(axis=1) / 3
    apart = np.linalg.norm(jets.normals - normals, axis=1) > 0.5
    sound = jets.fitted & (np.maximum(jets.tilt, doubt) < BAD) & ~apart
    # of 70 in 100 at least
    return jets if np.mean(sound) >= 0.7 else None


def absorbed(cloud: PieceCloud, close: Closeness) -> PieceCloud:
    """The mesh, its regions without creases that lie within one quadric."""
    # triangles of a region that may be absorbed, relative to those of the quadric
    few = 0.02
    regions = cloud.regions
    number, crease = regions.number.copy(), regions.crease.copy()
    sharp = np.flatnonzero(regions.crease & ~regions.level)
    sides = regions.sides[sharp]
    corners = cloud.vertices[cloud.triangles]
    flat = flat_normals(corners)[0]
    count = np.bincount(number)
    for k in np.argsort(-count).tolist():
        pair = number[sides]
        beside = np.unique(pair[(pair == k).any(axis=1)])
        small = [j for j in beside.tolist() if j != k and count[j] <= few * count[k]]
        itself = bool(np.any(np.all(pair == k, axis=1)))
        members = np.flatnonzero(number == k)
        patch = polynomial_patch(*_known(cloud, members)[1:], close) if itself or small else None
        if patch is None or patch.kind != "quadric":
            continue
        while small:
            mine = np.flatnonzero(np.isin(number, small))
            own = number[mine]
            fits = _lies_on(patch, corners[mine], flat[mine], close.most)
            good = [j for j in small if np.all(fits[own == j])]
            number[np.isin(number, good)] = k
            pair = number[sides]
            beside = np.unique(pair[(pair == k).any(axis=1)])
            small = [j for j in beside.tolist() if j != k and count[j] <= few * count[k]] if good else []
        crease[sharp[np.all(number[sides] == k, axis=1)]] = False
    if np.array_equal(crease, regions.crease):
        return cloud
    kept = np.unique(number, return_inverse=True)[1].ravel()
    return replace(cloud, regions=replace(regions, number=np.asarray(kept, dtype=np.int64), crease=crease))


def _lies_on(patch: Patch, corners: FloatArray, flat: FloatArray, tolerance: float) -> BoolArray:
    """Whether triangles (m, 3, 3) with normals (m, 3) lie on a quadric by their corners, and face along its slope."""
    value, gradient = patch.fine.value_and_gradient(corners.reshape(-1, 3))
    slope = np.linalg.norm(gradient, axis=1)
    off = second_order(value, slope, float(np.linalg.norm(patch.fine.hessian(corners[:1, 0]))))
    along = np.sum(patch.fine.gradient(corners.mean(axis=1)) * flat, axis=1) > 0
    # the slope is 1 in the median; a triangle at a tip may reach around it, and the tip is known less well
    at_tip = slope.reshape(-1, 3).min(axis=1) < SLIGHT
    near = off <= np.where(slope < TIP, TIP * float(patch.fine.spacing[0]), tolerance)
    return np.asarray(np.all(near.reshape(-1, 3), axis=1) & (along | at_tip))
