"""Radar cross sections for STK (.rcs), pattern type MonostaticRealSparse: rho, theta and dBsm, one row a direction.

Rho is counted from z, 90 degrees less the elevation; theta is the azimuth, about z from x to y, within 180 degrees.
The format's pages do not say from which axis theta starts where rho is from z; x is taken here.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from creeping.errors import InvalidInputError
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.echo import Echo


def write_stk(path: str | os.PathLike[str], echo: Echo, channel: str, frequency: int = 0) -> None:
    """Write the backscatter of one polarisation at one frequency, on a grid of azimuth and elevation, for STK.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    echo : Echo
        Of radar cross sections; its directions are all pairs of two or more azimuths and two or more elevations.
    channel : str
        One of the echo's.
    frequency : int
        Its number among those of the echo.

    Raises
    ------
    InvalidInputError
        If the echo is none of these, or a level is not finite.
    CreepingError
        If the file cannot be written.
    """
    if echo.quantity != "rcs" or echo.incidence is not None:
        raise InvalidInputError("a .rcs file holds radar cross sections in backscatter, no target strength, no cut")
    if channel not in echo.channels or not 0 <= frequency < len(echo.wavenumbers):
        raise InvalidInputError(
            f"channel {channel!r} and frequency {frequency!r} are not among {', '.join(echo.channels)} and 0 to "
            f"{len(echo.wavenumbers) - 1}"
        )
    pairs = {(round(a, 9), round(e, 9)) for a, e in zip(echo.azimuth.tolist(), echo.elevation.tolist(), strict=True)}
    azimuths, elevations = {a for a, _ in pairs}, {e for _, e in pairs}
    if min(len(azimuths), len(elevations)) < 2 or not len(azimuths) * len(elevations) == len(pairs) == len(
        echo.azimuth
    ):
        raise InvalidInputError(
            f"a .rcs file holds a grid: {len(pairs)} directions are not all pairs of {len(azimuths)} azimuths and "
            f"{len(elevations)} elevations, two of each at least"
        )
    levels = echo.levels()[echo.channels.index(channel), :, frequency]
    if not np.all(np.isfinite(levels)):
        raise InvalidInputError(f"{np.sum(~np.isfinite(levels))} of {len(levels)} levels are not finite")
    theta = np.where(np.abs(echo.azimuth) <= 180, echo.azimuth, np.mod(echo.azimuth + 180, 360) - 180)
    rho = 90 - echo.elevation
    order = np.lexsort((theta, rho))
    head = ["stk.v.9.0", "BEGIN rcs", "RCSPatternType MonostaticRealSparse", "RhoAxis RhoFromZ", "IsBistatic no"]
    rows = (f"{rho[i]:.10g} {theta[i]:.10g} {levels[i]:.10g}" for i in order)
    lines = [*head, f"NumPoints {len(levels)}", "BEGIN rcsdata", *rows, "END rcsdata", "END rcs"]
    with written_aside(path) as aside:
        aside.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")
