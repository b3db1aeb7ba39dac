"""A field on a plane as a table: one row for each point outside the body."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any

if TYPE_CHECKING:
    from creeping.field.cut_result import FieldCut


def notes(cut: "FieldCut") -> dict[str, str]:
    """Columns and what they hold."""
    field = cut.field
    unit = field.length_unit
    of = f"k = {field.wavenumber!r} 1/{unit}, {field.boundary} boundary, order {field.order}, time factor exp(-i w t)"
    place = f"from ({', '.join(f'{v!r}' for v in cut.point.tolist())})"
    columns = {
        name: f"along ({', '.join(f'{v!r}' for v in axis)}) {place}, {unit}"
        for name, axis in zip(("across", "up"), cut.axes.tolist(), strict=True)
    }
    columns |= {name: f"position, {unit}" for name in "xyz"}
    for name in _names(cut):
        columns[f"re_{name}"] = f"real part of {name}, {field.unit}; {of}"
        columns[f"im_{name}"] = "imaginary part"
    columns["error"] = f"of the field, {field.unit}"
    columns["status"] = "0 OK, 1 LIT, 2 CAUSTIC, 3 NO_RAY, 4 DETACHED, 5 TRUNCATED, 6 UNRESOLVED"
    columns["method"] = "what served"
    return columns


def rows(cut: "FieldCut") -> Iterable[tuple[Any, ...]]:
    """One tuple for each point outside, in the order of `notes`."""
    across, up = np.meshgrid(cut.across, cut.up)
    columns: list[Any] = [across[cut.outside], up[cut.outside], *cut.field.points.T]
    for name in _names(cut):
        values = _values(cut, name)
        columns += [values.real, values.imag]
    columns += [cut.field.error, cut.field.status, cut.field.method]
    yield from zip(*(np.asarray(column).tolist() for column in columns), strict=True)


def _names(cut: "FieldCut") -> list[str]:
    return ["u"] if cut.quantities == ("u",) else [f"{letter}{axis}" for letter in cut.quantities for axis in "xyz"]


def _values(cut: "FieldCut", name: str) -> Any:
    field: Any = cut.field
    return field.values if name == "u" else getattr(field, name[0])[:, "xyz".index(name[1])]
