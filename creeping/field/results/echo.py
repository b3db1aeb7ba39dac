"""An echo: amplitudes by channel, angle and wavenumber, and their levels in decibels.

    radar cross section   sigma = 4 pi |f|^2,   10 log10 sigma, dBsm
    target strength       TS = 20 log10 |f|, dB re 1 m

Sources: [S08] for the cross section, [U83] for target strength.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.frequency import frequency
from creeping.field.results.comparison import cross_section_decibels, decibels
from creeping.field.results.labelled import Tabled, dataset, power

if TYPE_CHECKING:
    import xarray

LEVELS = {"rcs": ("radar cross section", "dBsm"), "ts": ("target strength", "dB re 1 m")}
"""Names of the levels, and their units where lengths are metres."""


@dataclass(frozen=True, eq=False, repr=False)
class Echo(Drawn, Tabled):
    """Echo in c channels at n angles and k wavenumbers; lengths are in metres.

    Attributes
    ----------
    quantity : {"rcs", "ts"}
    channels : tuple of str
        Polarisations, received then transmitted, or a boundary.
    angle_name : str
        "azimuth" or "elevation", the angle that varies; "" for one direction.
    azimuth, elevation : (n,), degrees
        Of the radar, or of the observers of a bistatic cut, as seen from the body.
    incidence : (azimuth, elevation), degrees, or None
        Of the radar of a bistatic cut; None in backscatter.
    wavenumbers : (k,), 1/m
    total : (c, n, k) complex, m
        Amplitude f.
    parts : dict of str to (c, n, k) complex, m
        Contributions that add up to ``total`` (creeping, reflected, forward); NaN where no rays were summed.
    error : (c, n, k), m
        Error of |f|.
    unresolved : (c, n, k) of bool
        Whether an expansion fails or the error is large, as in `FarField`.
    by_currents : (c, n, k) of bool
        Whether currents, the integral equation or a T-matrix gave the value, rather than rays.
    sound_speed : float, m/s, optional
        Speed of the wave; the speed of light if None.
    otherwise : str
        Method used where ``by_currents`` is False: "rays", or "rays+optics" for a body with edges, joints or tips.

    Raises
    ------
    InvalidInputError
        If the arrays do not fit each other.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> from creeping.sweeping.echoes import echo_of
    >>> ds = cr.backscatter(sc.Sphere(0.15), wavenumbers=[200.0, 210.0])
    >>> echo = echo_of(ds, "rcs", ("VV", "HH"), "")
    >>> echo.levels().shape, echo.levels()[0, 0].round(1).tolist()
    ((2, 1, 2), [-11.4, -11.4])
    """

    quantity: str
    channels: tuple[str, ...]
    angle_name: str
    azimuth: FloatArray
    elevation: FloatArray
    incidence: tuple[float, float] | None
    wavenumbers: FloatArray
    total: ComplexArray
    parts: dict[str, ComplexArray]
    error: FloatArray
    unresolved: BoolArray
    by_currents: BoolArray
    sound_speed: float | None = None
    otherwise: str = "rays"

    def __post_init__(self) -> None:
        if self.quantity not in LEVELS:
            raise InvalidInputError(f"quantity {self.quantity!r} is none of {', '.join(LEVELS)}")
        shape = (len(self.channels), len(self.azimuth), len(self.wavenumbers))
        flags = {"error": self.error, "unresolved": self.unresolved, "by_currents": self.by_currents}
        for name, values in {"total": self.total, **self.parts, **flags}.items():
            if values.shape != shape:
                raise InvalidInputError(f"{name} of an echo has shape {values.shape}, not {shape}")
        if self.elevation.shape != self.azimuth.shape:
            raise InvalidInputError(f"elevation has shape {self.elevation.shape}, not {self.azimuth.shape}")

    def __repr__(self) -> str:
        told = self.summary()
        kind = "pec" if self.quantity == "rcs" else self.channels[0]
        tops = ", ".join(f"{c} up to {'none' if v is None else f'{v:.1f}'}" for c, v in told["largest"].items())
        return (
            f"Echo({told['quantity']}, {kind}, {told['angles']} angles x {told['frequencies']} frequencies)\n"
            f"  {tops} {told['unit']}; {told['unresolved']} of {told['values']} values unresolved"
        )

    @property
    def angles(self) -> FloatArray:
        """Azimuth or elevation, whichever varies: (n,), degrees."""
        return self.elevation if self.angle_name == "elevation" else self.azimuth

    @property
    def hertz(self) -> FloatArray:
        """Frequencies (k,), Hz, rounded to 14 digits, which removes the rounding of the wavenumbers."""
        found = np.atleast_1d(frequency(self.wavenumbers, sound_speed=self.sound_speed))
        return np.array([float(f"{value:.14g}") for value in found])

    @property
    def viewer(self) -> str:
        """What sees the body: "radar" or "sonar"."""
        return "radar" if self.quantity == "rcs" else "sonar"

    @property
    def level_name(self) -> tuple[str, str]:
        """Name of the level, e.g. "radar cross section", and its unit."""
        return LEVELS[self.quantity]

    def levels(self, amplitude: ComplexArray | FloatArray | None = None) -> FloatArray:
        """Levels, dB, of ``total`` (c, n, k), or of another amplitude (...), m, in the shape of that amplitude."""
        values = self.total if amplitude is None else amplitude
        return cross_section_decibels(values) if self.quantity == "rcs" else decibels(values)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Levels, dB, of |f| - error and |f| + error: (c, n, k) each; the lower may be -inf."""
        size = np.abs(self.total)
        return self.levels(np.maximum(size - self.error, 0.0)), self.levels(size + self.error)

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of amplitude, parts, level, error and flags by channel, angle and frequency."""
        dims = ("channel", "angle", "frequency")
        coordinates: dict[str, Any] = {
            "channel": (("channel",), list(self.channels)),
            "angle": (("angle",), self.angles, {"units": "degree", "long_name": self.angle_name or "angle"}),
            "azimuth": (("angle",), self.azimuth, {"units": "degree"}),
            "elevation": (("angle",), self.elevation, {"units": "degree"}),
            "frequency": (("frequency",), self.hertz, {"units": "Hz"}),
            "wavenumber": (("frequency",), self.wavenumbers, {"units": power("m", -1), "long_name": "k"}),
        }
        name, unit = self.level_name
        variables: dict[str, Any] = {
            "total": (dims, self.total, {"units": "m", "long_name": "far-field amplitude f"}),
            "level": (dims, self.levels(), {"units": unit, "long_name": name}),
            "error": (dims, self.error, {"units": "m", "long_name": "error of |f|"}),
            "unresolved": (dims, self.unresolved, {"long_name": "an expansion fails, or the error is large"}),
            "by_currents": (dims, self.by_currents, {"long_name": f"else by {self.otherwise}"}),
        }
        variables |= {part: (dims, values, {"units": "m"}) for part, values in self.parts.items()}
        return dataset(variables, coordinates)

    def summary(self) -> dict[str, Any]:
        """Sizes, largest level of each channel, error and number of unresolved values, by name."""
        levels, size = self.levels(), np.abs(self.total)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = 20 * np.log10(1 + self.error / size)
        known = off[np.isfinite(off)]
        return {
            "quantity": LEVELS[self.quantity][0],
            "unit": LEVELS[self.quantity][1],
            "channels": list(self.channels),
            "angles": len(self.azimuth),
            "frequencies": len(self.wavenumbers),
            "largest": {
                c: _finite(np.max(v, initial=-np.inf, where=np.isfinite(v)))
                for c, v in zip(self.channels, levels, strict=True)
            },
            "not_finite": int(np.sum(~np.isfinite(self.total))),
            "error_db_median": _finite(np.median(known)) if known.size else None,
            "error_db_95": _finite(np.quantile(known, 0.95)) if known.size else None,
            "unresolved": int(self.unresolved.sum()),
            "by_currents": int(self.by_currents.sum()),
            "otherwise_by": self.otherwise,
            "values": int(levels.size),
        }


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
