"""What ``creeping rcs`` and ``creeping ts`` ask for: angles, frequencies, polarisations. Degrees, hertz, metres."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import boundary_name, parse_boundary
from creeping.field.frequency import is_length, wavenumber
from creeping.field.lobes import lobe_step
from creeping.geometry.surface import Surface
from creeping.sweeping.accessor import POLARISATIONS

AXES = {"az": "azimuth", "el": "elevation"}
WHOLE = {"azimuth": (0.0, 360.0), "elevation": (-90.0, 90.0)}
MOST = 200_000
"""Angles of a cut."""


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
        Of the radar; of a monostatic cut the angle that does not vary.
    angle_name : str
        "azimuth" or "elevation", or "" for one direction.
    span : (first, last), degrees
    step : float, degrees, optional
        None: by the lobes.
    """

    quantity: str
    wavenumbers: FloatArray
    sound_speed: float | None
    channels: tuple[str, ...]
    boundary: str
    monostatic: bool
    incidence: tuple[float, float]
    angle_name: str
    span: tuple[float, float]
    step: float | None

    def angles(self, body: Surface) -> tuple[FloatArray, FloatArray]:
        """Azimuths and elevations (n,), degrees.

        Raises
        ------
        InvalidInputError
            If there are too many.
        """
        if not self.angle_name:
            return np.array([self.incidence[0]]), np.array([self.incidence[1]])
        step = self.step or lobe_step(body, float(self.wavenumbers.max()), monostatic=self.monostatic)
        count = (self.span[1] - self.span[0]) / step
        if count > MOST:
            raise InvalidInputError(
                f"a cut of {count:.3g} angles is asked for; {MOST} are the most: give a coarser step"
            )
        varied = np.asarray(self.span[0] + step * np.arange(int(count + 1e-9) + 1), dtype=float)
        fixed: FloatArray = np.full(len(varied), self.incidence[1 if self.angle_name == "azimuth" else 0])
        return (varied, fixed) if self.angle_name == "azimuth" else (fixed, varied)


def echo_request(
    quantity: str,
    *,
    frequency: str | None,
    wavelength: str | None,
    sound_speed: float | None,
    polarisation: str | None,
    boundary: str,
    monostatic: str | None,
    bistatic: str | None,
    incidence: str | None,
) -> EchoRequest:
    """What the options ask for.

    Raises
    ------
    InvalidInputError
        Names the option that is wrong.
    """
    if (frequency is None) == (wavelength is None):
        raise InvalidInputError('give --frequency, e.g. "10GHz" or "2:18:0.1GHz", or --wavelength, e.g. "3cm"')
    if monostatic is not None and bistatic is not None:
        raise InvalidInputError("--monostatic and --bistatic are both given; give one")
    text, option = (frequency, "--frequency") if frequency is not None else (wavelength, "--wavelength")
    assert text is not None
    try:
        if is_length(text) != (wavelength is not None):
            raise InvalidInputError(f"{text!r} is a {'wavelength' if wavelength is None else 'frequency'}")
        numbers = np.unique(np.atleast_1d(wavenumber(text, sound_speed=sound_speed)))
    except InvalidInputError as error:
        raise InvalidInputError(f"{option}: {error}") from error
    at = _numbers("--incidence", incidence, 2) if incidence is not None else (0.0, 0.0)
    if abs(at[1]) > 90:
        raise InvalidInputError(f"--incidence {incidence!r}: elevation is not between -90 and 90 degrees")
    asked = monostatic if monostatic is not None else bistatic
    if asked is None and len(numbers) == 1 and incidence is None:
        asked = "az"
    name, span, step = _cut("--bistatic" if bistatic is not None else "--monostatic", asked)
    return EchoRequest(
        quantity=quantity,
        wavenumbers=numbers,
        sound_speed=sound_speed,
        channels=_channels(polarisation, boundary),
        boundary=boundary,
        monostatic=bistatic is None,
        incidence=(at[0], at[1]),
        angle_name=name,
        span=span,
        step=step,
    )


def _channels(polarisation: str | None, boundary: str) -> tuple[str, ...]:
    if boundary != "pec":
        if polarisation is not None:
            raise InvalidInputError("--polarisation is of a conductor; sound has none")
        # as datasets name it
        return (boundary_name(parse_boundary(boundary)),)
    names = tuple(name.strip().upper() for name in (polarisation or "HH,VV").split(","))
    unknown = [name for name in names if name not in POLARISATIONS]
    if unknown or len(set(names)) < len(names):
        raise InvalidInputError(f"--polarisation {polarisation!r}: give some of {', '.join(POLARISATIONS)}, each once")
    return names


def _cut(option: str, text: str | None) -> tuple[str, tuple[float, float], float | None]:
    """Name of the angle that varies, its span, and the step if it is given: of ``az``, ``az:STEP``, ``az:A:B:STEP``."""
    if text is None:
        return "", (0.0, 0.0), None
    short, _, rest = text.partition(":")
    if short not in AXES:
        raise InvalidInputError(f"{option} {text!r} is unknown; give az, el, az:STEP or az:FIRST:LAST:STEP, in degrees")
    name = AXES[short]
    if not rest:
        return name, WHOLE[name], None
    numbers = _numbers(option, rest.replace(":", ","), rest.count(":") + 1)
    if len(numbers) not in (1, 3):
        raise InvalidInputError(f"{option} {text!r}: give {short}:STEP or {short}:FIRST:LAST:STEP, in degrees")
    first, last = WHOLE[name] if len(numbers) == 1 else (numbers[0], numbers[1])
    if not (numbers[-1] > 0 and first < last):
        raise InvalidInputError(f"{option} {text!r}: the step is not positive, or the first angle not below the last")
    if name == "elevation" and max(abs(first), abs(last)) > 90:
        raise InvalidInputError(f"{option} {text!r}: elevation is not between -90 and 90 degrees")
    return name, (first, last), numbers[-1]


def _numbers(option: str, text: Any, count: int) -> tuple[float, ...]:
    try:
        found = tuple(float(item) for item in str(text).split(","))
    except ValueError:
        found = ()
    if len(found) != count or not np.all(np.isfinite(found)):
        raise InvalidInputError(f"{option} {text!r} is not {count} number{'s' * (count > 1)}, e.g. 30,0, in degrees")
    return found
