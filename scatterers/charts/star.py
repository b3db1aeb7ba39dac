"""Whether a body is star-shaped, upright or along a bent spine, and the sphere map that follows.

Also here: atlases of the analytic bodies: six charts for genus 0, one doubly periodic chart for the torus.

Genus 0: the body is x = psi(s), s on the unit sphere. Face f = 2 a + (0 if s_a > 0 else 1) holds the s whose
largest component is s_a; with (a, b, c) cyclic and sign = +-1,

    s = (sign, sign tan xi, tan eta)/|.| in the order (a, b, c),  xi = (u - 1/2) pi/2,  eta = (v - 1/2) pi/2,

so the unit squares of (u, v) tile the sphere, and every point finds the chart in which it is farthest from the edge.

The equiangular cubed sphere is that of [RIP96]; Derivations, B1.

Sources: Derivations, B4.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.charts.radial import RadialMap, SpaceLevel, Spine
from scatterers.charts.samples import Samples
from scatterers.kernels.compiled import Compiled, evaluated, inverted, mapped

CHECKED = 20000
"""Points of the body at which the centre is checked."""


def star_map(space: SpaceLevel, samples: Samples, centre: FloatArray | None) -> tuple[RadialMap | None, str]:
    """Sphere map with a spine if the body is not upright and that does, without one otherwise.

    Returns
    -------
    RadialMap or None
        None if the body is not star-shaped.
    str
        What is wrong then.
    """
    points = samples.crossings()
    spines = [Spine.through(samples.values < 0, samples.origin, samples.spacing), Spine.none()]
    failure = ""
    for spine in spines[spines[0].upright :]:
        upright = points - spine.shift(points)
        low, high = upright.min(0), upright.max(0)
        middle = 0.5 * (low + high) if centre is None else centre - spine.shift(centre)
        sphere_map = RadialMap(space, middle, 0.5 * (high - low), spine)
        if not (failure := _hidden(sphere_map, points)):
            return sphere_map, ""
    return None, failure


def _hidden(sphere_map: RadialMap, points: FloatArray) -> str:
    """What is wrong unless F < 0 at the centre and rays from it leave the body at its points."""
    box, centre = sphere_map.space.box, sphere_map.centre + sphere_map.spine.shift(sphere_map.centre)
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


@dataclass(frozen=True)
class FaceChart:
    """Face ``2 axis + (sign < 0)`` of the equiangular cube over psi, which has the members of a `SphereMapped`."""

    sphere_map: Any
    axis: int
    sign: float
    periodic: tuple[bool, bool] = (False, False)

    def _order(self) -> tuple[int, int, int]:
        return self.axis, (self.axis + 1) % 3, (self.axis + 2) % 3

    def _cube(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Unnormalised cube point and tan xi, tan eta."""
        a, b, c = self._order()
        tangent = np.tan((np.asarray(uv, dtype=float) - 0.5) * (np.pi / 2))
        cube = np.empty((*tangent.shape[:-1], 3))
        cube[..., a] = self.sign
        cube[..., b] = self.sign * tangent[..., 0]
        cube[..., c] = tangent[..., 1]
        return cube, tangent[..., 0], tangent[..., 1]

    def point(self, uv: FloatArray) -> FloatArray:
        """Point of the body: (..., 2) -> (..., 3), L."""
        cube, _, _ = self._cube(uv)
        return np.asarray(self.sphere_map.forward(cube / np.linalg.norm(cube, axis=-1, keepdims=True)))

    def tangents(self, uv: FloatArray) -> FloatArray:
        """Columns x_u, x_v: (..., 2) -> (..., 3, 2), L."""
        _, b, c = self._order()
        cube, tan_u, tan_v = self._cube(uv)
        length = np.linalg.norm(cube, axis=-1)
        s = cube / length[..., None]
        ds = np.zeros((*s.shape, 2))
        ds[..., b, 0] = self.sign * (np.pi / 2) * (1 + tan_u**2)
        ds[..., c, 1] = (np.pi / 2) * (1 + tan_v**2)
        # derivative of the normalisation: (I - s s^T)/|cube|
        ds -= s[..., :, None] * np.sum(s[..., :, None] * ds, axis=-2, keepdims=True)
        ds /= length[..., None, None]
        return np.asarray(self.sphere_map.derivative(s) @ ds)


@dataclass(frozen=True)
class CubeSphereAtlas:
    """Six equiangular face charts over psi; ``compiled`` is a locator for kernels, or None."""

    sphere_map: Any
    compiled: Compiled | None = None

    @property
    def charts(self) -> Sequence[FaceChart]:
        """The six charts, ordered +x, -x, +y, -y, +z, -z."""
        return [FaceChart(self.sphere_map, a, sign) for a in range(3) for sign in (1.0, -1.0)]

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Chart number (...) and chart variables (..., 2) of points (..., 3)."""
        s = self.sphere_map.inverse(np.asarray(points, dtype=float))
        axis = np.argmax(np.abs(s), axis=-1)[..., None]
        along = np.take_along_axis(s, axis, -1)[..., 0]
        ratio_u = np.take_along_axis(s, (axis + 1) % 3, -1)[..., 0] / along
        # the second tangent carries no sign, so that faces of either sign are right-handed
        ratio_v = np.take_along_axis(s, (axis + 2) % 3, -1)[..., 0] / np.abs(along)
        uv = np.stack([np.arctan(ratio_u), np.arctan(ratio_v)], axis=-1) / (np.pi / 2) + 0.5
        return 2 * axis[..., 0] + (along < 0), uv


@dataclass(frozen=True)
class PeriodicChart:
    """A chart of period 1 in both variables, by the compiled forward function of its atlas."""

    compiled_forward: Compiled
    periodic: tuple[bool, bool] = (True, True)

    def _mapped(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        uv = np.asarray(uv, dtype=float)
        return mapped(self.compiled_forward, np.concatenate([uv, np.zeros_like(uv[..., :1])], axis=-1))

    def point(self, uv: FloatArray) -> FloatArray:
        """Point of the body: (..., 2) -> (..., 3), L."""
        return self._mapped(uv)[0]

    def tangents(self, uv: FloatArray) -> FloatArray:
        """Columns x_u, x_v: (..., 2) -> (..., 3, 2), L."""
        return self._mapped(uv)[1][..., :2]


@dataclass(frozen=True)
class PeriodicAtlas:
    """A single doubly periodic chart.

    ``compiled`` is its locator; ``compiled_forward`` takes (u, v, anything) to the point and, in columns 0 and 1 of the
    derivative, the tangents; ``compiled_inverse`` takes points to (u, v, 0).
    """

    compiled: Compiled
    compiled_forward: Compiled
    compiled_inverse: Compiled

    @property
    def charts(self) -> Sequence[PeriodicChart]:
        """The chart, in a list."""
        return [PeriodicChart(self.compiled_forward)]

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Chart number 0 (...) and chart variables in [0, 1) (..., 2) of points (..., 3)."""
        uv = inverted(self.compiled_inverse, points)[..., :2] % 1.0
        # -1e-17 % 1.0 is 1.0
        uv[uv >= 1.0] = 0.0
        return np.zeros(uv.shape[:-1], dtype=np.int64), uv
