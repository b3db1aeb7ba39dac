"""What lengths, wavenumbers and echoes of the page are in: L, or metres with hertz and decibels of a square metre."""

from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.explorer.request import ViewRequest
from creeping.field.decibels import cross_section_decibels, decibels
from creeping.field.frequency import frequency, suited


class WaveScale(NamedTuple):
    """What a slider of the wave shows: its name, and the wavenumber of one unit of it."""

    name: str
    per_unit: float


def wave_scale(request: ViewRequest) -> WaveScale:
    """Wavenumber in 1/L, or of a body in metres the frequency in the unit that suits the request's."""
    if not request.metres:
        return WaveScale("wavenumber (1/L)", 1.0)
    hertz, size, unit = _hertz(request)
    # one hertz is so much of k
    return WaveScale(f"frequency ({unit})", request.wavenumber / (hertz / size))


def wave_text(request: ViewRequest) -> str:
    """The wave in words."""
    if not request.metres:
        return f"k = {request.wavenumber:g} 1/L"
    hertz, size, unit = _hertz(request)
    return (
        f"{hertz / size:.4g} {unit}, wavelength {2 * np.pi / request.wavenumber:.3g} m, "
        f"k = {request.wavenumber:.4g} 1/m"
    )


def far_levels(request: ViewRequest, values: ComplexArray) -> FloatArray:
    """Decibels of far fields f: cross section, or target strength 20 log10 |f| of sound."""
    return decibels(values) if request.sound_speed is not None else cross_section_decibels(values)


def far_name(request: ViewRequest) -> str:
    """What those decibels are of."""
    if request.sound_speed is not None:
        return "target strength (dB re 1 m)"
    return "4π|f|² (dBsm)" if request.metres else "4π|f|² (dB re L²)"


def _hertz(request: ViewRequest) -> tuple[float, float, str]:
    """Frequency, and the size and the name of the unit that suits it."""
    hertz = float(frequency(request.wavenumber, sound_speed=request.sound_speed))
    return hertz, *suited(hertz)
