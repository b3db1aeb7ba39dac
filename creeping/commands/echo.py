"""``creeping rcs`` and ``creeping ts``: the echo of a body as a radar or a sonar measures it, with its error.

Lengths of the body are metres. Angles are those of the radar or the observer as seen from the body.
"""

import json
import sys
import time
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from creeping._progress import Progress
from creeping.commands.body import AS_IT_IS, HELP, Body, FileOptions, parse_body, table_formats

_angles = Group("Angles")
_output = Group("Output")
Frequency = Annotated[
    str | None, Parameter(help='One, e.g. "10GHz", or a band FIRST:LAST:STEP, e.g. "2:18:0.05GHz"; Hz, kHz, MHz, GHz.')
]
Wavelength = Annotated[str | None, Parameter(help='Instead of a frequency, e.g. "3cm".')]
Monostatic = Annotated[
    str | None,
    Parameter(
        group=_angles,
        help="Backscatter in a cut: az or el, whose step fits the lobes, or az:FIRST:LAST:STEP, degrees; az:20 or "
        "az:20,el:5 is one direction. az for one frequency if nothing else is asked for.",
    ),
]
Bistatic = Annotated[
    str | None, Parameter(group=_angles, help="Observers in a cut, in the same forms, the radar at --incidence.")
]
Incidence = Annotated[
    str | None,
    Parameter(group=_angles, help="AZIMUTH,ELEVATION of the radar, degrees; of a cut the angle that stays. 0,0."),
]
Method = Annotated[
    str,
    Parameter(
        help="auto, rays, currents, equation or t-matrix: auto takes currents where rays do not resolve a value and "
        "err more; equation solves the body's integral equation for every value, in seconds to minutes each; t-matrix "
        "makes one matrix a frequency for all angles."
    ),
]
Compare = Annotated[
    Path | None,
    Parameter(group=_output, help="Measured cut to compare with, a table with a column of angles or frequencies."),
]
Column = Annotated[
    str | None,
    Parameter(group=_output, help="Columns of --compare, one for each polarisation, if their names do not tell."),
]
Align = Annotated[float, Parameter(group=_output, help="Largest shift of the measured angles that is tried, degrees.")]
Folder = Annotated[Path | None, Parameter(name=["-o", "--output"], group=_output, help="Folder for the results.")]
Pictures = Annotated[bool, Parameter(group=_output, help="Draw pictures; --no-pictures leaves them out.")]
Formats = Annotated[str, Parameter(name="--format", group=_output, help=HELP)]
Json = Annotated[bool, Parameter(name="--json", negative="", group=_output, help="Print the summary as JSON.")]
Resume = Annotated[
    bool,
    Parameter(negative="", help="Go on with what a run that was ended has left in the folder of the results."),
]
Cache = Annotated[bool, Parameter(help="Keep the phase map for the next run.")]


def rcs(
    body: Body,
    *,
    frequency: Frequency = None,
    wavelength: Wavelength = None,
    polarisation: Annotated[
        str | None, Parameter(help="HH, VV, HV, VH, joined by commas: received, then transmitted. HH,VV.")
    ] = None,
    monostatic: Monostatic = None,
    bistatic: Bistatic = None,
    incidence: Incidence = None,
    compare: Compare = None,
    column: Column = None,
    align: Align = 0.0,
    output: Folder = None,
    method: Method = "auto",
    file: FileOptions = AS_IT_IS,
    cache: Cache = True,
    pictures: Pictures = True,
    formats: Formats = "csv",
    json_: Json = False,
    resume: Resume = False,
) -> int:
    """Radar cross section of a perfect conductor in dBsm: over angle, over frequency, or both."""
    asked: dict[str, Any] = {"frequency": frequency, "wavelength": wavelength, "sound_speed": None}
    asked |= {"polarisation": polarisation, "boundary": "pec"}
    asked |= {"monostatic": monostatic, "bistatic": bistatic, "incidence": incidence}
    made: dict[str, Any] = {"options": file, "cache": cache}
    written: dict[str, Any] = {"pictures": pictures, "formats": formats}
    measured = (compare, column, align)
    return _echo("rcs", body, asked, made, method, measured, output or Path("rcs"), written, json_, resume)


def ts(
    body: Body,
    *,
    sound_speed: Annotated[float, Parameter(help="Of the medium, m/s, e.g. 1477 of sea water.")],
    frequency: Frequency = None,
    wavelength: Wavelength = None,
    boundary: Annotated[str, Parameter(help="soft (pressure release), hard (rigid) or impedance:ETA.")] = "soft",
    monostatic: Monostatic = None,
    bistatic: Bistatic = None,
    incidence: Incidence = None,
    compare: Compare = None,
    column: Column = None,
    align: Align = 0.0,
    output: Folder = None,
    method: Method = "auto",
    file: FileOptions = AS_IT_IS,
    cache: Cache = True,
    pictures: Pictures = True,
    formats: Formats = "csv",
    json_: Json = False,
    resume: Resume = False,
) -> int:
    """Target strength of a body in dB re 1 m: over angle, over frequency, or both."""
    from creeping.errors import InvalidInputError

    if boundary == "pec":
        raise InvalidInputError("--boundary pec is of radar: creeping rcs")
    asked: dict[str, Any] = {"frequency": frequency, "wavelength": wavelength, "sound_speed": sound_speed}
    asked |= {"polarisation": None, "boundary": boundary}
    asked |= {"monostatic": monostatic, "bistatic": bistatic, "incidence": incidence}
    made: dict[str, Any] = {"options": file, "cache": cache}
    written: dict[str, Any] = {"pictures": pictures, "formats": formats}
    measured = (compare, column, align)
    return _echo("ts", body, asked, made, method, measured, output or Path("ts"), written, json_, resume)


def _echo(
    quantity: str,
    body: str,
    asked: dict[str, Any],
    made: dict[str, Any],
    method: str,
    measured: tuple[Path | None, str | None, float],
    output: Path,
    written: dict[str, Any],
    as_json: bool,
    resume: bool,
) -> int:
    from creeping.commands import echo_report, resuming
    from creeping.commands.echo_request import echo_request, radians_hint
    from creeping.commands.forecast import boundary_words, forecast
    from creeping.field.boundary import parse_boundary
    from creeping.sweeping.echoes import monostatic_method

    started = time.perf_counter()
    request = echo_request(quantity, **asked)
    for name in ("monostatic", "bistatic", "incidence"):
        if hint := radians_hint(f"--{name}", asked[name]):
            print(f"creeping: {hint}", file=sys.stderr)
    boundary = parse_boundary(request.boundary)
    options = {**asked, "method": method, **made["options"].given(), **written}
    options |= dict(zip(("compare", "column", "align"), measured, strict=True))
    written["formats"] = table_formats(written["formats"])
    # before the time is spent
    reference = echo_report.reference_of(request, *measured)
    with Progress(quiet=as_json) as progress:
        shape = parse_body(body, progress=progress, **made)
        azimuths, elevations = request.angles(shape)
        if method == "auto" and request.monostatic:
            method = monostatic_method(shape, request.wavenumbers, boundary, len(azimuths))
        told = forecast(
            shape,
            request.wavenumbers,
            boundary,
            method=method,
            radar=(azimuths, elevations) if request.monostatic else request.incidence,
            observers=1 if request.monostatic else len(azimuths),
            metres=True,
            cure=request.cure,
        )
        progress.note(f"{told.body}, {boundary_words(boundary)}")
        unfinished = resuming.begun(output, quantity, resuming.asked_for(body, shape, **options), resume=resume)
        if unfinished is None:
            print((output / resuming.SUMMARY).read_text() if as_json else f"nothing is missing in {output}")
            return 0
        values = len(azimuths) * len(request.wavenumbers)
        progress(f"{echo_report.asked_words(azimuths, request)} by {told.by}")
        progress.begin(0, values)

        def rows(found: Any) -> None:
            echo_report.write_rows(unfinished, request, found)

        def passed(done: float, total: int, seconds: float) -> None:
            progress.told(values * done / total, values, seconds)

        with resuming.kept(unfinished, progress.message):
            dataset = echo_report.computed(
                shape, request, boundary, azimuths, elevations, method, made["cache"], unfinished, passed, rows
            )
            echo = echo_report.echo_for(request, dataset)
            progress("tables and pictures" if written["pictures"] else "tables")
            compared, refused = echo_report.compared(echo, reference, measured[2])
            names, extra = echo_report.write_results(output, echo, compared, shape, body, **written)
            summary = echo_report.summary_of(body, request, echo, dataset) | extra | refused
            summary["files"] = [*names, resuming.SUMMARY]
            unfinished.write_summary(summary, complete=True)
            unfinished.finished()
    summary |= {"complete": True, "seconds": round(time.perf_counter() - started, 2)}
    print(json.dumps(summary, indent=1) if as_json else echo_report.readable(summary, output))
    return 0
