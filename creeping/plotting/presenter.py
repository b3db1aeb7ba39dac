"""How results show themselves: what `creeping._presenting` asks, answered type by type.

A table says what a result is, how large, how accurate, and what is wrong. Types are known by their names, so that to
show one result does not import the modules of all others.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from html import escape
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creeping._presenting import brief
from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.files.polylines import polydata
from creeping.files.tables import angles_of
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.geometry.incident import Incident, PointSource, incident_of_row
from creeping.plotting import coupling_pictures, echo_pictures, far_cuts, line_plots, plane_pictures, t_matrix_pictures

if TYPE_CHECKING:
    from creeping.field.cut_result import FieldCut
    from creeping.field.ports.coupling_result import Coupling
    from creeping.field.results.echo import Echo
    from creeping.field.results.far_result import FarField
    from creeping.field.results.impulse import ImpulseResponse, RangeProfile
    from creeping.field.results.point_result import PointData
    from creeping.field.sources import SourcePattern
    from creeping.field.tmatrix.result import TMatrix
    from creeping.geodesics.direct_flow import DirectFlow
    from creeping.geodesics.integrator import ErrorEstimate
    from creeping.phaseflow.phase_map import PhaseMap
    from creeping.rays.fan import RayFan
    from creeping.rays.isophase import IsoPhaseCurve
    from creeping.shadow.curve import ShadowCurve
    from creeping.shadow.line import ShadowLine

Facts = Iterable[tuple[str, str]]


def html(result: object) -> str:
    """Table of a result: no script, no style sheet, nothing from elsewhere."""
    left = ' style="text-align:left"'
    rows = "".join(
        f'<tr><th scope="row"{left}>{escape(name)}</th><td{left}>{escape(value)}</td></tr>'
        for name, value in _shown(result, "facts")(result)
    )
    return f"<table><caption{left}>{escape(type(result).__name__)}</caption><tbody>{rows}</tbody></table>"


def plot(result: object, ax: Any = None, **options: Any) -> Any:
    """Matplotlib axes with the picture of a result; options are those of its ``plot_*`` function."""
    return _shown(result, "plot")(result, ax, **options)


def to_polydata(result: object) -> Any:
    """Curves of a result as a ``pyvista.PolyData``."""
    return _shown(result, "polydata")(result)


class Ways(NamedTuple):
    """How a type shows itself; None where it does not."""

    facts: Callable[..., Facts]
    plot: Callable[..., Any] | None = None
    polydata: Callable[[Any], Any] | None = None


def _shown(result: object, way: str) -> Callable[..., Any]:
    """One way of the result's class, or of the nearest one that it is derived from."""
    ways = {
        "ShadowLine": Ways(of_line, line_plots.plot_line, polydata),
        "ShadowCurve": Ways(
            of_shadow_curve,
            lambda curve, ax, **shown: line_plots.plot_line(line_plots.line_of(curve), ax, **shown),
            lambda curve: polydata(line_plots.line_of(curve)),
        ),
        "RayFan": Ways(
            of_fan,
            lambda fan, ax, **shown: line_plots.plot_line(fan.line, ax, fan=fan, **shown),
            lambda fan: polydata(fan=fan),
        ),
        "IsoPhaseCurve": Ways(of_curve, line_plots.plot_curve, lambda curve: polydata(curves=[curve])),
        "FarField": Ways(of_far, far_cuts.plot_far),
        "PointData": Ways(of_points),
        "FieldCut": Ways(of_cut, plane_pictures.plot_field_cut),
        "PhaseMap": Ways(of_map, line_plots.plot_growth),
        "DirectFlow": Ways(of_direct),
        "Coupling": Ways(of_coupling, coupling_pictures.plot_coupling),
        "SourcePattern": Ways(of_pattern, coupling_pictures.plot_pattern),
        "ImpulseResponse": Ways(of_impulse, echo_pictures.plot_impulse),
        "RangeProfile": Ways(of_profile, echo_pictures.plot_profile),
        "Echo": Ways(of_echo, echo_pictures.plot_echo),
        "TMatrix": Ways(of_t_matrix, t_matrix_pictures.plot_t_matrix),
    }
    known: dict[str, Callable[..., Any]] = {
        name: one for name, row in ways.items() if (one := getattr(row, way)) is not None
    }
    for kind in type(result).__mro__:
        if kind.__name__ in known:
            return known[kind.__name__]
    raise InvalidInputError(f"a {type(result).__name__} cannot be shown so; only {', '.join(known)} can")


def of_line(line: "ShadowLine") -> Facts:
    """Facts of a shadow line."""
    yield "body", brief(line.body, 200)
    yield _wave(line.source)
    yield "curves", str(len(line.curves))
    yield "points", str(sum(len(curve.points) for curve in line.curves))
    unit = unit_of(line.body)
    yield "length", f"{line.length:.10g} {unit}"
    yield from _shares(line.fractions, line.length, unit)
    if len(line.curves) > 1:
        yield from _cut_short(
            (f"curve {k}", f"{curve.length:.10g} {unit}, {len(curve.arcs)} arcs") for k, curve in enumerate(line.curves)
        )
    worst = max((float(np.max(np.abs(curve.grazing))) for curve in line.curves), default=0.0)
    yield "largest |n.d|", f"{worst:.1e}"
    distance = line.singular_distance
    yield "singular distance", f"{distance:.3g}, about {np.degrees(distance):.3g}°" if np.isfinite(distance) else "none"


def of_shadow_curve(curve: "ShadowCurve") -> Facts:
    """Facts of one curve of a shadow line."""
    yield "body", brief(curve.body, 200)
    yield _wave(incident_of_row(curve.wave))
    yield "points", str(len(curve.points))
    unit = unit_of(curve.body)
    yield "length", f"{curve.length:.10g} {unit}"
    yield from _shares(curve.fractions, curve.length, unit)
    yield from _cut_short(
        (f"arc {k}", f"{status}, from {start:.6g} to {end:.6g} {unit}")
        for k, (start, end, status) in enumerate(curve.arcs)
    )
    yield "largest |n.d|", f"{np.max(np.abs(curve.grazing)):.1e}"
    yield "kappa_n(d)", _range(curve.curvature, f"1/{unit}")


def of_fan(fan: "RayFan") -> Facts:
    """Facts of a fan."""
    unit = unit_of(fan.body)
    yield "body", brief(fan.body, 200)
    yield _wave(fan.line.source)
    yield "rays", str(len(fan.points))
    yield "steps", str(len(fan.travel_time))
    yield "length", f"{fan.length:g}" + f" {unit}" * (unit != UNKNOWN)
    yield "arcs", str(len(fan.closed_arcs))
    for name, count in fan.status_counts.items():
        yield name, f"{count} rays"
    if np.any(np.isfinite(fan.detachment)):
        yield "first detachment", f"{np.min(fan.detachment):.6g}"
    yield "caustics passed", f"up to {int(fan.caustic_index[:, -1:].max(initial=0))}"
    yield "error at the end", _error(fan.error, "rays traced")
    if fan.flow_error is not None:
        yield "error of one g_T0", _error(fan.flow_error, "samples")


def of_curve(curve: "IsoPhaseCurve") -> Facts:
    """Facts of an iso-phase curve."""
    yield "level", f"{curve.of} = {curve.level:g}" + f" {curve.unit}" * (curve.unit != UNKNOWN)
    yield "points", str(len(curve.points))
    yield "closed", "yes" if curve.closed else "no"
    yield "length", f"{curve.length:.6g} {curve.unit}"
    yield "theta", _range(np.degrees(curve.parameters[:, 0]), "degrees")
    yield "phi", _range(np.degrees(curve.parameters[:, 1]), "degrees")
    if len(curve.rays):
        yield "rays", f"{len(np.unique(curve.rays))}, from {curve.rays.min()} to {curve.rays.max()}"
    yield from _lost(curve.points)


def of_far(far: "FarField") -> Facts:
    """Facts of a far field."""
    total = far.total
    size = np.abs(total[np.isfinite(total)])
    largest = float(size.max(initial=0.0))
    yield "directions", str(len(far.directions))
    if len(far.directions):
        angles = np.degrees(angles_of(far.directions))
        yield "theta", _range(angles[:, 0], "degrees")
        yield "phi", _range(angles[:, 1], "degrees")
    yield from _waved(far, far.unit)
    yield "order", str(far.order)
    if total.ndim == 3:
        yield "components", "θ and φ scattered by θ and φ incident"
    yield from _served(far.method, "directions")
    yield "largest |f|", f"{largest:.6g} {far.unit}"
    if largest > 0:
        yield (
            "largest 4π|f|²",
            f"{10 * np.log10(4 * np.pi * largest**2):.2f} " + ("dBsm" if far.unit == "m" else f"dB re 1 {far.unit}²"),
        )
    yield "unresolved", f"{int(far.unresolved.sum())} directions"
    yield from _lost(total)


def of_points(field: "PointData") -> Facts:
    """Facts of a near or surface field."""
    unit = field.length_unit
    yield "points", " x ".join(map(str, field.points.shape[:-1])) or "1"
    yield from _waved(field, unit)
    yield "order", str(field.order)
    yield from _served(field.method, "points")
    yield from _states(field, "points")
    yield from _sizes(field.magnitude, field.error, field.ok, f" {field.unit}")


def of_cut(cut: "FieldCut") -> Facts:
    """Facts of a field on a plane."""
    unit = cut.field.length_unit
    yield "grid", f"{len(cut.across)} x {len(cut.up)}, {cut.step:.6g} {unit} apart, {np.sum(~cut.outside)} inside"
    for name, axis in zip(("across", "up"), cut.axes, strict=True):
        yield name, _direction(axis)
    yield from of_points(cut.field)


def of_map(flow: "PhaseMap") -> Facts:
    """Facts of a phase map."""
    leap, growth = flow.leaps[-1], flow.growth
    yield "body", brief(flow.body, 200)
    yield "horizon T0", f"{flow.horizon:g}"
    yield "coordinates", flow.model.name
    yield "nodes", " x ".join(map(str, (len(leap.state), *flow.grid.nodes)))
    yield "degree", str(flow.grid.degree)
    yield "maps", str(len(flow.leaps))
    yield "numbers", f"{leap.state.dtype}, {flow.nbytes / 1e6:.1f} MB"
    yield "carries", "Jacobi matrix" * flow.has_jacobi + " and curvatures" * leap.has_curvature or "nothing"
    yield "error of one g_T0", _error(flow.error, "samples")
    if growth is not None:
        for length, rms, largest in zip(growth.lengths, growth.rms, growth.max, strict=True):
            yield f"error after {length:g}", f"rms {rms:.1e}, max {largest:.1e}"
    for name, value in flow.parameters.items():
        yield str(name), brief(value)


def of_direct(flow: "DirectFlow") -> Facts:
    """Facts of a direct flow."""
    yield "body", brief(flow.body, 200)
    yield "method", "direct integration, order 8"
    if flow.step is None:
        yield "rtol", f"{flow.rtol:g} per step"
    else:
        yield "step", f"equal, at most {flow.step:g}"
    yield "horizon", f"{flow.horizon:g}"
    yield "error at the end", _error(flow.error, "samples")


def _wave(source: Incident) -> tuple[str, str]:
    if isinstance(source, PointSource):
        return "source at", _direction(np.array(source.position))
    return "direction", _direction(np.array(source.direction))


def _direction(d: FloatArray) -> str:
    theta, phi = np.degrees(angles_of(d))
    return f"({', '.join(f'{x:.6g}' for x in d)}), theta {theta:.6g}°, phi {phi:.6g}°"


def _shares(fractions: dict[str, float], length: float, unit: str) -> Facts:
    for status, share in fractions.items():
        if share:
            yield status, f"{share:.6g} of the length, {share * length:.6g} {unit}"


def _range(values: FloatArray, unit: str) -> str:
    finite = np.asarray(values)[np.isfinite(values)]
    return f"{finite.min():.6g} to {finite.max():.6g} {unit}" if len(finite) else "none"


def _lost(values: Any) -> Facts:
    missing = int(np.sum(~np.isfinite(values.reshape(len(values), -1)).all(axis=1))) if len(values) else 0
    if missing:
        yield "not finite", str(missing)


def _error(error: "ErrorEstimate | None", of: str) -> str:
    if error is None or not error.samples:
        return "not measured"
    return f"rms {error.rms:.1e}, max {error.max:.1e} ({error.samples} {of})"


def _cut_short(rows: Facts) -> Facts:
    """Six rows of a kind at most: curves of a line, arcs of a curve."""
    listed = list(rows)
    yield from listed[:6]
    if len(listed) > 6:
        yield "", f"and {len(listed) - 6} more"


def of_coupling(found: "Coupling") -> Facts:
    """Facts of a coupling matrix."""
    yield "body", brief(found.body, 200)
    yield "ports", str(len(found.ports))
    yield from _waved(found, found.length_unit)
    yield "order", str(found.order)
    yield "geodesics up to", f"{found.length:.6g} {found.length_unit}"
    yield from _states(found, "values")
    yield from _sizes(np.abs(found.values), found.error, found.ok & np.isfinite(found.values))


def of_pattern(found: "SourcePattern") -> Facts:
    """Facts of far fields of sources."""
    yield "sources", str(len(found.sources))
    yield "directions", str(len(found.directions))
    yield from _waved(found, found.length_unit)
    yield from _states(found, "values")
    yield from _sizes(np.abs(found.values), found.error, found.ok)


def of_impulse(found: "ImpulseResponse") -> Facts:
    """Facts of a response to a pulse."""
    yield "responses", " x ".join(map(str, found.values.shape[1:])) or "1"
    yield "delays", f"{len(found.delay)}, {found.delay[0]:.6g} to {found.delay[-1]:.6g} {found.unit}"
    yield "resolution", f"{found.resolution:.4g} {found.unit}"
    yield "repeats after", f"{found.period:.6g} {found.unit}"
    yield "largest", f"{np.max(found.envelope, initial=0.0):.6g}"
    yield "error at most", f"{np.max(found.error, initial=0.0):.2g}"
    if found.values.ndim == 1:
        yield "arrivals", ", ".join(f"{t:.6g}" for t in found.arrivals()) + f" {found.unit}"


def of_profile(found: "RangeProfile") -> Facts:
    """Facts of a range profile."""
    yield "ranges", f"{len(found.range)}, {found.range[0]:.6g} to {found.range[-1]:.6g}"
    yield "resolution", f"{found.resolution:.4g}"
    size = np.abs(found.values)
    yield "largest", f"{size.max():.6g} at {found.range[int(np.argmax(size))]:.6g}"


def of_echo(found: "Echo") -> Facts:
    """Facts of an echo."""
    told = found.summary()
    yield "quantity", f"{told['quantity']}, {told['unit']}"
    yield "channels", ", ".join(found.channels)
    yield "angles", f"{told['angles']} of {found.angle_name or 'one direction'}"
    yield "frequencies", f"{told['frequencies']}, {found.hertz.min():.6g} to {found.hertz.max():.6g} Hz"
    for channel, level in told["largest"].items():
        yield f"largest {channel}", "none" if level is None else f"{level:.2f} {told['unit']}"
    if told["error_db_median"] is not None:
        yield "error", f"{told['error_db_median']:.2g} dB in the median, {told['error_db_95']:.2g} dB at 95 of 100"
    yield "unresolved", f"{told['unresolved']} of {told['values']} values"
    yield "served by currents", f"{told['by_currents']} of {told['values']}, else by {told['otherwise_by']}"


def of_t_matrix(T: "TMatrix") -> Facts:
    """Facts of a T-matrix."""
    yield "body", T.body[:200] or "unknown"
    yield from _waved(T, T.unit)
    yield "order", f"{T.order}, {len(T.matrix)} waves"
    yield "centre", f"({', '.join(f'{x:.6g}' for x in T.center)}) {T.unit}"
    averages = T.orientation_average()
    for name, value in zip(averages._fields[:3], averages, strict=False):
        yield f"mean {name}", f"{value:.6g} {T.unit}²"
    yield "reciprocity", f"{T.reciprocity:.1e}"
    if not T.absorbing:
        yield "unitarity", f"{T.unitarity:.1e}"
    yield "error of f", f"{T.error:.2g} {T.unit}"


def _waved(found: Any, unit: str) -> Facts:
    """Wavenumber and boundary."""
    yield "wavenumber", f"{found.wavenumber:g} 1/{unit} (wavelength {2 * np.pi / found.wavenumber:.6g} {unit})"
    yield "boundary", found.boundary


def _states(found: Any, of: str) -> Facts:
    for name, count in found.status_counts.items():
        yield name, f"{count} {of}"


def _sizes(size: FloatArray, error: FloatArray, ok: BoolArray, unit: str = "") -> Facts:
    if np.any(ok):
        yield "largest where OK", f"{size[ok].max():.6g}{unit}"
        yield "error where OK", f"{np.median(error[ok]):.2g} in the median, {error[ok].max():.2g} at most"


def _served(method: Any, of: str) -> Facts:
    for name, count in sorted(Counter(np.ravel(method).tolist()).items()):
        yield f"served by {name or 'nothing'}", f"{count} {of}"
