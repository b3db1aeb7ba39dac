"""What a far field is: complex amplitudes by direction, their parts, and what is to be thought of them.

Also here: polarisation of a perfect conductor's far field: each contribution is a sum of two dyads.

    across   s = n × d/|n × d| of the incident, n' × r/|n' × r| of the scattered wave      soft
    along    h = s × d,  s' × r                                                            electric hard

n is the normal where the wave lands, n' where it leaves: both s and h are carried by the ray (b → b, n → n), with no
exchange between them [PBM80]. Components are those of θ̂ and φ̂ at the directions of travel d and r.

Sources: Derivations, F14.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.results.comparison import cross_section_decibels, decibels
from creeping.field.results.labelled import COMPONENTS, Tabled, dataset, directed, power
from creeping.field.validity_range import Validity, validity_numbers
from creeping.geometry.arguments import shown

if TYPE_CHECKING:
    import xarray

BY_DIRECTION = ("directions", "total", "method", "unresolved", "error")
"""Arrays of a far field whose first axis is the direction, its parts apart."""


@dataclass(frozen=True, eq=False, repr=False)
class FarField(Drawn, Tabled):
    """Far-field amplitude f, L, in m directions; for a conductor a matrix, scattered (θ̂, φ̂) by incident (θ̂, φ̂).

    Attributes
    ----------
    directions : (m, 3)
        Unit vectors r from the body to the observers.
    total : (m,) or (m, 2, 2) complex, L
        The amplitude f.
    parts : dict of str to complex, L
        Contributions that add up to ``total``. Sums over rays have "creeping" (shed by creeping rays), "reflected"
        (from the lit side) and "forward" (the forward lobe), each with its blending weight. Currents have "lit" and
        "dark": the radiation of the currents on either side of the shadow line.
    method : (m,) of str
        "currents" (by expansions), "equation" (currents from the integral equation) or "rays+optics" (a body with
        edges). For sums over rays: how the creeping part was computed, "forward", "rays", "fan", or several joined
        by "+".
    unresolved : (m,) of bool
        For sums over rays, True if more than a twentieth of the field is missing or unreliable: at caustics of
        creeping or reflected rays, in the forward lobe of a body that is not convex, or where rays end too early.
        Also True if k times the radius of curvature is below 4 and the error exceeds half the sum of all
        contributions. For currents, True if the error exceeds a tenth of the largest |f|.
    error : (m,) or (m, 2, 2), L
        Error of |f|. It covers 95 % of directions; NaN where it is not known.
    error_by : str
        Source of the error: "extinction", the residual field inside the body (`creeping.field.currents.whole_body`);
        "order", the size of the terms that the expansions of the rays neglect; "extrapolated", the same, scaled to
        the error measured against currents at a lower wavenumber (`creeping.field.far`).
    wavenumber : float, 1/L
    boundary : str
    order : int
    measured_at : float, 1/L
        Wavenumber at which an extrapolated error was measured; else NaN.
    unit : str
        Unit of length: "m" if the body states it, else "L".
    validity : Validity, optional
        Least k rho and largest kappa_t rho/m^2 on the rays of the fan (`creeping.validity`); set by `far_field`.

    Raises
    ------
    ValueError
        If a part and the total differ in shape.

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
        """Contribution shed by creeping rays, L; NaN where the method does not separate it."""
        return self._part("creeping")

    @property
    def reflected(self) -> ComplexArray:
        """Contribution reflected by the lit side, L; NaN where the method does not separate it."""
        return self._part("reflected")

    @property
    def forward(self) -> ComplexArray:
        """Contribution of the forward lobe, L; NaN where the method does not separate it."""
        return self._part("forward")

    def _part(self, name: str) -> ComplexArray:
        known = self.parts.get(name)
        return np.full(self.total.shape, complex(np.nan, np.nan)) if known is None else known

    def take(self, rows: slice | IntArray) -> FarField:
        """Far field in the directions selected by a slice or by row numbers."""
        parts = {name: values[rows] for name, values in self.parts.items()}
        return replace(self, parts=parts, **{name: getattr(self, name)[rows] for name in BY_DIRECTION})

    @staticmethod
    def joined(fields: Sequence[FarField]) -> FarField:
        """Concatenate far fields of one kind along their directions."""
        parts = {name: np.concatenate([one.parts[name] for one in fields]) for name in fields[0].parts}
        lanes: dict[str, Any] = {n: np.concatenate([getattr(one, n) for one in fields]) for n in BY_DIRECTION}
        return replace(fields[0], parts=parts, **lanes)

    def packed(self) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of numbers (m, ...) for storage; `unpacked` restores the far field from them."""
        names, codes = np.unique(self.method, return_inverse=True)
        shared = ("error_by", "wavenumber", "boundary", "order", "measured_at", "unit")
        words = {name: getattr(self, name) for name in shared}
        words |= {"methods": names.tolist(), "validity": None if self.validity is None else list(self.validity)}
        arrays = {name: getattr(self, name) for name in BY_DIRECTION if name != "method"}
        arrays |= {f"part_{name}": values for name, values in self.parts.items()}
        return arrays | {"codes": codes, "words": np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)}

    @staticmethod
    def unpacked(arrays: dict[str, np.ndarray[Any, Any]]) -> FarField:
        """Restore a far field, (m,) or (m, 2, 2), L, from the arrays of `packed`."""
        words = json.loads(bytes(arrays["words"]))
        names, validity = words.pop("methods"), words.pop("validity")
        words["validity"] = None if validity is None else Validity(*validity)
        lanes: dict[str, Any] = {n: np.array(arrays[n]) for n in BY_DIRECTION if n != "method"}
        parts = {n.removeprefix("part_"): np.array(v) for n, v in arrays.items() if n.startswith("part_")}
        return FarField(parts=parts, method=np.array(names)[arrays["codes"]], **lanes, **words)

    @property
    def cross_section(self) -> FloatArray:
        """4π|f|², L²."""
        return np.asarray(4 * np.pi * np.abs(self.total) ** 2)

    @property
    def dbsm(self) -> FloatArray:
        """Radar cross section 10 log10(4π|f|²), dB relative to L² (dBsm if L is the metre), shaped as ``total``."""
        return cross_section_decibels(self.total)

    @property
    def target_strength(self) -> FloatArray:
        """Sonar target strength 20 log10 |f|, dB relative to L (to 1 m if L is the metre), shaped as ``total``."""
        return decibels(self.total)

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of amplitudes, parts, error and cross section.

        The dimension is ``direction``; a conductor has ``scattered`` and ``incident`` too, with "theta" and "phi".
        Coordinates of the directions are ``vector``, and ``azimuth`` and ``elevation`` in degrees.
        """
        unit = self.unit
        dims = ("direction", "scattered", "incident")[: self.total.ndim]
        coordinates = directed(self.directions, self.wavenumber, unit)
        if self.total.ndim == 3:
            coordinates |= {name: ((name,), list(COMPONENTS)) for name in dims[1:]}
        variables: dict[str, Any] = {"total": (dims, self.total, {"units": unit, "long_name": "far-field amplitude f"})}
        for name, values in self.parts.items():
            variables[name] = (dims, values, {"units": unit, "long_name": f"{name} part of f"})
        area = {"units": power(unit, 2), "long_name": "cross section 4 pi |f|^2"}
        doubt = {"long_name": "an expansion fails, or the error is large"}
        variables |= {
            "error": (dims, self.error, {"units": unit, "long_name": f"error of |f|, by {self.error_source}"}),
            "cross_section": (dims, self.cross_section, area),
            "unresolved": (("direction",), self.unresolved, doubt),
            "method": (("direction",), self.method, {"long_name": "the method used"}),
        }
        return dataset(variables, coordinates, boundary=self.boundary, order=self.order)

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
        """Source of the error in words."""
        if self.error_by == "extrapolated":
            return f"extrapolation from k = {self.measured_at:.3g}"
        return self.error_by

    @property
    def stated_error(self) -> tuple[float, float] | None:
        """Rms and maximum of the known errors, L; None if no error is known."""
        known = self.error[np.isfinite(self.error)]
        return (float(np.sqrt(np.mean(known**2))), float(known.max())) if len(known) else None


def spherical_frame(directions: FloatArray) -> FloatArray:
    """θ̂ and φ̂ at unit directions (..., 3), φ = 0 at the poles: (..., 2, 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    across = np.hypot(x, y)
    polar = across < 1e-12
    safe = np.where(polar, 1.0, across)
    cos, sin = np.where(polar, 1.0, x / safe), np.where(polar, 0.0, y / safe)
    theta = np.stack([z * cos, z * sin, -across], axis=-1)
    phi = np.stack([-sin, cos, np.zeros_like(cos)], axis=-1)
    return np.stack([theta, phi], axis=-2)


def incident_mix(polarisation: str | ArrayLike | None, direction: FloatArray) -> ComplexArray:
    """Components along theta and phi of incident waves with |E| = 1: (2, p); None is both waves.

    Raises
    ------
    InvalidInputError
        If E0 is an unknown text, not three finite numbers, 0, or not perpendicular to the direction.

    Examples
    --------
    >>> d = np.array([0.0, 0.0, 1.0])
    >>> incident_mix("phi", d).real.tolist(), np.round(incident_mix((1, 1j, 0), d), 3).tolist()
    ([[0.0], [1.0]], [[(0.707+0j)], [0.707j]])
    """
    if polarisation is None:
        return np.eye(2, dtype=complex)
    if isinstance(polarisation, str):
        if polarisation not in ("theta", "phi"):
            raise InvalidInputError(
                f"polarisation = {polarisation!r} is not 'theta' or 'phi'; or give E0 as three numbers"
            )
        return np.eye(2, dtype=complex)[:, [("theta", "phi").index(polarisation)]]
    try:
        given = np.asarray(polarisation, dtype=complex)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"polarisation = {shown(polarisation)} is not E0 of three numbers") from error
    if given.shape != (3,) or not np.all(np.isfinite(given)) or not np.any(given):
        raise InvalidInputError(
            f"polarisation = {shown(polarisation)} is not E0 of three finite numbers, not all of them 0"
        )
    given = given / np.linalg.norm(given)
    along = abs(given @ direction)
    # what rounding leaves of a wave across the direction
    if along > 1e-6:
        raise InvalidInputError(
            f"polarisation = {shown(polarisation)} has {100 * along:.3g} % of itself along the direction of incidence; "
            "give E0 across it"
        )
    mix = spherical_frame(direction) @ given
    return np.asarray((mix / np.linalg.norm(mix))[:, None])


def turned_to_azimuth(directions: FloatArray, phi: FloatArray) -> FloatArray:
    """Matrices (m, 2, 2) that give components along θ̂ and φ̂ of the azimuths φ (m,), radians, from those of here.

    They differ at the poles alone, where θ̂ and φ̂ are those of the azimuth from which a cut or a grid comes there.

    Examples
    --------
    >>> turned_to_azimuth(np.array([[0.0, 0.0, 1.0]]), np.array([np.pi / 2])).round(12)[0].tolist()
    [[0.0, 1.0], [-1.0, 0.0]]
    """
    cosine = directions[:, 2]
    theta = np.stack(
        [cosine * np.cos(phi), cosine * np.sin(phi), -np.hypot(directions[:, 0], directions[:, 1])], axis=-1
    )
    own = np.stack([theta, np.stack([-np.sin(phi), np.cos(phi), np.zeros_like(phi)], axis=-1)], axis=1)
    polar = np.hypot(directions[:, 0], directions[:, 1]) < 1e-12
    turn = np.einsum("nac,nbc->nab", own, spherical_frame(directions))
    return np.where(polar[:, None, None], turn, np.eye(2))


def wave_frame(normals: FloatArray, directions: FloatArray, spare: FloatArray) -> FloatArray:
    """Vectors s and h of waves that travel along unit directions, (n, 3) each, normals of any length: (n, 2, 3).

    ``spare`` (n, 3), tangent to the body, replaces n × d where d is along n.
    """
    s = np.cross(normals, directions)
    long = np.linalg.norm(s, axis=-1, keepdims=True)
    # normals are known to 1e-11, and d and r share ``spare`` to this angle
    clear = long > 1e-6 * np.linalg.norm(normals, axis=-1, keepdims=True)
    s = np.where(clear, s / np.where(clear, long, 1.0), spare)
    return np.stack([s, np.cross(s, directions)], axis=-2)


def dyads(incoming: FloatArray, outgoing: FloatArray, direction: FloatArray, observers: FloatArray) -> FloatArray:
    """Components of both dyads (n, 2 kinds, 2 scattered, 2 incident), from frames (n, 2, 3); d is (3,) or (n, 3).

    The kind is that of the incoming vector; the outgoing one stands in the same place.
    """
    received = incoming @ np.swapaxes(spherical_frame(direction), -1, -2)
    sent = np.einsum("nkc,noc->nko", outgoing, spherical_frame(observers))
    return np.asarray(sent[..., :, None] * received[..., None, :])
