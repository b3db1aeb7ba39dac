"""Geometry of the far field of one incidence in given directions; no wavenumber but in how finely it is sampled."""

from abc import ABC, abstractmethod
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import ArrayLike, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.creeping_modes import fock_scale
from creeping.geometry.surface import Surface, normal, project, size
from creeping.rays.fan import RayFan
from creeping.rays.observer_contour import HorizonGrid, HorizonRays, MidHorizon, forward_nodes
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays, shed_far
from creeping.rays.specular import SpecularPoints, specular_points
from creeping.rays.strips import Strip, strips_of
from creeping.shadow.occlusion import occluded

_KEPT: "WeakKeyDictionary[RayFan, tuple[bytes, FarGeometry]]" = WeakKeyDictionary()
_STRIPS: "WeakKeyDictionary[RayFan, tuple[Strip, ...]]" = WeakKeyDictionary()
NUDGE = 1e-6
"""Least angle between an observer and the forward direction in the forward integral, radians."""
ALONG = 0.9
"""p.r above which a crossing is near a ray towards the observer."""
EARLY = 0.28
"""Time, in body sizes, before which a horizon crossing does not count for merging."""


class Geometry(ABC):
    """What the far field in m directions is assembled from.

    The incidence is one, d (3,), or one for each observer, (m, 3); the forward lobe asks for a `FarGeometry`.
    """

    body: Surface
    directions: FloatArray
    direction: FloatArray

    @property
    @abstractmethod
    def angle(self) -> FloatArray:
        """Angle from d (m,)."""

    @property
    @abstractmethod
    def mean_root_radius(self) -> FloatArray | float:
        """Mean of ρ^(1/3) over the launch points, one or (m,): m̄ = (k/2)^(1/3) times it."""

    @property
    @abstractmethod
    def shed(self) -> ShedRays:
        """Rays with p = r."""

    @property
    @abstractmethod
    def long(self) -> BoolArray:
        """Whether a shed ray has crossed the observer's horizon before (n,)."""

    @property
    @abstractmethod
    def specular(self) -> SpecularPoints:
        """Specular points of the lit side."""

    @property
    @abstractmethod
    def least_merging(self) -> FloatArray:
        """Least χ = |J|/(|J| + ρ|J'|) over horizon crossings with p.r > ALONG, of each observer (m,); 0 without any."""

    @abstractmethod
    def fan_nodes(self, wavenumber: float, wanted: BoolArray) -> HorizonRays:
        """Nodes of the fan integral for the wanted observers."""

    @cached_property
    def shed_normals(self) -> FloatArray:
        """Normals where shed rays leave (n, 3)."""
        return self.normals_of(self.shed.rays.points)

    @cached_property
    def leaves(self) -> BoolArray:
        """Whether a shed ray misses the body on its way out (n,)."""
        # interpolated points may lie below the surface by their error
        return ~occluded(self.body, project(self.body, self.shed.rays.points), -self.shed.rays.directions)

    def normals_of(self, points: FloatArray) -> FloatArray:
        """N at points (n, 3)."""
        return normal(self.body, points)


def fan_strips(fan: RayFan, *, single: bool = False) -> tuple[Strip, ...]:
    """Strips of a fan, made once; those of a single ray, which have nothing to interpolate, on request."""
    if fan not in _STRIPS:
        _STRIPS[fan] = strips_of(fan)
    return tuple(strip for strip in _STRIPS[fan] if single or len(strip.positions) > 1)


def far_geometry(fan: RayFan, observation: ArrayLike, wavenumber: float) -> "FarGeometry":
    """Geometry of a fan for directions (..., 3), kept with the fan until other directions are asked for."""
    try:
        r = np.array(observation, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"observation is not an array of numbers: {error}") from error
    if r.ndim < 1 or r.shape[-1] != 3:
        raise InvalidInputError(f"observation has shape {r.shape}; give directions (..., 3)")
    r = r.reshape(-1, 3)
    length = np.linalg.norm(r, axis=1)
    bad = np.flatnonzero(~(np.isfinite(length) & (length > 0)))
    if len(bad):
        raise InvalidInputError(
            f"{len(bad)} of {len(r)} observation directions are zero or not finite (first: row {bad[0]})"
        )
    r = r / length[:, None]
    key = r.tobytes()
    kept = _KEPT.get(fan)
    if kept is None or kept[0] != key:
        _KEPT[fan] = kept = (key, FarGeometry(fan, r))
    return kept[1]


def off_axis(directions: FloatArray, axis: FloatArray) -> FloatArray:
    """Unit directions (m, 3), those nearer to the axis than NUDGE turned away from it by that angle."""
    near = np.linalg.norm(directions - axis, axis=1) < NUDGE
    aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    turned = axis + NUDGE * aside / np.linalg.norm(aside)
    return np.where(near[:, None], turned, directions)


def merging(rays: RayPoints) -> FloatArray:
    """χ = |J|/(|J| + ρ|J'|): 1 where rays to a far observer merge, J' = 0, and 0 on a caustic of the surface (n,)."""
    J, rate = np.abs(rays.spreading), np.abs(rays.spreading_rate)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(J / (J + rate / rays.curvature[1]))


class FarGeometry(Geometry):
    """What every frequency shares: rays shed towards the observers, specular points, nodes of the integrals."""

    def __init__(self, fan: RayFan, directions: FloatArray) -> None:
        # not the fan itself: this is kept as long as the fan lives
        self.directions, self.launch_curvature = directions, fan.curvature[:, 0]
        self.line, self.body, self.direction = fan.line, fan.body, fan.line.direction
        self.strips = fan_strips(fan)
        self._fan_nodes: tuple[tuple[int, bytes], HorizonRays] | None = None
        self._forward: tuple[tuple[int, bytes], tuple[HorizonRays, MidHorizon, IntArray]] | None = None

    @cached_property
    def angle(self) -> FloatArray:
        """Angle from d (m,), accurate at 0 and π."""
        apart = np.linalg.norm(self.directions - self.direction, axis=1)
        return np.asarray(2 * np.arctan2(apart, np.linalg.norm(self.directions + self.direction, axis=1)))

    @cached_property
    def mean_root_radius(self) -> float:
        """Mean of ρ^(1/3) over the launch points: m̄ = (k/2)^(1/3) times it."""
        kappa = self.launch_curvature
        return float(np.mean(fock_scale(2.0, kappa[kappa > 0]))) if np.any(kappa > 0) else 1.0

    @cached_property
    def shed(self) -> ShedRays:
        """Rays with p = r."""
        return shed_far(self.strips, self.body, self.directions)

    @cached_property
    def long(self) -> BoolArray:
        """Whether a shed ray has crossed the observer's horizon before (n,)."""
        shed = self.shed
        r = self.directions[shed.observer]
        found = np.sum(shed.rays.first_normal * r, axis=1) > 0
        for number, strip in enumerate(self.strips):
            mine = np.flatnonzero(shed.strip == number)
            # n.r along the next ray of the fan, up to a step and a half before
            n = strip.coarse_normals(self.body)[strip.nearest(shed.sigma[mine])]
            before = strip.times[strip.coarse_steps] < shed.rays.time[mine, None] - 1.5 * strip.cell[1]
            found[mine] |= np.any((np.einsum("nsi,ni->ns", n, r[mine]) > 0) & before, axis=1)
        return np.asarray(found)

    @cached_property
    def specular(self) -> SpecularPoints:
        """Specular points of the lit side."""
        return specular_points(self.body, self.direction, self.directions)

    @cached_property
    def least_merging(self) -> FloatArray:
        """Least χ = |J|/(|J| + ρ|J'|) over horizon crossings with p.r > 0.9, of each observer (m,); 0 without any."""
        least = np.ones(len(self.directions))
        found = np.zeros(len(self.directions), dtype=bool)
        back = np.flatnonzero(self.angle > np.pi / 2)
        nodes = HorizonGrid(self.strips, self.body, np.inf).crossings(back, self.directions)
        rays = nodes.rays
        near = np.sum(rays.directions * self.directions[nodes.observer], axis=1) > ALONG
        near &= (rays.time > EARLY * size(self.body)) & rays.alive
        np.minimum.at(least, nodes.observer[near], merging(rays)[near])
        found[nodes.observer[near]] = True
        return np.where(found, least, 0.0)

    def fan_nodes(self, wavenumber: float, wanted: BoolArray) -> HorizonRays:
        """Nodes of the fan integral for the wanted observers, at most 1/k apart on the shadow line."""
        longest = max((curve.length for curve in self.line.curves), default=1.0)
        # in steps of a quarter octave, so that near frequencies share them
        fineness = int(np.ceil(4 * np.log2(max(wavenumber * longest, 256.0))))
        key = (fineness, wanted.tobytes())
        kept = self._fan_nodes
        if kept is None or kept[0] != key:
            rows = np.flatnonzero(wanted)
            strips = self.strips if len(rows) else ()
            grid = HorizonGrid(strips, self.body, longest / 2 ** (fineness / 4))
            self._fan_nodes = kept = (key, grid.crossings(rows, self.directions))
        return kept[1]

    def forward_nodes(self, wavenumber: float, wanted: BoolArray) -> tuple[HorizonRays, MidHorizon, IntArray]:
        """Nodes of both halves of the forward integral for the wanted observers, and observers that lack some."""
        fineness = int(np.ceil(4 * np.log2(max(wavenumber * size(self.body), 16.0))))
        key = (fineness, wanted.tobytes())
        kept = self._forward
        if kept is None or kept[0] != key:
            rows = np.flatnonzero(wanted)
            # at r = d every ray meets the horizon where it starts; the lobe is flat there to second order
            r = off_axis(self.directions, self.direction)
            reach = 2 ** (fineness / 4) * 2 * np.sin(self.angle[rows] / 2)
            counts = (48 + 1.5 * reach).astype(np.int64)
            self._forward = kept = (key, forward_nodes(self.strips, self.line, rows, r, counts))
        return kept[1]
