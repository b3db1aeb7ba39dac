"""What ``creeping rcs`` and ``creeping ts`` compute, write and say."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from creeping import plotting
from creeping._typing import FloatArray
from creeping._version import __version__
from creeping.commands.echo_request import EchoRequest
from creeping.commands.forecast import boundary_words
from creeping.commands.resuming import SUMMARY, Unfinished
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike
from creeping.field.comparison import Comparison, compare
from creeping.field.echo import Echo
from creeping.field.impulse import RangeProfile, range_profile
from creeping.files import read_cut, write_echo, write_mat, write_profile
from creeping.files.measured import MeasuredCut
from creeping.geometry.checks import WRONG_SIGNS, wrong_signs
from creeping.geometry.directions import directions_from_azimuth_elevation
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.shadow.status import FAILED, SINGULAR
from creeping.sweeping.blocks import Rows
from creeping.sweeping.echoes import backscatter, bistatic, echo_of

TURN = 360.0
"""Degrees after which azimuths repeat."""
LEAST_BAND = 16
"""Frequencies from which a band has a range profile."""


def computed(
    body: Surface,
    request: EchoRequest,
    boundary: BoundaryLike,
    azimuths: FloatArray,
    elevations: FloatArray,
    method: str,
    cache: bool,
    unfinished: Unfinished,
    progress: Any,
    rows: Callable[[Rows], None],
) -> Any:
    """Dataset of what a request asks for; see `creeping.sweeping.blocks.sweep_blocks`."""
    asked: dict[str, Any] = {"wavenumbers": request.wavenumbers, "azimuth": azimuths, "elevation": elevations}
    asked |= {"boundary": boundary, "method": method, "cache": cache, "progress": progress}
    asked |= {"store": unfinished.parts, "resume": True, "rows": rows}
    if request.monostatic:
        return backscatter(body, **asked)
    # one fan for all observers: currents cost no more than rays
    chosen = "currents" if method == "auto" else method
    return bistatic(body, **(asked | {"incidence": request.incidence, "method": chosen}))


def asked_words(angles: FloatArray, request: EchoRequest) -> str:
    """How much is computed."""
    count, several = len(angles), len(request.wavenumbers)
    return f"{count} angle{'s' * (count > 1)} x {several} frequenc{'ies' if several > 1 else 'y'}"


def echo_for(request: EchoRequest, dataset: Any) -> Echo:
    """Echo of a request's dataset."""
    return echo_of(dataset, request.quantity, request.channels, request.angle_name, sound_speed=request.sound_speed)


def write_rows(unfinished: Unfinished, request: EchoRequest, found: Rows) -> None:
    """Write the rows that are there, with marks that others are missing."""
    done, of = int(found.known.sum()), found.known.size
    mark = f"incomplete: {done} of {of} values; {unfinished.mark}"
    table = unfinished.output / f"{request.quantity}.csv"
    write_echo(table, echo_for(request, found.dataset), known=found.known, mark=mark)
    words = {"values_done": done, "values": of, "resume": unfinished.again, "files": [table.name, SUMMARY]}
    unfinished.write_summary(words, complete=False)


def reference_of(
    request: EchoRequest, path: Path | None, column: str | None, align: float
) -> dict[str, tuple[MeasuredCut, FloatArray]]:
    """Measured cut and its levels by channel, of those that it has.

    Raises
    ------
    InvalidInputError
        If the file is no table, lacks the columns, or is over what the request does not vary.
    """
    if path is None:
        stray = [name for name, value in (("--column", column), ("--align", align)) if value]
        if stray:
            raise InvalidInputError(f"{' and '.join(stray)}: give --compare as well, what it is about")
        return {}
    if not (np.isfinite(align) and align >= 0):
        raise InvalidInputError(f"--align {align!r} is not a finite number of degrees >= 0")
    cut = read_cut(path)
    if len(request.wavenumbers) > 1 and request.angle_name:
        raise InvalidInputError("--compare takes a cut or a band; give one frequency, or one direction")
    over = "frequency" if len(request.wavenumbers) > 1 else "angle"
    if cut.over != over or (over == "angle" and not request.angle_name):
        raise InvalidInputError(f"--compare {path} is over {cut.over}; ask for a cut or a band that varies that")
    if column is None:
        found = {channel: cut.of(channel) for channel in request.channels}
        if len(request.channels) > 1 and len(cut.levels) == 1 and all(v is not None for v in found.values()):
            # a column without a polarisation's name is of one at most
            found = {}
    else:
        names = [name.strip() for name in column.split(",")]
        unknown = [name for name in names if name not in cut.levels]
        if unknown or len(names) != len(request.channels):
            raise InvalidInputError(
                f"--column {column!r}: give one of {', '.join(cut.levels)} for each of {', '.join(request.channels)}"
            )
        found = {channel: cut.levels[name] for channel, name in zip(request.channels, names, strict=True)}
    known = {channel: (cut, levels) for channel, levels in found.items() if levels is not None}
    if not known:
        raise InvalidInputError(
            f"--compare {path} has columns {', '.join(cut.levels)}: say with --column which is "
            f"{', '.join(request.channels)}"
        )
    return known


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
            options["period"] = TURN
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
    stem = echo.quantity
    names = [f"{stem}.{kind}" for kind in formats]
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
        names += _drawn(output, stem, echo, profiles, _ranges(echo, body), name)
        if comparisons:
            plotting.comparison_picture(output / "compared.png", echo, comparisons, title=_title(echo, name))
            names.append("compared.png")
    return names, extra


def _ranges(echo: Echo, body: Surface) -> tuple[float, float]:
    """Ranges, metres, nine tenths of the diagonal of the body's box to both sides of its middle."""
    d = -directions_from_azimuth_elevation(*np.radians((echo.azimuth[0], echo.elevation[0])))
    middle, diagonal = float(np.mean(body.bounds, axis=0) @ d), float(np.linalg.norm(np.ptp(body.bounds, axis=0)))
    return middle - 0.9 * diagonal, middle + 0.9 * diagonal


def _profiles(echo: Echo) -> dict[str, RangeProfile]:
    """Range profiles by channel, of backscatter in one direction over a band of equal steps whose values are finite."""
    if echo.incidence is not None or len(echo.azimuth) > 1 or len(echo.wavenumbers) < LEAST_BAND:
        return {}
    try:
        return {
            channel: range_profile(values[0], echo.wavenumbers)
            for channel, values in zip(echo.channels, echo.total, strict=True)
        }
    except InvalidInputError:
        return {}


def _drawn(
    output: Path, stem: str, echo: Echo, profiles: dict[str, RangeProfile], span: tuple[float, float], name: str
) -> list[str]:
    words: dict[str, Any] = {"title": _title(echo, name)}
    several, band = len(echo.azimuth) > 1, len(echo.wavenumbers) > 1
    jobs: list[tuple[str, Any]] = []
    if several and not band:
        jobs.append((f"{stem}.png", lambda path: plotting.echo_cut_picture(path, echo, **words)))
        polar = {"kind": "polar", **words}
        jobs.append((f"{stem}_polar.png", lambda path: plotting.echo_cut_picture(path, echo, **polar)))
    if several and band:
        jobs.append((f"{stem}_map.png", lambda path: plotting.echo_map_picture(path, echo, **words)))
    if band and not several:
        jobs.append((f"{stem}.png", lambda path: plotting.echo_band_picture(path, echo, **words)))
    if profiles:
        jobs.append(("range.png", lambda path: plotting.range_picture(path, profiles, echo, span, **words)))
    names = []
    for file, draw in jobs:
        try:
            draw(output / file)
        except InvalidInputError:
            # nothing that can be drawn in decibels: the table says so
            continue
        names.append(file)
    return names


def _title(echo: Echo, name: str) -> str:
    short = name if len(name) < 50 else f"{name[:47]}..."
    hertz = echo.hertz
    at = f"{hertz[0] / 1e9:g} GHz" if echo.quantity == "rcs" else f"{hertz[0] / 1e3:g} kHz"
    words = [short, "" if len(hertz) > 1 else at]
    if echo.incidence is not None:
        viewer = "radar" if echo.quantity == "rcs" else "sonar"
        words.append(f"bistatic, {viewer} at azimuth {echo.incidence[0]:g}°, elevation {echo.incidence[1]:g}°")
    elif len(echo.azimuth) == 1:
        words.append(f"azimuth {echo.azimuth[0]:g}°, elevation {echo.elevation[0]:g}°")
    off = echo.summary()["error_db_median"]
    told = "" if off is None else f"; error {off:.1g} dB in the median"
    return ", ".join(word for word in words if word) + told


def summary_of(body: str, request: EchoRequest, echo: Echo, dataset: Any) -> dict[str, Any]:
    """What the summary file holds."""
    least, largest = dataset["least_k_rho"].values, dataset["largest_transverse"].values
    return {
        "body": body,
        "version": __version__,
        **echo.summary(),
        "frequency_hz": [float(echo.hertz[0]), float(echo.hertz[-1])],
        "boundary": request.boundary,
        "validity": {
            "least_k_rho": _extreme(np.nanmin, least),
            "largest_transverse": _extreme(np.nanmax, largest),
        },
        "failed_incidences": int(np.sum(np.isin(dataset["incidence_status"].values, (SINGULAR, FAILED)))),
        "errors": dataset.attrs.get("errors"),
        "digest": dataset.attrs.get("sweep_digest"),
    }


def _extreme(pick: Any, values: Any) -> float | None:
    known = values[np.isfinite(values)]
    return float(pick(known)) if known.size else None


def readable(summary: dict[str, Any], output: Path) -> str:
    """The summary as a person reads it."""
    unit = summary["unit"]
    tops = ", ".join(
        f"{channel} up to {value:.2f}" if value is not None else f"{channel} nothing finite"
        for channel, value in summary["largest"].items()
    )
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
    if summary["otherwise_by"] == "t-matrix":
        served = "all values by the T-matrix of the body"
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
