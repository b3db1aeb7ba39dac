"""Files of lines, fans, iso-phase curves, far fields, fields on planes and echoes, as CSV.

Numbers keep all 17 digits, so that what is read back is what was written. A table has one row for each point, direction
or value; its columns are explained in lines that begin with ``#``.
"""

import os
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.results.comparison import LEVELS, cross_section_decibels, decibels, error_decibels
from creeping.field.results.point_result import FieldStatus
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.rays.ends import RayStatus
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    import xarray

    from creeping.field.cut_result import FieldCut
    from creeping.field.ports.coupling_result import Coupling
    from creeping.field.results.comparison import Echo
    from creeping.field.results.far_result import FarField
    from creeping.field.results.impulse import RangeProfile

Column = tuple[str, str, Any]
"""Name, what it holds (nothing if the name says it), and values (rows,)."""


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
        The result to write. Give exactly one; each kind has its own columns.
    observed : (texts, angles), optional
        For a far field: each direction as text, as the user gave it, and its angle along the cut (m,), degrees.
    mark : str
        Note on missing rows, written as the first line; none if empty.

    Raises
    ------
    InvalidInputError
        If not exactly one result is given.
    CreepingError
        If the file cannot be written.
    """
    makers: dict[str, tuple[Any, Callable[[Any], list[Column]]]] = {
        "line": (line, _line_columns),
        "fan": (fan, _fan_columns),
        "curves": (curves, _curve_columns),
        "far": (far, lambda one: _far_columns(one, observed)),
        "cut": (cut, _cut_columns),
    }
    given = {name: pair for name, pair in makers.items() if pair[0] is not None}
    if len(given) != 1:
        raise InvalidInputError(
            f"write_csv got {' and '.join(given) or 'nothing'}; give exactly one of {', '.join(makers)}, "
            "a file for each"
        )
    ((what, columns_of),) = given.values()
    _write_table(path, columns_of(what), mark)


def _write_table(path: str | os.PathLike[str], columns: Sequence[Column], mark: str = "") -> None:
    names, notes, values = zip(*columns, strict=True)
    with written_aside(path) as aside, aside.open("w", encoding="utf-8", newline="\n") as stream:
        stream.writelines([f"# {mark}\n"] if mark else [])
        stream.writelines(f"# {name}: {note}\n" for name, note in zip(names, notes, strict=True) if note)
        stream.write(",".join(names) + "\n")
        # not all rows at once: as Python's numbers they take several times the memory
        for first in range(0, len(values[0]), 4096):
            block = (np.asarray(column[first : first + 4096]).tolist() for column in values)
            # str of a Python float is its repr: the shortest text that reads back to the same number
            stream.writelines(",".join(map(str, row)) + "\n" for row in zip(*block, strict=True))


def joined(arrays: Iterable[Any], width: int | None = None) -> Any:
    """Rows of all arrays, of ``width`` numbers each if it is given."""
    parts = [np.asarray(one) for one in arrays]
    return np.concatenate(parts) if parts else np.zeros((0, width) if width else 0)


def number_of(parts: Sequence[Any]) -> Any:
    """Curve number of each point of all curves, from 0: (points,)."""
    return np.repeat(np.arange(len(parts)), [len(one.points) for one in parts])


def _complex(stem: str, suffix: str, values: Any, what: str, more: str = "imaginary part") -> list[Column]:
    """Columns of complex values (rows,): what the real part is, and the imaginary one."""
    return [(f"{stem}re{suffix}", what, values.real), (f"{stem}im{suffix}", more, values.imag)]


def _position(points: FloatArray, unit: str) -> list[Column]:
    """Columns of points (rows, 3)."""
    return [(name, f"position, {unit}", values) for name, values in zip("xyz", points.T, strict=True)]


def _line_columns(line: ShadowLine) -> list[Column]:
    unit, curves = unit_of(line.body), line.curves
    return [
        ("curve", "number of the closed curve", number_of(curves)),
        ("s", f"arclength along it, {unit}", joined(one.arclength for one in curves)),
        *_position(joined((one.points for one in curves), 3), unit),
        ("status", "attached, occluded or concave", joined(one.status for one in curves)),
    ]


def _fan_columns(fan: RayFan) -> list[Column]:
    unit, (rays, steps) = unit_of(fan.body), np.shape(fan.eikonal)
    tangents = np.asarray(fan.directions).reshape(-1, 3).T
    return [
        ("ray", "number of the ray", np.repeat(np.arange(rays), steps)),
        ("step", "number of the point on it", np.tile(np.arange(steps), rays)),
        ("t", f"travel time; {unit} where the speed is 1", np.tile(fan.travel_time, rays)),
        *_position(np.asarray(fan.points).reshape(-1, 3), unit),
        *((name, "unit tangent", values) for name, values in zip(("px", "py", "pz"), tangents, strict=True)),
        ("eikonal", "as t", np.ravel(fan.eikonal)),
        ("J", "spreading, 1 on the shadow line", np.ravel(fan.spreading)),
        ("dJ", "its rate along the ray", np.ravel(fan.spreading_rate)),
        ("kappa_n", f"normal curvature along the ray, 1/{unit}, positive where convex", np.ravel(fan.curvature)),
        ("caustic_index", "zeros of J passed", np.ravel(fan.caustic_index)),
        ("status", ", ".join(f"{int(one)} {one.name}" for one in RayStatus), np.repeat(fan.status, steps)),
    ]


def _curve_columns(curves: Sequence[IsoPhaseCurve]) -> list[Column]:
    unit, number = curves[0].unit if curves else UNKNOWN, number_of(curves)
    of, level = np.array([one.of for one in curves]), np.array([float(one.level) for one in curves])
    return [
        ("curve", "number of the curve", number),
        ("of", "travel_time or eikonal", of[number]),
        ("level", f"its constant value; {unit} where the speed is 1", level[number]),
        ("closed", "1 if the last point joins the first", np.array([int(one.closed) for one in curves])[number]),
        *_position(joined((one.points for one in curves), 3), unit),
    ]


def _wave_words(field: Any, unit: str) -> str:
    return f"k = {field.wavenumber!r} 1/{unit}, {field.boundary} boundary, order {field.order}, time factor exp(-i w t)"


def _cut_columns(cut: Any) -> list[Column]:
    """Columns of a `FieldCut`: a row for each point outside the body."""
    field: Any = cut.field
    unit, outside = field.length_unit, cut.outside
    place = f"from ({', '.join(f'{v!r}' for v in cut.point.tolist())})"
    columns: list[Column] = [
        (name, f"along ({', '.join(f'{v!r}' for v in axis)}) {place}, {unit}", grid[outside])
        for name, axis, grid in zip(("across", "up"), cut.axes.tolist(), np.meshgrid(cut.across, cut.up), strict=True)
    ]
    columns += _position(field.points, unit)
    if cut.quantities == ("u",):
        fields = {"u": field.values}
    else:
        fields = {f"{one}{axis}": getattr(field, one)[:, i] for one in cut.quantities for i, axis in enumerate("xyz")}
    for name, values in fields.items():
        columns += _complex("", f"_{name}", values, f"real part of {name}, {field.unit}; {_wave_words(field, unit)}")
    states = ", ".join(f"{int(one)} {one.name}" for one in FieldStatus)
    return [
        *columns,
        ("error", f"of the field, {field.unit}", field.error),
        ("status", states, field.status),
        ("method", "the method used", field.method),
    ]


def angles_of(directions: FloatArray) -> FloatArray:
    """θ and φ in radians, 0 <= φ < 2π and 0 at the poles: (..., 3) -> (..., 2)."""
    x, y, z = np.moveaxis(np.asarray(directions, dtype=float), -1, 0)
    across = np.hypot(x, y)
    phi = np.where(across < 1e-12, 0.0, np.mod(np.arctan2(y, x), 2 * np.pi))
    # just below 0 the remainder rounds to 2π
    return np.stack([np.arctan2(across, z), np.where(phi >= 2 * np.pi, 0.0, phi)], axis=-1)


def _far_columns(far: "FarField", observed: tuple[Sequence[str], FloatArray] | None) -> list[Column]:
    """A row for each direction; of a vector field columns for each component."""
    unit, count, x = far.unit, len(far.directions), np.asarray(far.directions).T
    theta, phi = np.degrees(angles_of(far.directions)).T
    columns: list[Column] = [
        ("x", "direction from the body to the observer", x[0]),
        ("y", "direction", x[1]),
        ("z", "direction", x[2]),
        ("theta", "degrees from z", theta),
        ("phi", "degrees from x, 0 at the poles", phi),
    ]
    known = {
        "extinction": "measured inside the body, for 95 of 100 directions",
        "extrapolated": f"of rays, its level measured against currents at k = {far.measured_at or 0:.4g}",
        "": "not known",
    }
    error_of = known.get(far.error_by or "", "of rays, by the size of their second order")
    spelled = {"t": "theta", "p": "phi"}
    for number, suffix in enumerate(("",) if np.ndim(far.total) == 1 else ("_tt", "_tp", "_pt", "_pp")):
        name = f", {spelled[suffix[1]]} by {spelled[suffix[2]]} incident" if suffix else ""
        total, error, *parts = (
            np.asarray(values).reshape(count, -1)[:, number] for values in (far.total, far.error, *far.parts.values())
        )
        area = "dBsm" if unit == "m" else f"dB re 1 {unit}^2"
        columns += [
            *_complex("", suffix, total, f"real part of the far field f, {unit}{name}; {_wave_words(far, unit)}"),
            (f"dB{suffix}", "20 log10 |f|, -inf where f is 0", decibels(total)),
            (f"rcs_dB{suffix}", f"10 log10(4 pi |f|^2), {area}", cross_section_decibels(total)),
            (f"error{suffix}", f"error of f, {unit}, {error_of}", error),
        ]
        for part, values in zip(far.parts, parts, strict=True):
            columns += _complex(f"{part}_", suffix, values, f"part of f, {unit}{name}")
    doubt = "1 where a part was not found, its expansion fails or the error is large"
    columns.append(("method", "what gave the field, or its part of creeping rays", far.method))
    columns.append(("unresolved", doubt, np.asarray(far.unresolved).astype(int)))
    if observed is not None:
        texts, angles = [text.replace(",", " ") for text in observed[0]], observed[1]
        columns.append(("observe", "what was asked for, its commas blanks", texts))
        columns.append(("angle", "degrees along a cut, theta with the sign of its side; nan of what is no cut", angles))
    return columns


def write_echo(path: str | os.PathLike[str], echo: "Echo", *, known: BoolArray | None = None, mark: str = "") -> None:
    """Write an echo as CSV, a row for each channel, angle and frequency.

    Parameters
    ----------
    path : str or path
    echo : Echo
    known : (n, k) of bool, optional
        Angles and wavenumbers whose rows are written; by default all.
    mark : str
        Note on missing rows, written as the first line; none if empty.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    shape = echo.total.shape
    at = c, n, k = np.nonzero(np.broadcast_to(True if known is None else known, shape))
    total, (low, high) = echo.total[at], echo.bounds()
    by_currents = echo.by_currents[at] & (echo.otherwise != "t-matrix")
    kind = "polarisation received and transmitted (V along theta, H along phi), or the boundary"
    phase = "of f, relative to the origin of the body's coordinates; time factor exp(-i w t)"
    columns: list[Column] = [
        ("channel", kind, np.array(echo.channels)[c]),
        ("azimuth_deg", "as seen from the body", echo.azimuth[n]),
        ("elevation_deg", "as seen from the body", echo.elevation[n]),
        ("frequency_hz", "", echo.hertz[k]),
        ("wavenumber_1_m", "k", echo.wavenumbers[k]),
        ("level_db", ", ".join(echo.level_name), echo.levels()[at]),
        ("low_db", "level of |f| less its error", low[at]),
        ("high_db", "level of |f| and its error", high[at]),
        ("phase_deg", phase, np.degrees(np.angle(total))),
        *_complex("", "_m", total, "real part of f", "imaginary part of f"),
        ("error_m", "of |f|", echo.error[at]),
    ]
    for part, values in echo.parts.items():
        columns += _complex(f"{part}_", "_m", values[at], *2 * [f"{part} part of f"])
    doubt = "1 where an expansion fails or the error is large"
    method = "rays; rays+optics of a body with edges; currents of all of it, by expansions or its equation; t-matrix"
    columns.append(("unresolved", doubt, echo.unresolved[at].astype(int)))
    columns.append(("method", method, np.where(by_currents, "currents", echo.otherwise)))
    _write_table(path, columns, mark)


def write_profile(path: str | os.PathLike[str], profiles: "dict[str, RangeProfile]", echo: "Echo") -> None:
    """Write the range profiles of an echo, a dict by channel, as CSV, a row for each channel and range.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    found = profiles.values()
    values = joined(one.values for one in found)
    bounds = echo.levels(np.array([one.error for one in found]))
    place = f"along the line of sight, 0 at the origin, negative towards the {echo.viewer}"
    counts = [len(one.range) for one in found]
    columns: list[Column] = [
        ("channel", "", np.repeat(list(profiles), counts)),
        ("range_m", place, joined(one.range for one in found)),
        ("level_db", "of the echo from there", echo.levels(values)),
        ("error_db", "bound of the error of its amplitude, as a level", np.repeat(bounds, counts)),
        ("phase_deg", "", np.degrees(np.angle(values))),
    ]
    _write_table(path, columns)


def write_couplings(
    path: str | os.PathLike[str], couplings: "Sequence[Coupling]", names: Sequence[str], hertz: FloatArray | None = None
) -> None:
    """Write couplings of named ports over frequency as CSV, a row for each source, receiver and frequency.

    Parameters
    ----------
    path : str or path
    couplings : sequence of n Coupling
    names : sequence of str
        Names of the ports.
    hertz : (n,), Hz, optional
        Frequencies; without them, wavenumbers are written.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    pairs = np.nonzero(~np.eye(len(names), dtype=bool))
    per, unit, ports = len(pairs[0]), couplings[0].unit, np.array(names)
    values, error = (joined(getattr(one, name)[pairs] for one in couplings) for name in ("values", "error"))
    columns: list[Column] = [
        _wave_column(couplings, hertz, [per] * len(couplings)),
        ("source", "name of the port", np.tile(ports[pairs[0]], len(couplings))),
        ("receiver", "name of the port", np.tile(ports[pairs[1]], len(couplings))),
        ("level_db", f"20 log10 of the field of a unit moment, re {unit}", decibels(values)),
        ("error_db", "by how much the level may be higher", error_decibels(values, error)),
        *_complex("", "", values, f"real part, {unit}; time factor exp(-i w t)", f"imaginary part, {unit}"),
        ("status", "of FieldStatus", [FieldStatus(code).name for one in couplings for code in one.status[pairs]]),
        ("method", "rays, or beams where geodesics merge", joined(one.method[pairs] for one in couplings)),
    ]
    _write_table(path, columns)


def write_paths(
    path: str | os.PathLike[str], couplings: "Sequence[Coupling]", names: Sequence[str], hertz: FloatArray | None = None
) -> None:
    """Write the geodesics between named ports as CSV, a row for each geodesic and frequency.

    Parameters are those of `write_couplings`.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    pairs = list(combinations(range(len(names)), 2))
    found = [[one.paths(i, j) for i, j in pairs] for one in couplings]
    every = [one for row in found for one in row]
    length, unit = couplings[0].length_unit, couplings[0].unit
    counts, ends = [len(one) for one in every], np.array(names)[pairs * len(couplings)]
    wave = joined(one.wave for one in every)
    columns: list[Column] = [
        _wave_column(couplings, hertz, [sum(map(len, row)) for row in found]),
        ("source", "name of the port", np.repeat(ends[:, 0], counts)),
        ("receiver", "name of the port", np.repeat(ends[:, 1], counts)),
        ("arclength", length, joined(one.arclength for one in every)),
        ("caustics", "passed on the way", joined(one.caustics for one in every)),
        ("spreading", f"J2, {length}", joined(one.spreading for one in every)),
        ("xi", "Fock parameter, without unit", joined(one.fock_parameter for one in every)),
        *_complex("", "", wave, f"real part of the wave, {unit}", f"imaginary part of the wave, {unit}"),
    ]
    for end in ("departure", "arrival"):
        vectors = joined((getattr(one, end) for one in every), 3)
        columns += [(f"{end}_{axis}", "unit tangent", vectors[:, k]) for k, axis in enumerate("xyz")]
    _write_table(path, columns)


def _wave_column(couplings: "Sequence[Coupling]", hertz: FloatArray | None, rows: Sequence[int]) -> Column:
    """Frequency or wavenumber of each coupling, so many rows of each."""
    if hertz is not None:
        return "frequency_hz", "", np.repeat(hertz, rows)
    return "wavenumber", f"1/{couplings[0].length_unit}", np.repeat([one.wavenumber for one in couplings], rows)


def write_averages(
    path: str | os.PathLike[str], quantity: str, hertz: FloatArray, averages: "xarray.Dataset", *, mark: str = ""
) -> None:
    """Write cross sections and levels averaged over orientation as CSV, a row for each frequency.

    Parameters
    ----------
    path : str or path
    quantity : {"rcs", "ts"}
    hertz : (k,), Hz
    averages : xarray.Dataset
        Result of `creeping.orientation_averages` for a body in metres.
    mark : str
        Note on missing rows, written as the first line; none if empty.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    level, unit = LEVELS[quantity]
    columns: list[Column] = [
        ("frequency_hz", "", hertz),
        ("wavenumber_1_m", "k", averages.wavenumber.values),
        ("level_db", f"{level}, {unit}, of the mean over orientation", averaged_levels(quantity, averages)),
        ("error_db", "of the level", averages.target_strength_error.values),
    ]
    for name in ("backscattering", "scattering", "extinction"):
        columns.append((f"{name}_m2", str(averages[name].attrs["description"]), averages[name].values))
    _write_table(path, columns, mark)


def averaged_levels(quantity: str, averages: "xarray.Dataset") -> FloatArray:
    """Levels (k,) of the backscattering averaged over orientation: "rcs" in dBsm, "ts" in dB re 1 m."""
    if quantity == "ts":
        return np.asarray(averages.target_strength.values)
    return np.asarray(10 * np.log10(averages.backscattering.values))
