"""The current of a conductor by marched waves, with beams that carry vectors where their rays merge.

    u: H along b, u_n + kappa_t u = 0,   v: dE/dn along b, E = 0
    J = sum over rays of u V - i e kappa_t1 u/(kJ) b
    J = sum of beams of u with V + M n V',   V = -h (1 + T C) p - t rho j p + (j + h t rho C) b,   V' = -h b
    error^2 = (|h| e_u)^2 + (|e| e_v/k)^2 + [A max(1, r) |u|/m^4]^2 + [B |u|/m^2]^2

with j = (i/k) e v/u, C = Du/(2 m^2 u) of creeping modes, 0 where they have ended, and the rest as in
`creeping.field.currents.conductor`; m and r = rho kappa_t in the error are of the launch point. The condition of u is
that of E along the ray, (curl H)_p = 0 on the body. The beam of u turns by M n, so that -h (p + M n b) is
(i/k) grad (h u): beside a ray that is its -e (i kappa_t1/(kJ)) u b, which grows without bound where J = 0, and the sum
does not. A stands for what both scalar problems leave out of Maxwell's, B for what passes from one to the other where
the body twists.

Sources: [C93], [P82]; Derivations, F22, F24, F26 and F31. A and B were set on a sphere, three ellipsoids, an egg and
the twisted ellipsoid.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.arguments import scales, transverse_ratios
from creeping.field.boundary import ELECTRIC_HARD, SOFT
from creeping.field.currents.conductor import amplitudes, ray_scalars, spread_of, turn_of, vectors_of
from creeping.field.marching.fan_rays import FLAT
from creeping.field.marching.fan_waves import FanWaves, fan_waves, marches, spread_out
from creeping.field.waves.beams import STRONG, beams_beside_rays, blended_sum, variation
from creeping.field.waves.ray_sums import RaySum
from creeping.field.waves.shed_wave import smoothstep
from creeping.field.waves.strip_waves import StripTable, resampled, without_tubes
from creeping.geometry.quadrature import BodyNodes, nodes_at
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays
from creeping.rays.strips import Strip

NEXT, MIXED = 0.5, 0.25
"""A and B."""
LEAST = 1e-9
"""Size of u below which v and Du are no shares of it."""


@dataclass(frozen=True, eq=False)
class MarchedWaves:
    """Marched waves of a conductor on the strips of a fan, u and v, for incident E0 (3, p): what beams are made of.

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

    @property
    def strips(self) -> tuple[Strip, ...]:
        """Strips of the fan."""
        return self.hard.strips

    @property
    def wavenumber(self) -> float:
        """K, 1/L."""
        return self.hard.wavenumber

    def at(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Y of u at places (n,) of a strip: (n,)."""
        return self.hard.at(strip, sigma, s)

    def slope(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative in s, 1/L: (n,)."""
        return self.hard.slope(strip, sigma, s)

    def lean(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """Lambda at places (n,) of a strip: (n,)."""
        return self.hard.lean(strip, sigma, s)

    def heights(self, strip: int, sigma: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """H and e (n, p) of the incident waves where rays at places (n,) of a strip begin."""
        rays, back = self._starts(strip, sigma)
        axes = np.broadcast_to(self.direction, rays.first_normal.shape)
        h, e = amplitudes(rays.first_normal, axes, self.direction, self.electric)
        return h[back], e[back]

    def components(
        self, strip: int, sigma: FloatArray, s: FloatArray, nodes: BodyNodes, p: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """V and V' (n, 3 p) of the beams at places (n,) of a strip, at nodes with tangents p (n, 3)."""
        (h, e), (rays, back) = self.heights(strip, sigma), self._starts(strip, sigma)
        b = np.cross(nodes.normals, p)
        turn = faded(nodes.curvature(p), nodes.twist(p), rays.curvature[1][back])
        u, v = self.hard.at(strip, sigma, s), self.soft.at(strip, sigma, s)
        ratio = np.where(np.abs(u) > LEAST, 1j / self.wavenumber * v / np.where(np.abs(u) > LEAST, u, 1.0), 0.0)
        V = vectors_of(p, b, h, e * ratio[:, None], np.ones(len(p)), turn, self.changing.at(strip, sigma, s))
        lean = -b[:, :, None] * h[:, None]
        return V.reshape(len(p), -1), lean.reshape(len(p), -1)

    @cached_property
    def changing(self) -> StripTable:
        """C of creeping modes, 0 where they have ended."""
        table = []
        for strip in self.strips:
            alive, ratio = strip.rays.alive, np.zeros(strip.rays.alive.shape, dtype=complex)
            hard, _, changing = ray_scalars(without_tubes(strip.rays)[alive], self.wavenumber, 2)
            ratio[alive] = np.where(np.abs(hard) > LEAST, changing / np.where(np.abs(hard) > LEAST, hard, 1.0), 0.0)
            table.append(resampled(strip, ratio, self.hard.times))
        return StripTable(self.strips, self.hard.times, table)

    def _starts(self, strip: int, sigma: FloatArray) -> tuple[RayPoints, IntArray]:
        """Where rays at places (n,) of a strip begin, each once, and which of these belongs to each place (n,)."""
        distinct, back = np.unique(sigma, return_inverse=True)
        return self.strips[strip].at(distinct, np.zeros(len(distinct))), back


def faded(curvature: FloatArray, twist: FloatArray, first: FloatArray) -> FloatArray:
    """T rho (n,), fading out as Lambda does where the body is much flatter than at the launch point, ``first``, 1/L."""
    return turn_of(curvature, twist) * smoothstep(curvature / first, 0.0, FLAT)


def current_marches(fan: RayFan, count: int, wavenumber: float) -> bool:
    """Whether both waves of a conductor can be marched, and cost little enough at ``count`` points."""
    return marches(fan, ELECTRIC_HARD, 2, 2 * count, wavenumber)


def marched_current(
    fan: RayFan,
    shed: ShedRays,
    points: FloatArray,
    normals: FloatArray,
    share: FloatArray,
    young: BoolArray,
    wavenumber: float,
    electric: ComplexArray,
) -> list[RaySum]:
    """Sums of J over the rays found (m,) at points of the body (n, 3), L, for each of incident E0 (3, p).

    ``share`` (n,) is that of the rays next to the line, of which ``young`` (m,) says which they are.
    """
    k, observer = wavenumber, shed.observer
    hard, soft = (fan_waves(fan, wavenumber=k, boundary=kind) for kind in (ELECTRIC_HARD, SOFT))
    waves = MarchedWaves(hard, soft, fan.line.direction, electric)
    J, size, part, y, slope = _on_rays(fan.body, waves, shed, points, normals)
    tube = spread_out(np.ones(len(observer), dtype=complex), shed.rays, k)
    weight = np.where(young, share[observer], 1.0)
    # an infinite wave is that of a caustic: beams serve there
    tube = np.where(np.isfinite(tube), tube, 0.0) * weight
    own = J * tube[:, None, None]
    count, waves_of = len(points), electric.shape[1]
    sums = [
        one.reshape(count, 3, waves_of)
        for one in beams_beside_rays(
            fan, waves, shed, points, own.reshape(len(own), 3 * waves_of), share, waves.components
        )
    ]
    eta, out = variation(fan, shed, y, slope, k), []
    for i in range(waves_of):
        strength = np.abs(tube) * size[:, i]
        bounded = np.minimum(strength, STRONG * size[:, i])
        beams = sums[0][:, :, i], sums[1][:, :, i]
        whole = blended_sum(fan, shed, own[:, :, i], strength, bounded, part[:, i], eta, beams, k, ELECTRIC_HARD)
        # feet of beams have tangents of their own
        tangential = whole.values - np.sum(normals * whole.values, axis=1, keepdims=True) * normals
        out.append(RaySum(tangential, whole.error, whole.status, whole.faded))
    return out


def _on_rays(
    body: Surface, waves: MarchedWaves, shed: ShedRays, points: FloatArray, normals: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray, ComplexArray, ComplexArray]:
    """J of rays found but for their tubes (m, 3, p), its size, at least |u|, its error as a share of that (m, p).

    And y and dy/dsigma of u (m,).
    """
    k, rays, count = waves.wavenumber, shed.rays, len(shed.sigma)
    y, v, slope, changing = np.zeros((4, count), dtype=complex)
    h, e = np.zeros((2, count, waves.electric.shape[1]), dtype=complex)
    off_u, off_v = np.zeros((2, count))
    for number in range(len(waves.strips)):
        mine = np.flatnonzero(shed.strip == number)
        at = number, shed.sigma[mine], rays.time[mine]
        y[mine], v[mine], slope[mine] = waves.at(*at), waves.soft.at(*at), waves.hard.across(*at)
        changing[mine] = waves.changing.at(*at)
        off_u[mine], off_v[mine] = waves.hard.error(*at), waves.soft.error(*at)
        h[mine], e[mine] = waves.heights(number, shed.sigma[mine])
    nodes = nodes_at(body, points[shed.observer], normals[shed.observer])
    p = rays.directions
    across = e * (1j / k * v - 1j / k * rays.transverse[0] * spread_of(rays, k) * y)[:, None]
    turn = faded(nodes.curvature(p), nodes.twist(p), rays.curvature[0])
    J = vectors_of(p, np.cross(nodes.normals, p), h, across, y, turn, y * changing)
    size = np.maximum(np.linalg.norm(J, axis=1), np.abs(y)[:, None])
    m, r = scales(rays, k)[0], np.abs(transverse_ratios(rays)[0])
    rest = np.abs(y) * np.hypot(NEXT * np.maximum(r, 1.0) / m**4, MIXED / m**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.sqrt(np.abs(h * off_u[:, None]) ** 2 + np.abs(e * off_v[:, None] / k) ** 2 + rest[:, None] ** 2)
        share = np.where(size > 0, error / size, 0.0)
    # without a wave there is no share of one
    return J, size, np.where(np.isfinite(off_u + off_v)[:, None], share, np.inf), y, slope
