"""The far field assembled from isolated rays, u_s ~ f(r) e^{ikR}/R, uniform across the caustics that we know of.

    f = w F + (1 - w) [(1 - v) f_rays + v f_fan + f_reflected] + w W(θ; 4°, 12°) f_rays, long ones only

with θ the angle from d, m̄ the mean of m over the shadow line and W a smooth step,

    w = 1 - W(m̄ θ; 0.55, 0.85)                  F the forward lobe (`creeping.field.forward`)
    v = W(min χ; 0.38, 0.52) for θ > 90°      χ = |J|/(|J| + ρ|J'|) over crossings of the horizon with p.r > 0.9
    f_rays = Σ -√(m1 m2) √(2/k) P |J'|^(-1/2) e^{-iπN/2} e^{ik(d.x0 + s - r.x)}   all rays with p = r

Sources: [LK59], [P79]; Derivations, F3, F10, F14 and F15. The thresholds of W were set by trial.
"""

from dataclasses import replace

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import (
    ELECTRIC_HARD,
    ELECTRIC_SOFT,
    Boundary,
    BoundaryLike,
    boundary_name,
    scalar_boundaries,
)
from creeping.field.far_geometry import FarGeometry, merging, off_axis
from creeping.field.far_result import FarField
from creeping.field.forward import fan_half, lit_half, shadow_half, silhouette
from creeping.field.polarisation import dyads, wave_frame
from creeping.field.reflected import NORMAL, UNRESOLVED, next_order, reflected_amplitude
from creeping.field.shed_wave import scales, shed_wave, smoothstep
from creeping.rays.quantities import RayPoints

FORWARD = (0.55, 0.85)
"""m̄ θ between which the forward lobe gives way."""
NEAR_AXIS = (0.3, 0.45)
"""m̄ θ between which its silhouette gives way to the poles."""
LONG_RAYS = (np.radians(4.0), np.radians(12.0))
CROSSED = {ELECTRIC_SOFT: (1, ELECTRIC_HARD), ELECTRIC_HARD: (-1, ELECTRIC_SOFT)}
"""Polarisations of a conductor and the other of each, with the sign of their coupling."""
MATTERS = 0.05
"""Share of the field from which a contribution whose expansion fails makes a direction unresolved."""
DARK = 0.5
"""Share of the field that ground without rays may have before a direction is unresolved."""
HIDDEN = 0.01
"""Share of the shadow line from which hidden parts leave the forward lobe unresolved."""
MERGED = (0.38, 0.52)
"""χ between which the fan integral replaces isolated rays."""


def field_of(geometry: FarGeometry, k: float, boundary: BoundaryLike, order: int) -> FarField:
    """Far field of a geometry, one row for each observer of each incidence."""
    kinds = scalar_boundaries(boundary)
    parts = _Parts(geometry, kinds, k, order)
    for number, kind in enumerate(kinds):
        parts.add(number, kind)
    return FarField(
        directions=geometry.directions.copy(),
        creeping=parts.creeping,
        reflected=parts.reflected,
        forward=parts.forward,
        method=_methods(parts.in_forward, parts.in_fan),
        unresolved=parts.unresolved(),
        error=parts.error(),
        error_by="",
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
    )


def error_by_order(far: FarField, geometry: FarGeometry, boundary: BoundaryLike) -> FarField:
    """A far field whose error has the difference of both orders too."""
    other = field_of(geometry, far.wavenumber, boundary, 3 - far.order)
    with np.errstate(invalid="ignore"):
        error = np.hypot(np.abs(far.total - other.total), far.error)
    return replace(far, error=np.where(np.isfinite(error), error, np.nan), error_by="order")


def isolated_rays(geometry: FarGeometry, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """Contribution of each ray shed towards an observer (n,), L; infinite where J' = 0."""
    rays = geometry.shed.rays
    m1, m2 = scales(rays, wavenumber)
    path = rays.eikonal - np.sum(rays.directions * rays.points, axis=-1)
    phase = wavenumber * path - 0.5 * np.pi * rays.far_caustics
    wave = shed_wave(rays, wavenumber, boundary, order)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if order == 2 and boundary in CROSSED:
            sign, other = CROSSED[boundary]
            wave = wave + sign * gradient_coupling(rays, wavenumber) * shed_wave(rays, wavenumber, other, order)
        amplitude = np.sqrt(2 * m1 * m2 / wavenumber / held_rate(rays, m2, passed_fold(geometry)))
        wave = np.where(amplitude > 0, -amplitude * wave * np.exp(1j * phase), 0.0)
    return np.asarray(np.where(rays.alive & geometry.leaves, wave, 0.0))


def passed_fold(geometry: FarGeometry) -> BoolArray:
    """Whether a shed ray is past the fold J' = 0 of its launch point (n,): φ outside [0, π/2], or turned back.

    Over regions with K < 0, φ may come back to 0.
    """
    rays = geometry.shed.rays
    turned = geometry.angle[geometry.shed.observer] > np.pi / 2
    return np.asarray((rays.prufer > np.pi / 2) | (rays.prufer < 0) | turned)


def held_rate(rays: RayPoints, m: FloatArray, passed: BoolArray) -> FloatArray:
    """|J'| (n,), held above |J|κₙ/(2m) at folds that are not the launch point's own, which the ray has passed.

    There a fold's wave stops growing.
    """
    rate = np.abs(rays.spreading_rate)
    least = np.where(passed, 0.5 * np.abs(rays.spreading) * np.maximum(rays.curvature[1], 0.0) / m, 0.0)
    return np.asarray(np.sqrt(np.sqrt(rate**4 + least**4)))


def gradient_coupling(rays: RayPoints, wavenumber: float) -> ComplexArray:
    """i κ_t1 κ_t2/(k J'): how much of one polarisation's wave goes with the other's (n,), without unit.

    An amplitude n0.E that varies across the rays has a transverse field of higher order in 1/k; the soft wave is so
    weak that this outweighs it. Found on the sphere, exactly; κ_t at both ends, for reciprocity, on other bodies.
    """
    first, last = rays.transverse
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1j * np.maximum(first * last, 0.0) / (wavenumber * rays.spreading_rate))


class _Parts:
    """Weighted parts of the far field, summed contribution by contribution."""

    def __init__(self, geometry: FarGeometry, kinds: tuple[Boundary, ...], wavenumber: float, order: int) -> None:
        self.geometry, self.wavenumber, self.order = geometry, wavenumber, order
        self.incident = geometry.direction
        self.vector = len(kinds) == 2
        m = len(geometry.directions)
        self.creeping, self.reflected, self.forward = (
            np.zeros((m, 2, 2) if self.vector else m, dtype=complex) for _ in range(3)
        )
        self.failing_size, self.missing = np.zeros(m), np.zeros(m, dtype=bool)
        theta = geometry.angle
        m_theta = geometry.mean_root_radius * np.cbrt(wavenumber / 2) * theta
        self.in_forward = 1 - smoothstep(m_theta, *FORWARD)
        self.beyond_axis = smoothstep(m_theta, *NEAR_AXIS)
        self.in_fan = np.where(theta > np.pi / 2, smoothstep(geometry.least_merging, *MERGED), 0.0)
        self.long_rays = self.in_forward * smoothstep(theta, *LONG_RAYS)
        # of the worse polarisation
        ends = [geometry.ends.lost(geometry.directions, geometry.incidence, wavenumber, kind) for kind in kinds]
        lost, fold = np.max(ends, axis=0), geometry.fold(wavenumber)
        self.left_out = (1 - self.in_forward) * np.hypot(lost, fold)
        # ground behind the rest of the line has no wave: its share of a field that is nowhere in particular
        self.dark = geometry.unserved * geometry.typical

    def unresolved(self) -> BoolArray:
        """Directions in which an expansion fails, or something is left out, that matters there (m,)."""
        total = np.abs(self.creeping + self.reflected + self.forward)
        largest = total.max(axis=tuple(range(1, total.ndim)), initial=0.0)
        failing = np.maximum(self.failing_size, self.left_out)
        without = self.dark > DARK * largest
        return np.asarray((self.missing & (self.in_forward > 0)) | (failing > MATTERS * largest) | without)

    def error(self) -> FloatArray:
        """Size of what is left out, and of what has an expansion that fails (m,) or (m, 2, 2), L."""
        error = np.hypot(np.hypot(self.left_out, self.failing_size), self.dark)
        return np.broadcast_to(error.reshape(-1, *(1,) * (self.creeping.ndim - 1)), self.creeping.shape).copy()

    def _note_failing(self, observer: IntArray, wave: ComplexArray, failing: BoolArray) -> None:
        """Note the size of contributions (n,) whose expansion fails."""
        np.add.at(self.failing_size, observer, np.where(failing, np.abs(wave), 0.0))

    def add(self, number: int, kind: Boundary) -> None:
        """Add every part of one scalar problem."""
        g, k, order = self.geometry, self.wavenumber, self.order
        w, shed = self.in_forward, g.shed
        share = ((1 - w) * (1 - self.in_fan))[shed.observer] + np.where(g.long, self.long_rays[shed.observer], 0.0)
        wave = _weighted(share, isolated_rays(g, k, kind, order))
        # the first zero of J' is the launch point itself, where the forward lobe serves
        merged = (merging(shed.rays) > MERGED[1]) & passed_fold(g)
        self._note_failing(shed.observer, wave, merged)
        n0, n = shed.rays.first_normal, g.shed_normals
        self._sum(self.creeping, number, shed.observer, wave, n0, n)
        fan = g.fan_nodes(k, self.in_fan > 0)
        wave = _weighted(((1 - w) * self.in_fan)[fan.observer], fan_half(fan, g.directions, k, kind, order))
        self._sum(self.creeping, number, fan.observer, wave, fan.rays.first_normal, g.normals_of(fan.rays.points))
        s = g.specular
        incident = self.incident[s.observer]
        wave = reflected_amplitude(s, g.directions, incident, k, kind, order)
        if self.vector:
            # at normal incidence no polarisation is along the plane of incidence: both take the mean of their orders
            other = reflected_amplitude(s, g.directions, incident, k, CROSSED[kind][1], order)
            wave = wave - 0.5 * (1 - smoothstep(s.sine, *NORMAL)) * (wave + other)
        wave = _weighted((1 - w)[s.observer], wave)
        self._note_failing(s.observer, wave, np.abs(next_order(s, k)) > UNRESOLVED)
        self._sum(self.reflected, number, s.observer, wave, s.normals, s.normals)
        if np.any(w > 0):
            self._add_forward(number, kind)

    def _add_forward(self, number: int, kind: Boundary) -> None:
        """Add the forward lobes."""
        g, k, order, w = self.geometry, self.wavenumber, self.order, self.in_forward
        shadow, lit, missing = g.forward_nodes(k, w > 0)
        self.missing[missing] = True
        wave = shadow_half(shadow, g.directions, self.incident, k, kind, order, self.beyond_axis[shadow.observer])
        wave = _weighted(w[shadow.observer], wave)
        self._sum(
            self.forward, number, shadow.observer, wave, shadow.rays.first_normal, g.normals_of(shadow.rays.points)
        )
        wave = lit_half(lit, g.directions, self.incident, k, kind, order, self.beyond_axis[lit.observer])
        self._sum(self.forward, number, lit.observer, _weighted(w[lit.observer], wave), lit.normals, lit.normals)
        for incidence in np.unique(g.incidence[w > 0]):
            here, line = (g.incidence == incidence) & (w > 0), g.line_of(int(incidence))
            self.missing[here] |= line.fractions["occluded"] > HIDDEN
            ahead = np.flatnonzero(here & (self.beyond_axis < 1))
            wave = (w * (1 - self.beyond_axis))[ahead] * silhouette(line, g.directions[ahead], k)
            # any normal of the plane of d and r will do, and any vector across d where they are one
            aside = np.cross(line.direction, off_axis(g.directions[ahead], line.direction))
            self._sum(self.forward, number, ahead, wave, aside, aside)

    def _sum(
        self, into: ComplexArray, number: int, observer: IntArray, wave: ComplexArray, n0: FloatArray, n: FloatArray
    ) -> None:
        """Add contributions (n,) of normals n0 where they land and n where they leave (n, 3)."""
        if not self.vector:
            np.add.at(into, observer, wave)
            return
        d, r = self.incident[observer], self.geometry.directions[observer]
        spare = np.cross(n, np.eye(3)[np.argmin(np.abs(n), axis=-1)])
        spare /= np.maximum(np.linalg.norm(spare, axis=-1, keepdims=True), 1e-300)
        pair = dyads(wave_frame(n0, d, spare), wave_frame(n, r, spare), d, r)
        np.add.at(into, observer, wave[:, None, None] * pair[:, number])


def _weighted(share: FloatArray, wave: ComplexArray) -> ComplexArray:
    """Product, 0 where the share is 0 even if the wave is infinite there."""
    return np.asarray(np.where(share != 0, share * np.where(share != 0, wave, 0.0), 0.0))


def _methods(forward: FloatArray, fan: FloatArray) -> np.ndarray[Any, np.dtype[np.str_]]:
    names = []
    for w, v in zip(forward, fan, strict=True):
        used = [
            name for name, share in (("forward", w), ("rays", (1 - w) * (1 - v)), ("fan", (1 - w) * v)) if share > 0
        ]
        names.append("+".join(used))
    return np.array(names, dtype="<U16")
