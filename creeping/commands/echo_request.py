"""What ``creeping rcs`` and ``creeping ts`` ask for: angles, frequencies, polarisations. Degrees, hertz, metres."""

import re
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from creeping._typing import FloatArray
from creeping.commands.forecast import cure_of, size_words
from creeping.commands.options import EchoOptions, FileOptions, each_once
from creeping.errors import InvalidInputError
from creeping.field.boundary import boundary_name, parse_boundary
from creeping.field.frequency import frequency as frequency_of
from creeping.field.frequency import is_length, wavenumber
from creeping.field.results.labelled import POLARISATIONS
from creeping.files.measured import MeasuredCut, read_cut
from creeping.geometry.surface import Surface

AXES = {"az": "azimuth", "el": "elevation"}
FORMS = "az or el for a cut, az:FIRST:LAST:STEP for a part of one, az:20 or az:20,el:5 for one direction"


@dataclass(frozen=True)
class EchoRequest:
    """One echo.

    Attributes
    ----------
    quantity : {"rcs", "ts"}
    wavenumbers : (k,), 1/m
    sound_speed : float, m/s, optional
    channels : tuple of str
        Polarisations, or one boundary.
    boundary : str
    monostatic : bool
    incidence : (azimuth, elevation), degrees
        Of the radar; of a cut the angle that does not vary.
    place : (azimuth, elevation), degrees
        The one direction where nothing varies.
    angle_name : str
        "azimuth" or "elevation", or "" for one direction.
    span : (first, last), degrees
    step : float, degrees, optional
        None: by the lobes.
    cure : str
        What to look at where the body has an absurd size in wavelengths.
    """

    quantity: str
    wavenumbers: FloatArray
    sound_speed: float | None
    channels: tuple[str, ...]
    boundary: str
    monostatic: bool
    incidence: tuple[float, float]
    place: tuple[float, float]
    angle_name: str
    span: tuple[float, float]
    step: float | None
    cure: str

    def angles(self, body: Surface) -> tuple[FloatArray, FloatArray]:
        """Azimuths and elevations (n,), degrees.

        Raises
        ------
        InvalidInputError
            If there are too many.
        """
        if not self.angle_name:
            return np.array([self.place[0]]), np.array([self.place[1]])
        from creeping.field.waves.forward import lobe_step

        step = self.step or lobe_step(body, float(self.wavenumbers.max()), monostatic=self.monostatic)
        count = (self.span[1] - self.span[0]) / step
        if count > 200_000:
            raise InvalidInputError(
                f"a cut of {count:.3g} angles is asked for; 200000 are the most: give a coarser step, if the body is "
                f"to be {size_words(body, self.wavenumbers, metres=True, cure=self.cure)}"
            )
        varied = np.asarray(self.span[0] + step * np.arange(int(count + 1e-9) + 1), dtype=float)
        fixed: FloatArray = np.full(len(varied), self.incidence[1 if self.angle_name == "azimuth" else 0])
        return (varied, fixed) if self.angle_name == "azimuth" else (fixed, varied)


def echo_request(quantity: str, **asked: Any) -> EchoRequest:
    """What the options ask for, those of the wave and of angles, each by its name.

    Raises
    ------
    InvalidInputError
        Names the option that is wrong.
    """
    frequency, wavelength, sound_speed = (asked[name] for name in ("frequency", "wavelength", "sound_speed"))
    monostatic, bistatic, incidence = (asked[name] for name in ("monostatic", "bistatic", "incidence"))
    if (frequency is None) == (wavelength is None):
        raise InvalidInputError('give --frequency, e.g. "10GHz" or "2:18:0.1GHz", or --wavelength, e.g. "3cm"')
    if monostatic is not None and bistatic is not None:
        raise InvalidInputError("--monostatic and --bistatic are both given; give one")
    text, option = (frequency, "--frequency") if frequency is not None else (wavelength, "--wavelength")
    try:
        if is_length(text) != (wavelength is not None):
            raise InvalidInputError(
                f"{text!r} is a length: --wavelength" if wavelength is None else f"{text!r}: give e.g. {text}cm"
            )
        numbers = np.unique(np.atleast_1d(wavenumber(text, sound_speed=sound_speed)))
    except InvalidInputError as error:
        raise InvalidInputError(f"{option}: {error}") from error
    at = (0.0, 0.0) if incidence is None else _pair("--incidence", incidence, _numbers("--incidence", incidence, 2))
    seen = monostatic if monostatic is not None else bistatic
    if seen is None and len(numbers) == 1 and incidence is None:
        seen = "az"
    if asked["boundary"] == "pec":
        channels = each_once("--polarisation", asked["polarisation"] or "HH,VV", POLARISATIONS)
    elif asked["polarisation"] is not None:
        raise InvalidInputError("--polarisation is of a conductor; sound has none")
    else:
        # as datasets name it
        channels = (boundary_name(parse_boundary(asked["boundary"])),)
    option_of_angles = "--bistatic" if bistatic is not None else "--monostatic"
    place = _place(option_of_angles, seen, at)
    varied = _cut(option_of_angles, seen if place is None else None)
    cure = cure_of(option, text, float(frequency_of(numbers.max(), sound_speed=sound_speed)))
    wave = numbers, sound_speed, channels, asked["boundary"]
    return EchoRequest(quantity, *wave, bistatic is None, at, place or at, *varied, cure)


@dataclass(frozen=True)
class EchoJob:
    """A request and what was typed: the body's text, options, what the wave was ``asked`` as; and when it began.

    ``reference`` has the measured cut and its levels by channel.
    """

    body: str
    given: EchoOptions
    file: FileOptions
    asked: dict[str, Any]
    request: EchoRequest
    formats: tuple[str, ...]
    reference: dict[str, tuple[MeasuredCut, FloatArray]]
    started: float


def echo_job(quantity: str, body: str, given: EchoOptions, file: FileOptions, **wave: Any) -> EchoJob:
    """What a command asks for, if its options go together; asks about angles that look like radians.

    Raises
    ------
    InvalidInputError
        Names the option that is wrong.
    """
    started = time.perf_counter()
    asked: dict[str, Any] = {"frequency": given.frequency, "wavelength": given.wavelength, **wave}
    asked |= {"monostatic": given.monostatic, "bistatic": given.bistatic, "incidence": given.incidence}
    request = echo_request(quantity, **asked)
    formats = each_once("--format", given.formats, ("csv",) if given.average else ("csv", "mat"))
    if given.average:
        names = ("monostatic", "bistatic", "incidence", "compare", "column", "align")
        stray = [f"--{name}" for name in names if getattr(given, name)]
        stray += ["--polarisation"] * bool(asked["polarisation"])
        stray += ["--method"] * (given.method not in ("auto", "t-matrix"))
        if stray:
            raise InvalidInputError(f"--average is over all angles and polarisations: leave out {', '.join(stray)}")
    elif given.compare is None and (stray := [f"--{name}" for name in ("column", "align") if getattr(given, name)]):
        raise InvalidInputError(f"{' and '.join(stray)}: give --compare as well, what it is about")
    for name in ("monostatic", "bistatic", "incidence"):
        if hint := radians_hint(f"--{name}", asked[name]):
            print(f"creeping: {hint}", file=sys.stderr)
    reference = reference_of(request, given.compare, given.column, given.align) if given.compare else {}
    return EchoJob(body, given, file, asked, request, formats, reference, started)


def reference_of(
    request: EchoRequest, path: Path, column: str | None, align: float
) -> dict[str, tuple[MeasuredCut, FloatArray]]:
    """Measured cut and its levels by channel, of those that it has.

    Raises
    ------
    InvalidInputError
        If the file is no table, lacks the columns, or is over what the request does not vary.
    """
    if not (np.isfinite(align) and align >= 0):
        raise InvalidInputError(f"--align {align!r} is not a finite number of degrees >= 0")
    cut = read_cut(path)
    if len(request.wavenumbers) > 1 and request.angle_name:
        raise InvalidInputError("--compare takes a cut or a band; give one frequency, or one direction")
    over = "frequency" if len(request.wavenumbers) > 1 else "angle"
    if cut.over != over or (over == "angle" and not request.angle_name):
        raise InvalidInputError(f"--compare {path} is over {cut.over}; ask for a cut or a band that varies that")
    if column is None:
        found = {channel: cut.of(channel) for channel in request.channels}
        if len(request.channels) > 1 and len(cut.levels) == 1 and all(v is not None for v in found.values()):
            # a column without a polarisation's name is of one at most
            found = {}
    else:
        names = [name.strip() for name in column.split(",")]
        unknown = [name for name in names if name not in cut.levels]
        if unknown or len(names) != len(request.channels):
            raise InvalidInputError(
                f"--column {column!r}: give one of {', '.join(cut.levels)} for each of {', '.join(request.channels)}"
            )
        found = {channel: cut.levels[name] for channel, name in zip(request.channels, names, strict=True)}
    known = {channel: (cut, levels) for channel, levels in found.items() if levels is not None}
    if not known:
        raise InvalidInputError(
            f"--compare {path} has columns {', '.join(cut.levels)}: say with --column which is "
            f"{', '.join(request.channels)}"
        )
    return known


def _pair(option: str, text: str, angles: Sequence[float]) -> tuple[float, float]:
    """Azimuth and elevation, degrees, if they are such."""
    if abs(angles[1]) > 90:
        raise InvalidInputError(f"{option} {text!r}: elevation is not between -90 and 90 degrees")
    return angles[0], angles[1]


def _place(option: str, text: str | None, at: tuple[float, float]) -> tuple[float, float] | None:
    """Azimuth and elevation of ``az:20``, ``el:5`` or ``az:20,el:5``, what is not given from ``at``; None of a cut."""
    given = [part.split(":") for part in (text or "").split(",")]
    if any(len(part) != 2 or part[0] not in AXES for part in given) or len({part[0] for part in given}) < len(given):
        return None
    named = {short: _numbers(option, angle, 1)[0] for short, angle in given}
    return _pair(option, str(text), [named.get(short, one) for short, one in zip(AXES, at, strict=True)])


def radians_hint(option: str, text: str | None) -> str:
    """A question where a number has the digits of a multiple of pi/2, and two of them or more behind the point.

    Examples
    --------
    >>> radians_hint("--incidence", "3.14,0"), radians_hint("--monostatic", "az:0:180:1.5")
    ('--incidence 3.14,0 is in degrees; 3.14 looks like radians, for 180', '')
    """
    for number in re.findall(r"\d+\.\d\d+", text or ""):
        quarters = round(float(number) / (np.pi / 2))
        if quarters and f"{quarters * np.pi / 2:.{len(number.partition('.')[2])}f}" == number:
            return f"{option} {text} is in degrees; {number} looks like radians, for {90 * quarters}"
    return ""


def _cut(option: str, text: str | None) -> tuple[str, tuple[float, float], float | None]:
    """Name of the angle that varies, its span, and the step if it is given: of ``az`` or ``az:FIRST:LAST:STEP``."""
    if text is None:
        return "", (0.0, 0.0), None
    short, _, rest = text.partition(":")
    if short not in AXES:
        raise InvalidInputError(f"{option} {text!r} is unknown; give {FORMS}, in degrees")
    name = AXES[short]
    if not rest:
        return name, (0.0, 360.0) if name == "azimuth" else (-90.0, 90.0), None
    numbers = _numbers(option, rest.replace(":", ","), rest.count(":") + 1)
    if len(numbers) != 3:
        raise InvalidInputError(f"{option} {text!r} has {len(numbers)} numbers; give {FORMS}, in degrees")
    first, last, step = numbers
    if not (step > 0 and first < last):
        raise InvalidInputError(f"{option} {text!r}: the step is not positive, or the first angle not below the last")
    if name == "elevation" and max(abs(first), abs(last)) > 90:
        raise InvalidInputError(f"{option} {text!r}: elevation is not between -90 and 90 degrees")
    return name, (first, last), step


def _numbers(option: str, text: Any, count: int) -> tuple[float, ...]:
    try:
        found = tuple(float(item) for item in str(text).split(","))
    except ValueError:
        found = ()
    if len(found) != count or not np.all(np.isfinite(found)):
        raise InvalidInputError(f"{option} {text!r} is not {count} number{'s' * (count > 1)}, e.g. 30,0, in degrees")
    return found
