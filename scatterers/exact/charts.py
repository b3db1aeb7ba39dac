"""Charts of a body of pieces that has no edges: six over its radial map from the middle of its box."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.atlas.charts import CubeSphereAtlas
from scatterers.exact.body import NoCharts
from scatterers.kernels.compiled import OPTIONS
from scatterers.kernels.revolved import evaluate, value_and_gradient
from scatterers.sphere_map.radial import RadialMap, Spine

FloatArray = NDArray[np.float64]
Tiles = Callable[[float], tuple[FloatArray, FloatArray, NDArray[np.int64]]]
# nodes along an axis plus four, of one cell
ONE_CELL = 6.0
SLACK = 0.1
"""By which the box of the map is wider than the body, in its half widths."""


@dataclass(frozen=True, eq=False)
class RevolvedSpace:
    """F of a body of revolution in a box; satisfies `scatterers.sphere_map.radial.SpaceLevel`.

    Attributes
    ----------
    box : (2, 3), L
    packed : callable
        All parameters from those of the map.
    """

    box: FloatArray
    packed: Callable[[FloatArray], FloatArray]

    def flat(self, of_map: FloatArray) -> FloatArray:
        """Parameters of the compiled functions: a grid of one cell, those of a map, those of the body."""
        cell = [np.full(3, ONE_CELL), self.box[0], 1 / (self.box[1] - self.box[0]), of_map]
        return self.packed(np.concatenate(cell))

    @property
    def sources(self) -> dict[str, Callable[..., None]]:
        """Plain Python of the compiled functions."""
        return {"level": evaluate, "forward": _forward()}


def charts(bounds: FloatArray, tiles: Tiles, packed: Callable[[FloatArray], FloatArray]) -> CubeSphereAtlas | NoCharts:
    """Six charts of a body that is seen whole from the middle of its box, none of another."""
    half = 0.5 * (bounds[1] - bounds[0])
    space = RevolvedSpace(np.stack([bounds[0] - SLACK * half, bounds[1] + SLACK * half]), packed)
    sphere_map = RadialMap(space, 0.5 * (bounds[0] + bounds[1]), half, Spine.none())
    points = tiles(0.05 * float(np.linalg.norm(half)))[0].reshape(-1, 3)
    if hidden := int(np.sum(~(sphere_map.facing(points) > 0))):
        return NoCharts(
            f"the body is not star-shaped about the middle of its box: {hidden} of {len(points)} points are hidden; "
            "no charts cover it, take its tiles"
        )
    return CubeSphereAtlas(sphere_map, sphere_map.compiled_locator)


@cache
def _forward() -> Callable[..., None]:
    """The sphere map's function on this level, the same object at every call."""
    from numba import njit

    from scatterers.kernels import radial as kernels

    space: dict[str, Any] = dict(vars(kernels))
    space["value_and_gradient"] = njit(**OPTIONS)(value_and_gradient)
    for name in ("_at", "_radius"):
        space[name] = njit(**OPTIONS)(FunctionType(space[name].py_func.__code__, space, name))
    # a file that does not exist: numba must not take the code that it keeps for splines
    code = kernels.forward.__code__.replace(co_filename="<body of revolution>")
    return FunctionType(code, space, "forward")
