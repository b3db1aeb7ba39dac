"""Sphere map of a body that is star-shaped once its spine is upright: x = psi(s) = T(c + r(s) A s).

A = diag(half axes), r > 0 the root of F(T(c + r A s)) = 0, and T a shear along the spine, in cyclic axes whose third is
the body's longest,

    T(w) = w + (X(w_3), Y(w_3), 0),   T^-1(x) = x - (X(x_3), Y(x_3), 0);

an upright body has T = 1. With y = A s and g = DT^T grad F(x): d psi/ds = r DT (A - y (A g)^T/(g.y)), and
psi^-1(x) = A^-1 (w - c)/|A^-1 (w - c)|, w = T^-1(x). Every ray meets the body once where g.(w - c) > 0 on all of it.
The root is found by Newton steps from r = 1, halved into the bracket when they leave it; beyond the grid counts as
outside the body. `scatterers.kernels.charts` has the compiled functions.

Also here: whether a body is star-shaped, upright or along a bent spine, and the sphere map that follows.

Atlases of the analytic bodies: six charts for genus 0, one doubly periodic chart for the torus.

Genus 0: the body is x = psi(s), s on the unit sphere. Face f = 2 a + (0 if s_a > 0 else 1) holds the s whose
largest component is s_a; with (a, b, c) cyclic and sign = +-1,

    s = (sign, sign tan xi, tan eta)/|.| in the order (a, b, c),  xi = (u - 1/2) pi/2,  eta = (v - 1/2) pi/2,

so the unit squares of (u, v) tile the sphere, and every point finds the chart in which it is farthest from the edge.

The equiangular cubed sphere is that of [RIP96]; Derivations, B1.

Bodies given by an F in a box of space: a star-shaped one, upright or along a bent spine, has the sphere map and by it
six charts; any other body has the Monge charts of `scatterers.charts.monge`.

Sources: Derivations, B1 and B4.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.polynomial import polynomial

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Body, Levelled, SphereMapped, cached, polar_angles
from scatterers.charts.samples import Samples
from scatterers.kernels.compiled import Compiled, evaluated, inverted, mapped
from scatterers.kernels.tensor import AT, DEGREE, REACH


class SpaceLevel(Protocol):
    """F in a box of space, as a sphere map needs it."""

    @property
    def box(self) -> FloatArray:
        """Box (2, 3) in which F is known, L."""
        ...

    def flat(self, of_map: FloatArray) -> FloatArray:
        """Parameters of the compiled functions, those of a map among them."""
        ...

    @property
    def sources(self) -> Mapping[str, Callable[..., None]]:
        """Plain Python of its "level" and of the "forward" sphere map over it; see `kernels.compiled`."""
        ...


@dataclass(frozen=True, eq=False)
class Spine:
    """Shift across one axis as polynomials of the place along it, constant from `REACH` times their range on.

    Attributes
    ----------
    axis : int
        The axis along which the spine runs.
    middle, half : float
        The range middle +- half of that coordinate, L.
    shifts : (DEGREE + 1, 3)
        Coefficients of the powers of (x_axis - middle)/half for the shifts along x, y and z, L; zero along the axis.
    """

    axis: int
    middle: float
    half: float
    shifts: FloatArray

    @property
    def upright(self) -> bool:
        """Whether there is no shift."""
        return not np.any(self.shifts)

    def shift(self, points: FloatArray) -> FloatArray:
        """T(w) - w = x - T^-1(x), L: (..., 3) -> (..., 3)."""
        t: FloatArray = (np.asarray(points, dtype=float)[..., self.axis] - self.middle) / self.half
        return np.moveaxis(np.asarray(polynomial.polyval(t.clip(-REACH, REACH), self.shifts)), 0, -1)

    def slope(self, points: FloatArray) -> FloatArray:
        """Derivative of the shift along the axis at points w or x, without unit: (..., 3) -> (..., 3)."""
        t: FloatArray = (np.asarray(points, dtype=float)[..., self.axis] - self.middle) / self.half
        found = polynomial.polyval(t.clip(-REACH, REACH), polynomial.polyder(self.shifts)) / self.half
        return np.moveaxis(np.where(np.abs(t) > REACH, 0.0, found), 0, -1)

    @classmethod
    def through(cls, inside: BoolArray, origin: FloatArray, spacing: FloatArray) -> "Spine":
        """Least-squares spine of the slices of the nodes inside a body, weighted by their areas.

        A shift within a hundredth of the half width of a constant, by the weighted mean square, is left out.
        """
        where = np.argwhere(inside)
        low, high = where.min(0), where.max(0)
        axis = int(np.argmax((high - low + 1) * spacing))
        middle, half = 0.5 * (low + high) * spacing + origin, 0.5 * (high - low + 1) * spacing
        area = np.bincount(where[:, axis], minlength=inside.shape[axis])
        slices = np.flatnonzero(area)
        area = area[slices]
        t = (origin[axis] + slices * spacing[axis] - middle[axis]) / half[axis]
        root, shifts = np.sqrt(area), np.zeros((DEGREE + 1, 3))
        # few slices determine few coefficients
        degree = min(DEGREE, len(slices) // 2)
        for across in (axis - 1, axis - 2):
            centroid = np.bincount(where[:, axis], where[:, across])[slices] / area * spacing[across] + origin[across]
            off = centroid - np.average(centroid, weights=area)
            if np.sqrt(np.average(off**2, weights=area)) > 0.01 * half[across]:
                shifts[: degree + 1, across] = polynomial.polyfit(t, centroid, degree, w=root)
        return cls(axis, float(middle[axis]), float(half[axis]), shifts)

    @classmethod
    def none(cls) -> "Spine":
        """No shift."""
        return cls(2, 0.0, 1.0, np.zeros((DEGREE + 1, 3)))


@dataclass(frozen=True, eq=False)
class RadialMap(SphereMapped):
    """The map over an F known in a box.

    Attributes
    ----------
    space : SpaceLevel
    centre, half_axes : (3,), L
        Of the body with upright spine.
    spine : Spine
    iterative : bool
        That psi is a search for a root: users who evaluate it often had better tabulate it.
    """

    space: SpaceLevel
    centre: FloatArray
    half_axes: FloatArray
    spine: Spine
    iterative = True

    @cached
    def box(self) -> FloatArray:
        """Box (2, 3) about the centre that contains the sheared grid, L."""
        ends = np.repeat(np.linspace(-REACH, REACH, 129)[:, None], 3, axis=1) * self.spine.half + self.spine.middle
        shift = self.spine.shift(ends)
        return np.asarray(self.space.box - self.centre - np.stack([shift.max(0), shift.min(0)]))

    def facing(self, points: FloatArray) -> FloatArray:
        """g.(w - c) at points of the body, positive where rays leave it: (..., 3) -> (...)."""
        _, gradient, _ = evaluated(self.compiled_level, points)
        y = points - self.spine.shift(points) - self.centre
        # g.y = grad F.(DT y)
        along = y + y[..., self.spine.axis, None] * self.spine.slope(points)
        return np.asarray(np.sum(gradient * along, axis=-1))

    @cached_property
    def parameters(self) -> FloatArray:
        """Parameters that all compiled functions share."""
        return self.space.flat(self.header)

    @cached_property
    def header(self) -> FloatArray:
        """Parameters of the map, as `scatterers.kernels.tensor` orders them."""
        spine = self.spine
        along = [spine.axis, spine.middle, 0.0 if spine.upright else 1 / spine.half]
        parts = [self.centre, self.half_axes, np.array(along, dtype=float), spine.shifts.T.ravel(), self.box.ravel()]
        return np.concatenate(parts)

    @cached_property
    def compiled_level(self) -> Compiled:
        """Compiled F, grad F and Hessian."""
        return Compiled(self.space.sources["level"], "level", self.parameters)

    @cached_property
    def compiled_forward(self) -> Compiled:
        """Compiled psi and its derivative."""
        return Compiled(self.space.sources["forward"], "forward", self.parameters)

    @cached_property
    def compiled_inverse(self) -> Compiled:
        """Compiled psi^-1."""
        from scatterers.kernels.charts import inverse

        return Compiled(inverse, "inverse", self.parameters)

    @cached_property
    def compiled_locator(self) -> Compiled:
        """Compiled locator of the six charts over psi."""
        from scatterers.kernels.charts import locate

        return Compiled(locate, "locator", self.parameters)


def star_map(space: SpaceLevel, samples: Samples, centre: FloatArray | None) -> tuple[RadialMap | None, str]:
    """Sphere map of a star-shaped body; a body that is not upright is tried with a spine first.

    Returns
    -------
    RadialMap or None
        None if the body is not star-shaped.
    str
        Why there is no map; else empty.
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
    # at 20 000 of them
    points = points[:: -(-len(points) // 20_000)]
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


if TYPE_CHECKING:
    from scatterers.charts.monge import MongeAtlas


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
        """Whether the body has a sphere map psi, which takes the unit sphere one-to-one to the body."""
        return self._map is not None

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi], radians: (..., 3) -> (..., 2).

        On a star-shaped body they are the angles of the unit vector that the sphere map takes to the point. On other
        bodies they are those of the point seen from the middle of the box; several points may share their angles.
        """
        return polar_angles(self._map.inverse(points) if self._map is not None else points - self._bounds.mean(0))

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled function that gives F, its gradient and its Hessian."""
        if self._map is not None:
            return self._map.compiled_level
        return Compiled(self._space.sources["level"], "level", self._space.flat(np.zeros(AT.end - AT.centre)))

    @cached
    def atlas(self) -> "CubeSphereAtlas | MongeAtlas":
        """Charts that cover the body: six by the sphere map of a star-shaped body, else Monge charts.

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
        for count in (25_000, 100_000):
            cloud = body_cloud(self.level, self.gradient, self._bounds, count)
            try:
                # fewer charts than with a larger margin, for maps of at least 15 nodes a side
                return MongeAtlas.covering(self.level, self.gradient, self.hessian, cloud, margin=0.4)
            except ValueError as error:
                # parts may be finer than the points
                failure = str(error)
        # to find that out takes as long as charts do
        self._no_charts = f"the body is too thin, or too sharply curved, in places for charts: {failure}"
        raise ValueError(self._no_charts)
