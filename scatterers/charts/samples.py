"""Points of a body F = 0, about evenly spread: where F changes sign along the edges of a cubic grid, put on the body.

An edge from node a to node b with F of both signs gives x = a + F(a)/(F(a) - F(b)) (b - a); then Newton steps
x <- x - F grad F/|grad F|^2, none longer than a cell. Edges that meet near one node give points close together, of
which one a voxel of half a cell is kept. Their number goes with 1/spacing^2: a first grid tells which one to take.

Also here: F at the nodes of a Cartesian grid: where the body lies, and that it is one closed body.

Sources: Derivations, B8.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import FloatArray
from scatterers.kernels.compiled import Compiled, evaluated

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
    # 24 cells along the side of a cube of the box's volume at first
    spacing = min(float(np.prod(side)) ** (1 / 3) / 24, longest)
    for _ in range(4):
        samples = sampled(level, box, spacing)
        points = sign_changes(samples.values, samples.origin, samples.spacing)
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
    for _ in range(30):
        x = points[active]
        step, distance = step_onto(level(x), gradient(x), reach)
        points[active] = x + step
        # a step so small squares to rounding
        active = active[~(np.abs(distance) < 1e-7 * reach)]
        if not len(active):
            return points
    raise ValueError(
        f"{len(active)} of {len(points)} points found no zero of F (first near {points[active[0]].round(4).tolist()}); "
        "F must be smooth with grad F != 0 on the body"
    )


def step_onto(level: FloatArray, gradient: FloatArray, reach: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Newton step onto F = 0 along grad F, at most ``reach``, L, and the distance F/|grad F|: (..., 3), (...).

    Where grad F = 0 neither is finite.
    """
    norm = np.linalg.norm(gradient, axis=-1)
    with np.errstate(all="ignore"):
        distance = level / norm
        step = -np.clip(distance, -reach, reach) / norm
    return step[..., None] * gradient, distance


def towards(compiled: Compiled, points: FloatArray, steps: int, reach: float | FloatArray = np.inf) -> FloatArray:
    """Points (..., 3), L, after ``steps`` Newton steps onto F = 0, none longer than ``reach``, L."""
    for _ in range(steps):
        value, gradient, _ = evaluated(compiled, points)
        step, _ = step_onto(value, gradient, reach)
        points = points + np.where(np.isfinite(step), step, 0.0)
    return points


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


def sampled(level: Field, box: FloatArray, spacing: float) -> Samples:
    """F on a cubic grid about a box (2, 3), L.

    Raises
    ------
    ValueError
        If it would have more than 30 million nodes.
    """
    most = 30_000_000
    side = box[1] - box[0]
    if np.prod(side / spacing + 4) > most:
        raise ValueError(
            f"a spacing of {spacing:.3g} L asks for a grid of more than {most} nodes; give a larger one: "
            "larger tiles, fewer points, or a smaller box"
        )
    # the shift keeps nodes off planes of symmetry, where F is often exactly 0
    origin = box[0] - (1 + 0.1 * np.sqrt([2.0, 3.0, 5.0])) * spacing
    axes = [origin[k] + spacing * np.arange(int(side[k] / spacing) + 4) for k in range(3)]
    # plane by plane, so that large grids do not fill the memory
    planes = [level(np.stack(np.broadcast_arrays(x, axes[1][:, None], axes[2]), axis=-1)) for x in axes[0]]
    return Samples(np.stack(planes), origin, np.full(3, spacing))


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
