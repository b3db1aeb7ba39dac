"""F of one smooth region of a body: a plane or quadric where its points lie on one, else a fitted spline.

A quadric Q = 0 has q of unit length that makes sum 1e8 Q(x)^2 + |n x grad Q(x)|^2 least over points x and normals n,
which tell it from other quadrics through the points. It is taken if all points lie on it within 1e-6 of the body's
size, as those of cylinders, cones and balls of engineering do, or if what is left, e over a length l, changes
curvatures by 8 e/l^2 < 2e-4 of the largest, as of cylinders that a program wrote as splines. As polynomials of
degree 2 both kinds are splines of one cell, which go on as they are far beyond the region. Other regions are fitted as
whole bodies are (`scatterers.fits.solver`), from their own points only, so that nothing is rounded off at their
borders; a coarser fit tells how far they are known.

Also here: curved triangles: points between the corners of a mesh that has normals there, and a mesh made of them.

With corners x_i, normals n_i and barycentric coordinates b_i, the cubic triangle of [VPBM01],

    x = sum b_ijk(x, n) 3!/(i! j! k!) b_1^i b_2^j b_3^k,   b_210 = (2 x_1 + x_2 - ((x_2 - x_1).n_1) n_1)/3, ...,

and quadratic normals, which mirror the mean of two normals in the middle of a side. Neighbours with common normals meet
without gaps.

Sources: Derivations, B13; [VPBM01] Vlachos, Peters, Boyd, Mitchell, Curved PN triangles, I3D 2001, eqs. 1 to 6.
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.fits.solver import ACCURACY, COARSER, fit, spacing_of
from scatterers.fits.tensor import TensorSpline
from scatterers.kernels.tensor import POWERS
from scatterers.triangles.jets import Jets, centroids, signed_distance

SLIGHT = 0.1
"""Of the median slope of a quadric: with less, as next to the tip of a cone, it turns much within a triangle, and
normals need only be on the same side."""
TIP = 1e-3
"""Of the median slope: with less there is no normal to compare. Also the share of a piece's size by which the sheets of
a cone may miss their tip."""
SPACING = 1.8
"""Grid of a spline in units of the distance of its points."""
MOST = 4_000_000
"""Triangles of a mesh that is made."""


@dataclass(frozen=True, eq=False)
class Patch:
    """F of one region.

    Attributes
    ----------
    fine, coarse : TensorSpline
        The second known less well; the same for planes and quadrics.
    kind : {"plane", "quadric", "spline"}
    misfit, turn : float
        Rms distance of the points from F = 0, L, and rms angle between grad F and the normals there, radians.
    spacing : float
        Of the points, L; 0 for planes and quadrics.
    """

    fine: TensorSpline
    coarse: TensorSpline
    kind: str
    misfit: float
    turn: float
    spacing: float


def spline_patch(
    points: FloatArray, normals: FloatArray, spacing: float, jets: Jets | None = None, triangles: IntArray | None = None
) -> Patch:
    """F of a region fitted to points (n, 3), L, so far apart, and outward normals (n, 3).

    With jets at the points and triangles (m, 3) between them, to the points that jets give there as well.
    """
    distance = mean = None
    # change of the curvatures at which a fit stops: curved triangles err by more than jets
    accuracy, cells = 3e-4, SPACING
    if jets is not None and triangles is not None:
        more, there = centroids(points, triangles, jets)
        distance = partial(signed_distance, points, jets)
        # with the points between them
        accuracy, cells = ACCURACY, 1.1
        mean = np.concatenate([np.where(jets.fitted, jets.mean, np.nan), np.full(len(more), np.nan)])
        points, normals = np.concatenate([points, more]), np.concatenate([normals, there])
    grid = max(cells * spacing, spacing_of(points, 4e5))
    fine, coarse = (
        fit(
            points,
            normals,
            h,
            distance=distance,
            mean_curvature=mean,
            keep_start=distance is not None,
            accuracy=accuracy,
            # the borders of a piece take long, and gain little
            iterations=300,
        )
        for h in (grid, COARSER * grid)
    )
    return Patch(fine.spline, coarse.spline, "spline", fine.misfit, fine.turn, spacing)


class Closeness(NamedTuple):
    """What points on a plane or quadric may be off it, all and rms, L."""

    most: float
    rms: float = np.inf

    @classmethod
    def of(cls, size: float, noise: float = 0.0) -> "Closeness":
        """On a body of a size whose points have noise, both L."""
        # single precision and some; of noisy points the rms tells what a quadric misses
        exact = cls(1e-6 * size)
        return cls(max(exact.most, 5.0 * noise), max(exact.most, 1.4 * noise)) if noise else exact


def polynomial_patch(points: FloatArray, normals: FloatArray, close: Closeness) -> Patch | None:
    """Plane or quadric through points (n, 3), L, with such normals, if there is one.

    Examples
    --------
    >>> import numpy as np
    >>> turn = np.linspace(0, 6, 50)
    >>> normals = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> polynomial_patch(normals + np.outer(turn % 1, [0, 0, 1]), normals, Closeness(1e-6)).kind
    'quadric'
    """
    middle = points.mean(axis=0)
    half = float(np.max(np.ptp(points, axis=0))) or 1.0
    x = (points - middle) / half
    for kind, degree in (("plane", 1), ("quadric", 2)):
        powers = [(a, b, c) for a in range(3) for b in range(3) for c in range(3) if a + b + c <= degree]
        # monomials (n, p) and their gradients (n, p, 3)
        exponent = np.array(powers)
        value = np.prod(x[:, None] ** exponent, axis=-1)
        slope = np.empty((*value.shape, 3))
        for axis in range(3):
            lower = exponent.copy()
            lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
            slope[..., axis] = exponent[:, axis] * np.prod(x[:, None] ** lower, axis=-1)
        if len(x) * 3 < len(powers):
            continue
        q = _least(value, slope, normals)
        # the normals of triangles tell which quadric it is; its own do not pull at it
        q = _least(value, slope, np.einsum("npk,p->nk", slope, q))
        f, g = value @ q, np.einsum("npk,p->nk", slope, q)
        steep = np.linalg.norm(g, axis=1)
        lean = np.sum(g * normals, axis=1) / np.maximum(steep, 1e-300)
        if np.median(lean) < 0:
            f, g, lean, q = -f, -g, -lean, -q
        # size of the second derivatives of Q, in the variables of the monomials
        second = np.array([[2.0 if 2 in p else 1.0] for p in powers]) * (np.sum(powers, axis=1) == 2)[:, None]
        bend = float(np.linalg.norm(q[:, None] * second))
        off = second_order(f, steep, bend) * half
        # a quadric may be a pair of sheets, of which the points take one
        curved = 2e-4 * bend / float(np.median(steep)) * half / 8 if kind == "quadric" else 0.0
        slope = steep / np.median(steep)
        # normals of triangles lean by so many radians from those of a quadric through their corners
        least = np.select([slope > SLIGHT, slope > TIP], [np.cos(0.35), 0.0], -1.0)
        if np.all(off <= max(close.most, curved)) and np.all(lean >= least) and np.sum(slope <= TIP) <= 1:
            spline, rms = _as_spline(q / np.median(steep), powers, middle, half), float(np.sqrt(np.mean(off**2)))
            return Patch(spline, spline, kind, rms, 0.0, 0.0) if rms <= close.rms else None
    return None


def second_order(value: FloatArray, slope: FloatArray, bend: float) -> FloatArray:
    """Distance (n,) from Q = 0 by Q, |grad Q| and |Q''|; next to the tip of a cone there is no slope to divide by."""
    return np.asarray(2 * np.abs(value) / (slope + np.sqrt(slope**2 + 2 * bend * np.abs(value)) + 1e-300))


def _least(value: FloatArray, slope: FloatArray, normals: FloatArray) -> FloatArray:
    """q (p,) of unit length with least sum 1e8 (value.q)^2 + |n x slope.q|^2, normals (n, 3) made unit vectors."""
    n = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    across = np.cross(slope, n[:, None])
    # triangles give normals roughly
    rows = np.concatenate([1e4 * value, *np.moveaxis(across, -1, 0)])
    return np.asarray(np.linalg.svd(rows, full_matrices=False)[2][-1])


def tip_of(patch: Patch) -> FloatArray | None:
    """The point (3,), L, at which a quadric has no slope, if it lies on it: the tip of a cone."""
    if patch.kind != "quadric":
        return None
    spline = patch.fine
    middle = spline.origin + 0.5 * spline.spacing
    hessian = spline.hessian(middle[None])[0]
    strength = np.abs(np.linalg.eigvalsh(hessian))
    if strength.min() < TIP * strength.max():
        return None
    tip = np.asarray(middle - np.linalg.solve(hessian, spline.gradient(middle[None])[0]))
    # Q = 0 is a cone or nearly one: its sheets come as near as that to the tip
    gap = np.sqrt(2 * abs(float(spline.level(tip[None])[0])) / strength.max())
    return tip if gap < TIP * float(spline.spacing[0]) else None


def _as_spline(q: FloatArray, powers: list[tuple[int, int, int]], middle: FloatArray, half: float) -> TensorSpline:
    """half sum q_p ((x - middle)/half)^p as a spline of one cell, which reaches from middle - half to middle + half."""
    # t of the cell is (1 + y)/2, y the variable of the monomials: coefficients of y^m
    t = np.linspace(0.0, 1.0, 6)
    rows = np.linalg.solve(
        np.vander(t, 6, increasing=True) @ POWERS, np.stack([(2 * t - 1) ** m for m in range(3)], axis=1)
    )
    total = np.zeros((6, 6, 6))
    for value, (a, b, c) in zip(q, powers, strict=True):
        total += value * np.einsum("i,j,k->ijk", rows[:, a], rows[:, b], rows[:, c])
    return TensorSpline(total * half, middle - half, np.full(3, 2 * half))


def divided(corners: FloatArray, edge: float) -> tuple[IntArray, FloatArray]:
    """Triangles (m, 3, 3) cut into others whose sides are at most ``edge`` long: of which one, and where.

    Returns
    -------
    origin : (k,)
        Number of the triangle that each of the k ones is part of.
    barycentric : (k, 3, 3)
        Of its corners, in that triangle.

    Raises
    ------
    ValueError
        If they are more than `MOST`.

    Examples
    --------
    >>> import numpy as np
    >>> origin, place = divided(np.array([[[0.0, 0, 0], [4, 0, 0], [0, 1, 0]]]), 1.5)
    >>> len(origin), bool(np.allclose(place.sum(axis=-1), 1))
    (9, True)
    """
    origin = np.arange(len(corners))
    place = np.broadcast_to(np.eye(3), (len(corners), 3, 3)).copy()
    done: list[tuple[IntArray, FloatArray]] = []
    while len(origin):
        x = place @ corners[origin]
        side = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
        longest = np.argmax(side, axis=1)
        fine = side[np.arange(len(x)), longest] <= edge
        done.append((origin[fine], place[fine]))
        origin, place, longest = origin[~fine], place[~fine], longest[~fine]
        if sum(len(part) for part, _ in done) + 2 * len(origin) > MOST:
            raise ValueError(f"sides of at most {edge:.3g} L ask for more than {MOST} triangles; take longer ones")
        # halved at the longest side: the same point on both sides of it
        rows = np.arange(len(origin))
        a, b, c = (place[rows, (longest + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        origin = np.concatenate([origin, origin])
        place = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate([part for part, _ in done]), np.concatenate([part for _, part in done])


def curved(corners: FloatArray, normals: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points (..., 3), L, and unit normals of triangles (..., 3, 3) with such at their corners, at places (..., 3)."""
    b = place[..., None]
    x, n = np.moveaxis(corners, -2, 0), np.moveaxis(normals, -2, 0)
    w = np.moveaxis(b, -2, 0)
    points = sum(w[i] ** 3 * x[i] for i in range(3))
    normal = sum(w[i] ** 2 * n[i] for i in range(3))
    sides = np.zeros_like(x[0])
    for i in range(3):
        for j in range(3):
            if i != j:
                toward = (2 * x[i] + x[j] - np.sum((x[j] - x[i]) * n[i], axis=-1, keepdims=True) * n[i]) / 3
                points = points + 3 * w[i] ** 2 * w[j] * toward
                sides = sides + toward / 6
    # the middle of the sides' points, and half as far again from the plane
    points = points + 6 * w[0] * w[1] * w[2] * (1.5 * sides - 0.5 * (x[0] + x[1] + x[2]) / 3)
    for i in range(3):
        j = (i + 1) % 3
        along = x[j] - x[i]
        both = n[i] + n[j]
        length = np.maximum(np.sum(along**2, axis=-1, keepdims=True), 1e-300)
        middle = both - 2 * np.sum(along * both, axis=-1, keepdims=True) / length * along
        middle = middle / np.maximum(np.linalg.norm(middle, axis=-1, keepdims=True), 1e-300)
        normal = normal + 2 * w[i] * w[j] * middle
    return np.asarray(points), np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
