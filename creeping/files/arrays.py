"""Results as arrays by name: for MATLAB (.mat, version 5) with their units, and for pyvista and VTK (.vtp).

Shadow lines, fans and iso-phase curves are polylines with named arrays, for files and for pyvista alike.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import io
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from creeping._typing import Any, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.results.labelled import power
from creeping.files.tables import angles_of, joined, number_of
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.geometry.evaluators import speed_of
from creeping.geometry.incident import PointSource
from creeping.rays.ends import ENDED, RayStatus
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import STATUSES
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.cut_result import FieldCut
    from creeping.field.results.comparison import Echo
    from creeping.field.results.far_result import FarField

Content = dict[str, tuple[Any, str]]
"""Values and their units by name; of what has none the unit is empty."""


def write_mat(
    path: str | os.PathLike[str],
    result: Echo | FarField | FieldCut | ShadowLine | RayFan | Sequence[IsoPhaseCurve],
    *,
    observed: tuple[Sequence[str], FloatArray] | None = None,
) -> None:
    """Write a result for MATLAB, Octave or ``scipy.io.loadmat``.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    result : Echo, FarField, FieldCut, ShadowLine, RayFan or sequence of IsoPhaseCurve
        Arrays keep their axes: channels, angles, frequencies of an echo; directions, scattered and incident θ̂ and φ̂
        of a far field; ``up`` and ``across`` of a field on a plane, NaN and status -1 inside the body; rays and steps
        of a fan. A shadow line and iso-phase curves have one row per point, with the number of its curve.
    observed : (texts, angles), optional
        For a far field: each direction as text, as the user gave it, and its angle along the cut (m,), degrees.

    Raises
    ------
    InvalidInputError
        If the result is of another type.
    CreepingError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile, creeping as cr, scatterers as sc, scipy.io
    >>> from creeping.files import write_mat
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere(), rtol=1e-6), cr.shadow_line(sc.Sphere(), (0, 0, 1)), n_rays=16)
    >>> far = cr.far_field(fan, [(0, 1, 0), (1, 0, 0)], wavenumber=30.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mat(f"{folder}/far.mat", far)
    ...     back = scipy.io.loadmat(f"{folder}/far.mat", squeeze_me=True)
    >>> bool((back["f"] == far.total).all()), str(back["units"]["f"])
    (True, 'L')
    """
    from scipy.io import savemat

    # by name: a field's classes need not be imported for a line to be written
    makers: dict[str, Callable[[Any], Content]] = {
        "Echo": _echo,
        "FarField": _far,
        "FieldCut": _cut,
        "ShadowLine": _line,
        "RayFan": _fan,
    }
    kinds = [kind.__name__ for kind in type(result).__mro__ if kind.__name__ in makers]
    if kinds:
        found = makers[kinds[0]](result)
    elif isinstance(result, Sequence) and all(isinstance(one, IsoPhaseCurve) for one in result):
        # curves do not know their body
        found = {
            "curve": (number_of(result), ""),
            "points": (joined([c.points for c in result], 3), UNKNOWN),
            "rays": (joined([c.rays for c in result]).astype(float), ""),
            "of": _words([c.of for c in result]),
            "level": (np.array([c.level for c in result]), UNKNOWN),
            "closed": (np.array([c.closed for c in result], dtype=bool), ""),
        }
    else:
        raise InvalidInputError(
            f"{type(result).__name__} is not written to .mat; give one of {', '.join(makers)}, or a list of "
            "IsoPhaseCurve"
        )
    if observed is not None:
        found |= {"observe": (np.array(observed[0], dtype=object), ""), "angle": (observed[1], "degree")}
    content = {name: value for name, (value, _) in found.items()}
    units = {name: unit for name, (_, unit) in found.items() if unit}
    about = "time factor exp(-i w t); far field f exp(i k r)/r; 4 pi |f|^2 is the cross section"
    content |= {"units": units, "about": about, "creeping_version": __version__}
    # a full disk is an error of Python's own writing
    whole = io.BytesIO()
    savemat(whole, content, do_compression=True, oned_as="column", long_field_names=True)
    with written_aside(path) as aside:
        aside.write_bytes(whole.getvalue())


def _attributes(result: Any, **units: str) -> Content:
    """Attributes of a result with their units."""
    return {name: (getattr(result, name), unit) for name, unit in units.items()}


def _words(texts: Any) -> tuple[Any, str]:
    """Texts, as MATLAB has them in a cell array."""
    return np.array(texts, dtype=object), ""


def _line(line: ShadowLine) -> Content:
    unit, curves = unit_of(line.body), line.curves
    numbers = {"arclength": unit, "curvature": power(unit, -1)}
    vectors = {"points": unit, "normals": "1", "tangents": "1"}
    return {
        **_wave(line),
        "curve": (number_of(curves), ""),
        **{name: (joined([getattr(c, name) for c in curves]), of) for name, of in numbers.items()},
        **{name: (joined([getattr(c, name) for c in curves], 3), of) for name, of in vectors.items()},
        "status": _words([str(s) for c in curves for s in c.status]),
        "length": (line.length, unit),
    }


def _wave(line: ShadowLine) -> Content:
    """Direction of a plane wave, or where a point source is."""
    if isinstance(line.source, PointSource):
        return {"source": (np.array(line.source.position), unit_of(line.body))}
    return {"direction": (line.direction, "1")}


def _fan(fan: RayFan) -> Content:
    length = unit_of(fan.body)
    time, curved = length if speed_of(fan.body) is None else "time", power(length, -1)
    of_points = _attributes(fan, points=length, directions="1", travel_time=time, eikonal=time, spreading="1")
    of_points |= _attributes(fan, spreading_rate=curved, curvature=curved, attenuation=f"{length}^(1/3)")
    of_rays = _attributes(fan, caustic_index="", status="", detachment=time, curve_index="", arclength=length)
    return {name: (np.asarray(value), unit) for name, (value, unit) in (of_points | of_rays).items()} | _wave(fan.line)


def _cut(cut: FieldCut) -> Content:
    field: Any = cut.field
    length = field.length_unit
    values = {name: field.values if name == "u" else getattr(field, name) for name in cut.quantities}
    return {
        **_attributes(cut, across=length, up=length, point=length, axes="1", points=length, outside=""),
        **{name: (cut.on_grid(one), field.unit) for name, one in values.items()},
        **_attributes(cut, error=field.unit, status=""),
        "method": (cut.on_grid(field.method.astype(object), "inside"), ""),
        **_attributes(field, wavenumber=power(length, -1), boundary="", order=""),
    }


def _far(far: FarField) -> Content:
    angles, length = np.degrees(angles_of(far.directions)), far.unit
    return {
        "directions": (far.directions, "1"),
        "theta": (angles[:, 0], "degree"),
        "phi": (angles[:, 1], "degree"),
        **{name: (values, length) for name, values in {"f": far.total, **far.parts, "error": far.error}.items()},
        "cross_section": (far.cross_section, power(length, 2)),
        "cross_section_dB": (far.dbsm, "dBsm" if length == "m" else f"dB re 1 {length}^2"),
        "unresolved": (far.unresolved, ""),
        "method": (far.method.astype(object), ""),
        **_attributes(far, wavenumber=power(length, -1), boundary="", order=""),
    }


def _echo(echo: Echo) -> Content:
    (low, high), (name, unit) = echo.bounds(), echo.level_name
    found: Content = {
        "quantity": (name, ""),
        "channels": _words(echo.channels),
        **_attributes(echo, azimuth="degree", elevation="degree"),
        "frequency": (echo.hertz, "Hz"),
        "wavenumber": (echo.wavenumbers, "1/m"),
        **{part: (values, "m") for part, values in {"f": echo.total, **echo.parts, "error": echo.error}.items()},
        "level": (echo.levels(), unit),
        "level_low": (low, unit),
        "level_high": (high, unit),
        **_attributes(echo, unresolved="", by_currents=""),
        "otherwise_by": (echo.otherwise, ""),
    }
    if echo.incidence is not None:
        found["incidence"] = (np.array(echo.incidence), "degree")
    if echo.sound_speed is not None:
        found["sound_speed"] = (echo.sound_speed, "m/s")
    return found


RAY_ARRAYS = ("eikonal", "spreading", "spreading_rate", "curvature", "attenuation")
POINT_ARRAYS: dict[str, type] = dict.fromkeys(("travel_time", *RAY_ARRAYS), np.float64)
POINT_ARRAYS |= dict.fromkeys(("caustic_index", "line_status", "ray_status"), np.int64)
"""Arrays with a value per point, and their types,"""
CELL_ARRAYS: dict[str, type] = dict.fromkeys(("kind", "ray", "status", "curve_index"), np.int64) | {"level": np.float64}
"""and per polyline. Where one does not apply it is NaN, or -1 if of integers."""

Lines = tuple[FloatArray, bool, dict[str, Any]]
"""Points (lines, k, 3), whether they are closed, and arrays (lines, k), (k,) and (lines,) by name."""


def polydata(line: ShadowLine | None = None, fan: RayFan | None = None, curves: Sequence[IsoPhaseCurve] = ()) -> Any:
    """Polylines as a ``pyvista.PolyData``, with the points and arrays that `write_vtp` writes.

    Building one loads no part of VTK that draws, so it needs neither a display nor OpenGL.

    Parameters
    ----------
    line, fan, curves : ShadowLine, RayFan and sequence of IsoPhaseCurve, optional
        Results to include.

    Returns
    -------
    pyvista.PolyData
        Its arrays are copies: changes do not affect the results.
    """
    import pyvista

    found: list[Lines] = []
    for number, one in enumerate(line.curves if line is not None else ()):
        status = np.array([STATUSES.index(str(name)) for name in one.status], dtype=np.int64)
        found.append((one.points[None], True, {"kind": [0], "line_status": status, "curve_index": [number]}))
    if fan is not None:
        found.append((fan.points, False, _ray_arrays(fan)))
    for curve in curves:
        values = {"kind": [2], curve.of: np.full(len(curve.points), float(curve.level)), "level": [curve.level]}
        found.append((curve.points[None], bool(curve.closed), values))
    points, cells, first = [np.zeros((0, 3))], [np.zeros(0, dtype=np.int64)], 0
    for where, closed, _ in found:
        lines, length = np.shape(where)[:2]
        points.append(np.asarray(where, dtype=float).reshape(-1, 3))
        numbers = first + np.arange(lines * length, dtype=np.int64).reshape(lines, length)
        first += lines * length
        # the number of its points, then these; one that is closed ends with its first
        ends = np.concatenate([numbers, numbers[:, :1]], axis=1) if closed else numbers
        cells.append(np.insert(ends, 0, ends.shape[1], axis=1).ravel())
    mesh = pyvista.PolyData(np.concatenate(points), lines=np.concatenate(cells))
    for name, dtype in POINT_ARRAYS.items():
        columns = [_column(arrays.get(name), dtype, np.size(where) // 3) for where, _, arrays in found]
        mesh.point_data[name] = np.concatenate([np.zeros(0, dtype=dtype), *columns])
    for name, dtype in CELL_ARRAYS.items():
        columns = [_column(arrays.get(name), dtype, len(where)) for where, _, arrays in found]
        mesh.cell_data[name] = np.concatenate([np.zeros(0, dtype=dtype), *columns])
    return mesh


def write_vtp(
    path: str | os.PathLike[str],
    line: ShadowLine | None = None,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
) -> None:
    """Write polylines as VTK XML PolyData, for ParaView, pyvista and others.

    One polyline per curve of the shadow line, ray and iso-phase curve. Point arrays: travel_time, eikonal, spreading,
    spreading_rate, curvature, attenuation, caustic_index, line_status (0 attached, 1 occluded, 2 concave), ray_status
    (OK up to the point where the ray ends, then its status). Cell arrays: kind (0 shadow line, 1 ray, 2 iso-phase
    curve), ray (its number), status (`RayStatus`), curve_index, level. Where an array does not apply, it is NaN, or -1
    if it holds integers.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    line, fan, curves : ShadowLine, RayFan and sequence of IsoPhaseCurve, optional
        Results to write.

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


def _ray_arrays(fan: RayFan) -> dict[str, Any]:
    """Arrays of a fan at its points (rays, steps) and by ray (rays,)."""
    times = np.broadcast_to(fan.travel_time, np.shape(fan.eikonal))
    arrays = {name: getattr(fan, name) for name in (*RAY_ARRAYS, "caustic_index")} | {"travel_time": times}
    status, detachment = np.asarray(fan.status)[:, None], np.asarray(fan.detachment)[:, None]
    # these come on the way, other trouble is there from the start
    met = np.isin(status, ENDED)
    arrays["ray_status"] = np.where(met & (times <= detachment), RayStatus.OK, status)
    rays = len(status)
    return arrays | {"kind": [1] * rays, "ray": range(rays), "status": fan.status, "curve_index": fan.curve_index}


def _column(values: Any, dtype: type, count: int) -> NDArray[Any]:
    """Values as one column, or what stands for none."""
    if values is None:
        return np.full(count, np.nan if dtype is np.float64 else -1, dtype=dtype)
    return np.asarray(values, dtype=dtype).reshape(-1)
