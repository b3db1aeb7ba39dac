"""Files of lines, fans, iso-phase curves, far fields and fields on planes for other programs: VTK (.vtp) and CSV.

Numbers keep all 17 digits, so that what is read back is what was written.

Also here: a field on a plane as a table: one row for each point outside the body.

Also here: a far field as a table: one row per direction, the total and its parts, for a vector field each component.

Also here: an echo as a table: a row for each channel, angle and frequency, columns explained in lines that begin with
#.
"""

import os
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TextIO

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.files import tables as _cut_table
from creeping.files import tables as _far_table
from creeping.files.polylines import polydata
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.cut_result import FieldCut
    from creeping.field.echo import Echo
    from creeping.field.far_result import FarField
    from creeping.field.impulse import RangeProfile
from itertools import repeat
from typing import TYPE_CHECKING

from creeping.field.comparison import cross_section_decibels, decibels

_RAY_COLUMNS = ("eikonal", "spreading", "spreading_rate", "curvature", "caustic_index")

_COMPONENTS = ("_tt", "_tp", "_pt", "_pp")

COLUMNS = {
    "channel": "polarisation received and transmitted (V along theta, H along phi), or the boundary",
    "azimuth_deg": "as seen from the body",
    "elevation_deg": "as seen from the body",
    "frequency_hz": "",
    "wavenumber_1_m": "k",
    "level_db": "",
    "low_db": "level of |f| less its error",
    "high_db": "level of |f| and its error",
    "phase_deg": "of f, relative to the origin of the body's coordinates; time factor exp(-i w t)",
    "re_m": "real part of f",
    "im_m": "imaginary part of f",
    "error_m": "of |f|",
}
_POSITION = {"x": "position, L", "y": "position, L", "z": "position, L"}
_LINE_NOTES = {
    "curve": "number of the closed curve",
    "s": "arclength along it, L",
    **_POSITION,
    "status": "attached, occluded or concave",
}
_FAN_NOTES = {
    "ray": "number of the ray",
    "step": "number of the point on it",
    "t": "travel time; L where the speed is 1",
    **_POSITION,
    "px": "unit tangent",
    "py": "unit tangent",
    "pz": "unit tangent",
    "eikonal": "as t",
    "J": "spreading, 1 on the shadow line",
    "dJ": "its rate along the ray",
    "kappa_n": "normal curvature along the ray, 1/L, positive where convex",
    "caustic_index": "zeros of J passed",
    "status": "status code of the ray",
}
_CURVE_NOTES = {
    "curve": "number of the curve",
    "of": "travel_time or eikonal",
    "level": "its constant value; L where the speed is 1",
    "closed": "1 if the last point joins the first",
    **_POSITION,
}


def write_vtp(
    path: str | os.PathLike[str],
    line: ShadowLine | None = None,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
) -> None:
    """Write polylines as VTK XML PolyData, for ParaView, pyvista and others.

    One polyline per curve of the shadow line, ray and iso-phase curve. Point arrays: travel_time, eikonal, spreading,
    spreading_rate, curvature, attenuation, caustic_index, line_status (0 attached, 1 occluded, 2 concave), ray_status
    (the ray's, from where it applies). Cell arrays: kind (0 shadow line, 1 ray, 2 iso-phase curve), ray (its number),
    status (`RayStatus`), curve_index, level. Where an array does not apply it is NaN, or -1 if of integers.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    line, fan, curves
        What to write; leave out what is not wanted.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    # to memory, then by Python: a full disk is an error here, whereas VTK's own writing to a file only logs it
    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(polydata(line, fan, curves))
    writer.SetHeaderTypeToUInt64()
    # binary, because VTK's reader stops at an ascii nan
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    writer.Write()
    with written_aside(path) as aside:
        aside.write_text(writer.GetOutputString(), encoding="ascii")


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, replaced at once when complete.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    with written_aside(path) as aside:
        aside.write_text(text, encoding="utf-8", newline="\n")


def write_csv(
    path: str | os.PathLike[str],
    *,
    line: ShadowLine | None = None,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] | None = None,
    far: "FarField | None" = None,
    cut: "FieldCut | None" = None,
    observed: tuple[Sequence[str], FloatArray] | None = None,
    mark: str = "",
) -> None:
    """Write one table as CSV, one row per point or direction, its columns explained in lines that begin with ``#``.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    line, fan, curves, far, cut
        Exactly one of them: they have different columns.
    observed : (texts, angles), optional
        Of a far field: what each direction was asked for as, and its angle along the cut (m,), degrees.
    mark : str
        What the first line says of rows that are missing.

    Raises
    ------
    InvalidInputError
        If not exactly one is given.
    CreepingError
        If the file cannot be written.
    """
    parts = {"line": line, "fan": fan, "curves": curves, "far": far, "cut": cut}
    given = [name for name, value in parts.items() if value is not None]
    if len(given) != 1:
        raise InvalidInputError(
            f"write_csv got {' and '.join(given) or 'nothing'}; give exactly one of {', '.join(parts)}, a file for each"
        )
    with written_aside(path) as aside, aside.open("w", encoding="ascii", newline="\n") as stream:
        stream.writelines([f"# {mark}\n"] if mark else [])
        if line is not None:
            _write_table(stream, _in_unit(_LINE_NOTES, unit_of(line.body)), _line_rows(line))
        elif fan is not None:
            _write_table(stream, _in_unit(_FAN_NOTES, unit_of(fan.body)), _fan_rows(fan))
        elif curves is not None:
            unit = curves[0].unit if curves else UNKNOWN
            _write_table(stream, _in_unit(_CURVE_NOTES, unit), _curve_rows(curves))
        elif far is not None:
            _write_table(
                stream,
                _far_table.far_field_notes(far, observed=observed is not None),
                _far_table.far_field_rows(far, observed),
            )
        elif cut is not None:
            _write_table(stream, _cut_table.notes(cut), _cut_table.rows(cut))


def _in_unit(notes: dict[str, str], unit: str) -> dict[str, str]:
    """Notes with the unit of the body's lengths in place of L."""
    return {name: re.sub(r"\bL\b", unit, note) for name, note in notes.items()}


def _write_table(stream: TextIO, notes: dict[str, str], rows: Iterable[tuple[Any, ...]]) -> None:
    stream.writelines(f"# {name}: {note}\n" for name, note in notes.items())
    stream.write(",".join(notes) + "\n")
    # str of a Python float is its repr: the shortest text that reads back to the same number
    stream.writelines(",".join(map(str, row)) + "\n" for row in rows)


def _line_rows(line: ShadowLine) -> Iterable[tuple[Any, ...]]:
    for number, curve in enumerate(line.curves):
        arclength, points = np.asarray(curve.arclength).tolist(), np.asarray(curve.points).tolist()
        for s, point, status in zip(arclength, points, curve.status, strict=True):
            yield (number, s, *point, status)


def _fan_rows(fan: RayFan) -> Iterable[tuple[Any, ...]]:
    times = np.asarray(fan.travel_time).tolist()
    for ray in range(len(fan.points)):
        status = int(fan.status[ray])
        columns = (fan.points, fan.directions, *(getattr(fan, name) for name in _RAY_COLUMNS))
        values = zip(times, *(np.asarray(column[ray]).tolist() for column in columns), strict=True)
        for step, (t, point, direction, *carried) in enumerate(values):
            yield (ray, step, t, *point, *direction, *carried, status)


def _curve_rows(curves: Sequence[IsoPhaseCurve]) -> Iterable[tuple[Any, ...]]:
    for number, curve in enumerate(curves):
        for point in np.asarray(curve.points).tolist():
            yield (number, curve.of, float(curve.level), int(curve.closed), *point)


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
    columns["method"] = "the method used"
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


def angles_of(directions: FloatArray) -> FloatArray:
    """θ and φ in radians, 0 <= φ < 2π and 0 at the poles: (..., 3) -> (..., 2)."""
    x, y, z = np.moveaxis(np.asarray(directions, dtype=float), -1, 0)
    across = np.hypot(x, y)
    phi = np.where(across < 1e-12, 0.0, np.mod(np.arctan2(y, x), 2 * np.pi))
    # just below 0 the remainder rounds to 2π
    return np.stack([np.arctan2(across, z), np.where(phi >= 2 * np.pi, 0.0, phi)], axis=-1)


def far_field_notes(far: "FarField", *, observed: bool = False) -> dict[str, str]:
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


def far_field_rows(
    far: "FarField", observed: "tuple[Sequence[str], FloatArray] | None" = None
) -> Iterable[tuple[Any, ...]]:
    """One tuple for each direction, in the order of `far_field_notes`."""
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


def write_echo(path: str | os.PathLike[str], echo: "Echo", *, known: BoolArray | None = None, mark: str = "") -> None:
    """Write an echo as CSV.

    Parameters
    ----------
    path : str or path
    echo : Echo
    known : (n, k) of bool, optional
        Angles and wavenumbers whose rows are written.
    mark : str
        What the first line says of rows that are missing.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    from creeping.field.echo import LEVELS

    total, levels, (low, high) = echo.total, echo.levels(), echo.bounds()
    phase = np.degrees(np.angle(total))
    name, unit = LEVELS[echo.quantity]
    words = COLUMNS | {"level_db": f"{name}, {unit}"}
    words |= {f"{part}_{axis}_m": f"{part} part of f" for part in echo.parts for axis in ("re", "im")}
    words |= {
        "unresolved": "1 where an expansion fails or the error is large",
        "method": "rays, currents, or rays+optics of a body with edges, joints or tips",
    }
    hertz = echo.hertz
    with written_aside(path) as aside, open(aside, "w", encoding="utf-8", newline="\n") as stream:
        stream.writelines([f"# {mark}\n"] if mark else [])
        stream.writelines(f"# {key}: {text}\n" for key, text in words.items() if text)
        stream.write(",".join(words) + "\n")
        for at in np.ndindex(total.shape):
            c, n, k = at
            if known is not None and not known[n, k]:
                continue
            row: list[Any] = [
                echo.channels[c],
                echo.azimuth[n],
                echo.elevation[n],
                hertz[k],
                echo.wavenumbers[k],
                levels[at],
            ]
            row += [low[at], high[at], phase[at], total[at].real, total[at].imag, echo.error[at]]
            for part in echo.parts.values():
                row += [part[at].real, part[at].imag]
            row += [
                echo.unresolved[at].astype(int),
                "currents" if echo.by_currents[at] and echo.otherwise != "t-matrix" else echo.otherwise,
            ]
            stream.write(",".join(map(_text, row)) + "\n")


def _text(value: object) -> str:
    """Shortest text that reads back to the same number."""
    return value if isinstance(value, str) else repr(getattr(value, "item", lambda: value)())


def write_profile(path: str | os.PathLike[str], profiles: "dict[str, RangeProfile]", echo: "Echo") -> None:
    """Write range profiles by channel as CSV.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    with written_aside(path) as aside, open(aside, "w", encoding="utf-8", newline="\n") as stream:
        stream.write("# range_m: along the line of sight, 0 at the origin, negative towards the radar\n")
        stream.write("# level_db: of the echo from there\n")
        stream.write("channel,range_m,level_db,phase_deg\n")
        for channel, found in profiles.items():
            levels, phase = echo.levels(found.values), np.degrees(np.angle(found.values))
            for values in zip(found.range.tolist(), levels.tolist(), phase.tolist(), strict=True):
                stream.write(f"{channel},{','.join(map(repr, values))}\n")
