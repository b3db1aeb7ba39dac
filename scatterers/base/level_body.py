"""Bodies given by an F in a box of space, whatever its kind: charts, parameters, compiled level.

A star-shaped body, upright or along a bent spine, has the sphere map of `scatterers.sphere_map.radial` and by it six
charts; any other body has the Monge charts of `scatterers.atlas.monge.atlas`.

Also here: what all bodies share: checked parameters, the speed, the fingerprint.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from scatterers.kernels.compiled import Compiled
from scatterers.kernels.tensor import CENTRE, HEADER
from scatterers.shown import Shown
from scatterers.sphere_map.radial import RadialMap, SpaceLevel
from scatterers.sphere_map.star import CubeSphereAtlas, FaceChart
from scatterers.spline.cloud import Samples
from scatterers.spline.tensor import SYMMETRIC, evaluated

if TYPE_CHECKING:
    from scatterers.atlas.monge.atlas import MongeAtlas
    from scatterers.pieces.patch import Crease
import math
import sys
from collections.abc import Sized
from dataclasses import fields
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from scatterers.cached import cached
from scatterers.speed import as_speed

CLOUDS = (25_000, 100_000)
"""Points of the body by which charts are chosen, the more if the fewer do not do."""
MARGIN = 0.4
"""How far charts reach beyond their squares: fewer charts than with more, for maps of at least 15 nodes a side."""
MOST_NUMBERS = 10**9


FloatArray = NDArray[np.float64]


def finite(**values: float) -> None:
    """Raise ValueError unless every named value is a finite number."""
    for name, value in values.items():
        # of a whole number that is no float math knows nothing
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
        if not number or not math.isfinite(value):
            raise ValueError(f"{name} = {value!r} is not a finite number")


def positive(**values: float) -> None:
    """Raise ValueError unless every named value is a positive finite number."""
    finite(**values)
    for name, value in values.items():
        if value <= 0:
            raise ValueError(f"{name} = {value!r} is not positive; give a length > 0")


def numbers(values: ArrayLike) -> NDArray[np.float64]:
    """Array of what a caller gives.

    Raises
    ------
    ValueError, TypeError
        If they are no numbers, or more of them than an array is made of.
    """
    count = values.size if isinstance(values, np.ndarray) else len(values) if isinstance(values, Sized) else 0
    if count > MOST_NUMBERS:
        raise ValueError(f"{count} numbers are more than {MOST_NUMBERS}")
    try:
        return np.asarray(values, dtype=float)
    except (OverflowError, RecursionError) as error:
        raise ValueError(str(error)) from None


class Body(Shown):
    """Base of the dataclass bodies; each lists its parameters as fields, ``speed`` last.

    ``creases`` are the edges, joints, seams and tips of a body of smooth pieces.
    """

    @property
    def creases(self) -> Sequence["Crease"]:
        """Empty: the whole body is smooth."""
        return ()

    @property
    def tiling(self) -> Sequence[Any]:
        """Charts whose unit squares cover the body once and meet along their sides; empty if there are none."""
        return ()

    def _set_speed(self) -> None:
        object.__setattr__(self, "speed", as_speed(getattr(self, "speed", None)))

    def _shape_texts(self) -> list[str]:
        """Texts that change with the shape."""
        return [f"{f.name}={float(getattr(self, f.name)).hex()}" for f in fields(self) if f.name != "speed"]  # type: ignore[arg-type]

    @property
    def fingerprint(self) -> str | None:
        """Text that identifies shape and speed; None if the speed has no fingerprint."""
        values = self._shape_texts()
        speed: Any = getattr(self, "speed", None)
        if speed is not None:
            named = getattr(speed, "fingerprint", None)
            if named is None:
                return None
            values.append(f"speed={named}")
        return f"{type(self).__name__}({', '.join(values)})"


class LevelBody(Body):
    """Base of bodies given by a level function F; a subclass calls `_place` with F and defines ``_identity``."""

    _space: SpaceLevel
    _map: RadialMap | None
    _bounds: FloatArray
    # places where the body is not smooth, and how far from them rays are not trusted
    _non_smooth: FloatArray = np.zeros((0, 3))
    _reach: float = 0.0
    # why there are none, once that is known
    _no_charts: str = ""
    # charts found before
    _charts: Mapping[str, FloatArray] = MappingProxyType({})

    def _place(self, space: SpaceLevel, samples: Samples, sphere_map: RadialMap | None) -> None:
        """Take F, its samples and the sphere map, None for a body that has none."""
        self._space, self._map = space, sphere_map
        for made in ("compiled", "atlas", "_non_smooth_tree"):
            self.__dict__.pop(made, None)
        low, high = samples.inside
        reach = np.stack([low - 1.5 * samples.spacing, high + 1.5 * samples.spacing])
        self._bounds = np.clip(reach, space.box[0], space.box[1])

    def _identity(self) -> str:
        """Text that changes with the shape."""
        raise NotImplementedError

    def _shape_texts(self) -> list[str]:
        # what is stored on charts belongs to these charts
        charts = [] if self._map is not None else [f"charts={cast('MongeAtlas', self.atlas).digest}"]
        return [self._identity(), *charts]

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body with some slack, L."""
        return self._bounds

    @property
    def star_shaped(self) -> bool:
        """Whether the body has a sphere map."""
        return self._map is not None

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: points (..., 3), L, to (...)."""
        return evaluated(self.compiled, points)[0]

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F, unit of F over L: points (..., 3), L, to (..., 3)."""
        return evaluated(self.compiled, points)[1]

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F, unit of F over L^2: points (..., 3), L, to (..., 3, 3)."""
        return evaluated(self.compiled, points)[2][..., SYMMETRIC]

    def non_smooth(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (..., 3), L, lie where the body is not smooth enough for creeping rays: (...)."""
        points = np.asarray(points, dtype=float)
        found = np.zeros(points.shape[:-1], dtype=bool)
        if len(self._non_smooth):
            finite = np.all(np.isfinite(points), axis=-1)
            distance, _ = self._non_smooth_tree.query(points[finite], distance_upper_bound=self._reach)
            found[finite] = np.isfinite(distance)
        return found

    @cached_property
    def _non_smooth_tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._non_smooth)

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi], radians: (..., 3) -> (..., 2).

        Of psi^-1(x) on a star-shaped body; else of x as seen from the middle of the box, where several points of the
        body may share their angles.
        """
        s = self._map.inverse(points) if self._map is not None else points - self._bounds.mean(0)
        theta = np.arctan2(np.hypot(s[..., 0], s[..., 1]), s[..., 2])
        return np.stack([theta, np.arctan2(s[..., 1], s[..., 0])], axis=-1)

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        if self._map is not None:
            return self._map.compiled_level
        return Compiled(self._space.sources["level"], "level", self._space.flat(np.zeros(HEADER - CENTRE)))

    @cached
    def atlas(self) -> "CubeSphereAtlas | MongeAtlas":
        """Six charts over the sphere map, or Monge charts.

        Raises
        ------
        ValueError
            If the body is too thin, or too sharply curved, for charts.
        """
        return self._covered()

    @property
    def tiling(self) -> Sequence[FaceChart]:
        """The six charts of a star-shaped body; empty for other bodies."""
        return CubeSphereAtlas(self._map).charts if self._map is not None else ()

    def _covered(self) -> "CubeSphereAtlas | MongeAtlas":
        """Make the atlas."""
        if self._map is not None:
            return CubeSphereAtlas(self._map, self._map.compiled_locator)
        from scatterers.atlas.monge.atlas import MongeAtlas
        from scatterers.spline.cloud import body_cloud

        if self._charts:
            return MongeAtlas.restored(self.level, self.gradient, self._charts)
        if self._no_charts:
            raise ValueError(self._no_charts)
        failure = ""
        for count in CLOUDS:
            cloud = body_cloud(self.level, self.gradient, self._bounds, count)
            try:
                return MongeAtlas.covering(self.level, self.gradient, self.hessian, cloud, margin=MARGIN)
            except ValueError as error:
                # parts may be finer than the points
                failure = str(error)
        # to find that out takes as long as charts do
        self._no_charts = f"the body is too thin, or too sharply curved, in places for charts: {failure}"
        raise ValueError(self._no_charts)
