"""What ``creeping rcs`` and ``creeping ts`` compute, write and say: echoes, and means over all orientations."""

import json
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from creeping import plotting
from creeping._progress import Progress
from creeping._typing import FloatArray
from creeping._version import __version__
from creeping.commands.echo_request import EchoJob, EchoRequest
from creeping.commands.forecast import boundary_words, forecast
from creeping.commands.options import title_of
from creeping.commands.resuming import SUMMARY, Unfinished, asked_for, begun, kept
from creeping.errors import InvalidInputError
from creeping.field.boundary import parse_boundary
from creeping.field.frequency import frequency
from creeping.field.results.comparison import LEVELS, Comparison, Echo, compare
from creeping.field.results.impulse import RangeProfile, range_profile
from creeping.field.tmatrix.patterns import Averages
from creeping.files import averaged_levels, write_averages, write_echo, write_mat, write_profile
from creeping.files.measured import MeasuredCut
from creeping.geometry.checks import WRONG_SIGNS, wrong_signs
from creeping.geometry.directions import directions_from_azimuth_elevation
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.shadow.status import LineStatus
from creeping.sweeping.blocks import Rows
from creeping.sweeping.echoes import backscatter, bistatic, echo_of, monostatic_method
from creeping.sweeping.over_wavenumbers import averages_of, t_matrices


def run_echo(job: EchoJob, shape: Any, progress: Progress) -> str:
    """Compute and write an echo, or means over orientation: what there is to say of it."""
    request, given, k = job.request, job.given, job.request.wavenumbers
    output, boundary = given.output or Path(request.quantity), parse_boundary(request.boundary)
    angles, seen = None, dict[str, Any](method="t-matrix")
    words = job.asked | {"average": True} | job.file.given() | {"pictures": given.pictures}
    if not given.average:
        words = job.asked | {"method": given.method} | job.file.given() | {"pictures": given.pictures}
        words |= {name: getattr(given, name) for name in ("formats", "compare", "column", "align")}
        angles = request.angles(shape)
        count, mono = len(angles[0]), request.monostatic
        seen = {"radar": angles if mono else request.incidence, "observers": 1 if mono else count}
        auto = given.method == "auto" and mono
        seen["method"] = monostatic_method(shape, k, boundary, count) if auto else given.method
    told = forecast(shape, k, boundary, metres=True, cure=request.cure, **seen)
    progress.note(f"{told.body}, {boundary_words(boundary)}")
    unfinished = begun(output, request.quantity, asked_for(job.body, shape, **words), resume=given.resume)
    if unfinished is None:
        return (output / SUMMARY).read_text() if given.json_ else f"nothing is missing in {output}"
    frequencies = f"{len(k)} frequenc{'ies' if len(k) > 1 else 'y'} by {told.by}"
    with kept(unfinished, progress.message):
        if angles is None:
            progress(f"the mean over all orientations at {frequencies}")
            summary = _averages(job, shape, unfinished, progress)
        else:
            progress(f"{len(angles[0])} angle{'s' * (len(angles[0]) > 1)} x {frequencies}")
            summary = _echo(job, shape, angles, unfinished, progress)
        summary["files"].append(SUMMARY)
        unfinished.write_summary(summary, complete=True)
    summary |= {"complete": True, "seconds": round(time.perf_counter() - job.started, 2)}
    say = _readable_averages if given.average else readable
    return json.dumps(summary, indent=1) if given.json_ else say(summary, output)


def _echo(job: EchoJob, shape: Any, angles: Any, unfinished: Unfinished, progress: Progress) -> dict[str, Any]:
    """Compute and write an echo at azimuths and elevations (n,), degrees; returns the summary."""
    request, given, k = job.request, job.given, job.request.wavenumbers
    output, quantity, method = unfinished.output, request.quantity, given.method
    values = len(angles[0]) * len(k)
    progress.begin(0, values)

    def echo_for(dataset: Any) -> Echo:
        return echo_of(dataset, quantity, request.channels, request.angle_name, sound_speed=request.sound_speed)

    def rows(found: Rows) -> None:
        """Write the rows that are there, with marks that others are missing."""
        done = int(found.known.sum())
        mark = f"incomplete: {done} of {values} values; {unfinished.mark}"
        table = output / f"{quantity}.csv"
        write_echo(table, echo_for(found.dataset), known=found.known, mark=mark)
        unfinished.write_missing(done, values, table.name)

    def passed(done: float, total: int, seconds: float) -> None:
        progress.told(values * done / total, values, seconds)

    asked: dict[str, Any] = {"wavenumbers": k, "azimuth": angles[0], "elevation": angles[1]}
    asked |= {"boundary": parse_boundary(request.boundary), "cache": given.cache, "progress": passed}
    asked |= {"store": unfinished.parts, "resume": True, "rows": rows}
    if request.monostatic:
        dataset = backscatter(shape, method=method, **asked)
    else:
        # one fan for all observers: currents cost no more than rays
        method = "currents" if method == "auto" else method
        dataset = bistatic(shape, incidence=request.incidence, method=method, **asked)
    echo = echo_for(dataset)
    progress("tables and pictures" if given.pictures else "tables")
    comparisons, refused = compared(echo, job.reference, given.align)
    pictured: dict[str, Any] = {"pictures": given.pictures, "formats": job.formats}
    names, extra = write_results(output, echo, comparisons, shape, job.body, **pictured)
    return summary_of(job.body, request, echo, dataset) | extra | refused | {"files": names}


def compared(
    echo: Echo, reference: dict[str, tuple[MeasuredCut, FloatArray]], align: float
) -> tuple[dict[str, Comparison], dict[str, Any]]:
    """Comparison by channel, and for the summary why there is none; ``align`` in degrees."""
    found, refused, levels, (low, high) = {}, {}, echo.levels(), echo.bounds()
    for channel, (cut, given) in reference.items():
        c = echo.channels.index(channel)
        at = (c, 0, slice(None)) if cut.over == "frequency" else (c, slice(None), 0)
        values = echo.hertz if cut.over == "frequency" else echo.angles
        options: dict[str, Any] = {"align": align if cut.over == "angle" else 0.0}
        if cut.over == "angle" and echo.angle_name == "azimuth" and not cut.polar:
            options["period"] = 360.0
        try:
            found[channel] = compare(values, levels[at], cut.values, given, low=low[at], high=high[at], **options)
        except InvalidInputError as error:
            # the results are written all the same
            refused[channel] = str(error)
    return found, {"not_compared": refused} if refused else {}


def write_results(
    output: Path,
    echo: Echo,
    comparisons: dict[str, Comparison],
    body: Surface,
    name: str,
    *,
    pictures: bool,
    formats: tuple[str, ...] = ("csv",),
) -> tuple[list[str], dict[str, Any]]:
    """Write tables and pictures; their names, and what they add to the summary."""
    names = [f"{echo.quantity}.{kind}" for kind in formats]
    for file in names:
        write = write_mat if file.endswith(".mat") else write_echo
        write(output / file, echo)
    extra: dict[str, Any] = {"wrong_signs": wrong_signs(body)[0]} if is_piecewise(body) else {}
    for channel, found in comparisons.items():
        extra.setdefault("compared", {})[channel] = found.summary()
    profiles = _profiles(echo)
    if profiles:
        write_profile(output / "range.csv", profiles, echo)
        names.append("range.csv")
        extra["range_resolution"] = next(iter(profiles.values())).resolution
        extra["range_repeats"] = float(np.pi / np.diff(echo.wavenumbers).mean())
    if pictures:
        names += _drawn(output, echo, profiles, body, name)
        if comparisons:
            plotting.comparison_picture(output / "compared.png", echo, comparisons, title=_title(echo, name))
            names.append("compared.png")
    return names, extra


def _profiles(echo: Echo) -> dict[str, RangeProfile]:
    """Range profiles by channel, of backscatter in one direction over a band of 16 or more equal steps, all finite."""
    if echo.incidence is not None or len(echo.azimuth) > 1 or len(echo.wavenumbers) < 16:
        return {}
    # inf: of what has no error none is known
    known = np.where(np.isnan(echo.error), np.inf, echo.error)
    try:
        return {
            channel: range_profile(values[0], echo.wavenumbers, error=error[0])
            for channel, values, error in zip(echo.channels, echo.total, known, strict=True)
        }
    except InvalidInputError:
        return {}


def _drawn(output: Path, echo: Echo, profiles: dict[str, RangeProfile], body: Surface, name: str) -> list[str]:
    several, band, names = len(echo.azimuth) > 1, len(echo.wavenumbers) > 1, list[str]()

    def drawn(file: str, draw: Callable[..., None], *what: Any, **options: Any) -> None:
        # what cannot be drawn in decibels the table says
        with suppress(InvalidInputError):
            draw(output / file, *what, title=_title(echo, name), **options)
            names.append(file)

    if several or band:
        drawn(f"{echo.quantity}{'_map' if several and band else ''}.png", plotting.echo_picture, echo)
    if several and not band:
        drawn(f"{echo.quantity}_polar.png", plotting.echo_picture, echo, kind="polar")
    if profiles:
        # ranges, metres, nine tenths of the diagonal of the body's box to both sides of its middle
        d = -directions_from_azimuth_elevation(*np.radians((echo.azimuth[0], echo.elevation[0])))
        middle, diagonal = float(np.mean(body.bounds, axis=0) @ d), float(np.linalg.norm(np.ptp(body.bounds, axis=0)))
        drawn("range.png", plotting.range_picture, profiles, echo, (middle - 0.9 * diagonal, middle + 0.9 * diagonal))
    return names


def _title(echo: Echo, name: str) -> str:
    hertz = echo.hertz
    at = f"{hertz[0] / 1e9:g} GHz" if echo.quantity == "rcs" else f"{hertz[0] / 1e3:g} kHz"
    words = [title_of(name), "" if len(hertz) > 1 else at]
    if echo.incidence is not None:
        words.append(f"bistatic, {echo.viewer} at azimuth {echo.incidence[0]:g}°, elevation {echo.incidence[1]:g}°")
    elif len(echo.azimuth) == 1:
        words.append(f"azimuth {echo.azimuth[0]:g}°, elevation {echo.elevation[0]:g}°")
    off = echo.summary()["error_db_median"]
    told = "" if off is None else f"; error {off:.1g} dB in the median"
    return ", ".join(word for word in words if word) + told


def summary_of(body: str, request: EchoRequest, echo: Echo, dataset: Any) -> dict[str, Any]:
    """What the summary file holds."""
    all_values = (dataset[name].values for name in ("least_k_rho", "largest_transverse"))
    least, largest = (values[np.isfinite(values)] for values in all_values)
    total = dataset.field.total
    none = total.isnull().all([name for name in total.dims if name != "incidence"]).values
    return {
        "body": body,
        "version": __version__,
        **echo.summary(),
        "frequency_hz": [float(echo.hertz[0]), float(echo.hertz[-1])],
        "boundary": request.boundary,
        "validity": {
            "least_k_rho": float(least.min()) if least.size else None,
            "largest_transverse": float(largest.max()) if largest.size else None,
        },
        "failed_incidences": int(
            np.sum(none & np.isin(dataset["incidence_status"].values, (LineStatus.SINGULAR, LineStatus.FAILED)))
        ),
        "errors": dataset.attrs.get("errors"),
        "digest": dataset.attrs.get("sweep_digest"),
    }


def readable(summary: dict[str, Any], output: Path) -> str:
    """The summary as a person reads it."""
    unit = summary["unit"]
    largest = summary["largest"].items()
    tops = ", ".join(f"{name} " + ("nothing finite" if top is None else f"up to {top:.2f}") for name, top in largest)
    rows = [f"{summary['quantity']} of {summary['body']}, {boundary_words(summary['boundary'])}, {unit}: {tops}"]
    if summary["error_db_median"] is not None:
        rows.append(
            f"stated error: {summary['error_db_median']:.2g} dB in the median, "
            f"{summary['error_db_95']:.2g} dB in 95 of 100 values"
        )
    others = "rays" if summary["otherwise_by"] == "rays" else "rays and physical optics"
    count, values = summary["by_currents"], summary["values"]
    rest = "" if count == values else f", the others by {others}"
    served = f"{count} of {values} values by currents{rest}"
    together = {"t-matrix": "the T-matrix of the body", "equation": "the integral equation"}
    if summary["otherwise_by"] in together:
        served = f"all values by {together[summary['otherwise_by']]}"
    rows.append(f"{served}; {summary['unresolved']} unresolved")
    least, largest = summary["validity"]["least_k_rho"], summary["validity"]["largest_transverse"]
    if least is not None and largest is not None:
        rows.append(f"on the rays k rho >= {least:.3g}, kappa_t rho/m^2 <= {largest:.2g}")
    if summary.get("wrong_signs", 0.0) > WRONG_SIGNS:
        rows.append(
            f"beside {100 * summary['wrong_signs']:.2g} % of its area F has the wrong sign outside or inside: see "
            "`creeping check`; a file can be taken with --surface facets"
        )
    if summary["failed_incidences"]:
        rows.append(f"{summary['failed_incidences']} incidences are singular or failed: their rows are NaN")
        rows += str(summary["errors"] or "").splitlines()[:3]
    if "range_resolution" in summary:
        rows.append(
            f"range profile: resolution {summary['range_resolution']:.3g} m, repeats after "
            f"{summary['range_repeats']:.3g} m"
        )
    for channel, why in summary.get("not_compared", {}).items():
        rows.append(f"{channel} is not compared: {why}")
    for channel, off in summary.get("compared", {}).items():
        rows.append(
            f"{channel} against the reference at {off['places']:g} places: mean {off['mean_db']:+.3g} dB, rms "
            f"{off['rms_db']:.3g} dB, largest {off['largest_db']:.3g} dB, Austin measure {off['austin_db']:.3g} dB"
        )
        shift = f"; shifted by {off['shift']:g} degrees" if off["shift"] else ""
        wrapped = f"; {off['wrapped']:g} of its azimuths by whole turns" if off["wrapped"] else ""
        rows.append(f"  {100 * off['within_error']:.0f} % within the stated error{shift}{wrapped}")
    rows.append(f"{summary['seconds']:.1f} s; results in {output}/: {', '.join(summary['files'])}")
    return "\n".join(rows)


def _averages(job: EchoJob, shape: Any, unfinished: Unfinished, progress: Progress) -> dict[str, Any]:
    """Compute and write means over orientation; returns the summary."""
    request, given, k = job.request, job.given, job.request.wavenumbers
    output, quantity, boundary = unfinished.output, request.quantity, parse_boundary(request.boundary)
    hertz = np.array([float(f"{one:.14g}") for one in np.atleast_1d(frequency(k, sound_speed=request.sound_speed))])
    progress.begin(0, len(k))
    table, rows = output / f"{quantity}_average.csv", list[tuple[float, Averages]]()

    def write(mark: str = "") -> Any:
        found = averages_of(shape, boundary, rows)
        write_averages(table, quantity, hertz[: len(rows)], found, mark=mark)
        return found

    def incomplete() -> None:
        write(f"incomplete: {len(rows)} of {len(k)} frequencies; {unfinished.mark}")
        unfinished.write_missing(len(rows), len(k), table.name)

    for T in t_matrices(shape, wavenumbers=k, boundary=boundary, store=unfinished.parts):
        rows.append((T.wavenumber, T.orientation_average()))
        progress.told(len(rows), len(k))
        if len(rows) < len(k):
            unfinished.now_and_then(incomplete)
    found = write()
    levels, error = averaged_levels(quantity, found), found.target_strength_error.values
    names = [table.name]
    if given.pictures and len(k) > 1:
        title = f"{title_of(job.body)}, mean over all orientations"
        picture = output / f"{quantity}_average.png"
        plotting.averages_picture(picture, quantity, hertz, levels, error, title=title)
        names.append(picture.name)
    return {
        "body": job.body,
        "version": __version__,
        "quantity": f"{quantity}, mean over orientation",
        "unit": LEVELS[quantity][1],
        "boundary": request.boundary,
        "values": len(k),
        "frequency_hz": [float(hertz[0]), float(hertz[-1])],
        "range": [float(levels.min()), float(levels.max())],
        "error_db": float(error.max()),
        "files": names,
    }


def _readable_averages(summary: dict[str, Any], output: Path) -> str:
    """The summary as a person reads it."""
    low, high = summary["range"]
    span = f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}"
    of = f"{summary['quantity']}, of {summary['body']}, {boundary_words(summary['boundary'])}"
    return (
        f"{of}: {span} {summary['unit']}, error {summary['error_db']:.1g} dB at most\n"
        f"{summary['seconds']:.1f} s; results in {output}/: {', '.join(summary['files'])}"
    )
