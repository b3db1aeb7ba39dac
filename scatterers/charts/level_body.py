"""Bodies given by an F in a box of space, whatever its kind: charts, parameters, compiled level.

A star-shaped body, upright or along a bent spine, has the sphere map of `scatterers.charts.radial` and by it six
charts; any other body has the Monge charts of `scatterers.charts.monge`.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, cast

import numpy as np

from creeping._typing import FloatArray
from scatterers.body import Body, Levelled, polar_angles
from scatterers.cached import cached
from scatterers.charts.radial import RadialMap, SpaceLevel
from scatterers.charts.samples import Samples
from scatterers.charts.star import CubeSphereAtlas, FaceChart
from scatterers.kernels.compiled import Compiled
from scatterers.kernels.tensor import CENTRE, HEADER

if TYPE_CHECKING:
    from scatterers.charts.monge import MongeAtlas


CLOUDS = (25_000, 100_000)
"""Points of the body by which charts are chosen, the more if the fewer do not do."""
MARGIN = 0.4
"""How far charts reach beyond their squares: fewer charts than with more, for maps of at least 15 nodes a side."""


class LevelBody(Levelled, Body):
    """Base of bodies given by a level function F; a subclass calls `_place` with F and defines ``_identity``."""

    _space: SpaceLevel
    _map: RadialMap | None
    _bounds: FloatArray
    # why there are none, once that is known
    _no_charts: str = ""
    # charts found before
    _charts: Mapping[str, FloatArray] = MappingProxyType({})

    def _place(self, space: SpaceLevel, samples: Samples, sphere_map: RadialMap | None) -> None:
        """Take F, its samples and the sphere map, None for a body that has none."""
        self._space, self._map = space, sphere_map
        for made in ("compiled", "atlas"):
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

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi], radians: (..., 3) -> (..., 2).

        Of psi^-1(x) on a star-shaped body; else of x as seen from the middle of the box, where several points of the
        body may share their angles.
        """
        return polar_angles(self._map.inverse(points) if self._map is not None else points - self._bounds.mean(0))

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
        from scatterers.charts.monge import MongeAtlas
        from scatterers.charts.samples import body_cloud

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
