"""What a far field is: complex amplitudes by direction, their parts, and what is to be thought of them."""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.decibels import cross_section_decibels, decibels
from creeping.field.validity_range import Validity, validity_numbers

if TYPE_CHECKING:
    import pandas
    import xarray


BY_DIRECTION = ("directions", "total", "method", "unresolved", "error")
"""Arrays of a far field whose first axis is the direction, its parts apart."""


@dataclass(frozen=True, eq=False, repr=False)
class FarField(Drawn):
    """Far field in m directions, a length; scalar, or (θ̂, φ̂) scattered by (θ̂, φ̂) incident.

    Attributes
    ----------
    directions : (m, 3)
        Unit r, from the body to the observer.
    total : (m,) or (m, 2, 2) complex, L
        The amplitude f.
    parts : dict of str to complex, L
        What ``total`` is the sum of. Of rays "creeping", "reflected" and "forward": what creeping rays shed, what the
        lit side reflects, the forward lobe; where they are blended each carries its weight. Of currents "lit" and
        "dark": what the currents of both sides of the shadow line radiate, which are no rays.
    method : (m,) of str
        What gave the field: "currents" by expansions, "equation" where the body's integral equation gave them,
        "rays+optics" of a body with edges, or what gave the part of the creeping rays, "forward", "rays", "fan", or
        several joined by "+".
    unresolved : (m,) of bool
        Whether an expansion fails there for more than a twentieth of the field: a caustic of creeping rays that the
        fan integral does not cover, a caustic of the reflected field (a specular point on a nearly flat region), or a
        forward lobe with no bisector contour (a concave region) or with a rim that the body hides in part; or whether
        rays that end too early may lack so much there (`creeping.field.ray_ends`); or whether,
        where k times the radii is below 4, the error is more than half of all contributions. With currents, whether
        it is more than a tenth of the largest |f|.
    error : (m,) or (m, 2, 2), L
        Of |f|, meant to hold in 95 of 100 directions; NaN where it is not known.
    error_by : str
        "extinction", measured inside the body (`creeping.field.currents.whole_body`); "order", the size of what is
        beyond both orders of each ray and of what is left out; "extrapolated", the same, its level measured against
        currents at a lower wavenumber (`creeping.field.extrapolated`).
    wavenumber : float, 1/L
    boundary : str
    order : int
    measured_at : float, 1/L
        Wavenumber at which the level of an extrapolated error was measured; else NaN.
    unit : str
        Of lengths: "m" where the body knows it, else "L".
    validity : Validity, optional
        Least k rho and largest kappa_t rho/m^2 on the fan's rays; of `far_field`.

    Raises
    ------
    ValueError
        If a part is of another shape than the total.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=2.0, n_rays=16)
    >>> ff = cr.far_field(fan, [(0, 1, 0)], wavenumber=30.0, boundary="soft")
    >>> bool(abs(ff.cross_section[0] / np.pi - 1) < 0.05), ff.method.tolist()       # about pi radius^2
    (True, ['currents'])
    """

    directions: FloatArray
    total: ComplexArray
    parts: dict[str, ComplexArray]
    method: np.ndarray[Any, np.dtype[np.str_]]
    unresolved: BoolArray
    error: FloatArray
    error_by: str
    wavenumber: float
    boundary: str
    order: int
    measured_at: float = np.nan
    unit: str = "L"
    validity: Validity | None = None

    def __post_init__(self) -> None:
        for name, values in self.parts.items():
            if values.shape != self.total.shape:
                raise ValueError(f"part {name} of a far field has shape {values.shape}, the total {self.total.shape}")

    @property
    def creeping(self) -> ComplexArray:
        """What creeping rays shed, L; NaN where the method does not know it apart, as `reflected` and `forward`."""
        return self._part("creeping")

    @property
    def reflected(self) -> ComplexArray:
        """What the lit side reflects, L; NaN where it is not known apart."""
        return self._part("reflected")

    @property
    def forward(self) -> ComplexArray:
        """The forward lobe, L; NaN where it is not known apart."""
        return self._part("forward")

    def _part(self, name: str) -> ComplexArray:
        known = self.parts.get(name)
        return np.full(self.total.shape, complex(np.nan, np.nan)) if known is None else known

    def take(self, rows: slice | IntArray) -> FarField:
        """The field in some of its directions."""
        parts = {name: values[rows] for name, values in self.parts.items()}
        return replace(self, parts=parts, **{name: getattr(self, name)[rows] for name in BY_DIRECTION})

    @staticmethod
    def joined(fields: Sequence[FarField]) -> FarField:
        """Fields of one kind in the directions of all, one after the other."""
        parts = {name: np.concatenate([one.parts[name] for one in fields]) for name in fields[0].parts}
        lanes: dict[str, Any] = {n: np.concatenate([getattr(one, n) for one in fields]) for n in BY_DIRECTION}
        return replace(fields[0], parts=parts, **lanes)

    @property
    def cross_section(self) -> FloatArray:
        """4π|f|², L²."""
        return np.asarray(4 * np.pi * np.abs(self.total) ** 2)

    @property
    def dbsm(self) -> FloatArray:
        """Radar cross section 10 log10(4π|f|²), dB relative to a square metre if L is the metre: as ``total``."""
        return cross_section_decibels(self.total)

    @property
    def target_strength(self) -> FloatArray:
        """Target strength 20 log10 |f|, dB relative to a metre if L is the metre, as of sonar: as ``total``."""
        return decibels(self.total)

    def to_xarray(self) -> xarray.Dataset:
        """Amplitudes, parts, error and cross section with names on their axes: an ``xarray.Dataset``.

        Dimensions are ``direction``, of a conductor ``scattered`` and ``incident`` too, "theta" and "phi"; coordinates
        ``vector``, ``azimuth`` and ``elevation`` (degrees) of the directions.
        """
        from creeping.field.labelled import far_dataset

        return far_dataset(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """The same as a ``pandas.DataFrame``, one row for each direction, of a conductor for each component of it."""
        return self.to_xarray().drop_vars("vector").drop_dims("axis", errors="ignore").to_dataframe()

    def __repr__(self) -> str:
        names, counts = np.unique(self.method, return_counts=True)
        served = ", ".join(f"{n} by {name}" for name, n in zip(names, counts, strict=True))
        size = np.abs(self.total)
        finite = np.isfinite(size)
        largest = np.max(size, initial=0.0, where=finite)
        missing = f", {int(np.sum(~finite))} not finite" if not np.all(finite) else ""
        off = self.stated_error
        error = (
            ""
            if off is None
            else f"; error by {self.error_source} {off[0]:.2g} {self.unit} rms, {off[1]:.2g} {self.unit} at most"
        )
        return (
            f"FarField({len(self.directions)} directions, k = {self.wavenumber:g}, {self.boundary}, "
            f"order {self.order}{self._range})\n"
            f"  {served or 'none'}; {int(self.unresolved.sum())} unresolved{missing}\n"
            f"  |f| up to {largest:.4g} {self.unit}{error}"
        )

    @property
    def _range(self) -> str:
        """What its text says of how far the wave is from the limit of short waves."""
        if self.validity is None or not np.isfinite(self.validity.least_k_rho):
            return ""
        return f"; {validity_numbers(self.validity)}"

    @property
    def error_source(self) -> str:
        """What the error comes from, in words."""
        if self.error_by == "extrapolated":
            return f"extrapolation from k = {self.measured_at:.3g}"
        return self.error_by

    @property
    def stated_error(self) -> tuple[float, float] | None:
        """Rms and largest of the errors that are known, L; None if none is."""
        known = self.error[np.isfinite(self.error)]
        return (float(np.sqrt(np.mean(known**2))), float(known.max())) if len(known) else None
