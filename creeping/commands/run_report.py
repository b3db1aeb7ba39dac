"""What one ``creeping run`` says and writes, of rays, of bodies without them and on planes."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from creeping import files, plotting
from creeping._progress import Progress
from creeping._version import __version__
from creeping.commands.forecast import boundary_words, frequency_words
from creeping.commands.options import Output, write_tables
from creeping.commands.resuming import Unfinished, kept
from creeping.commands.run_field import DPI, Job
from creeping.errors import InvalidInputError
from creeping.field.cut_result import FieldCut, cut_grid, field_cut
from creeping.field.equation.solution import Solution
from creeping.field.validity_range import Validity, validity_words
from creeping.geometry.arguments import rays_refused
from creeping.geometry.piecewise import is_piecewise
from creeping.rays.ends import RayStatus
from creeping.rays.fan import RayFan
from creeping.rays.uncertain_body import body_uncertainty


@dataclass(frozen=True)
class Plane:
    """One ``--plane``: its text, the axes that span it (2, 3) or None, and the step if one is given, L."""

    text: str
    axes: Any
    step: float | None


def parse_plane(text: str) -> Plane:
    """What one ``--plane`` asks for.

    Raises
    ------
    InvalidInputError
        If the text has none of the known forms.
    """
    name, colon, rest = text.partition(":")
    axes = {"incidence": None, "xy": [0, 1], "xz": [0, 2], "yz": [1, 2]}
    try:
        step = float(rest) if colon else None
    except ValueError:
        step = np.nan
    if name not in axes or (step is not None and not (np.isfinite(step) and step > 0)):
        raise InvalidInputError(
            f"--plane {text!r} is unknown; give incidence, xy, xz or yz, with :STEP if it is not to fit "
            "the wave, e.g. xz:0.02"
        )
    return Plane(text, None if axes[name] is None else np.eye(3)[axes[name]], step)


def write_planes(
    planes: Sequence[Plane],
    job: Job,
    source: RayFan | Solution,
    output: Output,
    progress: Callable[[str], None],
) -> tuple[list[dict[str, Any]], list[str]]:
    """Compute fields on planes, by a fan or a solution, and write their files.

    Returns entries of the summary and the names of the files.
    """
    entries, names = [], []
    for number, plane in enumerate(planes, 1):
        stem = "plane" if number == 1 else f"plane_{number}"
        asked: dict[str, Any] = {"step": plane.step} | (job.wave if isinstance(source, RayFan) else {})
        if plane.axes is not None:
            asked |= {"across": plane.axes[0], "up": plane.axes[1]}
        grid = cut_grid(source, **asked)
        progress(f"field on the plane {plane.text}: {grid.outside.sum()} points")
        started = time.perf_counter()
        if job.boundary == "pec":
            # the transmitted one of the first component that pictures show
            asked["polarisation"] = {"t": "theta", "p": "phi"}[job.components[0][1]]
        cut = field_cut(source, **asked)
        seconds = time.perf_counter() - started
        if job.unit:
            cut = replace(cut, field=replace(cut.field, length_unit=job.unit))
        names += write_tables(output.folder / stem, output.formats, cut, cut=cut)
        if output.pictures and np.any(cut.field.ok):
            title = f"{output.name}\n{job.told(cut.field.length_unit)}, {cut.field.boundary}"
            plotting.field_cut_picture(output.folder / f"{stem}.png", cut, error=True, title=title, dpi=DPI)
            names.append(f"{stem}.png")
        entries.append(_plane_entry(plane, cut) | {"seconds": round(seconds, 2)})
    return entries, names


def _plane_entry(plane: Plane, cut: FieldCut) -> dict[str, Any]:
    field = cut.field
    off = field.error[field.ok]
    return {
        "plane": plane.text,
        "points": [len(cut.across), len(cut.up)],
        "step": cut.step,
        "inside": int(np.sum(~cut.outside)),
        "status": field.status_counts,
        "methods": dict(sorted(Counter(field.method.tolist()).items())),
        "error_median": float(np.median(off)) if off.size else None,
        "error_max": float(off.max()) if off.size else None,
    }


def plane_words(entry: dict[str, Any]) -> str:
    """One line on a field on a plane."""
    states, error = ", ".join(f"{count} {name}" for name, count in entry["status"].items()), ""
    if entry["error_max"] is not None:
        error = f"; error {entry['error_median']:.1e} in the median, {entry['error_max']:.1e} at most"
    return (
        f"field on the plane {entry['plane']}: {' x '.join(map(str, entry['points']))} points {entry['step']:.3g} "
        f"apart, {states}{error}; {entry['seconds']:.1f} s"
    )


def wave_entry(source: Any) -> dict[str, list[float]]:
    """The incident wave as the summary names it."""
    position = getattr(source, "position", None)
    return {"direction": list(source.direction)} if position is None else {"source": list(position)}


def summary_of(body: str, speed: str | None, line: Any, carrier: Any, fan: Any, curves: list[Any]) -> dict[str, Any]:
    """What the summary file holds."""
    summary: dict[str, Any] = {
        "body": body,
        "speed": speed,
        "version": __version__,
        **wave_entry(line.source),
        "shadow_line": [{"length": c.length, "fractions": c.fractions} for c in line.curves],
        "flow": "map" if hasattr(carrier, "leaps") else "direct",
        "rays": len(fan.points),
        "steps": len(fan.travel_time),
        "length": fan.length,
        "ray_status": {s.name: int(np.sum(fan.status == s)) for s in RayStatus},
        "earliest_detachment": float(fan.detachment.min()) if np.isfinite(fan.detachment).any() else None,
        "caustics_passed": int(fan.caustic_index.max(initial=0)),
        "iso_phase_curves": len(curves),
        "error_of_rays": {"rms": fan.error.rms, "max": fan.error.max, "rays_traced": fan.error.samples},
    }
    if summary["flow"] == "map":
        summary["phase_map"] = {
            "horizon": carrier.horizon,
            "charts": len(carrier.leaps[-1].state),
            "nodes": list(carrier.grid.nodes),
            "degree": carrier.grid.degree,
            "megabytes": round(carrier.nbytes / 1e6, 1),
            "type": str(carrier.leaps[-1].state.dtype),
            "rms": carrier.error.rms,
            "max": carrier.error.max,
            "samples": carrier.error.samples,
        }
    if is_piecewise(fan.body):
        summary["losses"] = fan.losses()._asdict()
    # how well a body from a file is known, and what that does to its rays
    if getattr(fan.body, "fit", None) is not None:
        error = body_uncertainty(fan)
        summary |= {
            "fit": fan.body.fit.to_json(),
            "verdict": fan.body.quality.verdict,
            "repairs": list(fan.body.repairs),
            "error_of_body": None if error is None else asdict(error),
        }
    return summary


def write_results(line: Any, fan: Any, curves: list[Any], output: Output, **wave: Any) -> tuple[list[str], str | None]:
    """Write data files and pictures; their names, and what drew the pictures.

    ``wave`` is what pictures are told besides: wavenumber and boundary.
    """
    folder = output.folder
    # pictures last: a graphics driver that ends the process shall not take the numbers with it
    files.write_vtp(folder / "line.vtp", line=line)
    files.write_vtp(folder / "rays.vtp", fan=fan)
    files.write_vtp(folder / "curves.vtp", curves=curves)
    tables: dict[str, tuple[str, Any]] = {"line": ("line", line), "rays": ("fan", fan), "curves": ("curves", curves)}
    for name, (kind, what) in tables.items():
        write_tables(folder / name, output.formats, what, **{kind: what})
    names, drawn_by = [f"{n}.{kind}" for kind in ("vtp", *output.formats) for n in tables], None
    if output.pictures:
        wave["name"] = output.name
        drawn_by = plotting.picture(folder / "rays.png", line, fan, curves, backend=output.backend, dpi=DPI, **wave)
        plotting.parameter_picture(folder / "parameters.png", line, fan, curves, dpi=DPI, **wave)
        names = ["rays.png", "parameters.png", *names]
    return [*names, "summary.json"], drawn_by


def readable(summary: dict[str, Any], output: Path) -> str:
    """The summary as a person reads it."""
    name, place = ("d", summary["direction"]) if "direction" in summary else ("source at", summary["source"])
    equals = " =" if name == "d" else ""
    kind = f", {boundary_words(summary['field']['boundary'])}" if "field" in summary else ""
    rows = [f"{summary['body']}{kind}, {name}{equals} ({', '.join(f'{v:.4f}' for v in place)})"]
    for k, curve in enumerate(summary["shadow_line"]):
        shares = ", ".join(f"{100 * v:.1f} % {name}" for name, v in curve["fractions"].items() if v > 0)
        rows.append(f"shadow line {k + 1}: length {curve['length']:.10f}, {shares}")
    if "phase_map" in summary:
        m = summary["phase_map"]
        grid = " x ".join(map(str, [m["charts"], *m["nodes"]]))
        rows.append(
            f"phase map: T0 = {m['horizon']:g}, {grid} nodes, degree {m['degree']}; rms error {m['rms']:.1e} a leap"
        )
    else:
        rows.append("direct integration of order 8")
    statuses = ", ".join(f"{n} {name}" for name, n in summary["ray_status"].items() if n)
    rows.append(f"rays: {summary['rays']} of length {summary['length']:g} ({statuses or 'none launched'})")
    if "losses" in summary:
        line, ended, outline = (100 * summary["losses"][name] for name in ("line", "rays", "outline"))
        rows.append(
            f"on edges and tips: {line:.3g} % of the line, {outline:.3g} % of the outline; "
            f"{ended:.3g} % of the rays, by what is left of their waves, end there"
        )
    error = summary["error_of_rays"]
    rows.append(
        f"error at their ends, against independent integration at 1e-12: rms {error['rms']:.1e}, max {error['max']:.1e}"
    )
    if "fit" in summary:
        fit, off = summary["fit"], summary["error_of_body"]
        rows.append(
            f"body: a fit to {fit['points']} points, off by {fit['misfit']:.1e} m rms; kappa_n uncertain by "
            f"{fit['normal_curvature_error'] / fit['normal_curvature']:.1e} of its rms"
        )
        rows.extend(f"body: {text}" for text in summary["repairs"])
        if off is not None:
            rows.append(
                f"error at the ends of {off['rays']} rays because of it: points {off['points']:.1e} m, J "
                f"{off['spreading']:.1e}, attenuation {off['attenuation']:.1e} m^(1/3)"
            )
    if "field" in summary:
        f = summary["field"]
        hertz = "" if f["frequency"] is None else f"{frequency_words(f['frequency'])}, "
        unit = "dBsm" if f["unit"] == "m" else "dB re 1 L^2"
        level = "" if f["largest_db"] is None else f" ({f['largest_db']:.2f} {unit})"
        rows.append(
            f"field: {hertz}k = {f['wavenumber']:g}, {f['boundary']}, {f['directions']} directions, |f| up to "
            f"{f['largest']:.4g} {f['unit']}{level}, {f['unresolved']} unresolved; {f['seconds']:.1f} s"
        )
        k_rho, transverse = f["validity"]["least_k_rho"], f["validity"]["largest_transverse"]
        if k_rho is not None:
            measured = f["error"]["by"] == "extinction"
            rows.append(f"on its rays {validity_words(Validity(k_rho, transverse), measured=measured)}")
        if f["error"]["by"] is not None:
            off = f["error"]
            rows.append(f"error of |f| by {off['by']}: rms {off['rms']:.1e}, max {off['max']:.1e}")
        if "uncertain_by" in f:
            off = f["uncertain_by"]
            known = off["reason"] or f"rms {off['rms']:.1e}, max {off['max']:.1e}"
            rows.append(f"error of the field because of the body: {known}")
    rows.extend(plane_words(entry) for entry in summary.get("planes", ()))
    drawn = f"3-D picture by {summary['drawn_by']}" if summary["drawn_by"] else "no pictures"
    rows.append(f"{summary['iso_phase_curves']} iso-phase curves; {drawn}")
    rows.append(f"{summary['seconds']:.1f} s; results in {output}/: {', '.join(summary['files'])}")
    return "\n".join(rows)


def run_solved(
    shape: Any,
    without: str,
    job: Job | None,
    incident: Any,
    planes: Sequence[Plane],
    output: Output,
    progress: Progress,
    unfinished: Unfinished,
) -> dict[str, Any]:
    """Write the far field of a plane wave that launches no rays, ``without`` says why; returns the summary.

    Raises
    ------
    InvalidInputError
        If no field is asked for, or one of a point source.
    """
    if job is None:
        raise InvalidInputError(f"{rays_refused(shape)}; give --wavenumber, --frequency or --wavelength")
    if not hasattr(incident, "direction"):
        raise InvalidInputError(f"--source is of bodies with rays; {without}: give --direction")
    started = time.perf_counter()
    with kept(unfinished, progress.message):
        solution, far, seconds = job.solved(shape, incident.direction, progress, unfinished)
        progress("pictures and files" if output.pictures else "files")
        summary: dict[str, Any] = {"body": unfinished.asked["body"], "version": __version__, **wave_entry(incident)}
        summary |= {"rays": None, "without_rays": without, "nodes": solution.nodes}
        summary["field"], names = job.write(far, solution, output)
        summary["planes"], more = write_planes(planes, job, solution, output, progress)
        summary["field"]["seconds"], summary["files"] = seconds, [*names, *more, "summary.json"]
        summary["seconds"] = round(time.perf_counter() - started, 2)
        unfinished.write_summary(summary, complete=True)
    return summary


def readable_solved(summary: dict[str, Any], output: Path) -> str:
    """The summary in a few lines."""
    field = summary["field"]
    error = field["error"]
    told = "" if error["rms"] is None else f"; error by {error['by']} {error['rms']:.2g} {field['unit']} rms"
    rows = [
        f"no creeping rays: {summary['without_rays']}",
        f"{field['boundary']} far field in {field['directions']} directions by the integral equation between "
        f"{summary['nodes']} nodes, |f| up to {field['largest']:.4g} {field['unit']}{told}, "
        f"{field['unresolved']} unresolved",
        *map(plane_words, summary["planes"]),
        f"{len(summary['files'])} files in {output} ({', '.join(summary['files'])}), {summary['seconds']:.1f} s",
    ]
    return "\n".join(rows)
