"""The current of creeping waves where their rays merge, by Gaussian beams that carry vectors.

    J = sum of beams of u with V + M n V',   V = -h (1 + T C) p - t rho j p + (j + h t rho C) b,   V' = -h b

u is the wave "electric hard", j = e v/u (i/k) and C = Du/(2 m^2 u) as in `creeping.field.currents.conductor`. The beam
of u turns by M n, so that -h (p + M n b) is (i/k) grad (h u): beside a ray that is its -e (i kappa_t1/(kJ)) u b, which
grows without bound where J = 0, and the sum does not.

Sources: [P82]; Derivations, F24 and F26.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.beams import seconds
from creeping.field.boundary import ELECTRIC_HARD
from creeping.field.currents.conductor import amplitudes, ray_scalars, turn_of, vectors_of
from creeping.field.far_geometry import fan_strips
from creeping.field.strip_waves import StripTable, modes_on_strip, resampled, without_tubes
from creeping.geometry.quadrature import BodyNodes
from creeping.rays.fan import RayFan
from creeping.rays.status import RayStatus
from creeping.rays.strips import Strip

STEPS = 12.0
"""Steps a wavelength at which waves are kept along rays."""
FEWEST = 8
"""Rays of a strip from which waves are interpolated between them."""
LONGEST = 60.0
"""Seconds that beams may take."""


@dataclass(frozen=True, eq=False)
class ModeWaves:
    """Creeping modes of a conductor on the strips of a fan, for incident E0 (3, p): what beams are made of.

    Attributes
    ----------
    strips : tuple of Strip
    times : (steps,), L
    wavenumber : float, 1/L
    direction : (3,)
    electric : (3, p) complex
    """

    strips: tuple[Strip, ...]
    times: FloatArray
    wavenumber: float
    direction: FloatArray
    electric: ComplexArray

    def at(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Y of u at places (n,) of a strip: (n,)."""
        return self._hard.at(strip, sigma, s)

    def slope(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative in s, 1/L: (n,)."""
        return self._hard.at(strip, sigma, s, ds=1)

    def across(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative in sigma, 1/L: (n,)."""
        return self._hard.at(strip, sigma, s, dsigma=1)

    def lean(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """0 (n,): modes know nothing of what varies across their rays."""
        return np.zeros(sigma.shape)

    def components(
        self, strip: int, sigma: FloatArray, s: FloatArray, nodes: BodyNodes, p: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """V and V' (n, 3 p) of the beams at places (n,) of a strip, at nodes with tangents p (n, 3)."""
        own = self.strips[strip]
        starts, back = np.unique(sigma, return_inverse=True)
        first = own.at(starts, np.zeros(len(starts))).first_normal
        axes = np.broadcast_to(self.direction, first.shape)
        h, e = (v[back] for v in amplitudes(first, axes, self.direction, self.electric))
        b = np.cross(nodes.normals, p)
        turn = turn_of(nodes.curvature(p), nodes.twist(p))
        soft, changing = (table.at(strip, sigma, s) for table in self._ratios)
        V = vectors_of(p, b, h, e * soft[:, None], np.ones(len(p)), turn, changing)
        lean = -b[:, :, None] * h[:, None]
        return V.reshape(len(p), -1), lean.reshape(len(p), -1)

    @cached_property
    def _hard(self) -> StripTable:
        found = [modes_on_strip(strip, self.times, self.wavenumber, ELECTRIC_HARD)[0] for strip in self.strips]
        return StripTable(self.strips, self.times, found)

    @cached_property
    def _ratios(self) -> tuple[StripTable, StripTable]:
        """(i/k) v/u and Du/(2 m^2 u) on the strips' rays."""
        tables: tuple[list[ComplexArray], list[ComplexArray]] = ([], [])
        for strip in self.strips:
            hard, soft, changing = ray_scalars(without_tubes(strip.rays), self.wavenumber, 2)
            for table, wave in zip(tables, (soft, changing), strict=True):
                with np.errstate(divide="ignore", invalid="ignore"):
                    ratio = np.where(np.abs(hard) > 0, wave / hard, 0.0)
                table.append(resampled(strip, ratio, self.times))
        soft_table, changing_table = (StripTable(self.strips, self.times, table) for table in tables)
        return soft_table, changing_table


def mode_waves_of(fan: RayFan, wavenumber: float, electric: ComplexArray) -> ModeWaves:
    """Creeping modes of a conductor on a fan."""
    count = max(64, int(np.ceil(STEPS * fan.length * wavenumber / (2 * np.pi))))
    times = np.linspace(0.0, fan.length, count + 1)
    return ModeWaves(fan_strips(fan), times, wavenumber, fan.line.direction, electric)


def beams_serve(fan: RayFan, count: int, wavenumber: float) -> bool:
    """Whether beams can be made of a fan's modes, and cost little enough at ``count`` points."""
    strips = fan_strips(fan)
    return (
        len(strips) > 0
        and sum(len(strip.positions) for strip in strips) == len(fan.status)
        and min(len(strip.positions) for strip in strips) >= FEWEST
        and bool(np.all(fan.status == RayStatus.OK))
        and seconds(fan, strips, wavenumber, count) < LONGEST
    )
