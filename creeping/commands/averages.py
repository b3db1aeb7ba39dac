"""``creeping rcs --average`` and ``creeping ts --average``: the mean echo of a body over all its orientations."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from creeping import plotting
from creeping._progress import Progress
from creeping._version import __version__
from creeping.commands.body import each_once, parse_body
from creeping.commands.echo_request import echo_request
from creeping.commands.forecast import boundary_words, forecast
from creeping.commands.options import EchoOptions, FileOptions
from creeping.commands.resuming import SUMMARY, asked_for, begun, kept
from creeping.errors import InvalidInputError
from creeping.field.boundary import parse_boundary
from creeping.field.frequency import frequency
from creeping.field.results.echo import LEVELS
from creeping.field.tmatrix.patterns import Averages
from creeping.files import averaged_levels, write_averages
from creeping.sweeping.over_wavenumbers import averages_of, t_matrices

STRAY = ("monostatic", "bistatic", "incidence", "compare", "column", "align")
"""Options of angles and of cuts."""


def run_averages(quantity: str, body: str, given: EchoOptions, file: FileOptions, **wave: Any) -> int:
    """Compute, write and tell means over orientation; ``wave`` as of `creeping.commands.echo_report.run_echo`."""
    started, output = time.perf_counter(), given.output or Path(quantity)
    stray = [f"--{name}" for name in STRAY if getattr(given, name)]
    stray += ["--polarisation"] * bool(wave["polarisation"])
    stray += ["--method"] * (given.method not in ("auto", "t-matrix"))
    if stray:
        raise InvalidInputError(f"--average is over all angles and polarisations: leave out {', '.join(stray)}")
    each_once("--format", given.formats, ("csv",))
    asked: dict[str, Any] = {"frequency": given.frequency, "wavelength": given.wavelength, **wave}
    request = echo_request(quantity, monostatic=None, bistatic=None, incidence=None, **asked)
    boundary, k = parse_boundary(request.boundary), request.wavenumbers
    hertz = np.array([float(f"{one:.14g}") for one in np.atleast_1d(frequency(k, sound_speed=request.sound_speed))])
    words = asked | {"average": True} | file.given() | {"pictures": given.pictures}
    with Progress("frequencies", quiet=given.json_) as progress:
        shape = parse_body(body, options=file, cache=given.cache, progress=progress)
        told = forecast(shape, k, boundary, method="t-matrix", metres=True, cure=request.cure)
        progress.note(f"{told.body}, {boundary_words(boundary)}")
        unfinished = begun(output, quantity, asked_for(body, shape, **words), resume=given.resume)
        if unfinished is None:
            print((output / SUMMARY).read_text() if given.json_ else f"nothing is missing in {output}")
            return 0
        progress(f"the mean over all orientations at {len(k)} frequenc{'ies' if len(k) > 1 else 'y'} by {told.by}")
        progress.begin(0, len(k))
        table, rows = output / f"{quantity}_average.csv", list[tuple[float, Averages]]()

        def write(mark: str = "") -> Any:
            found = averages_of(shape, boundary, rows)
            write_averages(table, quantity, hertz[: len(rows)], found, mark=mark)
            return found

        def incomplete() -> None:
            write(f"incomplete: {len(rows)} of {len(k)} frequencies; {unfinished.mark}")
            missing = {"values_done": len(rows), "values": len(k), "resume": unfinished.again}
            unfinished.write_summary(missing | {"files": [table.name, SUMMARY]}, complete=False)

        with kept(unfinished, progress.message):
            for T in t_matrices(shape, wavenumbers=k, boundary=boundary, store=unfinished.parts):
                rows.append((T.wavenumber, T.orientation_average()))
                progress.told(len(rows), len(k))
                if len(rows) < len(k):
                    unfinished.now_and_then(incomplete)
            found = write()
            levels, error = averaged_levels(quantity, found), found.target_strength_error.values
            names = [table.name]
            if given.pictures and len(k) > 1:
                title = f"{body if len(body) < 50 else f'{body[:47]}...'}, mean over all orientations"
                picture = output / f"{quantity}_average.png"
                plotting.averages_picture(picture, quantity, hertz, levels, error, title=title)
                names.append(picture.name)
            summary = {
                "body": body,
                "version": __version__,
                "quantity": f"{quantity}, mean over orientation",
                "unit": LEVELS[quantity][1],
                "boundary": request.boundary,
                "values": len(k),
                "frequency_hz": [float(hertz[0]), float(hertz[-1])],
                "range": [float(levels.min()), float(levels.max())],
                "error_db": float(error.max()),
                "files": [*names, SUMMARY],
            }
            unfinished.write_summary(summary, complete=True)
    summary |= {"complete": True, "seconds": round(time.perf_counter() - started, 2)}
    print(json.dumps(summary, indent=1) if given.json_ else _readable(summary, output))
    return 0


def _readable(summary: dict[str, Any], output: Path) -> str:
    """The summary as a person reads it."""
    low, high = summary["range"]
    span = f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}"
    of = f"{summary['quantity']}, of {summary['body']}, {boundary_words(summary['boundary'])}"
    return (
        f"{of}: {span} {summary['unit']}, error {summary['error_db']:.1g} dB at most\n"
        f"{summary['seconds']:.1f} s; results in {output}/: {', '.join(summary['files'])}"
    )
