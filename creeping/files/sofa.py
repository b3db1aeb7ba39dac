"""Head-related transfer functions as SOFA files (AES69), for programs that render sound or analyse arrays.

    H(f) = conj F(r; x),   k = 2 pi f/c

F of `creeping.field.sources`: what a receiver at x on the body or near it gets from a far source towards r, over what
the origin gets of it with no body. SOFA counts time as e^{+iwt}, hence the conjugate; receivers and directions are in
the body's axes, in which the listener is at the origin, looks along x and has z for up.

Sources: [AES69], conventions SimpleFreeFieldHRTF 1.0 and GeneralTF 2.0; Derivations, F27.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.frequency import frequency
from creeping.field.sources import SourcePattern
from creeping.geometry.arguments import positive_number
from creeping.geometry.checks import METRE
from creeping.geometry.directions import angles_of
from creeping.storage.atomic import written_aside
from creeping.storage.memory import required

HRTF, GENERAL = "SimpleFreeFieldHRTF", "GeneralTF"
AUTO = "auto"
SUFFIX = ".sofa"
DISTANCE = 1.0
"""What the file says of how far sources are, m: it has no word for far fields."""


def write_sofa(
    path: str | os.PathLike[str],
    patterns: Sequence[SourcePattern],
    *,
    sound_speed: float,
    unit_length: float = 1.0,
    convention: str = AUTO,
    title: str = "",
) -> None:
    """Write what receivers on a body or near it get from far sources, over frequency, as a SOFA file.

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
        By default that of heads for two receivers, the left one (of larger y) first, and the general one for other
        numbers of them.
    title : str
        Of the file; the name of the body, say.

    Raises
    ------
    InvalidInputError
        If patterns are of different directions, sources or boundaries or not in order, on a bad speed, unit,
        suffix or convention, and for ears that are not left and right.
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
    if Path(path).suffix != SUFFIX:
        raise InvalidInputError(f"{os.fspath(path)!r} is no name of a SOFA file; end it in {SUFFIX}")
    given = _checked(patterns)
    first = given[0]
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
    file.GLOBAL_Comment = _comment(given, speed, unit)
    with written_aside(path) as aside:
        library.write_sofa(str(aside), file)


def _checked(patterns: Sequence[SourcePattern]) -> list[SourcePattern]:
    """The patterns, if they are of one body, one set of receivers and directions, and in order."""
    given = list(patterns) if isinstance(patterns, Sequence) else []
    if not given or not all(isinstance(one, SourcePattern) for one in given):
        raise InvalidInputError(
            "patterns has none in it, or more than results of creeping.source_pattern; give a list of them"
        )
    for name in ("directions", "sources"):
        own = getattr(given[0], name)
        other = [n for n, one in enumerate(given) if not np.array_equal(getattr(one, name), own)]
        if other:
            raise InvalidInputError(
                f"{len(other)} of {len(given)} patterns are of other {name} than the first (first: number {other[0]}); "
                "write one file for each set"
            )
    kinds = sorted({f"{one.boundary}, lengths in {one.length_unit}" for one in given})
    if len(kinds) > 1:
        raise InvalidInputError(f"patterns are of several bodies: {'; '.join(kinds)}; write one file for each")
    k = np.array([one.wavenumber for one in given])
    if np.any(np.diff(k) <= 0):
        raise InvalidInputError(f"wavenumbers {k.tolist()} do not ascend; sort the patterns by them")
    return given


def _convention(asked: str, receivers: FloatArray) -> str:
    """Name of the convention for receivers (r, 3), m."""
    if asked not in (AUTO, HRTF, GENERAL):
        raise InvalidInputError(f"convention = {asked!r} is none of {AUTO!r}, {HRTF!r}, {GENERAL!r}")
    if asked == AUTO:
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


def _comment(given: Sequence[SourcePattern], speed: float, unit: float) -> str:
    """What the numbers are, for those who open the file."""
    bad = sum(int(np.sum(~one.ok)) for one in given)
    error = max((float(np.max(one.error[one.ok], initial=0.0)) for one in given), default=0.0)
    return (
        f"creeping {__version__}: asymptotic, for short waves on a smooth body, {given[0].boundary} "
        f"boundary, unit of length {unit:.10g} m, sound speed {speed:.10g} m/s. Sources are in the far field; their "
        f"distance of {DISTANCE:g} m is nominal. Values are relative to the free field at the origin, phases with it, "
        f"for exp(+i omega t). Largest stated error {error:.3g}; of {bad} of {sum(one.values.size for one in given)} "
        "values the status is not OK."
    )
