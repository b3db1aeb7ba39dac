"""Currents J = n x H of the whole of a perfect conductor, for both polarisations of the incident wave.

On the lit side as `creeping.field.currents.lit` says. On a creeping ray, with tangent p, b = n x p, h = H0.b
and e = E0.b at its launch point, u and v the waves "electric hard" and "electric soft" there, t = p.Kb the torsion,

    J = -(h u + h (T/(2m^2)) Du + t rho j) p + (j + h (t rho/(2m^2)) Du) b,      T = (t rho)^2, rho = 1/kappa_n
    j = e (i/k) v - e (i kappa_t1/(kJ)) u

Du is u with t under Fock's integral. The current of v flows in the direction conjugate to the ray, b - t rho p; u gives
to b by its rate along the ray, and because h, by which it starts, varies across the rays at the rate kappa_t1 e. Both
are exact on the circular cylinder and on the sphere.

Also here: the same by marched waves, for rays and for the beams that carry vectors where these merge.

    u: H along b, u_n + kappa_t u = 0,   v: dE/dn along b, E = 0
    J = sum of beams of u with V + M n V',   V = -h (1 + T C) p - t rho j p + (j + h t rho C) b,   V' = -h b
    error^2 = (|h| e_u)^2 + (|e| e_v/k)^2 + [0.5 max(1, r) |u|/m^4]^2 + [0.25 |u|/m^2]^2

with C = Du/(2 m^2 u) of creeping modes, 0 where they have ended; m and r = rho kappa_t in the error are of the launch
point. The condition of u is that of E along the ray, (curl H)_p = 0 on the body. The beam of u turns by M n, so that
-h (p + M n b) is (i/k) grad (h u): beside a ray that is its -e (i kappa_t1/(kJ)) u b, which grows without bound where
J = 0, and the sum does not. The third term of the error stands for what both scalar problems leave out of Maxwell's,
the last for what passes from one to the other where the body twists; both were set on a sphere, three ellipsoids, an
egg and the twisted ellipsoid.

Sources: [F46], [CK13, sec. 6.2]; [C93], [P82]; Derivations, F18, F22, F24, F26 and F31.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.arguments import fock_parameter, scales, transverse_ratios
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT
from creeping.field.currents.lit import STEEPEST, lit_conductor
from creeping.field.currents.nodes import LitNodes, RayNodes
from creeping.field.currents.radiation import far_of_vector, field_of_vector, received_vectors
from creeping.field.currents.whole_body import SurfaceCurrents, level_at
from creeping.field.fock import surface_function
from creeping.field.marching.fan_rays import FLAT
from creeping.field.marching.fan_waves import FanWaves, OnRays, StripTable, at_shed, resampled, without_tubes
from creeping.field.results.far_result import spherical_frame
from creeping.field.waves.shed_wave import smoothstep
from creeping.field.waves.surface import ray_factor, surface_waves
from creeping.geometry.quadrature import BodyNodes, nodes_at
from creeping.geometry.surface import Surface
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays

LEAST = 1e-9
"""Size of u below which v and Du are no shares of it."""


@dataclass(frozen=True, eq=False, repr=False)
class ConductorCurrents(SurfaceCurrents):
    """Currents n x H at nodes of a perfect conductor, (n, 3, p): components, and incident polarisations.

    Fields are (m, 2, p) far away, theta and phi scattered, and H and E (m, 3, p) near.

    Attributes
    ----------
    mix : (2, p) complex
        Components along theta and phi of each incident polarisation: those two, unless `polarised` by others.
    """

    mix: ComplexArray = field(default_factory=lambda: np.eye(2, dtype=complex))
    _factors: ClassVar[tuple[float, float]] = (2.8, 2.3)
    _levels: ClassVar[tuple[float, float, float]] = (2.3, 4.6, 2.3)

    def polarised(self, mix: ComplexArray) -> "ConductorCurrents":
        """Currents of incident waves with other components along theta and phi (2, p)."""
        if np.array_equal(mix, self.mix):
            return self
        return replace(self, values=self.values @ mix, change=self.change @ mix, mix=mix)

    @property
    def incident_electric(self) -> ComplexArray:
        """E0 of each polarisation (3, p)."""
        return np.asarray(spherical_frame(self.direction).T @ self.mix)

    def reflected_onto(self, points: FloatArray, normals: FloatArray) -> ComplexArray:
        """J that points of the body (m, 3), L, with normals, receive from above: (m, 3, p)."""
        strength = self.values * (self.weights / (4 * np.pi))[:, None, None]
        return received_vectors((points, normals), (self.points, self.normals), strength, self.wavenumber)

    def scattered_electric(self, points: FloatArray) -> ComplexArray:
        """Scattered E at points (m, 3), L, at least a quarter of a wavelength off the surface: (m, 3, p)."""
        return self._electric(self.values, points)

    @cached_property
    def left_of_each(self) -> FloatArray:
        """What is left inside of E and of H, rms, as a share of the incident wave (2, p)."""
        x = self.inner_points
        wave = np.exp(1j * self.wavenumber * (x @ self.direction))
        electric = self._electric(self.values, x) + np.multiply.outer(wave, self.incident_electric)
        return np.stack([self._at_least(self._rms(electric)), self._left])

    def total(self, points: FloatArray, dark: BoolArray) -> tuple[ComplexArray, FloatArray]:
        """Incident and scattered E and H (m, 6, p) at points (m, 3), L, some in the shadow, and their error (m, p)."""
        scattered = np.concatenate([self.scattered_electric(points), self.scattered(points)], axis=1)
        left, (lit, shadow, factor) = self.left_of_each, self._levels
        shapes = (
            self._changed(points, electric=True) / self._electric_inside,
            self._changed(points, electric=False) / self._change_inside,
        )
        level = np.stack([level_at(self, points, dark, float(mean), lit, shadow) for mean in self._amplitude], axis=1)
        each = [part * np.hypot(level, factor * shape) for part, shape in zip(left, shapes, strict=True)]
        return self.incident_at(points) + scattered, np.maximum(*each)

    def incident_at(self, points: FloatArray) -> ComplexArray:
        """E and H of the incident waves at points (m, 3), L: (m, 6, p)."""
        both = np.concatenate([self.incident_electric, self._incident])
        return np.asarray(np.multiply.outer(np.exp(1j * self.wavenumber * (points @ self.direction)), both))

    def _changed(self, points: FloatArray, *, electric: bool) -> FloatArray:
        """What the second order of the lit nodes and of the others adds, apart, in the root of squares (m, p)."""
        J = self.change * self.weights[:, None, None]
        given = points, self.wavenumber
        each = [field_of_vector(self.points[on], J[on], *given, electric=electric) for on in (self.lit, ~self.lit)]
        return np.asarray(np.sqrt(np.sum(np.abs(each) ** 2, axis=(0, 2))))

    @cached_property
    def _electric_inside(self) -> FloatArray:
        """Rms inside of what the second order adds to E, of each incident wave."""
        return self._rms(self._electric(self.change, self.inner_points))

    def _radiated(self, values: ComplexArray, part: BoolArray, directions: FloatArray) -> ComplexArray:
        strength = values[part] * self.weights[part, None, None]
        f = far_of_vector(self.points[part], strength, directions, self.wavenumber)
        return np.asarray(np.einsum("moc,mci->moi", spherical_frame(directions), f))

    def _field(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        J = values * self.weights[:, None, None]
        return field_of_vector(self.points, J, points, self.wavenumber, electric=False)

    def _electric(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        J = values * self.weights[:, None, None]
        return field_of_vector(self.points, J, points, self.wavenumber, electric=True)

    @cached_property
    def _amplitude(self) -> FloatArray:
        """Rms of |f| over all directions, L, of each incident wave."""
        forward = np.sum(np.conj(self.mix) * self.far(self.direction[None])[0], axis=0)
        return np.asarray(np.sqrt(np.abs(forward.imag) / self.wavenumber))

    @property
    def _incident(self) -> ComplexArray:
        """H0 of each polarisation (3, p)."""
        return np.cross(self.direction, self.incident_electric, axisb=0).T


def conductor_waves(lit: LitNodes, shadow: RayNodes, direction: FloatArray, k: float, order: int) -> ComplexArray:
    """J at the nodes of the lit side, then at those of the rays, for both incident polarisations (n, 3, 2)."""
    electric = np.asarray(spherical_frame(direction).T, dtype=complex)
    on_lit = lit_vectors(lit, direction, electric, k, order)
    on_rays = ray_vectors(shadow.rays, shadow.normals, shadow.twist, direction, electric, k, order, coupled=order == 2)
    return np.concatenate([on_lit, np.where(np.isfinite(on_rays), on_rays, 0.0)])


def lit_vectors(
    lit: LitNodes, direction: FloatArray, electric: ComplexArray, wavenumber: float, order: int
) -> ComplexArray:
    """J of the lit side's expansion at its nodes, for incident E0 (3, p): (n, 3, p)."""
    bright = lit_conductor(lit.ground, wavenumber, order)
    bright = bright * np.exp(1j * wavenumber * (lit.points @ direction))[:, None, None]
    h, e = amplitudes(lit.normals, lit.axes, direction, electric)
    b = np.cross(lit.normals, lit.axes)
    rows = bright[:, :, :1] * h[:, None] + bright[:, :, 1:] * e[:, None]
    return np.asarray(lit.axes[:, :, None] * rows[:, :1] + b[:, :, None] * rows[:, 1:])


def amplitudes(
    normals: FloatArray, axes: FloatArray, direction: FloatArray, electric: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """h = H0.b and e = E0.b (n, p) of incident waves E0 (3, p), b = n x a."""
    b = np.cross(normals, axes)
    return np.asarray(b @ np.cross(direction, electric, axisb=0).T), np.asarray(b @ electric)


def ray_vectors(
    rays: RayPoints,
    normals: FloatArray,
    twist: FloatArray,
    direction: FloatArray,
    electric: ComplexArray,
    wavenumber: float,
    order: int,
    *,
    coupled: bool = True,
) -> ComplexArray:
    """J of creeping rays (n,) at points with these normals and torsions, for incident E0 (3, p): (n, 3, p).

    It is not finite on their caustics. ``order`` is that of u and v; what either gives to the other polarisation is of
    second order itself.
    """
    k, p = wavenumber, rays.directions
    axes = np.broadcast_to(direction, rays.first_normal.shape)
    h, e = amplitudes(rays.first_normal, axes, direction, electric)
    hard, soft, changing = ray_scalars(rays, k, order)
    across, turn = e * soft[:, None], np.zeros(hard.shape)
    if coupled:
        turn = turn_of(rays.curvature[1], twist)
        across = across - e * (1j / k * rays.transverse[0] * spread_of(rays, k) * hard)[:, None]
    return vectors_of(p, np.cross(normals, p), h, across, hard, turn, changing)


def ray_scalars(rays: RayPoints, wavenumber: float, order: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Waves u, (i/k) v and Du/(2m^2) of rays (...); the last one is of second order."""
    hard = surface_waves(rays, wavenumber, ELECTRIC_HARD, order)
    soft = 1j / wavenumber * surface_waves(rays, wavenumber, ELECTRIC_SOFT, order)
    changing = np.zeros_like(hard)
    if order == 2:
        m = scales(rays, wavenumber)[1]
        # where a ray has ended there is no wave to change
        rate = surface_function(np.where(rays.alive, fock_parameter(rays, wavenumber), 0.0), 0.0, 1)
        changing = np.where(rays.alive, rate * ray_factor(rays, wavenumber) / (2 * m**2), 0.0)
    return hard, soft, changing


def spread_of(rays: RayPoints, wavenumber: float) -> FloatArray:
    """1/J (...), bounded where rays cross: J is known to be no narrower than the boundary layer there."""
    m = scales(rays, wavenumber)[1]
    return np.asarray(rays.spreading / (rays.spreading**2 + 1 / m**4))


def turn_of(curvature: FloatArray, twist: FloatArray) -> FloatArray:
    """t rho (...), bounded, of kappa_n and t, 1/L."""
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.clip(twist / curvature, -STEEPEST, STEEPEST)
    return np.asarray(np.nan_to_num(turn))


def vectors_of(
    p: FloatArray,
    b: FloatArray,
    h: ComplexArray,
    across: ComplexArray,
    hard: ComplexArray | FloatArray,
    turn: FloatArray,
    changing: ComplexArray,
) -> ComplexArray:
    """J (n, 3, p) along p and b (n, 3), of h and j = ``across`` (n, p) and u, t rho and Du/(2m^2) (n,)."""
    along = -h * (hard + turn**2 * changing)[:, None] - turn[:, None] * across
    across = across + h * (turn * changing)[:, None]
    return np.asarray(p[:, :, None] * along[:, None] + b[:, :, None] * across[:, None])


@dataclass(frozen=True, eq=False)
class ConductorWaves:
    """Marched waves of a conductor on the strips of a fan, u and v, for incident E0 (3, p).

    Attributes
    ----------
    hard, soft : FanWaves
        u and v.
    direction : (3,)
    electric : (3, p) complex
    """

    hard: FanWaves
    soft: FanWaves
    direction: FloatArray
    electric: ComplexArray

    def on_rays(self, body: Surface, shed: ShedRays, points: FloatArray, normals: FloatArray) -> OnRays:
        """J of the rays found at points of the body (n, 3), L, with these normals."""
        k, rays = self.hard.wavenumber, shed.rays
        hard, soft, changing = self.hard, self.soft, self.changing
        of = hard.at, soft.at, changing.at, hard.error, soft.error, self._heights
        y, v, change, off_u, off_v, both = at_shed(shed, len(hard.strips), *of)
        h, e = both[:, 0], both[:, 1]
        nodes = nodes_at(body, points[shed.observer], normals[shed.observer])
        p = rays.directions
        across = e * (1j / k * v - 1j / k * rays.transverse[0] * spread_of(rays, k) * y)[:, None]
        turn = faded(nodes.curvature(p), nodes.twist(p), rays.curvature[0])
        J = vectors_of(p, np.cross(nodes.normals, p), h, across, y, turn, y * change)
        size = np.maximum(np.linalg.norm(J, axis=1), np.abs(y)[:, None])
        m, r = scales(rays, k)[0], np.abs(transverse_ratios(rays)[0])
        rest = np.abs(y) * np.hypot(0.5 * np.maximum(r, 1.0) / m**4, 0.25 / m**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.sqrt(np.abs(h * off_u[:, None]) ** 2 + np.abs(e * off_v[:, None] / k) ** 2 + rest[:, None] ** 2)
            share = np.where(size > 0, error / size, 0.0)
        # without a wave there is no share of one
        return OnRays(J, size, np.where(np.isfinite(off_u + off_v)[:, None], share, np.inf))

    def components(
        self, strip: int, sigma: FloatArray, s: FloatArray, nodes: BodyNodes, p: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """V and V' (n, 3 p) of the beams at places (n,) of a strip, at nodes with tangents p (n, 3)."""
        (h, e), (rays, back) = np.moveaxis(self._heights(strip, sigma, s), 1, 0), self._starts(strip, sigma)
        b = np.cross(nodes.normals, p)
        turn = faded(nodes.curvature(p), nodes.twist(p), rays.curvature[1][back])
        u, v = self.hard.at(strip, sigma, s), self.soft.at(strip, sigma, s)
        there = np.abs(u) > LEAST
        ratio = np.where(there, 1j / self.hard.wavenumber * v / np.where(there, u, 1.0), 0.0)
        V = vectors_of(p, b, h, e * ratio[:, None], np.ones(len(p)), turn, self.changing.at(strip, sigma, s))
        lean = -b[:, :, None] * h[:, None]
        return V.reshape(len(p), -1), lean.reshape(len(p), -1)

    @cached_property
    def changing(self) -> StripTable:
        """Du/(2m^2 u) of creeping modes, 0 where they have ended."""
        strips, times, table = self.hard.strips, self.hard.times, []
        for strip in strips:
            alive, ratio = strip.rays.alive, np.zeros(strip.rays.alive.shape, dtype=complex)
            hard, _, changing = ray_scalars(without_tubes(strip.rays)[alive], self.hard.wavenumber, 2)
            ratio[alive] = np.where(np.abs(hard) > LEAST, changing / np.where(np.abs(hard) > LEAST, hard, 1.0), 0.0)
            table.append(resampled(strip, ratio, times))
        return StripTable(strips, times, table)

    def _heights(self, strip: int, sigma: FloatArray, _: FloatArray) -> ComplexArray:
        """h and e of the incident waves where rays at places (n,) of a strip begin: (n, 2, p)."""
        rays, back = self._starts(strip, sigma)
        axes = np.broadcast_to(self.direction, rays.first_normal.shape)
        return np.stack(amplitudes(rays.first_normal, axes, self.direction, self.electric), axis=1)[back]

    def _starts(self, strip: int, sigma: FloatArray) -> tuple[RayPoints, IntArray]:
        """Where rays at places (n,) of a strip begin, each once, and which of these belongs to each place (n,)."""
        distinct, back = np.unique(sigma, return_inverse=True)
        return self.hard.strips[strip].at(distinct, np.zeros(len(distinct))), back


def faded(curvature: FloatArray, twist: FloatArray, first: FloatArray) -> FloatArray:
    """t rho (n,), fading out as Lambda does where the body is much flatter than at the launch point, ``first``, 1/L."""
    return turn_of(curvature, twist) * smoothstep(curvature / first, 0.0, FLAT)
