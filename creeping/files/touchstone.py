"""Couplings of ports over frequency as a Touchstone file, for programs that read N-port data.

    h_ij = 2 pi r0 u_ij,   u of a source e^{ikr}/(4 pi r) on the body

the field at port i of a source at port j, in units of what that source gives at a distance r0 along a hard plane, that
is 1/(2 pi r0). It is written as S_ij: a transfer ratio without unit, not a scattering parameter: nothing is known
of what ports reflect, S_ii is 0, and columns are not bounded by 1. Numbers are conjugated, for e^{+jwt}.

Also here: radar cross sections for STK (.rcs), pattern type MonostaticRealSparse: rho, theta and dBsm, one row a
direction.

Rho is counted from z, 90 degrees less the elevation; theta is the azimuth, about z from x to y, within 180 degrees.
The format's pages do not say from which axis theta starts where rho is from z; x is taken here.

Sources: Derivations, F25.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import ComplexArray
from creeping.errors import InvalidInputError
from creeping.field.frequency import frequency
from creeping.field.ports.coupling_result import Coupling
from creeping.geometry.arguments import positive_number
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.echo import Echo

ACROSS = 4
"""Pairs of numbers on a line, as the format asks for."""


def write_touchstone(
    path: str | os.PathLike[str],
    couplings: Sequence[Coupling],
    *,
    reference_distance: float,
    sound_speed: float | None = None,
) -> None:
    """Write couplings of the same ports at ascending wavenumbers as Touchstone, version 1.

    Parameters
    ----------
    path : str or path
        File to write, by custom of suffix .sNp for N ports; replaced at once when complete.
    couplings : sequence of Coupling
        One for each wavenumber.
    reference_distance : float, L
        r0 of the transfer ratio.
    sound_speed : float, optional, m/s
        For the frequency of a wavenumber; that of light if not given.

    Raises
    ------
    InvalidInputError
        If couplings are of slots or monopoles or both, of different ports or not in order.
    CreepingError
        If the file cannot be written.
    """
    unit = positive_number(reference_distance, "reference_distance")
    given = list(couplings)
    if not given or not all(isinstance(one, Coupling) for one in given):
        raise InvalidInputError(
            "couplings has none in it, or more than results of creeping.coupling; give a list of them"
        )
    electric = [n for n, one in enumerate(given) if one.boundary == "pec"]
    if electric:
        raise InvalidInputError(
            f"{len(electric)} of {len(given)} couplings are of a conductor (first: number {electric[0]}), which are no "
            "ratios of pressures; write those of creeping.coupling"
        )
    ports = given[0].ports
    strangers = [n for n, one in enumerate(given) if one.ports.shape != ports.shape or np.any(one.ports != ports)]
    if strangers:
        raise InvalidInputError(
            f"{len(strangers)} of {len(given)} couplings are of other ports (first: number {strangers[0]}); write one "
            "file for each set"
        )
    k = np.array([one.wavenumber for one in given])
    if np.any(np.diff(k) <= 0):
        raise InvalidInputError(f"wavenumbers {k.tolist()} do not ascend; sort the couplings by them")
    hertz = frequency(k, sound_speed=sound_speed)
    with written_aside(path) as aside, aside.open("w", encoding="ascii", newline="\n") as stream:
        stream.write(f"! creeping: couplings of {len(ports)} ports on a hard body, as transfer ratios 2 pi r0 u\n")
        stream.write(
            f"! r0 = {unit!r} {given[0].length_unit}; no scattering parameters: S_ii is not known, and 0 here\n"
        )
        for number, port in enumerate(ports.tolist()):
            stream.write(f"! port {number + 1} at {' '.join(map(repr, port))} {given[0].length_unit}\n")
        bad = sum(int(np.sum(np.triu(~one.ok, 1))) for one in given)
        if bad:
            stream.write(f"! {bad} pairs of ports at some frequency have a status that is not OK\n")
        stream.write("# HZ S RI R 1\n")
        for at, one in zip(np.asarray(hertz).tolist(), given, strict=True):
            stream.writelines(_lines(at, 2 * np.pi * unit, one.values))


def _lines(hertz: float, factor: float, values: ComplexArray) -> Iterable[str]:
    """Lines of one frequency; of two ports, column by column on one line, as version 1 has it."""
    h = factor * np.conj(np.where(np.isfinite(values), values, 0.0))
    rows = [h.T.ravel()] if len(h) == 2 else list(h)
    first = True
    for row in rows:
        for begin in range(0, len(row), ACROSS):
            pairs = " ".join(f"{z.real!r} {z.imag!r}" for z in row[begin : begin + ACROSS].tolist())
            yield f"{hertz!r} {pairs}\n" if first else f"  {pairs}\n"
            first = False


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
