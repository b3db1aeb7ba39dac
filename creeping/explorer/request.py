"""What the page is asked to show: one incidence, its fan, and the wave.

d = (sin θ cos φ, sin θ sin φ, cos θ)

Also here: what lengths, wavenumbers and echoes of the page are in: L, or metres with hertz and decibels of a square
metre.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.frequency import frequency, suited
from creeping.field.results.comparison import cross_section_decibels, decibels
from creeping.geometry.directions import angles_of, directions_from_angles

BOUNDARIES = ("soft", "hard", "pec", "impedance")
RAYS = (16, 1024)
"""Fewest and most rays."""
LEVELS = 400
"""Most iso-phase levels along a ray."""


@dataclass(frozen=True)
class ViewRequest:
    """What to show; every number is checked, as it may come over a wire.

    Attributes
    ----------
    theta, phi : float, degrees
        Where the wave travels: from +z, and from +x towards +y.
    rays : int
    length : float, L (travel time for a weighted body)
        Of the rays.
    spacing : float, L
        Between iso-phase curves; 0 for none.
    wavenumber : float, 1/L
    boundary : str
        "soft", "hard", "pec" or "impedance:ETA".
    cut : float, degrees
        Azimuth of the half plane whose directions the far-field cut runs through, with its opposite.
    metres : bool
        Whether lengths are metres: then there are frequencies and dBsm.
    sound_speed : float, m/s, optional
        Of the medium, if the wave is sound; light if not given.
    """

    theta: float
    phi: float
    rays: int
    length: float
    spacing: float
    wavenumber: float
    boundary: str
    cut: float = 0.0
    metres: bool = False
    sound_speed: float | None = None

    def __post_init__(self) -> None:
        for name in ("theta", "phi", "length", "spacing", "wavenumber", "cut"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
                raise InvalidInputError(f"{name} = {value!r} is not a finite number")
        if isinstance(self.rays, bool) or not isinstance(self.rays, int) or not RAYS[0] <= self.rays <= RAYS[1]:
            raise InvalidInputError(f"rays = {self.rays!r} is not a whole number from {RAYS[0]} to {RAYS[1]}")
        if not (self.length > 0 and self.wavenumber > 0 and self.spacing >= 0):
            raise InvalidInputError(
                f"length = {self.length:g} and wavenumber = {self.wavenumber:g} must be positive, "
                f"spacing = {self.spacing:g} not negative"
            )
        if self.spacing and self.length / self.spacing > LEVELS:
            raise InvalidInputError(f"spacing = {self.spacing:g} makes more than {LEVELS} curves; widen it")
        if not isinstance(self.boundary, str):
            raise InvalidInputError(f"boundary = {self.boundary!r} is no text")
        parse_boundary(self.boundary)
        if self.sound_speed is not None and not self.metres:
            raise InvalidInputError("sound_speed is of a body in metres")

    @property
    def direction(self) -> FloatArray:
        """Unit vector d (3,)."""
        return directions_from_angles(*np.radians([self.theta, self.phi]))

    @property
    def kind(self) -> BoundaryLike:
        """The boundary as fields take it."""
        return parse_boundary(self.boundary)

    @property
    def on_rays(self) -> BoundaryLike:
        """Boundary of the field along rays: of a conductor the wave with E along the normal, which decays less.

        Its |n x H| is |u| of the hard boundary to first order.
        """
        return "hard" if self.boundary == "pec" else self.kind

    @property
    def levels(self) -> FloatArray:
        """Travel times of the iso-phase curves (m,)."""
        if not self.spacing:
            return np.zeros(0)
        return np.asarray(self.spacing * np.arange(1, int(self.length / self.spacing + 1e-9) + 1))

    def changed(self, **values: Any) -> "ViewRequest":
        """The request with other values."""
        return replace(self, **values)


def angles(direction: FloatArray) -> tuple[float, float]:
    """Theta in 0..180 and phi in -180..180, degrees, of a vector (3,) that is not zero."""
    theta, phi = angles_of(direction)
    return float(np.degrees(theta)), float(np.degrees(phi))


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
