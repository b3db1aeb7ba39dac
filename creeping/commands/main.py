"""The ``creeping`` command: the only place that joins creeping and scatterers.

Exit codes: 0 done, 2 usage, 3 bad input, 4 partial sweep, 130 interrupted. Libraries are imported inside the commands,
so that ``creeping --help`` answers at once.
"""

import json
import re
import sys
import time
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, CycloptsError, Group, Parameter, validators

from creeping._progress import Progress
from creeping._version import __version__
from creeping.commands import antennas as _antennas
from creeping.commands import check as _checking
from creeping.commands import explore as _explore_command
from creeping.commands import options, resuming
from creeping.commands import sweep as _sweep_command
from creeping.commands import upkeep as _upkeep
from creeping.commands.options import Output, each_once, flow_of, parse_body, title_of
from creeping.errors import CreepingError, InvalidInputError

app = App(
    name="creeping",
    version=__version__,
    help="Creeping rays and the scattered field of any closed body, with a measured error. Angles are in degrees.",
    # stars of an expression are no markup
    help_format="plaintext",
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)
cache_app = App(name="cache", help="Stored phase maps and fitted bodies: list, verify, clear.")
app.command(cache_app)

_wave = Group("Incident wave", validator=validators.mutually_exclusive)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line (of the process, unless arguments are given) and exit with its code."""
    given = sys.argv[1:] if arguments is None else arguments
    resuming.words[:] = given
    if sorted(given) == ["--json", "--version"]:
        print(json.dumps(_upkeep.versions(), indent=1))
        raise SystemExit(0)
    try:
        # the library's own code for wrong usage is another in other versions
        code = app(given, exit_on_error=False)
    except CycloptsError:
        code = 2
    except BrokenPipeError:
        code = 0
    except (CreepingError, KeyboardInterrupt, MemoryError, OverflowError, OSError) as error:
        code, words = 3, str(error)
        if isinstance(error, CreepingError):
            words = _as_options(words)
        elif isinstance(error, KeyboardInterrupt):
            code, words = 130, "interrupted"
        elif not isinstance(error, OSError):
            reason = words or "an array is too large"
            words = f"not enough memory ({reason}); ask for fewer or shorter rays, or fewer directions"
        print(f"creeping: {words}", file=sys.stderr)
    raise SystemExit(code if isinstance(code, int) else 0)


def _as_options(text: str) -> str:
    """A message of the library with the options of this command line for its arguments.

    Examples
    --------
    >>> _as_options("take one, e.g. part='largest', or all with union=True; sound_speed = 1 m/s is slow")
    'take one, e.g. --part largest, or all with --union; --sound-speed 1 m/s is slow'
    """
    from dataclasses import fields
    from inspect import signature

    kinds = (options.FileOptions, options.WaveOptions, options.EchoOptions)
    names = {field.name for kind in kinds for field in fields(kind)}
    names.update(*(signature(command).parameters for command in (run, ts)))
    # k is in messages whichever of three options gave it
    words = "|".join(sorted(names - {"wavenumber", "body", "file", "wave"}, key=len, reverse=True))
    pattern = rf"(?<![\w.-])({words})(?:=| = )(?:'([^']*)'|\"([^\"]*)\"|True\b)?"

    def option(found: re.Match[str]) -> str:
        value = found[2] or found[3] or ""
        gap = " " if value or found[0].endswith(" ") else ""
        return f"--{found[1].replace('_', '-')}{gap}{value}"

    return re.sub(pattern, option, re.sub("^boundary ", "--boundary ", text))


@app.command
def run(
    body: options.Body,
    *,
    direction: Annotated[
        tuple[float, float, float] | None,
        Parameter(help="Where the wave travels, three numbers; need not be unit.", group=_wave),
    ] = None,
    source: Annotated[
        tuple[float, float, float] | None, Parameter(help="Or where a point source is, off the body.", group=_wave)
    ] = None,
    output: options.Folder,
    length: Annotated[
        float | Literal["auto"],
        Parameter(help="Travel time of the rays; auto is where the wave has died away, at k rho = 10 without a field."),
    ] = "auto",
    rays: Annotated[int, Parameter(help="Rays at the start; more are inserted where neighbours part.")] = 256,
    spacing: Annotated[float | None, Parameter(help="Spacing of iso-phase curves; length/16 if not given.")] = None,
    of: Annotated[
        Literal["travel_time", "eikonal"] | None,
        Parameter(help="What is constant on an iso-phase curve; eikonal of a source if not given, else travel_time."),
    ] = None,
    launch_from: Annotated[
        Literal["attached", "all"], Parameter(help="Points of the shadow line that launch.")
    ] = "attached",
    tolerance: Annotated[float, Parameter(help="Rms error of points and directions at the ends of rays.")] = 1e-6,
    flow: Annotated[
        Literal["auto", "map", "direct"],
        Parameter(help="Phase map or direct integration; auto takes what is faster, its preparation included."),
    ] = "auto",
    speed: options.SpeedOption = None,
    file: options.FileOptions = options.AS_IT_IS,
    wave: options.WaveOptions = options.NO_WAVE,
    boundary: Annotated[
        str | None,
        Parameter(group=options.FIELD, help="soft (if not given), hard, pec or impedance:ETA, e.g. 0.5+0.2j."),
    ] = None,
    observe: Annotated[
        list[str] | None,
        Parameter(
            group=options.FIELD,
            negative="",
            help="Where the far field is wanted; may be repeated. cut:PHI:STEP is theta from -180 to 180 in the plane "
            "PHI, without STEP one that fits the lobes, grid:STEP all theta and phi (gives far.ffe), THETA,PHI one "
            "direction, backscatter the way back. "
            "If not given, the cut through the direction of the wave.",
        ),
    ] = None,
    polarisation: Annotated[
        str | None,
        Parameter(group=options.FIELD, help="Of a conductor in far.png: HH, VV, HV, VH, joined by commas. HH,VV."),
    ] = None,
    plane: Annotated[
        list[str] | None,
        Parameter(
            group=options.FIELD,
            negative="",
            help="Planes through the middle of the body on which the total field is wanted; may be repeated: incidence "
            "(the direction of the wave and the body's longest side), xy, xz, yz, with :STEP for a spacing of points "
            "of your own. Gives plane.csv and plane.png.",
        ),
    ] = None,
    cache: options.Cache = True,
    pictures: options.Pictures = True,
    backend: Annotated[
        Literal["auto", "pyvista", "matplotlib"], Parameter(group=options.OUTPUT, help="What draws in 3-D.")
    ] = "auto",
    formats: options.Formats = "csv",
    json_: options.Json = False,
    resume: options.Resume = False,
) -> int:
    """Shadow line, creeping rays, iso-phase curves, pictures and files for one incidence."""
    words = {name: value for name, value in locals().items() if name not in ("body", "file", "wave", "output", "json_")}
    words |= vars(wave) | file.given()
    del words["resume"]
    # the kernels of rays are compiled while libraries are loaded
    import creeping.kernels.block
    from creeping.kernels import first_use

    first_use.begin("creeping.shadow")
    import numpy as np

    import creeping as cr
    from creeping.commands import forecast as _forecast
    from creeping.commands import run_field as _field_run
    from creeping.commands import run_report as _run_results
    from creeping.geometry.incident import PlaneWave, PointSource
    from creeping.geometry.surface import why_no_rays
    from creeping.rays.fan import enough_steps
    from creeping.rays.reach import ray_length

    started = time.perf_counter()
    written = Output(output, title_of(body), each_once("--format", formats, ("csv", "mat")), pictures, backend)
    for name, value in (("length", length), ("spacing", spacing)):
        if isinstance(value, float) and not (np.isfinite(value) and value > 0):
            raise cr.CreepingError(f"--{name} {value!r} is not a positive finite number")
    of = of or ("travel_time" if source is None else "eikonal")
    if source is None and direction is None:
        raise InvalidInputError("give --direction X Y Z, where a plane wave travels, or --source X Y Z, a point source")
    incident: Any = PlaneWave(direction or ()) if source is None else PointSource(source)
    job = _field_run.job(wave, boundary, observe, direction, weighted=speed is not None, polarisation=polarisation)
    with Progress(quiet=json_) as progress:
        shape = parse_body(body, speed, options=file, cache=cache, progress=progress)
        planes = [_run_results.parse_plane(text) for text in plane or ()]
        if planes and job is None:
            raise cr.InvalidInputError("--plane needs --wavenumber or --frequency, which ask for the field")
        if job:
            told = job.forecast(shape, incident)
            progress.note(told.body)
            kind = _forecast.boundary_words(job.boundary)
            progress.note(f"{kind}{'' if boundary else ', as no --boundary is given'}: far field by {told.by}")
            job = job.fitted(shape)
        unfinished = resuming.begun(output, "run", resuming.asked_for(body, shape, **words), resume=resume)
        if unfinished is None:
            print((output / resuming.SUMMARY).read_text() if json_ else f"nothing is missing in {output}")
            return 0
        without, singular = why_no_rays(shape), None
        if not without:
            progress("shadow line")
            try:
                line = cr.shadow_line(shape, source=incident)
            except cr.SingularIncidenceError as error:
                if job is None or source is not None:
                    raise
                # the equation needs no line
                without, singular = str(error), error
        if without:
            try:
                result = _run_results.run_solved(shape, without, job, incident, planes, written, progress, unfinished)
            except cr.InvalidInputError as error:
                # rays of a direction close by are what is left
                raise singular or error from error
            print(json.dumps(result, indent=1) if json_ else _run_results.readable_solved(result, output))
            return 0
        length = ray_length(line, length, wavenumber=job.wavenumber if job else None)
        progress("flow")
        steps = enough_steps(shape, length)
        asked: dict[str, Any] = {"length": length, "n_steps": steps, "cache": cache, "progress": progress}
        # rays are inserted where neighbours part
        carrier = flow_of(flow, shape, tolerance, n_rays=2 * rays, **asked)
        progress("creeping rays")
        fan = cr.launch(carrier, line, length=length, n_rays=rays, n_steps=steps, launch_from=launch_from)
        step = spacing or fan.length / 16
        curves = cr.iso_phase_curves(fan, levels_of(fan, step, of), of=of)
        summary = _run_results.summary_of(body, speed, line, carrier, fan, curves)
        with resuming.kept(unfinished, progress.message):
            if job:
                progress("field")
                far, field_seconds = job.far_field(fan, unfinished, progress.told)
            progress("pictures and files" if pictures else "files")
            asked = job.wave if job else {}
            summary["files"], summary["drawn_by"] = _run_results.write_results(line, fan, curves, written, **asked)
            if job:
                summary["field"], names = job.write(far, fan, written)
                summary["field"]["seconds"] = field_seconds
                summary["files"][-1:-1] = names
            if job and planes:
                summary["planes"], names = _run_results.write_planes(planes, job, fan, written, progress)
                summary["files"][-1:-1] = names
            summary["seconds"] = round(time.perf_counter() - started, 2)
            unfinished.write_summary(summary, complete=True)
    print(json.dumps(summary, indent=1) if json_ else _run_results.readable(summary, output))
    return 0


@app.command
def rcs(
    body: options.Body,
    *,
    polarisation: Annotated[
        str | None, Parameter(help="HH, VV, HV, VH, joined by commas: received, then transmitted. HH,VV.")
    ] = None,
    echo: options.EchoOptions = options.AS_USUAL,
    file: options.FileOptions = options.AS_IT_IS,
) -> int:
    """Radar cross section of a perfect conductor in dBsm: over angle, frequency or both, or in the mean."""
    return _run_echo("rcs", body, echo, file, sound_speed=None, polarisation=polarisation, boundary="pec")


@app.command
def ts(
    body: options.Body,
    *,
    sound_speed: Annotated[float, Parameter(help="Of the medium, m/s, e.g. 1477 of sea water.")],
    boundary: Annotated[str, Parameter(help="soft (pressure release), hard (rigid) or impedance:ETA.")] = "soft",
    echo: options.EchoOptions = options.AS_USUAL,
    file: options.FileOptions = options.AS_IT_IS,
) -> int:
    """Target strength of a body in dB re 1 m: over angle, frequency or both, or in the mean."""
    if boundary == "pec":
        raise InvalidInputError("--boundary pec is of radar: creeping rcs")
    return _run_echo("ts", body, echo, file, sound_speed=sound_speed, polarisation=None, boundary=boundary)


def _run_echo(quantity: str, body: str, echo: options.EchoOptions, file: options.FileOptions, **wave: Any) -> int:
    """Refuse what makes no sense before the body is read, and its size before libraries of fields are loaded."""
    from creeping.commands.echo_request import echo_job
    from creeping.commands.forecast import size_words

    job = echo_job(quantity, body, echo, file, **wave)
    with Progress("frequencies" if echo.average else "", quiet=echo.json_) as progress:
        shape = parse_body(body, options=file, cache=echo.cache, progress=progress)
        size_words(shape, job.request.wavenumbers, metres=True, cure=job.request.cure)
        from creeping.commands.echo_report import run_echo

        told = run_echo(job, shape, progress)
    print(told)
    return 0


def levels_of(fan: Any, step: float, of: str) -> Any:
    """Multiples of the step that rays of the fan meet, at most 1000.

    Raises
    ------
    InvalidInputError
        If the step gives more levels than that.
    """
    import numpy as np

    values = fan.travel_time if of == "travel_time" else fan.eikonal
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    first, last = int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9))
    if last - first > 1000:
        raise InvalidInputError(
            f"spacing {step:g} makes {last - first + 1} iso-phase levels; give one above {(high - low) / 1000:g}"
        )
    return step * np.arange(first, last + 1)


def _studies() -> Any:
    """The package of studies, which lies beside this one in the repository and is not installed."""
    from importlib import import_module

    beside = str(Path(__file__).parents[2])
    if not (Path(beside) / "studies" / "__init__.py").is_file():
        raise InvalidInputError(
            "figures are drawn by `studies`, which only the repository has, not the installed package: clone it and "
            "install it as its README says"
        )
    if beside not in sys.path:
        # first: a figure takes its reference from `tests`, a name that other distributions leave packages of, too
        sys.path.insert(0, beside)
    return import_module("studies")


@app.command
def figure(
    name: Annotated[str | None, Parameter(help="Name of the figure; see --list.")] = None,
    /,
    *,
    output: options.Folder = Path("out"),
    all_: Annotated[bool, Parameter(name="--all", negative="", help="Draw every figure.")] = False,
    list_: Annotated[bool, Parameter(name="--list", negative="", help="List the figures.")] = False,
    quick: Annotated[bool, Parameter(negative="", help="Coarser and faster.")] = False,
    json_: options.Json = False,
) -> int:
    """Draw figures of the paper, each with a sidecar of its parameters, error and seconds; from a clone alone."""
    studies = _studies()
    if list_:
        print("\n".join(f"{key:16} {title}" for key, title in studies.titles().items()))
        return 0
    if all_ == (name is not None):
        raise InvalidInputError(f"give one figure or --all; figures are {', '.join(studies.FIGURES)}")
    names = studies.FIGURES if name is None else [name]
    for key in names:
        studies.drawer(key)
    cards = []
    with Progress(quiet=json_) as progress:
        for key in names:
            progress(f"figure {key}")
            cards.append(studies.draw(key, output, quick=quick))
    told = (f"{output / card['file']}  {card['seconds']:.1f} s  {card['headline']}" for card in cards)
    print(json.dumps(cards, indent=1) if json_ else "\n".join(told))
    return 0


app.command(_checking.check)
app.command(_sweep_command.sweep)
app.command(_explore_command.explore)
app.command(_antennas.coupling)
cache_app.command(_upkeep.list_maps, name="ls")
cache_app.command(_upkeep.verify_maps, name="verify")
cache_app.command(_upkeep.clear_maps, name="clear")
app.command(_upkeep.doctor)
