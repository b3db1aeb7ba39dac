"""Files of lines, fans, iso-phase curves, far fields and fields on planes for other programs: VTK (.vtp) and CSV.

Numbers keep all 17 digits, so that what is read back is what was written.
"""

import os
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TextIO

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.files import cut_table as _cut_table
from creeping.files import far_table as _far_table
from creeping.files.polylines import polydata
from creeping.geometry.unit import UNKNOWN, unit_of
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.cut_result import FieldCut
    from creeping.field.far_result import FarField

_RAY_COLUMNS = ("eikonal", "spreading", "spreading_rate", "curvature", "caustic_index")


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
        if line is not None:
            _write_table(stream, _in_unit(_LINE_NOTES, unit_of(line.body)), _line_rows(line))
        elif fan is not None:
            _write_table(stream, _in_unit(_FAN_NOTES, unit_of(fan.body)), _fan_rows(fan))
        elif curves is not None:
            unit = curves[0].unit if curves else UNKNOWN
            _write_table(stream, _in_unit(_CURVE_NOTES, unit), _curve_rows(curves))
        elif far is not None:
            _write_table(stream, _far_table.notes(far, observed=observed is not None), _far_table.rows(far, observed))
        elif cut is not None:
            _write_table(stream, _cut_table.notes(cut), _cut_table.rows(cut))


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
