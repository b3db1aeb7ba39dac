"""``creeping rcs`` and ``creeping ts``: the echo of a body as a radar or a sonar measures it, with its error.

Lengths of the body are metres. Angles are those of the radar or the observer as seen from the body.
"""

import json
import sys
import time
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

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
) -> int:
    """Radar cross section of a perfect conductor in dBsm: over angle, over frequency, or both."""
    asked: dict[str, Any] = {"frequency": frequency, "wavelength": wavelength, "sound_speed": None}
    asked |= {"polarisation": polarisation, "boundary": "pec"}
    asked |= {"monostatic": monostatic, "bistatic": bistatic, "incidence": incidence}
    made: dict[str, Any] = {"options": file, "cache": cache}
    written: dict[str, Any] = {"pictures": pictures, "formats": formats}
    measured = (compare, column, align)
    return _echo("rcs", body, asked, made, method, measured, output or Path("rcs"), written, as_json=json_)


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
    return _echo("ts", body, asked, made, method, measured, output or Path("ts"), written, as_json=json_)


def _echo(
    quantity: str,
    body: str,
    asked: dict[str, Any],
    made: dict[str, Any],
    method: str,
    measured: tuple[Path | None, str | None, float],
    output: Path,
    written: dict[str, Any],
    *,
    as_json: bool,
) -> int:
    from creeping.commands import echo_report
    from creeping.commands.echo_report import echo_request
    from creeping.commands.forecast import boundary_words, forecast
    from creeping.field.boundary import parse_boundary
    from creeping.sweeping.echoes import echo_of, monostatic_method

    started = time.perf_counter()
    request = echo_request(quantity, **asked)
    for name in ("monostatic", "bistatic", "incidence"):
        if hint := echo_report.radians_hint(f"--{name}", asked[name]):
            print(f"creeping: {hint}", file=sys.stderr)
    boundary = parse_boundary(request.boundary)
    written["formats"] = table_formats(written["formats"])
    # before the time is spent
    reference = echo_report.reference_of(request, *measured)

    def progress(text: str) -> None:
        if not as_json:
            print(f"creeping: {text} ...", file=sys.stderr, flush=True)

    shape = parse_body(body, progress=progress, **made)
    azimuths, elevations = request.angles(shape)
    meter = _Meter(progress, len(azimuths) * len(request.wavenumbers))
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
    if not as_json:
        print(f"creeping: {told.body}, {boundary_words(boundary)}", file=sys.stderr)
    progress(f"{meter.asked(request)} by {told.by}")
    ready = time.perf_counter()
    dataset = echo_report.computed(shape, request, boundary, azimuths, elevations, method, made["cache"], meter.told)
    echo = echo_of(dataset, quantity, request.channels, request.angle_name, sound_speed=request.sound_speed)
    computed = time.perf_counter()
    progress("tables and pictures" if written["pictures"] else "tables")
    compared, refused = echo_report.compared(echo, reference, measured[2])
    names, extra = echo_report.write_results(output, echo, compared, shape, body, **written)
    summary = echo_report.summary_of(body, request, echo, dataset) | extra | refused
    now = time.perf_counter()
    summary |= {"seconds": round(now - started, 2), "seconds_of_fields": round(computed - ready, 2)}
    summary["files"] = [*names, "summary.json"]
    from creeping.files import write_text

    write_text(output / "summary.json", json.dumps(summary, indent=1) + "\n")
    print(json.dumps(summary, indent=1) if as_json else echo_report.readable(summary, output))
    return 0


class _Meter:
    """Says how much is asked for, and how long it takes once that can be told."""

    def __init__(self, progress: Any, values: int) -> None:
        self.progress, self.values, self._shown = progress, values, 0.0
        self._first: tuple[float, float] | None = None

    def asked(self, request: Any) -> str:
        """What is computed."""
        several = len(request.wavenumbers)
        count = self.values // several
        return f"{count} angle{'s' * (count > 1)} x {several} frequenc{'ies' if several > 1 else 'y'}"

    def told(self, done: float, total: int, seconds: float) -> None:
        """Show what is left, by what came after the first part, which may have had to compile."""
        if self._first is None:
            self._first = (done, seconds)
            return
        first, then = self._first
        if done > first and seconds - self._shown > 5 and done < total:
            self._shown = seconds
            left = (total - done) * (seconds - then) / (done - first)
            self.progress(f"{int(self.values * done / total)} of {self.values}, {left:.0f} s left")
