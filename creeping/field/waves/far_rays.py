"""The far field assembled from isolated rays, u_s ~ f(r) e^{ikR}/R, uniform across the caustics that we know of.

    f = w F + (1 - w) [(1 - v) f_rays + v f_fan + f_reflected] + w W(θ; 4°, 12°) f_rays, long ones only

with θ the angle from d, m̄ the mean of m over the shadow line and W a smooth step,

    w = 1 - W(m̄ θ; 0.55, 0.85)                  F the forward lobe (`creeping.field.waves.forward`)
    v = W(min χ; 0.38, 0.52) for θ > 90°      χ = |J|/(|J| + ρ|J'|) over crossings of the horizon with p.r > 0.9
    f_rays = Σ -√(m1 m2) √(2/k) P |J'|^(-1/2) e^{-iπN/2} e^{ik(d.x0 + s - r.x)}   all rays with p = r

Its error adds in squares what is left out (`creeping.field.waves.likely_cells`, `creeping.field.waves.far_geometry`)
and what is beyond the second order of each ray, 3 |f2 - f1|^2/|f2|, of a specular point 3 T^2 |f|
(`creeping.field.waves.reflected`), of the forward lobe 2 |f2 - f1| and 0.1 |F|/m̄^4.

Also here: the far field of many incidences as sums over sheets: rays and specular points that move with the incidence.

    f_c = sum over sheets of a_c exp(i k_c L)

A sheet is a ray shed towards an observer, or a specular point; its path L and its amplitudes a_c, one of each problem c
(a boundary, its component and a wavenumber), are smooth functions of the incidence where the field itself oscillates.

Sources: [LK59], [P79]; Derivations, F3, F10, F13 to F15 and F23. The thresholds of W and these factors were set by
trial.
"""

from typing import ClassVar, NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.arguments import scales
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.results.far_result import FarField, dyads, wave_frame
from creeping.field.waves.far_geometry import FarGeometry, merging, off_axis
from creeping.field.waves.forward import fan_half, lit_half, shadow_half, silhouette
from creeping.field.waves.ray_sums import CROSSED, gradient_coupling, held_coupling, strong_coupling, turning
from creeping.field.waves.reflected import (
    NORMAL,
    polarisation_terms,
    reflected_amplitude,
    reflected_error,
    series_fails,
)
from creeping.field.waves.shed_wave import shed_orders, smoothstep
from creeping.geometry.surface import size
from creeping.rays.quantities import RayPoints
from creeping.rays.specular import SpecularPoints

MATTERS = 0.05
"""Share of the field from which a contribution whose expansion fails makes a direction unresolved."""
THIRD = 3.0
"""Third order over the square of the second, each beside the first."""
MERGED = (0.38, 0.52)
"""χ between which the fan integral replaces isolated rays."""


def field_of(geometry: FarGeometry, k: float, boundary: BoundaryLike, order: int) -> FarField:
    """Far field of a geometry, one row for each observer of each incidence."""
    return parts_of(geometry, k, boundary, order).field(boundary)


def parts_of(geometry: FarGeometry, k: float, boundary: BoundaryLike, order: int) -> "Parts":
    """What `field_of` is the sum of."""
    kinds = scalar_boundaries(boundary)
    parts = Parts(geometry, kinds, k, order)
    for number, kind in enumerate(kinds):
        parts.add(number, kind)
    return parts


def isolated_rays(geometry: FarGeometry, wavenumber: float, boundary: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Contribution of each ray shed towards an observer (n,), L, in both orders; infinite where J' = 0."""
    rays = geometry.shed.rays
    m1, m2 = scales(rays, wavenumber)
    phase = wavenumber * rays.departing - 0.5 * np.pi * rays.far_caustics
    first, second = shed_orders(rays, wavenumber, boundary)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if boundary in CROSSED:
            sign, other = CROSSED[boundary]
            held = held_coupling(gradient_coupling(rays, wavenumber))
            second = second + sign * held * shed_orders(rays, wavenumber, other)[1]
        amplitude = np.sqrt(2 * m1 * m2 / wavenumber / held_rate(rays, m2, passed_fold(geometry)))
        turned, there = -amplitude * np.exp(1j * phase), (amplitude > 0) & rays.alive & geometry.leaves
        first, second = (np.where(there, turned * wave, 0.0) for wave in (first, second))
    return first, second


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


class Parts:
    """Weighted parts of the far field, summed contribution by contribution, and the squares of what each may be off."""

    names: ClassVar[tuple[str, ...]] = ("creeping", "reflected", "forward")

    def __init__(self, geometry: FarGeometry, kinds: tuple[Boundary, ...], wavenumber: float, order: int) -> None:
        self._begin(geometry, kinds, wavenumber, order)
        theta = geometry.angle
        m_theta = geometry.mean_root_radius * np.cbrt(wavenumber / 2) * theta
        self.missing = np.zeros(len(theta), dtype=bool)
        # where the silhouette has given way to the poles
        self.beyond_axis = smoothstep(m_theta, 0.3, 0.45)
        self.in_fan = np.where(theta > np.pi / 2, smoothstep(geometry.least_merging, *MERGED), 0.0)
        self.long_rays = self.in_forward * smoothstep(theta, np.radians(4.0), np.radians(12.0))
        self.left_out = (1 - self.in_forward) * np.hypot(self.ended, geometry.fold(wavenumber))
        # ground behind the rest of the line has no wave: its share of a field that is nowhere in particular
        self.dark = geometry.unserved * geometry.typical

    def _begin(self, geometry: FarGeometry, kinds: tuple[Boundary, ...], wavenumber: float, order: int) -> None:
        """What all parts have in common."""
        self.geometry, self.wavenumber, self.order = geometry, wavenumber, order
        self.incident, self.vector = geometry.direction, len(kinds) == 2
        # some terms of an impedance's second order are left out
        self.unsure = 1.5 if kinds[0].kind == "impedance" else 1.0
        m = len(geometry.directions)
        self.creeping, self.reflected, self.forward = (self._zeros() for _ in range(3))
        self.doubt, self.sizes, self.failing_size = self._zeros().real, np.zeros(m), np.zeros(m)
        m_theta = geometry.mean_root_radius * np.cbrt(wavenumber / 2) * geometry.angle
        self.in_forward = 1 - smoothstep(m_theta, 0.55, 0.85)
        # of the worse polarisation
        ends = [geometry.ends.lost(geometry.directions, geometry.incidence, wavenumber, kind) for kind in kinds]
        self.ended: FloatArray = np.max(ends, axis=0)
        self.left_out, self.dark = np.zeros(m), np.zeros(m)
        # of the shed rays and of the specular points of the geometry, one of each for each polarisation
        self.shed_waves: list[ComplexArray] = []
        self.specular_waves: list[ComplexArray] = []

    def _zeros(self) -> ComplexArray:
        m = len(self.geometry.directions)
        return np.zeros((m, 2, 2) if self.vector else m, dtype=complex)

    def field(self, boundary: BoundaryLike) -> FarField:
        """The far field of all parts."""
        parts = {name: getattr(self, name) for name in self.names}
        return FarField(
            directions=self.geometry.directions.copy(),
            total=np.asarray(sum(parts.values())),
            parts=parts,
            method=self.methods(),
            unresolved=self.unresolved(),
            error=self.error(),
            error_by="order",
            wavenumber=self.wavenumber,
            boundary=boundary_name(boundary),
            order=self.order,
        )

    def methods(self) -> np.ndarray[Any, np.dtype[np.str_]]:
        """What serves in each direction (m,)."""
        return _methods(self.in_forward, self.in_fan)

    def unresolved(self) -> BoolArray:
        """Directions in which an expansion fails, or something is left out, that matters there (m,)."""
        total = np.abs(self.creeping + self.reflected + self.forward)
        largest = total.max(axis=tuple(range(1, total.ndim)), initial=0.0)
        failing = np.maximum(self.failing_size, self.left_out)
        without = ~(self.dark <= 0.5 * largest)
        # contributions may cancel: a deep null is none the worse for it; of a conductor two come for every wave
        vague = ~(_sizes(self.error()) <= 0.5 * self.sizes / np.sqrt(2 if self.vector else 1))
        # up to k ρ of 4 it is the expansion that fails, not one of its waves
        without |= vague & (self.geometry.mean_root_radius * np.cbrt(self.wavenumber / 2) < 1.3)
        return np.asarray((self.missing & (self.in_forward > 0)) | ~(failing <= MATTERS * largest) | without)

    def error(self) -> FloatArray:
        """Size of what is left out, what has an expansion that fails, and what is beyond both orders, L."""
        error = np.hypot(np.hypot(self.left_out, self.failing_size), self.dark)
        g, more = self.geometry, (1,) * (self.creeping.ndim - 1)
        # where most of the forward lobe is one sum over the rim, its error falls like that of Fock's currents
        scale = (g.mean_root_radius * np.cbrt(self.wavenumber / 2)).reshape(-1, *more)
        ahead = self.unsure * 0.1 * np.abs(self.forward) / scale**4
        error = np.hypot(error.reshape(-1, *more), np.hypot(np.sqrt(self.doubt), ahead))
        return np.asarray(np.where(np.isfinite(error), error, np.nan))

    def add(self, number: int, kind: Boundary) -> None:
        """Add every part of one scalar problem."""
        g, w, shed = self.geometry, self.in_forward, self.geometry.shed
        share = ((1 - w) * (1 - self.in_fan))[shed.observer] + np.where(g.long, self.long_rays[shed.observer], 0.0)
        self._add_rays(number, kind, share)
        if np.any(self.in_fan > 0):
            self._add_fan(number, kind)
        self._add_specular(number, kind, g.specular, (1 - w)[g.specular.observer])
        if np.any(w > 0):
            self._add_forward(number, kind)

    def _add_rays(self, number: int, kind: Boundary, share: FloatArray) -> None:
        """Add isolated rays (n,), each by a share."""
        g, shed = self.geometry, self.geometry.shed
        first, second = (_weighted(share, wave) for wave in isolated_rays(g, self.wavenumber, kind))
        # the first zero of J' is the launch point itself, where the forward lobe serves
        merged = (merging(shed.rays) > MERGED[1]) & passed_fold(g)
        merged |= strong_coupling(shed.rays, self.wavenumber, kind)
        normals = shed.rays.first_normal, g.shed_normals
        wave = second if self.order == 2 else first
        off = beyond(np.abs(second - first), wave, self.order, self.unsure)
        if self.vector:
            # what may pass from creeping waves of one polarisation into the other on their way
            passing = np.nan_to_num(turning(shed.rays, self.wavenumber) * np.abs(wave))
            np.add.at(self.doubt, shed.observer, passing[:, None, None] ** 2)
        each, doubts = (self._each(number, shed.observer, one, *normals) for one in (wave, off))
        self._add_apart(self.creeping, shed.observer, each, doubts, merged)

    def _add_fan(self, number: int, kind: Boundary) -> None:
        g, k = self.geometry, self.wavenumber
        nodes = g.fan_nodes(k, self.in_fan > 0)
        share = ((1 - self.in_forward) * self.in_fan)[nodes.observer]
        normals = nodes.rays.first_normal, g.normals_of(nodes.rays.points)
        waves = fan_half(nodes, g.directions, k, kind)
        sums = [self._summed(number, nodes.observer, _weighted(share, wave), *normals) for wave in waves]
        self._add_whole(self.creeping, *sums)

    def _add_specular(self, number: int, kind: Boundary, s: SpecularPoints, share: FloatArray) -> None:
        """Add specular points (n,), each by a share (n,)."""
        g, k = self.geometry, self.wavenumber
        incident = self.incident[s.observer]
        wave = reflected_amplitude(s, g.directions, incident, k, kind, self.order)
        crossed: ComplexArray | None = None
        if self.vector:
            # at normal incidence no polarisation is along the plane of incidence: both take the mean of their orders
            sign, other = CROSSED[kind]
            mean = reflected_amplitude(s, g.directions, incident, k, other, self.order)
            wave = wave - 0.5 * (1 - smoothstep(s.sine, *NORMAL)) * (wave + mean)
            if self.order == 2:
                own, turned = polarisation_terms(s, k)
                wave, crossed = (1 + sign * own) * wave, _weighted(share, -turned * wave)
        off = share * reflected_error(s, wave, k, self.order, THIRD * self.unsure)
        wave = _weighted(share, wave)
        failing = series_fails(s, k, conductor=self.vector)
        each, doubts = (self._reflected(number, s, one) for one in (wave, off))
        if crossed is not None:
            each = each + self._reflected(number, s, crossed, turned=True)
        self._add_apart(self.reflected, s.observer, each, doubts, failing)

    def _reflected(
        self, number: int, s: SpecularPoints, wave: ComplexArray | FloatArray, *, turned: bool = False
    ) -> ComplexArray:
        """Waves (n,) of specular points as they are summed, of a conductor those that come ``turned`` out as well."""
        if not self.vector:
            return np.asarray(wave, dtype=complex)
        d, r = self.incident[s.observer], self.geometry.directions[s.observer]
        b = np.cross(s.normals, s.plane)
        before, after = (np.stack([b, np.cross(b, way)], axis=-2) for way in (d, r))
        pair = dyads(before, after[:, ::-1] if turned else after, d, r)[:, number]
        return np.asarray(np.asarray(wave)[:, None, None] * pair)

    def _add_forward(self, number: int, kind: Boundary) -> None:
        """Add the forward lobes."""
        g, k, w = self.geometry, self.wavenumber, self.in_forward
        shadow, lit, missing = g.forward_nodes(k, w > 0)
        self.missing[missing] = True
        normals = shadow.rays.first_normal, g.normals_of(shadow.rays.points)
        sums = []
        for order in (1, 2):
            dark = shadow_half(shadow, g.directions, self.incident, k, kind, order, self.beyond_axis[shadow.observer])
            bright = lit_half(lit, g.directions, self.incident, k, kind, order, self.beyond_axis[lit.observer])
            one = self._summed(number, shadow.observer, _weighted(w[shadow.observer], dark), *normals)
            two = self._summed(number, lit.observer, _weighted(w[lit.observer], bright), lit.normals, lit.normals)
            sums.append(one + two)
        self._add_whole(self.forward, *sums, sharp=False)
        for incidence in np.unique(g.incidence[w > 0]):
            here, line = (g.incidence == incidence) & (w > 0), g.line_of(int(incidence))
            self.missing[here] |= line.fractions["occluded"] > 0.01
            ahead = np.flatnonzero(here & (self.beyond_axis < 1))
            wave = (w * (1 - self.beyond_axis))[ahead] * silhouette(line, g.directions[ahead], k)
            # any normal of the plane of d and r will do, and any vector across d where they are one
            aside = np.cross(line.direction, off_axis(g.directions[ahead], line.direction))
            lobe = self._summed(number, ahead, np.asarray(wave), aside, aside)
            self.forward += lobe
            self.sizes += _sizes(lobe)

    def _add_apart(
        self, into: ComplexArray, observer: IntArray, each: ComplexArray, off: ComplexArray, failing: BoolArray
    ) -> None:
        """Add contributions (n, ...) that err apart, by ``off``; those whose expansion fails are noted."""
        np.add.at(into, observer, each)
        (self.shed_waves if into is self.creeping else self.specular_waves).append(each)
        np.add.at(self.doubt, observer, np.abs(off) ** 2)
        sizes = _sizes(each)
        np.add.at(self.sizes, observer, sizes)
        np.add.at(self.failing_size, observer, np.where(failing, sizes, 0.0))

    def _add_whole(self, into: ComplexArray, first: ComplexArray, second: ComplexArray, *, sharp: bool = True) -> None:
        """Add an integral of both orders (m, ...), which errs as one; unless ``sharp`` by what the second adds."""
        wave = second if self.order == 2 else first
        into += wave
        self.sizes += _sizes(wave)
        change = np.abs(second - first)
        self.doubt += np.asarray(beyond(change, wave, self.order, self.unsure) if sharp else 2 * change) ** 2

    def _summed(
        self,
        number: int,
        observer: IntArray,
        wave: ComplexArray | FloatArray,
        n0: FloatArray,
        n: FloatArray,
    ) -> ComplexArray:
        """Sums (m, ...) of contributions (n,)."""
        out, each = self._zeros(), self._each(number, observer, wave, n0, n)
        np.add.at(out, observer, each)
        return out

    def _each(
        self, number: int, observer: IntArray, wave: ComplexArray | FloatArray, n0: FloatArray, n: FloatArray
    ) -> ComplexArray:
        """Contributions (n,) as they are summed: (n,), or (n, 2, 2) of a conductor."""
        if not self.vector:
            return np.asarray(wave, dtype=complex)
        d, r = self.incident[observer], self.geometry.directions[observer]
        spare = np.cross(n, np.eye(3)[np.argmin(np.abs(n), axis=-1)])
        spare /= np.maximum(np.linalg.norm(spare, axis=-1, keepdims=True), 1e-300)
        pair = dyads(wave_frame(n0, d, spare), wave_frame(n, r, spare), d, r)[:, number]
        return np.asarray(np.asarray(wave)[:, None, None] * pair)


def beyond(change: FloatArray, wave: ComplexArray, order: int, unsure: float = 1.0) -> FloatArray:
    """Size of what is beyond an order, from what the second adds to the first: (...), as ``wave``.

    Of the first order that is the second itself; of the second, as in a geometric series, change^2/|wave|, some times.

    Examples
    --------
    >>> beyond(np.array([0.1, 3.0]), np.array([1.0, 1.0]), 2).round(3).tolist()
    [0.03, 3.0]
    """
    if order == 1:
        return change
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(np.fmin(change, unsure * THIRD * change * (change / np.abs(wave))))


def _sizes(waves: ComplexArray | FloatArray) -> FloatArray:
    """Sizes (n,) of waves (n, ...), of all polarisations."""
    return np.asarray(np.sqrt(np.sum(np.abs(waves) ** 2, axis=tuple(range(1, waves.ndim)))))


def _weighted(share: FloatArray, wave: ComplexArray) -> ComplexArray:
    """Product, 0 where the share is 0 even if the wave is infinite there."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(share != 0, share * np.where(share != 0, wave, 0.0), 0.0))


def _methods(forward: FloatArray, fan: FloatArray) -> np.ndarray[Any, np.dtype[np.str_]]:
    names = []
    for w, v in zip(forward, fan, strict=True):
        used = [
            name for name, share in (("forward", w), ("rays", (1 - w) * (1 - v)), ("fan", (1 - w) * v)) if share > 0
        ]
        names.append("+".join(used))
    return np.array(names, dtype="<U16")


class Sheets(NamedTuple):
    """Sheets of incidences with their observers.

    Attributes
    ----------
    observer : (n,) of int
        Row of the observer, ascending; those of one incidence follow each other.
    creeping : (n,) of bool
        Whether it is a shed ray, else a specular point.
    key : (n, 4)
        Where the ray leaves, and its time, in body sizes: what tells neighbours.
    path : (n,), L
        L.
    amplitudes : (n, problems), L
        Complex.
    """

    observer: IntArray
    creeping: BoolArray
    key: FloatArray
    path: FloatArray
    amplitudes: ComplexArray


def sheets_of(geometry: FarGeometry, parts: list[Parts]) -> Sheets:
    """Sheets of a geometry with the amplitudes of all its problems, one component after the other of each."""
    shed, specular = geometry.shed, geometry.specular
    rays, length = shed.rays, size(geometry.body)
    points = specular.points
    path = np.concatenate([rays.departing, specular.path(geometry.direction[specular.observer], geometry.directions)])
    key = np.concatenate(
        [
            np.concatenate([rays.points, rays.time[:, None]], axis=1),
            np.concatenate([points, np.zeros((len(points), 1))], axis=1),
        ]
    )
    waves = np.concatenate(
        [
            np.concatenate([_columns(one.shed_waves, len(shed.observer), _width(one)) for one in parts], axis=1),
            np.concatenate([_columns(one.specular_waves, len(points), _width(one)) for one in parts], axis=1),
        ]
    )
    numbers = np.concatenate([np.full(_width(one), one.wavenumber) for one in parts])
    with np.errstate(invalid="ignore"):
        amplitudes = waves * np.exp(-1j * numbers * path[:, None])
    observer = np.concatenate([shed.observer, specular.observer])
    creeping = np.arange(len(observer)) < len(shed.observer)
    # what has come to its end, or is hidden, is not there
    there = np.flatnonzero(np.any(amplitudes != 0, axis=1))
    order = there[np.argsort(observer[there], kind="stable")]
    return Sheets(observer[order], creeping[order], key[order] / length, path[order], amplitudes[order])


def isolated(geometry: FarGeometry, parts: list[Parts]) -> BoolArray:
    """Whether the field of each observer is that of its sheets alone, without integrals, in all problems (m,)."""
    alone = np.ones(len(geometry.directions), dtype=bool)
    for one in parts:
        alone &= (one.in_forward == 0) & (one.in_fan == 0)
    return alone


def _width(parts: Parts) -> int:
    return 4 if parts.vector else 1


def _columns(waves: list[ComplexArray], count: int, width: int) -> ComplexArray:
    """Contributions of both polarisations of a conductor, or of the one scalar problem, as columns (count, width)."""
    return np.asarray(np.sum(waves, axis=0, dtype=complex).reshape(count, width))
