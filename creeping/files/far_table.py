"""A far field as a table: one row per direction, the total and its parts, for a vector field each component."""

from collections.abc import Iterable, Sequence
from itertools import repeat
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.field.decibels import cross_section_decibels, decibels

if TYPE_CHECKING:
    from creeping.field.far_result import FarField

_COMPONENTS = ("_tt", "_tp", "_pt", "_pp")


def angles_of(directions: FloatArray) -> FloatArray:
    """θ and φ in radians, 0 <= φ < 2π and 0 at the poles: (..., 3) -> (..., 2)."""
    x, y, z = np.moveaxis(np.asarray(directions, dtype=float), -1, 0)
    across = np.hypot(x, y)
    phi = np.where(across < 1e-12, 0.0, np.mod(np.arctan2(y, x), 2 * np.pi))
    # just below 0 the remainder rounds to 2π
    return np.stack([np.arctan2(across, z), np.where(phi >= 2 * np.pi, 0.0, phi)], axis=-1)


def notes(far: "FarField", *, observed: bool = False) -> dict[str, str]:
    """Columns and what they hold."""
    unit = far.unit
    of = f"k = {far.wavenumber!r} 1/{unit}, {far.boundary} boundary, order {far.order}, time factor exp(-i w t)"
    columns = {
        "x": "direction from the body to the observer",
        "y": "direction",
        "z": "direction",
        "theta": "degrees from z",
        "phi": "degrees from x, 0 at the poles",
    }
    for suffix in _suffixes(far):
        name = f", {_spelled(suffix)} by {_spelled(suffix[0] + suffix[2:])} incident" if suffix else ""
        columns[f"re{suffix}"] = f"real part of the far field f, {unit}{name}; {of}"
        columns[f"im{suffix}"] = "imaginary part"
        columns[f"dB{suffix}"] = "20 log10 |f|, -inf where f is 0"
        area = "dBsm" if unit == "m" else f"dB re 1 {unit}^2"
        columns[f"rcs_dB{suffix}"] = f"10 log10(4 pi |f|^2), {area}"
        columns[f"error{suffix}"] = f"error of f, {unit}, {_error_of(far)}"
        for part in far.parts:
            columns[f"{part}_re{suffix}"] = f"part of f, {unit}{name}"
            columns[f"{part}_im{suffix}"] = "imaginary part"
    columns["method"] = "what gave the field, or its part of creeping rays"
    columns["unresolved"] = "1 where a part was not found, its expansion fails or the error is large"
    if observed:
        columns["observe"] = "what was asked for, its commas blanks"
        columns["angle"] = "degrees along a cut, theta with the sign of its side; nan of what is no cut"
    return columns


def rows(far: "FarField", observed: "tuple[Sequence[str], FloatArray] | None" = None) -> Iterable[tuple[Any, ...]]:
    """One tuple for each direction, in the order of `notes`."""
    columns: list[Any] = [*np.asarray(far.directions).T, *np.degrees(angles_of(far.directions)).T]
    for k in range(len(_suffixes(far))):
        total = _component(far.total, k)
        columns += [total.real, total.imag, decibels(total), cross_section_decibels(total), _component(far.error, k)]
        for values in (_component(part, k) for part in far.parts.values()):
            columns += [values.real, values.imag]
    numbers = zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    texts, angles = observed or ((), np.zeros(0))
    ends = zip((text.replace(",", " ") for text in texts), angles.tolist(), strict=True) if observed else repeat(())
    for row, method, lost, end in zip(numbers, far.method, far.unresolved, ends, strict=False):
        yield (*row, method, int(lost), *end)


def _error_of(far: "FarField") -> str:
    if far.error_by == "extinction":
        return "measured inside the body, for 95 of 100 directions"
    if far.error_by == "extrapolated":
        return f"of rays, its level measured against currents at k = {far.measured_at:.4g}"
    return "of rays, by the size of their second order" if far.error_by else "not known"


def _suffixes(far: "FarField") -> tuple[str, ...]:
    return ("",) if np.ndim(far.total) == 1 else _COMPONENTS


def _component(values: Any, number: int) -> Any:
    """One component (m,) of a field (m,) or (m, 2, 2)."""
    return np.asarray(values).reshape(len(values), -1)[:, number]


def _spelled(suffix: str) -> str:
    return {"t": "theta", "p": "phi"}[suffix[1]]
