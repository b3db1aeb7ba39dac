"""Points of a body F = 0, about evenly spread: where F changes sign along the edges of a cubic grid, put on the body.

An edge from node a to node b with F of both signs gives x = a + F(a)/(F(a) - F(b)) (b - a); then Newton steps
x <- x - F grad F/|grad F|^2, none longer than a cell. Edges that meet near one node give points close together, of
which one a voxel of half a cell is kept. Their number goes with 1/spacing^2: a first grid tells which one to take.

Also here: f at the nodes of a Cartesian grid: where the body lies, and that it is one closed body.

Also here: what is known of a body fitted to points: how well it meets them, and how its curvatures depend on the grid.

Also here: what a spline makes of points of its body: two fits of one body differ there by about the error of the worse.

Sources: Derivations, B8.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.kernels.compiled import SYMMETRIC, evaluated
from scatterers.spline.tensor import TensorSpline

# cells of the first grid, along the side of a cube of the box's volume
COARSE = 24
# nodes of the largest grid
MOST = 30_000_000
NEWTON = 30
# a Newton step this small, in units of the longest, squares to rounding
SMALL = 1e-7


FloatArray = NDArray[np.float64]
Field = Callable[[FloatArray], FloatArray]


def body_cloud(level: Field, gradient: Field, box: FloatArray, count: int) -> FloatArray:
    """About ``count`` points (n, 3) of a body inside its box (2, 3), more if it is thin.

    Parameters
    ----------
    level, gradient : callable
        F and its gradient, (..., 3) -> (...) and (..., 3).
    box : (2, 3), L
    count : int

    Raises
    ------
    ValueError
        If F has no sign change in the box, is not smooth on the body, or so many points ask for too large a grid.
    """
    box = np.asarray(box, dtype=float)
    side = box[1] - box[0]
    # a thin body passes between the nodes of a coarser grid
    longest = 0.4 * float(side.min())
    spacing = min(float(np.prod(side)) ** (1 / 3) / COARSE, longest)
    for _ in range(4):
        if np.prod(side / spacing + 4) > MOST:
            raise ValueError(
                f"{count} points ask for a grid of more than {MOST} nodes; ask for fewer, or a smaller box"
            )
        # the shift keeps nodes off planes of symmetry, where F is often exactly 0
        origin = box[0] - (1 + 0.1 * np.sqrt([2.0, 3.0, 5.0])) * spacing
        axes = [origin[k] + spacing * np.arange(int(side[k] / spacing) + 4) for k in range(3)]
        # plane by plane, so that large grids do not fill the memory
        planes = [level(np.stack(np.broadcast_arrays(x, axes[1][:, None], axes[2]), axis=-1)) for x in axes[0]]
        points = sign_changes(np.stack(planes), origin, np.full(3, spacing))
        if not len(points):
            raise ValueError("F has no sign change in its box: no body; check the box and F")
        if 0.9 * count < len(points) < 1.1 * count:
            break
        # not straight to a much finer grid: a coarse one may have missed parts
        spacing = min(spacing * np.clip(np.sqrt(len(points) / count), 0.2, 5.0), longest)
    return onto(level, gradient, points, spacing)


def sign_changes(values: FloatArray, origin: FloatArray, spacing: FloatArray) -> FloatArray:
    """Points (n, 3), L, where F changes sign on a grid of samples (n0, n1, n2), one in each voxel of half a cell."""
    index = edge_crossings(values)
    voxel = np.floor(2 * index).astype(np.int64)
    shape = 2 * np.array(values.shape, dtype=np.int64)
    _, first = np.unique((voxel[:, 0] * shape[1] + voxel[:, 1]) * shape[2] + voxel[:, 2], return_index=True)
    return np.asarray(origin + index[first] * spacing)


def onto(level: Field, gradient: Field, points: FloatArray, reach: float) -> FloatArray:
    """Points (n, 3), L, brought onto F = 0 by Newton steps of at most ``reach`` each, L.

    Raises
    ------
    ValueError
        If one finds no zero of F.
    """
    points = points.copy()
    active = np.arange(len(points))
    for _ in range(NEWTON):
        x = points[active]
        step, distance = step_onto(level(x), gradient(x), reach)
        points[active] = x + step
        active = active[~(np.abs(distance) < SMALL * reach)]
        if not len(active):
            return points
    raise ValueError(
        f"{len(active)} of {len(points)} points found no zero of F (first near {points[active[0]].round(4).tolist()}); "
        "F must be smooth with grad F != 0 on the body"
    )


def step_onto(level: FloatArray, gradient: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    """Newton step onto F = 0 along grad F, at most ``reach``, L, and the distance F/|grad F|: (..., 3), (...).

    Where grad F = 0 neither is finite.
    """
    norm = np.linalg.norm(gradient, axis=-1)
    with np.errstate(all="ignore"):
        distance = level / norm
        step = -np.clip(distance, -reach, reach) / norm
    return step[..., None] * gradient, distance


@dataclass(frozen=True)
class Samples:
    """F at the nodes of a grid.

    Attributes
    ----------
    values : (n0, n1, n2)
    origin, spacing : (3,), L
    """

    values: FloatArray
    origin: FloatArray
    spacing: FloatArray

    @property
    def far_corner(self) -> FloatArray:
        """The last node (3,), L."""
        return np.asarray(self.origin + (np.array(self.values.shape) - 1) * self.spacing)

    @property
    def inside(self) -> FloatArray:
        """Box (2, 3) of the nodes with F < 0, L."""
        index = np.nonzero(self.values < 0)
        corners = np.stack([np.array(index).min(1), np.array(index).max(1)])
        return np.asarray(self.origin + corners * self.spacing)

    def on_faces(self) -> FloatArray:
        """F at the nodes of the grid's faces: (n,)."""
        edge = np.ones(self.values.shape, dtype=bool)
        edge[1:-1, 1:-1, 1:-1] = False
        return np.asarray(self.values[edge])

    def middles(self) -> list[tuple[int, FloatArray]]:
        """Nodes with F < 0, and their middle, of each connected part, the largest first."""
        from scipy.ndimage import label

        parts, count = label(self.values < 0)
        where = [np.argwhere(parts == k + 1) for k in range(count)]
        found = [(len(w), self.origin + w.mean(0) * self.spacing) for w in where]
        return sorted(found, key=lambda pair: -pair[0])

    def has_cavity(self) -> bool:
        """Whether the nodes with F >= 0 are not connected."""
        from scipy.ndimage import label

        return int(label(self.values >= 0)[1]) > 1

    def crossings(self) -> FloatArray:
        """Points (n, 3), L, where edges of the grid cross the body, by linear interpolation."""
        return np.asarray(self.origin + edge_crossings(self.values) * self.spacing)


def edge_crossings(values: FloatArray) -> FloatArray:
    """Places (n, 3) in cells where values on a grid (n0, n1, n2) change sign along its edges, by linear interpolation.

    Nodes where they are not numbers take no part.
    """
    found = []
    for axis in range(3):
        last = values.shape[axis] - 1
        f, g = np.take(values, range(last), axis), np.take(values, range(1, last + 1), axis)
        crossed = ((f < 0) & (g >= 0)) | ((f >= 0) & (g < 0))
        index = np.argwhere(crossed).astype(float)
        index[:, axis] += f[crossed] / (f[crossed] - g[crossed])
        found.append(index)
    return np.concatenate(found)


@dataclass(frozen=True)
class FitReport:
    """Numbers of a fit; curvatures differ between it and a fit on another grid by about their error on the coarser.

    Attributes
    ----------
    points : int
        Points of the body that were fitted.
    spacing, coarser_spacing : float
        Of the grids, L; of a subdivided mesh the second is the finer one.
    nodes : tuple of int
        Of the grid of the fit.
    misfit : float
        Rms distance of the points from the body, L; of a subdivided mesh, of its vertices or of points nearer to them.
    turn : float
        Rms angle between the body's normals and those of these points, radians.
    slope : tuple of float
        Least and largest |grad F| on the body; 1 for a signed distance.
    normal_curvature, gaussian_curvature : float
        Rms of kappa_n over points and directions, 1/L, and of K, 1/L^2.
    normal_curvature_error, gaussian_curvature_error : float
        Rms difference between the two fits and, of points without noise, the angle of normals over the spacing, which
        is in both: the square root of the sum of their squares. The error of the finer fit is about a third of it
        where the grids resolve the body, since curvatures converge with order 4. Of a subdivided mesh it is all of it,
        and what the source cannot show stands for the normals (`scatterers.triangles.subdivision`).
    noise : float
        Rms distance of the points from a smooth body, estimated before the fit, L.
    smoothing : float
        Weight of the fourth differences that was taken.
    factor : float
        By how much the body errs more than it differs from the second fit; 1, of a subdivided mesh larger.
    """

    points: int
    spacing: float
    coarser_spacing: float
    nodes: tuple[int, ...]
    misfit: float
    turn: float
    slope: tuple[float, float]
    normal_curvature: float
    normal_curvature_error: float
    gaussian_curvature: float
    gaussian_curvature_error: float
    noise: float
    smoothing: float
    factor: float = 1.0

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> "FitReport":
        """The report again."""
        return cls(**content | {"nodes": tuple(content["nodes"]), "slope": tuple(content["slope"])})

    def __str__(self) -> str:
        if not self.spacing:
            return f"fit: {self.points} points, all of planes and quadrics, which are exact"
        # a box has no curvature at all
        kappa = self.normal_curvature_error / (self.normal_curvature or 1.0)
        gauss = self.gaussian_curvature_error / (self.gaussian_curvature or 1.0)
        return "\n".join(
            [
                f"fit: {self.points} points, {' x '.join(map(str, self.nodes))} nodes, spacing {self.spacing:.3g} m",
                f"  points off the body by {self.misfit:.1e} m rms, normals by {self.turn:.1e} rad",
                f"  |grad F| {self.slope[0]:.3f} to {self.slope[1]:.3f} (1 for a distance)",
                f"  curvatures against a grid of spacing {self.coarser_spacing:.3g} m: kappa_n {kappa:.1e}, "
                f"K {gauss:.1e} of their rms" + ("" if self.factor == 1 else ", what the source cannot show included"),
            ]
        )


def differences(fits: Sequence[tuple[TensorSpline, TensorSpline, FloatArray, FloatArray]]) -> dict[str, Any]:
    """What a `FitReport` says of curvatures and |grad F|, by two fits, points (n, 3), L, and normals of each F."""
    found = []
    for fine, coarse, points, normals in fits:
        along = tangents(normals)[0]
        (kappa, gauss, slope), (other, other_gauss, _) = (curvatures(one, points, along) for one in (fine, coarse))
        found.append((kappa, kappa - other, gauss, gauss - other_gauss, slope))
    every = [np.concatenate(parts) for parts in zip(*found, strict=True)] or [np.zeros(1)] * 4 + [np.ones(1)]
    names = ("normal_curvature", "normal_curvature_error", "gaussian_curvature", "gaussian_curvature_error")
    measured: dict[str, Any] = {name: rms(values) for name, values in zip(names, every[:4], strict=True)}
    return measured | {"slope": (float(every[4].min()), float(every[4].max()))}


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def curvatures(
    spline: TensorSpline, points: FloatArray, along: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """kappa_n along tangents and across them (2 n,), K (n,) and |grad F| (n,) at points brought onto the spline.

    Along ``along`` (n, 3), or any tangents that depend on the normals alone.
    """
    for _ in range(2):
        value, gradient, _ = evaluated(spline.compiled, points)
        points = points - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
    _, gradient, entries = evaluated(spline.compiled, points)
    slope = np.linalg.norm(gradient, axis=1)
    n = gradient / slope[:, None]
    along = tangents(n)[0] if along is None else along
    e = along - np.sum(along * n, axis=1, keepdims=True) * n
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    t = np.stack([e, np.cross(n, e)])
    form = np.einsum("ani,nij,bnj->abn", t, entries[:, SYMMETRIC], t) / slope
    gauss = form[0, 0] * form[1, 1] - form[0, 1] ** 2
    return np.concatenate([form[0, 0], form[1, 1]]), gauss, slope


def principal_curvatures(spline: TensorSpline, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Principal curvatures (n, 2) and K (n,) at points brought onto the spline."""
    kappa, gauss, _ = curvatures(spline, points)
    mean = kappa.reshape(2, -1).mean(axis=0)
    half = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
    return np.stack([mean - half, mean + half], axis=1), gauss


def normal_curvatures(spline: TensorSpline, points: FloatArray, along: FloatArray) -> FloatArray:
    """kappa_n (n,) at points brought onto the spline, along directions (n, 3) that lie nearly on it."""
    return curvatures(spline, points, along)[0][: len(points)]


def left_at(spline: TensorSpline, points: FloatArray, normals: FloatArray | None = None) -> tuple[float, float]:
    """Rms of F/|grad F| at points (n, 3), L, and rms angle between grad F and unit normals (n, 3) there, radians."""
    value, gradient, _ = evaluated(spline.compiled, points)
    slope = np.linalg.norm(gradient, axis=1)
    turn = 0.0 if normals is None else np.linalg.norm(gradient / slope[:, None] - normals, axis=1)
    return rms(value / slope), rms(np.asarray(turn))


def tangents(normals: FloatArray) -> FloatArray:
    """Two orthonormal tangents at unit normals: (n, 3) -> (2, n, 3)."""
    e = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    return np.stack([e, np.cross(normals, e)])
