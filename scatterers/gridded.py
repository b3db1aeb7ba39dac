"""Body whose F is given by samples on a Cartesian grid: F = quintic tensor-product B-spline through them.

F and its derivatives are those of the spline, exactly; the body has to be star-shaped about a centre, once a bent or
slanted one is sheared upright, which gives it the sphere map of `scatterers._radial` and by it six charts.
"""

import hashlib
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scatterers._body import Body
from scatterers._charts import CubeSphereAtlas
from scatterers._compile import Compiled
from scatterers._radial import RadialMap, Spine
from scatterers._tensor_spline import TensorSpline, coefficients, evaluated

FloatArray = NDArray[np.float64]
FEWEST = 8
# points of the body at which the centre is checked
CHECKED = 20000
# where xx, yy, zz, yz, xz, xy stand in a matrix
SYMMETRIC = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])


class Level(Protocol):
    """What `Gridded.sampled` asks of the body that it samples."""

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        ...

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: (..., 3) -> (...)."""
        ...


class Gridded(Body):
    """Star-shaped body from samples of F on a grid.

    Parameters
    ----------
    samples : (n0, n1, n2) array_like
        F at the nodes, positive outside the body; at least 8 nodes along each axis.
    bounds : (2, 3) array_like
        Box whose faces the outermost nodes lie on, L.
    centre : (3,) array_like, optional
        Point that sees the whole body from within, L; by default the middle of the body's box. A body whose slices
        across its longest side are shifted against each other is sheared upright first, if that leaves it star-shaped.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the samples are too few or not finite, no node is inside, nodes of the grid's faces are not outside, or
        the body is not star-shaped about the centre.
    """

    def __init__(
        self, samples: ArrayLike, bounds: ArrayLike, *, centre: ArrayLike | None = None, speed: Any = None
    ) -> None:
        box = _numbers("bounds", bounds, (2, 3))
        if not np.all(box[1] > box[0]):
            raise ValueError(f"bounds {box.tolist()} are no box; give ((x0, y0, z0), (x1, y1, z1)) with x0 < x1 etc.")
        nodes = _checked(samples)
        spacing = (box[1] - box[0]) / (np.array(nodes.shape) - 1)
        inside = np.stack([np.array(np.nonzero(nodes < 0)).min(1), np.array(np.nonzero(nodes < 0)).max(1)])
        inside = box[0] + inside * spacing
        given = None if centre is None else _numbers("centre", centre, (3,))
        self.speed = speed
        self._set_speed()
        self._spline = TensorSpline(coefficients(nodes), box[0], spacing)
        self._map = _star(self._spline, nodes, given)
        reach = np.stack([inside[0] - 1.5 * spacing, inside[1] + 1.5 * spacing])
        self._bounds: FloatArray = np.clip(reach, box[0], box[1])
        digest = hashlib.blake2b(nodes.tobytes(), digest_size=8)
        # what is stored by the sphere map depends on it, too
        digest.update(np.concatenate([box.ravel(), self._map.header, np.array(nodes.shape, dtype=float)]).tobytes())
        self._digest = digest.hexdigest()

    @classmethod
    def sampled(
        cls,
        body: Level,
        nodes: int | Sequence[int] = 64,
        margin: float = 0.15,
        *,
        centre: ArrayLike | None = None,
    ) -> "Gridded":
        """Sample another body's F, and take over its speed.

        Parameters
        ----------
        body : object with ``level`` and ``bounds``
        nodes : int or three ints
            Nodes along each axis.
        margin : float
            By how much of its half width the body's box is widened on every side.
        centre : (3,) array_like, optional
            As of the class.

        Raises
        ------
        ValueError
            As the class, and if the nodes or the margin are not usable.
        """
        counts = [nodes] * 3 if isinstance(nodes, int) else list(nodes)
        if len(counts) != 3 or any(isinstance(n, bool) or not isinstance(n, int) or n < FEWEST for n in counts):
            raise ValueError(f"nodes = {nodes!r}; give one or three whole numbers, at least {FEWEST}")
        if isinstance(margin, bool) or not isinstance(margin, (int, float)) or not 0 < margin < np.inf:
            raise ValueError(f"margin = {margin!r} is not a positive finite number; give e.g. 0.15")
        box = np.asarray(body.bounds, dtype=float)
        widened = margin * 0.5 * (box[1] - box[0])
        box = np.stack([box[0] - widened, box[1] + widened])
        x, y, z = (np.linspace(box[0, k], box[1, k], counts[k]) for k in range(3))
        # plane by plane, so that large grids do not fill the memory
        planes = [body.level(np.stack(np.broadcast_arrays(v, y[:, None], z), axis=-1)) for v in x]
        return cls(np.stack(planes), box, centre=centre, speed=getattr(body, "speed", None))

    def __repr__(self) -> str:
        nodes = " x ".join(str(n - 4) for n in self._spline.coefficients.shape)
        return f"Gridded({nodes} nodes, {self._digest}, speed={self.speed!r})"

    @property
    def fingerprint(self) -> str | None:
        """Text that changes with the shape or the speed; None if the speed cannot be named."""
        if self.speed is None:
            return f"Gridded({self._digest})"
        named = getattr(self.speed, "fingerprint", None)
        return None if named is None else f"Gridded({self._digest}, speed={named})"

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body with some slack, L."""
        return self._bounds

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: (..., 3) -> (...)."""
        return evaluated(self.compiled, points)[0]

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F: (..., 3) -> (..., 3)."""
        return evaluated(self.compiled, points)[1]

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F: (..., 3) -> (..., 3, 3)."""
        return evaluated(self.compiled, points)[2][..., SYMMETRIC]

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi] of psi^-1(x): (..., 3) -> (..., 2)."""
        s = self._map.inverse(points)
        theta = np.arctan2(np.hypot(s[..., 0], s[..., 1]), s[..., 2])
        return np.stack([theta, np.arctan2(s[..., 1], s[..., 0])], axis=-1)

    @property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        return self._map.compiled_level

    @cached_property
    def atlas(self) -> CubeSphereAtlas:
        """Six charts."""
        return CubeSphereAtlas(self._map, self._map.compiled_locator)


def _star(spline: TensorSpline, nodes: FloatArray, centre: FloatArray | None) -> RadialMap:
    """Sphere map with a spine if the body is not upright and that does, without one otherwise, or ValueError."""
    points = _crossings(spline, nodes)
    spines = [Spine.through(nodes < 0, spline.origin, spline.spacing), Spine.none()]
    failure = ""
    for spine in spines[spines[0].upright :]:
        upright = points - spine.shift(points)
        low, high = upright.min(0), upright.max(0)
        middle = 0.5 * (low + high) if centre is None else centre - spine.shift(centre)
        sphere_map = RadialMap(spline, middle, 0.5 * (high - low), spine)
        if not (failure := _hidden(sphere_map, points)):
            return sphere_map
    raise ValueError(failure)


def _crossings(spline: TensorSpline, nodes: FloatArray) -> FloatArray:
    """Points (n, 3) where edges of the grid cross the body, by linear interpolation."""
    found = []
    for axis in range(3):
        last = nodes.shape[axis] - 1
        f, g = np.take(nodes, range(last), axis), np.take(nodes, range(1, last + 1), axis)
        crossed = (f < 0) != (g < 0)
        index = np.argwhere(crossed).astype(float)
        index[:, axis] += f[crossed] / (f[crossed] - g[crossed])
        found.append(index)
    return np.asarray(spline.origin + np.concatenate(found) * spline.spacing)


def _hidden(sphere_map: RadialMap, points: FloatArray) -> str:
    """What is wrong unless F < 0 at the centre and rays from it leave the body at its points."""
    box, centre = sphere_map.spline.box, sphere_map.centre + sphere_map.spine.shift(sphere_map.centre)
    remedy = "give a centre from which every point of the body is in sight, or another body"
    where = tuple(centre.round(6).tolist())
    inside = np.all(centre > box[0]) and np.all(centre < box[1])
    if not inside or not evaluated(sphere_map.compiled_level, centre)[0] < 0:
        return f"the centre {where} is not inside the body; {remedy}"
    points = points[:: -(-len(points) // CHECKED)]
    hidden = int(np.sum(~(sphere_map.facing(points) > 0)))
    if not hidden:
        return ""
    return f"the body is not star-shaped about {where}: {hidden} of {len(points)} directions fail; {remedy}"


def _numbers(name: str, values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {values!r} are not numbers; give an array of shape {shape}") from None
    if found.shape != shape or not np.all(np.isfinite(found)):
        raise ValueError(f"{name} = {values!r} is no array of {shape} finite numbers")
    return found


def _checked(samples: ArrayLike) -> FloatArray:
    """Samples as an array, or ValueError."""
    try:
        nodes = np.ascontiguousarray(samples, dtype=float)
    except (TypeError, ValueError):
        raise ValueError("the samples are not numbers; give F at the nodes, an array (n0, n1, n2)") from None
    if nodes.ndim != 3 or min(nodes.shape) < FEWEST:
        raise ValueError(f"samples have shape {nodes.shape}; give (n0, n1, n2), each at least {FEWEST}")
    if bad := int(np.sum(~np.isfinite(nodes))):
        raise ValueError(f"{bad} of {nodes.size} samples are not finite; give F at every node, also far away")
    if not np.any(nodes < 0):
        raise ValueError(f"none of {nodes.size} samples is negative: no body; give F < 0 inside, or more nodes")
    edge = np.ones(nodes.shape, dtype=bool)
    edge[1:-1, 1:-1, 1:-1] = False
    if bad := int(np.sum(~(nodes[edge] > 0))):
        raise ValueError(
            f"F <= 0 at {bad} of {edge.sum()} nodes on the grid's faces: the body leaves the grid or F is negative "
            "outside; widen the box or change the sign"
        )
    return nodes
