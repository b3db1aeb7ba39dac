"""The current of creeping waves where their rays merge, by Gaussian beams that carry vectors.

Beams of `creeping.field.conductor.vector_waves`, whose waves are creeping modes of second order.

Sources: [P82]; Derivations, F24 and F26.
"""

from functools import cached_property

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.beams import seconds
from creeping.field.boundary import ELECTRIC_HARD
from creeping.field.conductor.vector_waves import VectorWaves
from creeping.field.currents.conductor import ray_scalars
from creeping.field.far_geometry import fan_strips
from creeping.field.strip_waves import StripTable, modes_on_strip, resampled, without_tubes
from creeping.rays.fan import RayFan
from creeping.rays.status import RayStatus

STEPS = 12.0
"""Steps a wavelength at which waves are kept along rays."""
FEWEST = 8
"""Rays of a strip from which waves are interpolated between them."""
LONGEST = 60.0
"""Seconds that beams may take."""


class ModeWaves(VectorWaves):
    """Creeping modes of a conductor."""

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

    def ratios(self, strip: int, sigma: FloatArray, s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """(i/k) v/u and Du/(2 m^2 u) at places (n,) of a strip."""
        soft, changing = (table.at(strip, sigma, s) for table in self._ratios)
        return soft, changing

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
