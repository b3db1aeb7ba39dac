"""The wave of a command: its wavenumber, or the frequency or wavelength it comes from."""

from creeping._typing import Any
from creeping.errors import CreepingError, InvalidInputError
from creeping.field.arguments import checked
from creeping.field.frequency import frequency as hertz_of
from creeping.field.frequency import suited
from creeping.field.frequency import wavenumber as wavenumber_of


def frequency_words(hertz: float) -> str:
    """Frequency with the unit that makes it readable.

    Examples
    --------
    >>> frequency_words(1e10), frequency_words(38e3), frequency_words(0.5)
    ('10 GHz', '38 kHz', '0.5 Hz')
    """
    scale, name = suited(hertz)
    return f"{hertz / scale:.6g} {name}"


def asked_wavenumber(
    wavenumber: float | None, frequency: str | None, wavelength: str | None, sound_speed: float | None
) -> tuple[float, float | None, str]:
    """The one wavenumber that is asked for, its frequency, Hz, if it was not given as a wavenumber, and `cure_of` it.

    Raises
    ------
    InvalidInputError
        If not exactly one is given, or it is no number.
    """
    given: dict[str, Any] = {"--wavenumber": wavenumber, "--frequency": frequency, "--wavelength": wavelength}
    given = {name: value for name, value in given.items() if value is not None}
    if len(given) != 1:
        raise InvalidInputError(f"{' and '.join(given) or 'no wave'} given; give one of --wavenumber, --frequency")
    ((option, value),) = given.items()
    if wavenumber is not None:
        if sound_speed is not None:
            raise InvalidInputError("--sound-speed goes with --frequency; --wavenumber needs none")
        try:
            return checked(wavenumber, 2), None, cure_of(option, value, None)
        except CreepingError as error:
            raise InvalidInputError(f"--{error}") from error
    if wavelength is not None and not wavelength.strip().endswith("m"):
        raise InvalidInputError(f"--wavelength {wavelength!r} has no unit; give e.g. 3cm")
    try:
        found = wavenumber_of(value, sound_speed=sound_speed)
        if not isinstance(found, float):
            raise InvalidInputError(f"{value!r} is a range; `creeping rcs`, `ts` and `coupling` take those")
        hertz = float(hertz_of(found, sound_speed=sound_speed))
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
