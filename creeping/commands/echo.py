"""``creeping rcs`` and ``creeping ts``: the echo of a body as a radar or a sonar measures it, with its error.

Lengths of the body are metres. Angles are those of the radar or the observer as seen from the body.
"""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from creeping._progress import Progress
from creeping.commands import options
from creeping.commands.body import parse_body, table_formats

_angles = Group("Angles")


@Parameter(name="*")
@dataclass(frozen=True)
class EchoOptions:
    """What of an echo is computed, what it is compared with, and what is written."""

    frequency: Annotated[
        str | None,
        Parameter(help='One, e.g. "10GHz", or a band FIRST:LAST:STEP, e.g. "2:18:0.05GHz"; Hz, kHz, MHz, GHz.'),
    ] = None
    wavelength: Annotated[str | None, Parameter(help='Instead of a frequency, e.g. "3cm".')] = None
    monostatic: Annotated[
        str | None,
        Parameter(
            group=_angles,
            help="Backscatter in a cut: az or el, whose step fits the lobes, or az:FIRST:LAST:STEP, degrees; az:20 or "
            "az:20,el:5 is one direction. az for one frequency if nothing else is asked for.",
        ),
    ] = None
    bistatic: Annotated[
        str | None, Parameter(group=_angles, help="Observers in a cut, in the same forms, the radar at --incidence.")
    ] = None
    incidence: Annotated[
        str | None,
        Parameter(group=_angles, help="AZIMUTH,ELEVATION of the radar, degrees; of a cut the angle that stays. 0,0."),
    ] = None
    compare: Annotated[
        Path | None,
        Parameter(
            group=options.OUTPUT, help="Measured cut to compare with, a table with a column of angles or frequencies."
        ),
    ] = None
    column: Annotated[
        str | None,
        Parameter(
            group=options.OUTPUT, help="Columns of --compare, one for each polarisation, if their names do not tell."
        ),
    ] = None
    align: Annotated[
        float, Parameter(group=options.OUTPUT, help="Largest shift of the measured angles that is tried, degrees.")
    ] = 0.0
    output: Annotated[
        Path | None, Parameter(name=["-o", "--output"], group=options.OUTPUT, help="Folder for the results.")
    ] = None
    method: Annotated[
        str,
        Parameter(
            help="auto, rays, currents, equation or t-matrix: auto takes currents where rays do not resolve a value "
            "and err more; equation solves the body's integral equation for every value, in seconds to minutes each; "
            "t-matrix makes one matrix a frequency for all angles."
        ),
    ] = "auto"
    cache: options.Cache = True
    pictures: options.Pictures = True
    formats: options.Formats = "csv"
    json_: options.Json = False
    resume: options.Resume = False


AS_USUAL = EchoOptions()


def rcs(
    body: options.Body,
    *,
    polarisation: Annotated[
        str | None, Parameter(help="HH, VV, HV, VH, joined by commas: received, then transmitted. HH,VV.")
    ] = None,
    echo: EchoOptions = AS_USUAL,
    file: options.FileOptions = options.AS_IT_IS,
) -> int:
    """Radar cross section of a perfect conductor in dBsm: over angle, over frequency, or both."""
    return _echo("rcs", body, echo, file, sound_speed=None, polarisation=polarisation, boundary="pec")


def ts(
    body: options.Body,
    *,
    sound_speed: Annotated[float, Parameter(help="Of the medium, m/s, e.g. 1477 of sea water.")],
    boundary: Annotated[str, Parameter(help="soft (pressure release), hard (rigid) or impedance:ETA.")] = "soft",
    echo: EchoOptions = AS_USUAL,
    file: options.FileOptions = options.AS_IT_IS,
) -> int:
    """Target strength of a body in dB re 1 m: over angle, over frequency, or both."""
    from creeping.errors import InvalidInputError

    if boundary == "pec":
        raise InvalidInputError("--boundary pec is of radar: creeping rcs")
    return _echo("ts", body, echo, file, sound_speed=sound_speed, polarisation=None, boundary=boundary)


def _echo(quantity: str, body: str, given: EchoOptions, file: options.FileOptions, **wave: Any) -> int:
    """Compute, write and tell an echo; ``wave`` has the speed of sound, polarisations and boundary."""
    from creeping.commands import echo_report, resuming
    from creeping.commands.echo_request import echo_request, radians_hint
    from creeping.commands.forecast import boundary_words, forecast
    from creeping.field.boundary import parse_boundary
    from creeping.sweeping.echoes import monostatic_method

    started = time.perf_counter()
    asked: dict[str, Any] = {"frequency": given.frequency, "wavelength": given.wavelength, **wave}
    asked |= {"monostatic": given.monostatic, "bistatic": given.bistatic, "incidence": given.incidence}
    request, method, output = echo_request(quantity, **asked), given.method, given.output or Path(quantity)
    for name in ("monostatic", "bistatic", "incidence"):
        if hint := radians_hint(f"--{name}", asked[name]):
            print(f"creeping: {hint}", file=sys.stderr)
    boundary = parse_boundary(request.boundary)
    given_words = {**asked, "method": method, **file.given(), "pictures": given.pictures, "formats": given.formats}
    given_words |= {"compare": given.compare, "column": given.column, "align": given.align}
    formats = table_formats(given.formats)
    # before the time is spent
    reference = echo_report.reference_of(request, given.compare, given.column, given.align)
    with Progress(quiet=given.json_) as progress:
        shape = parse_body(body, options=file, cache=given.cache, progress=progress)
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
        unfinished = resuming.begun(
            output, quantity, resuming.asked_for(body, shape, **given_words), resume=given.resume
        )
        if unfinished is None:
            print((output / resuming.SUMMARY).read_text() if given.json_ else f"nothing is missing in {output}")
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
                shape, request, boundary, azimuths, elevations, method, given.cache, unfinished, passed, rows
            )
            echo = echo_report.echo_for(request, dataset)
            progress("tables and pictures" if given.pictures else "tables")
            compared, refused = echo_report.compared(echo, reference, given.align)
            names, extra = echo_report.write_results(
                output, echo, compared, shape, body, pictures=given.pictures, formats=formats
            )
            summary = echo_report.summary_of(body, request, echo, dataset) | extra | refused
            summary["files"] = [*names, resuming.SUMMARY]
            unfinished.write_summary(summary, complete=True)
            unfinished.finished()
    summary |= {"complete": True, "seconds": round(time.perf_counter() - started, 2)}
    print(json.dumps(summary, indent=1) if given.json_ else echo_report.readable(summary, output))
    return 0
