"""Results over frequency for other programs: Touchstone of couplings, SOFA of receivers; and STK of radar echoes.

Touchstone, for programs that read N-port data:

    h_ij = 2 pi r0 u_ij,   u of a source e^{ikr}/(4 pi r) on the body

the field at port i of a source at port j, in units of what that source gives at a distance r0 along a hard plane, that
is 1/(2 pi r0). It is written as S_ij: a transfer ratio without unit, not a scattering parameter: nothing is known
of what ports reflect, S_ii is 0, and columns are not bounded by 1. On a conductor

    Z_ij = -Z_0 l^2 E_ij     monopoles of height l, ohm
    Y_ij = -l^2 H_ij/Z_0     slots of length l, siemens

with E and H those of `creeping.monopole_coupling` and `creeping.slot_coupling`; Z_ii and Y_ii are not known, and 0.
Numbers are conjugated, for e^{+jwt}.

SOFA (AES69), head-related transfer functions for programs that render sound or analyse arrays:

    H(f) = conj F(r; x),   k = 2 pi f/c

F of `creeping.field.sources`: what a receiver at x on the body or near it gets from a far source towards r, over what
the origin gets of it with no body. SOFA counts time as e^{+iwt}, hence the conjugate; receivers and directions are in
the body's axes, in which the listener is at the origin, looks along x and has z for up.

STK (.rcs), radar cross sections, pattern type MonostaticRealSparse: rho, theta and dBsm, one row a direction. Rho is
counted from z, 90 degrees less the elevation; theta is the azimuth, about z from x to y, within 180 degrees. The
format's pages do not say from which axis theta starts where rho is from z; x is taken here.

Sources: [AES69], conventions SimpleFreeFieldHRTF 1.0 and GeneralTF 2.0; Derivations, F25 and F27.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.frequency import frequency
from creeping.field.ports.coupling_result import Coupling
from creeping.field.sources import SourcePattern
from creeping.geometry.arguments import positive_number
from creeping.geometry.checks import METRE
from creeping.geometry.directions import angles_of
from creeping.storage.atomic import written_aside
from creeping.storage.memory import required

if TYPE_CHECKING:
    from creeping.field.results.comparison import Echo

HRTF, GENERAL = "SimpleFreeFieldHRTF", "GeneralTF"
IMPEDANCE = 376.730313668
"""Z_0, impedance of free space, ohm [CODATA 2018]."""
DISTANCE = 1.0
"""What a SOFA file says of how far sources are, m: it has no word for far fields."""


def over_frequency(results: Any, kind: type, name: str, made_by: str, shared: Sequence[str]) -> list[Any]:
    """Results of a kind at ascending wavenumbers that share some of their arrays, as a list.

    Raises
    ------
    InvalidInputError
        If they are none of that kind, of different arrays, or not in order; ``name`` says what they are.
    """
    given = list(results) if isinstance(results, Sequence) else []
    if not given or not all(isinstance(one, kind) for one in given):
        raise InvalidInputError(
            f"{name} has none in it, or more than results of creeping.{made_by}; give a list of them"
        )
    for part in shared:
        own = getattr(given[0], part)
        other = [n for n, one in enumerate(given) if not np.array_equal(getattr(one, part), own)]
        if other:
            raise InvalidInputError(
                f"{len(other)} of {len(given)} {name} are of other {part} than the first (first: number {other[0]}); "
                "write one file for each set"
            )
    k = np.array([one.wavenumber for one in given])
    if np.any(np.diff(k) <= 0):
        raise InvalidInputError(f"wavenumbers {k.tolist()} do not ascend; sort the {name} by them")
    return given


def write_touchstone(
    path: str | os.PathLike[str],
    couplings: Sequence[Coupling],
    *,
    reference_distance: float,
    sound_speed: float | None = None,
    names: Sequence[str] = (),
) -> None:
    """Write couplings of the same ports at ascending wavenumbers as Touchstone, version 1.

    Point sources on a hard body give S parameters, monopoles Z and slots Y parameters. Diagonal entries are written as
    0, because they are not known.

    Parameters
    ----------
    path : str or path
        File to write, usually with suffix .sNp for N ports; replaced at once when complete.
    couplings : sequence of Coupling
        One for each wavenumber.
    reference_distance : float, L
        Distance r0 of the transfer ratio 2 pi r0 u for points; height of monopoles; length of slots.
    sound_speed : float, optional, m/s
        Speed that converts wavenumbers to frequencies; by default that of light.
    names : sequence of str
        Names of the ports, written in comments.

    Raises
    ------
    InvalidInputError
        If couplings mix slots and monopoles, differ in ports, or are not in ascending order of wavenumber.
    CreepingError
        If the file cannot be written.
    """
    unit = positive_number(reference_distance, "reference_distance")
    given = over_frequency(couplings, Coupling, "couplings", "coupling", ("ports",))
    kinds = sorted({str(kind) for one in given for kind in one.kinds})
    if len(kinds) > 1:
        raise InvalidInputError(
            f"ports are {' and '.join(kinds)}: hybrid parameters, which the format has of two ports only; write one "
            "file for each kind"
        )
    letter, factor, what = {
        "point": ("S", 2 * np.pi * unit, "transfer ratios 2 pi r0 u of points on a hard body, r0"),
        "monopole": ("Z", -IMPEDANCE * unit**2, "mutual impedances, ohm, of monopoles of height"),
        "slot": ("Y", -(unit**2) / IMPEDANCE, "mutual admittances, siemens, of slots of length"),
    }[kinds[0]]
    ports, k = given[0].ports, np.array([one.wavenumber for one in given])
    # as typed: k and back leaves rounding
    hertz = [float(f"{one:.12g}") for one in np.atleast_1d(frequency(k, sound_speed=sound_speed))]
    with written_aside(path) as aside, aside.open("w", encoding="ascii", errors="replace", newline="\n") as stream:
        length, more = given[0].length_unit, "; no scattering parameters" if letter == "S" else ""
        stream.write(f"! creeping: couplings of {len(ports)} ports: {what} {unit!r} {length}\n")
        stream.write(f"! {letter}_ii is not known, and 0 here{more}\n")
        for number, port in enumerate(ports.tolist()):
            name = f" {names[number]}" if names else ""
            stream.write(f"! port {number + 1}{name} at {' '.join(map(repr, port))} {length}\n")
        bad = sum(int(np.sum(np.triu(~one.ok, 1))) for one in given)
        if bad:
            stream.write(f"! {bad} pairs of ports at some frequency have a status that is not OK\n")
        stream.write(f"# HZ {letter} RI R 1\n")
        for at, one in zip(hertz, given, strict=True):
            stream.writelines(_lines(at, factor, one.values))


def _lines(hertz: float, factor: float, values: ComplexArray) -> Iterable[str]:
    """Lines of one frequency; of two ports, column by column on one line, as version 1 has it."""
    h = factor * np.conj(np.where(np.isfinite(values), values, 0.0))
    begin = f"{hertz!r}"
    for row in [h.T.ravel()] if len(h) == 2 else h:
        for four in np.split(row, range(4, len(row), 4)):
            yield " ".join([begin, *(f"{z.real!r} {z.imag!r}" for z in four.tolist())]) + "\n"
            begin = " "


def write_stk(path: str | os.PathLike[str], echo: Echo, channel: str, frequency: int = 0) -> None:
    """Write the backscatter of one polarisation at one frequency, on a grid of azimuth and elevation, for STK.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    echo : Echo
        Monostatic radar cross sections; directions are all pairs of two or more azimuths and elevations.
    channel : str
        Name of one of the echo's channels.
    frequency : int
        Number of the frequency, from 0, among those of the echo.

    Raises
    ------
    InvalidInputError
        If the echo, the channel or the frequency is not as described, or a level is not finite.
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
    angles = np.round([echo.azimuth, echo.elevation], 9)
    pairs, (azimuths, elevations) = np.unique(angles, axis=1).T, map(np.unique, angles)
    every = len(azimuths) * len(elevations)
    if min(len(azimuths), len(elevations)) < 2 or not every == len(pairs) == len(echo.azimuth):
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


def write_sofa(
    path: str | os.PathLike[str],
    patterns: Sequence[SourcePattern],
    *,
    sound_speed: float,
    unit_length: float = 1.0,
    convention: str = "auto",
    title: str = "",
) -> None:
    """Write transfer functions from far sources to receivers on a body or near it, over frequency, as a SOFA file.

    Parameters
    ----------
    path : str or path
        File to write, of suffix .sofa; replaced at once when complete.
    patterns : sequence of SourcePattern
        One for each wavenumber, ascending, of the same directions, sources and boundary. By reciprocity their sources
        are the receivers, such as ears, and their directions those of the far sources.
    sound_speed : float, m/s
    unit_length : float, m
        Length of the body's unit L; 1 for bodies in metres.
    convention : {"auto", "SimpleFreeFieldHRTF", "GeneralTF"}
        "auto" uses the convention of heads for two receivers, of which the left one (of larger y) comes first, and
        the general one otherwise.
    title : str
        Title of the file, e.g. the name of the body.

    Raises
    ------
    InvalidInputError
        If patterns differ in directions, sources or boundary, or are not in order; on a bad speed, unit, suffix or
        convention; if two ears are not one left and one right.
    CreepingError
        If the library sofar is missing, or the file cannot be written.

    Examples
    --------
    >>> import tempfile, creeping as cr, scatterers as sc
    >>> flow, ears = cr.DirectFlow(sc.Sphere(0.0875)), [(0, 0.0875, 0), (0, -0.0875, 0)]
    >>> heard = [cr.source_pattern(flow, ears, [(1, 0, 0), (0, 1, 0)], wavenumber=k) for k in (100.0, 200.0)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_sofa(f"{folder}/head.sofa", heard, sound_speed=343.0)
    """
    if Path(path).suffix != ".sofa":
        raise InvalidInputError(f"{os.fspath(path)!r} is no name of a SOFA file; end it in .sofa")
    given = over_frequency(patterns, SourcePattern, "patterns", "source_pattern", ("directions", "sources"))
    first = given[0]
    kinds = sorted({f"{one.boundary}, lengths in {one.length_unit}" for one in given})
    if len(kinds) > 1:
        raise InvalidInputError(f"patterns are of several bodies: {'; '.join(kinds)}; write one file for each")
    unit = positive_number(unit_length, "unit_length")
    if first.length_unit == METRE and unit != 1:
        raise InvalidInputError(f"unit_length = {unit:g} m, of a body whose lengths are metres; leave it out")
    speed = positive_number(sound_speed, "sound_speed")
    hertz = np.asarray(frequency(np.array([one.wavenumber for one in given]) / unit, sound_speed=speed))
    receivers = unit * first.sources
    values = np.stack([one.values for one in given], axis=-1)
    library = required("sofar", use="SOFA files need", extra="hrtf")
    file = _filled(library.Sofa(_convention(convention, receivers)), first.directions, receivers, hertz, values)
    file.GLOBAL_Title = title
    # what the numbers are, for those who open the file
    bad = sum(int(np.sum(~one.ok)) for one in given)
    error = max((float(np.max(one.error[one.ok], initial=0.0)) for one in given), default=0.0)
    file.GLOBAL_Comment = (
        f"creeping {__version__}: asymptotic, for short waves on a smooth body, {given[0].boundary} "
        f"boundary, unit of length {unit:.10g} m, sound speed {speed:.10g} m/s. Sources are in the far field; their "
        f"distance of {DISTANCE:g} m is nominal. Values are relative to the free field at the origin, phases with it, "
        f"for exp(+i omega t). Largest stated error {error:.3g}; of {bad} of {sum(one.values.size for one in given)} "
        "values the status is not OK."
    )
    with written_aside(path) as aside:
        library.write_sofa(str(aside), file)


def _convention(asked: str, receivers: FloatArray) -> str:
    """Name of the convention for receivers (r, 3), m."""
    if asked not in ("auto", HRTF, GENERAL):
        raise InvalidInputError(f"convention = {asked!r} is none of 'auto', {HRTF!r}, {GENERAL!r}")
    if asked == "auto":
        asked = HRTF if len(receivers) == 2 else GENERAL
    if asked == GENERAL:
        return asked
    if len(receivers) != 2:
        raise InvalidInputError(f"{HRTF} has two ears, not {len(receivers)}; give convention={GENERAL!r}")
    left, right = receivers[:, 1].tolist()
    # programs take the first for the left ear without a look at its place
    if not left > right:
        raise InvalidInputError(
            f"ears at y = {left:g} and {right:g} m: {HRTF} has the left one, of larger y, first (the listener looks "
            f"along x, z is up); exchange them, or give convention={GENERAL!r} if they are no ears"
        )
    return asked


def _filled(file: Any, directions: FloatArray, receivers: FloatArray, hertz: FloatArray, values: ComplexArray) -> Any:
    """A file with directions (m, 3), receivers (r, 3), frequencies (n,) and F (m, r, n) set."""
    theta, phi = angles_of(directions)
    azimuth, elevation = np.mod(np.degrees(phi), 360.0), 90.0 - np.degrees(theta)
    file.SourcePosition = np.stack([azimuth, elevation, np.full(len(directions), DISTANCE)], axis=-1)
    file.SourcePosition_Type, file.SourcePosition_Units = "spherical", "degree, degree, metre"
    file.ReceiverPosition = receivers
    file.ReceiverPosition_Type, file.ReceiverPosition_Units = "cartesian", "metre"
    file.N = hertz
    heard = np.conj(np.where(np.isfinite(values), values, 0.0))
    file.Data_Real, file.Data_Imag = np.ascontiguousarray(heard.real), np.ascontiguousarray(heard.imag)
    file.GLOBAL_RoomType = "free field"
    file.GLOBAL_ApplicationName, file.GLOBAL_ApplicationVersion = "creeping", __version__
    return file
