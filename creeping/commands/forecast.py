"""The wave of a command, and what a field will be made by, how long that takes and how far it errs, told before.

Libraries of fields are loaded when a forecast is asked for: requests that make no sense are refused before.
"""

from typing import Any, NamedTuple

import numpy as np

from creeping._progress import duration
from creeping._typing import ArrayLike, FloatArray
from creeping.commands.options import WaveOptions
from creeping.errors import CreepingError, InvalidInputError
from creeping.field.arguments import checked, checked_across
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.field.frequency import frequency as hertz_of
from creeping.field.frequency import suited
from creeping.field.frequency import wavenumber as wavenumber_of
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.checks import unit_of
from creeping.geometry.piecewise import has_edges, is_piecewise
from creeping.geometry.surface import why_no_rays

SOLVED = "errors of 0.01 to 1 % of the largest amplitude (0.1 dB)"
COARSE = (
    "errors of 0.1 to 3 % of the largest amplitude (0.3 dB), of bodies with fins or narrow gaps up to 25 %, for want "
    "of time: coarse tiles and few steps"
)
"""Of the equation and the T-matrix: what they stated on bodies with edges and without."""


class Forecast(NamedTuple):
    """The body and its size; the method in words, with time, memory and error; nodes of the equation, 0 where none."""

    body: str
    by: str
    nodes: int

    def __str__(self) -> str:
        return f"{self.body}: {self.by}"


def boundary_words(*boundaries: BoundaryLike) -> str:
    """What the surface is to the wave.

    Examples
    --------
    >>> boundary_words("soft", "pec"), boundary_words("impedance:0.5")
    ('soft (pressure release) and perfect conductor', 'impedance:0.5')
    """
    names = [boundary_name(one) for one in boundaries]
    kinds = {"soft": "soft (pressure release)", "hard": "hard (rigid)", "pec": "perfect conductor"}
    return " and ".join(kinds.get(name, name) for name in names)


def size_words(shape: Any, wavenumbers: ArrayLike, *, metres: bool, cure: str) -> str:
    """Size of the body in its unit and in wavelengths, with a question where a unit seems to be forgotten.

    Raises
    ------
    InvalidInputError
        If no field is known of a body so small or large; ``cure`` says what to give.
    """
    k = np.atleast_1d(np.asarray(wavenumbers, dtype=float))
    # longest side of the body, L: of its own points where its bounds are those of a grid about it
    padded = any(hasattr(shape, name) for name in ("fit", "expression"))
    points = points_of_charts(shape) if padded and not why_no_rays(shape) else np.asarray(shape.bounds, dtype=float)
    unit, side = "m" if metres else unit_of(shape), float(np.max(np.ptp(points, axis=0)))
    ends = [side * float(end) / (2 * np.pi) for end in (k.min(), k.max())]
    told = " to ".join(dict.fromkeys(f"{end:.3g}" for end in ends))
    size = f"{side:.4g} {unit}, {told} wavelengths across"
    try:
        checked_across(shape, float(k.min()), float(k.max()))
    except InvalidInputError as error:
        word = "small" if ends[0] < 1 else "large"
        raise InvalidInputError(f"the body is {size}, too {word} for any field; {cure}") from error
    # a unit is asked about from a thousandth of 30 wavelengths, and from a thousand times 3
    doubt = "small" if ends[1] < 0.03 else "large" if ends[0] > 3e3 else ""
    return f"{size} (so {doubt}? {cure})" if doubt else size


def forecast(
    shape: Any,
    wavenumbers: ArrayLike,
    boundary: BoundaryLike,
    *,
    method: str = "auto",
    radar: tuple[ArrayLike, ArrayLike] | None = None,
    observers: int = 1,
    metres: bool = False,
    cure: str = "give the wavenumber in the inverse of the body's unit",
) -> Forecast:
    """What a field of the body is made by, what that takes, and about which error it has.

    ``radar``: azimuths and elevations (n,), degrees, of the incidences of a backscatter cut, or of one incidence with
    several ``observers``. Without it the equation's cost is that of one incidence, and none is told of rays.
    """
    from creeping.field.equation.effort import ASKED, plan_of
    from creeping.field.tmatrix.computing import expected
    from creeping.field.validity_range import is_reached

    k = np.atleast_1d(np.asarray(wavenumbers, dtype=float))
    without, pieces = why_no_rays(shape), is_piecewise(shape)
    kind = without or (f"in smooth pieces with {len(shape.creases)} creases" if pieces else "one smooth surface")
    size = size_words(shape, k, metres=metres, cure=cure)
    body = f"body: {kind}, {size}"
    incidences = None if radar is None else (np.atleast_1d(radar[0]), np.atleast_1d(radar[1]))
    count, top = 1 if incidences is None else len(incidences[0]), float(k.max())
    if method == "rays":
        return Forecast(body, f"rays alone, in seconds, {_errors(shape, k)}", 0)
    if method == "t-matrix":
        plan = [expected(shape, one, boundary) for one in k]
        takes = _takes(sum(one.seconds for one in plan), plan[-1].memory)
        return Forecast(body, f"the T-matrix of the body, one for all angles, {takes}, {SOLVED}", 0)
    smooth = not (without or pieces)
    solved = plan_of(shape, top, boundary, ASKED if method == "equation" else None, incidences=count)
    if without and solved.refused:
        solved = plan_of(shape, top, boundary, ASKED, incidences=count)
    # nodes grow with the area in square wavelengths, and what pairs of them take with the square of that
    share = float(np.sum((k / top) ** 4))
    nodes, refused = solved.nodes, solved.refused
    takes = _takes(share * solved.seconds, solved.memory)
    equation = f"the integral equation between {nodes} nodes, {takes}, {COARSE if solved.effort.coarse else SOLVED}"
    if not refused and (not smooth or method == "equation"):
        by = equation
    elif without:
        by = f"nothing within five minutes: {refused}; creeping.solve(..., seconds=) takes as long as it may"
    elif has_edges(shape):
        by = f"rays and physical optics, which err by several per cent (0.5 dB): the equation is not solved, {refused}"
    elif not refused and not is_reached(shape, float(k.min())):
        by = f"{equation}, as parts are more curved than rays and currents allow"
    else:
        by = "creeping rays and surface currents, "
        if incidences is not None:
            from creeping.sweeping.echoes import seconds_of_currents

            # where currents must serve all they are hundreds of times as slow as rays
            seconds = seconds_of_currents(shape, k, incidences, observers=observers, boundary=boundary)
            by += f"up to about {duration(seconds)} if currents serve all, " if seconds else ""
        by += _errors(shape, k)
        by += "" if refused else f"; where these fail, {equation}"
    return Forecast(body, by, nodes)


def _takes(seconds: float, memory: float) -> str:
    return f"about {duration(seconds)} and {memory / 1e9:.2g} GB"


def _errors(shape: Any, k: FloatArray) -> str:
    """How far rays and currents err, by the lowest wavenumber."""
    from creeping.field.validity_range import is_reached

    if why_no_rays(shape) or has_edges(shape):
        return "errors of several per cent of the largest amplitude (0.5 dB)"
    if is_reached(shape, float(k.min())):
        return "errors of 0.1 to 5 % of the largest amplitude (0.4 dB)"
    return "errors of up to 40 % of the largest amplitude (3 dB), as parts are more curved than a wavelength allows"


def frequency_words(hertz: float) -> str:
    """Frequency with the unit that makes it readable.

    Examples
    --------
    >>> frequency_words(1e10), frequency_words(38e3), frequency_words(0.5)
    ('10 GHz', '38 kHz', '0.5 Hz')
    """
    scale, name = suited(hertz)
    return f"{hertz / scale:.6g} {name}"


def asked_wavenumber(wave: WaveOptions) -> tuple[float, float | None, str]:
    """The one wavenumber that is asked for, its frequency, Hz, if it was not given as a wavenumber, and `cure_of` it.

    Raises
    ------
    InvalidInputError
        If not exactly one is given, or it is no number.
    """
    given = {f"--{name}": value for name, value in vars(wave).items() if name != "sound_speed" and value is not None}
    if len(given) != 1:
        raise InvalidInputError(f"{' and '.join(given) or 'no wave'} given; give one of --wavenumber, --frequency")
    ((option, value),) = given.items()
    if wave.wavenumber is not None:
        if wave.sound_speed is not None:
            raise InvalidInputError("--sound-speed goes with --frequency; --wavenumber needs none")
        try:
            return checked(wave.wavenumber, 2), None, cure_of(option, value, None)
        except CreepingError as error:
            raise InvalidInputError(f"--{error}") from error
    if option == "--wavelength" and not value.strip().endswith("m"):
        raise InvalidInputError(f"--wavelength {value!r} has no unit; give e.g. 3cm")
    try:
        found = wavenumber_of(value, sound_speed=wave.sound_speed)
        if not isinstance(found, float):
            raise InvalidInputError(f"{value!r} is a range; `creeping rcs`, `ts` and `coupling` take those")
        hertz = float(hertz_of(found, sound_speed=wave.sound_speed))
        return checked(found, 2), hertz, cure_of(option, value, hertz)
    except InvalidInputError as error:
        raise InvalidInputError(f"{option}: {error}") from error


def cure_of(option: str, text: object, hertz: float | None) -> str:
    """What to look at where a body has an absurd size in wavelengths: how the wave was understood.

    Examples
    --------
    >>> cure_of("--frequency", "10", 10.0), cure_of("--wavelength", "3cm", 1e10)
    ('--frequency 10 is 10 Hz, give e.g. 10GHz', 'lengths are metres, of a file in its --units')
    """
    if hertz is None:
        return f"{option} {text} is in the inverse of the body's unit of length"
    if option == "--frequency" and not str(text).strip()[-1:].isalpha():
        return f"{option} {text} is {frequency_words(hertz)}, give e.g. {text}GHz"
    return "lengths are metres, of a file in its --units"
