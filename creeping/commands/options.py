"""What several commands have: their options, the BODY, the flow that carries its rays, and the tables they write.

A BODY is a name with parameters, a file, or an expression.
"""

import inspect
import os
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from creeping.errors import InvalidInputError, near_names

Body = Annotated[
    str,
    Parameter(
        help="Name with parameters, e.g. torus or ellipsoid:a=1.2,b=0.8,c=0.8; a file, e.g. hull.stl or hull.step; "
        "or an expression F(x, y, z), negative inside, or an equation, e.g. 'x**2 + y**4 + z**2 = 1'."
    ),
]
SpeedOption = Annotated[str | None, Parameter(help="Speed c(x, y, z) of the weighted flow, e.g. '1 + x'.")]
OUTPUT, FIELD, ANGLES = Group("Output"), Group("Field"), Group("Angles")
Folder = Annotated[Path, Parameter(name=["-o", "--output"], group=OUTPUT, help="Folder for the results.")]
Json = Annotated[bool, Parameter(name="--json", negative="", group=OUTPUT, help="Print as JSON.")]
Pictures = Annotated[bool, Parameter(group=OUTPUT, help="Draw pictures; --no-pictures leaves them out.")]
Formats = Annotated[
    str,
    Parameter(name="--format", group=OUTPUT, help="Tables: csv or mat (MATLAB), or both joined by a comma."),
]
Cache = Annotated[bool, Parameter(help="Keep the phase map for the next run.")]
Resume = Annotated[
    bool,
    Parameter(negative="", help="Go on with what a run that was ended has left in the folder of the results."),
]


@Parameter(name="*", group=FIELD)
@dataclass(frozen=True)
class WaveOptions:
    """The wave that a field is asked for by."""

    wavenumber: Annotated[float | None, Parameter(help="k, in the inverse of the body's unit of length.")] = None
    frequency: Annotated[
        str | None, Parameter(help='Instead of k, e.g. "10GHz": lengths are metres then. `coupling` takes bands, too.')
    ] = None
    wavelength: Annotated[str | None, Parameter(help='Instead of k, e.g. "3cm".')] = None
    sound_speed: Annotated[
        float | None, Parameter(help="With a frequency: of the medium, m/s; that of light if not given.")
    ] = None


NO_WAVE = WaveOptions()


@Parameter(name="*")
@dataclass(frozen=True)
class FileOptions:
    """What of a file or expression is the body, and how it is taken."""

    units: Annotated[
        str | None,
        Parameter(help="Unit of a file's numbers: m, mm, cm, um, in, ft or km; lengths are metres from there on."),
    ] = None
    strict: Annotated[
        bool, Parameter(negative="", help="Refuse edges, tips and coarse meshes; else rays end at them.")
    ] = False
    part: Annotated[str | None, Parameter(help="Which part of a file: largest, a number from 1, or a name.")] = None
    cap: Annotated[float | None, Parameter(help="Close holes of a file up to this size, m.")] = None
    union: Annotated[
        bool, Parameter(negative="", help="Take the outer surface of all parts of a file, which may cross.")
    ] = False
    subdivide: Annotated[
        str | None, Parameter(help="Loop's subdivision of a coarse smooth mesh: auto, or 1, 2 or 3 times.")
    ] = None
    surface: Annotated[
        str | None,
        Parameter(
            help="smooth: a smooth surface through a mesh, on which rays creep; facets: its triangles as they are, all "
            "parts, without rays; auto: facets where no smooth surface fits."
        ),
    ] = None
    sew: Annotated[float | None, Parameter(help="Sew faces of a CAD file that are so far apart at most, m.")] = None

    def given(self) -> dict[str, Any]:
        """Options that are not the defaults, as the bodies take them."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        for name in ("part", "subdivide"):
            if isinstance(found[name], str) and found[name].isdigit():
                found[name] = int(found[name])
        # 0 equals False, and is a bad size that is to be told
        return {name: value for name, value in found.items() if value is not None and value is not False}


AS_IT_IS = FileOptions()


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
            group=ANGLES,
            help="Backscatter in a cut: az or el, whose step fits the lobes, or az:FIRST:LAST:STEP, degrees; az:20 or "
            "az:20,el:5 is one direction. az for one frequency if nothing else is asked for.",
        ),
    ] = None
    bistatic: Annotated[
        str | None, Parameter(group=ANGLES, help="Observers in a cut, in the same forms, the radar at --incidence.")
    ] = None
    incidence: Annotated[
        str | None,
        Parameter(group=ANGLES, help="AZIMUTH,ELEVATION of the radar, degrees; of a cut the angle that stays. 0,0."),
    ] = None
    average: Annotated[
        bool,
        Parameter(
            negative="",
            group=ANGLES,
            help="The mean over all orientations of the body, by one T-matrix a frequency, in place of angles.",
        ),
    ] = False
    compare: Annotated[
        Path | None,
        Parameter(group=OUTPUT, help="Measured cut to compare with, a table with a column of angles or frequencies."),
    ] = None
    column: Annotated[
        str | None,
        Parameter(group=OUTPUT, help="Columns of --compare, one for each polarisation, if their names do not tell."),
    ] = None
    align: Annotated[
        float, Parameter(group=OUTPUT, help="Largest shift of the measured angles that is tried, degrees.")
    ] = 0.0
    output: Annotated[Path | None, Parameter(name=["-o", "--output"], group=OUTPUT, help="Folder for the results.")] = (
        None
    )
    method: Annotated[
        str,
        Parameter(
            help="auto, rays, currents, equation or t-matrix: auto takes currents where rays do not resolve a value "
            "and err more; equation solves the body's integral equation for every value, in seconds to minutes each; "
            "t-matrix makes one matrix a frequency for all angles."
        ),
    ] = "auto"
    cache: Cache = True
    pictures: Pictures = True
    formats: Formats = "csv"
    json_: Json = False
    resume: Resume = False


AS_USUAL = EchoOptions()


BODIES = "sphere ellipsoid torus twisted-ellipsoid cylinder capsule cone cone-sphere ogive double-ogive almond".split()
"""Names of the classes of `scatterers`, in small letters."""
MESHES = (".stl", ".obj", ".ply", ".off", ".glb", ".3mf", ".msh", ".bdf", ".nas", ".mesh", ".gz")
CAD = (".step", ".stp", ".iges", ".igs", ".brep")

Tell = Callable[[str], None]


def parse_body(
    text: str,
    speed: str | None = None,
    *,
    options: FileOptions = AS_IT_IS,
    cache: bool = True,
    progress: Tell | None = None,
) -> Any:
    """Make a body from ``name``, ``name:key=value,...``, a file's name or an expression.

    Raises
    ------
    InvalidInputError
        Names the unknown body, parameter or value, and what is known; or what is wrong with the file or expression.
    """
    import scatterers

    suffix, of_file = Path(text).suffix.lower(), is_file(text)
    name, _, rest = text.partition(":")
    given = options.given()
    if ":" in text and not of_file and name not in BODIES and _like_expression(rest):
        raise InvalidInputError(f"{name}: is no part of a body; give the expression or equation alone: {rest!r}")
    if not (of_file or name in BODIES or _like_expression(text)):
        known = f"give one of {', '.join(BODIES)}, e.g. ellipsoid:a=1.2,b=0.8,c=0.8, a file ({', '.join(MESHES + CAD)})"
        near = near_names(re.split(r"[^\w-]", text)[0], BODIES)
        raise InvalidInputError(f"unknown body {text!r}{near or f'; {known}, or an expression in x, y, z'}")
    belong: tuple[str, ...] = () if name in BODIES else ("strict",)
    if of_file:
        belong = ("units", "strict", "part", "cap", "union", "surface", "sew" if suffix in CAD else "subdivide")
    if alien := [option for option in given if option not in belong]:
        what = f"{name} takes none" if not belong else f"{text!r} takes --{', --'.join(belong)}"
        if belong and not of_file and alien[0] != "sew":
            what = f"{text!r} is no file on this machine, but an expression"
        raise InvalidInputError(f"--{alien[0]} does not belong to this body: {what}")
    try:
        if of_file:
            kind: Any = scatterers.Cad if suffix in CAD else scatterers.Mesh
            given = {"surface": "auto"} | given
            return _with_charts(kind(text, **given, cache=cache, speed=speed, progress=progress), progress)
        if name in BODIES:
            return _with_charts(_named(name, rest, speed), None)
        if progress:
            progress("examining the expression")
        return _with_charts(scatterers.Implicit(text, **given, speed=speed), progress)
    except InvalidInputError:
        raise
    except (TypeError, ValueError, ModuleNotFoundError) as error:
        named = "" if str(error).startswith(text) else f"{text if len(text) < 60 else text[:57] + '...'}: "
        raise InvalidInputError(f"{named}{error}") from error


def is_file(text: str, folder: Path = Path()) -> bool:
    """Whether a BODY names a file, whose lengths are metres: by its ending, or because there is one in the folder."""
    named = text.partition(":")[0] in BODIES
    return Path(text).suffix.lower() in MESHES + CAD or (not named and os.path.isfile(folder / text))


def title_of(text: str) -> str:
    """Name of a BODY for titles: what was typed, of a file its name, cut if long."""
    name = Path(text).name if is_file(text) else " ".join(text.split())
    return name if len(name) <= 40 else f"{name[:37]}..."


def _with_charts(shape: Any, progress: Tell | None) -> Any:
    """Body whose charts are made: flows need them, and of thin parts there may be none; bodies of pieces have none."""
    if any(getattr(shape, name, ()) for name in ("creases", "without_rays")):
        return shape
    if progress:
        progress("charts")
    _ = shape.atlas.charts
    return shape


def _named(name: str, rest: str, speed: str | None) -> Any:
    import scatterers

    make = getattr(scatterers, name.title().replace("-", ""))
    known = {key: p for key, p in inspect.signature(make).parameters.items() if key != "speed"}
    values: dict[str, Any] = {}
    for item in filter(None, rest.split(",")):
        key, equals, number = (part.strip() for part in item.partition("="))
        try:
            value = float(number)
        except ValueError:
            equals = ""
        if not equals:
            cure = f"give {', '.join(known)}, e.g. {name}:{next(iter(known))}=0.15; lengths are numbers of one unit"
            raise InvalidInputError(f"body parameter {item!r} is not of the form name=number: {cure}")
        if key not in known:
            raise InvalidInputError(f"{name} has no parameter {key!r}; it has {', '.join(known)}")
        if key in values:
            raise InvalidInputError(f"parameter {key!r} of {name} is given twice: {values[key]:g} and {value:g}")
        values[key] = value
    missing = [key for key, p in known.items() if p.default is p.empty and key not in values]
    if missing:
        raise InvalidInputError(f"{name} needs {', '.join(f'{key}=' for key in missing)}")
    if speed is not None:
        values["speed"] = speed
    return make(**values)


def _like_expression(text: str) -> bool:
    """Whether the text has an operation or a bracket, and one of x, y, z as a word of its own."""
    return bool(re.search(r"[-+*/(]", text) and re.search(r"(?<![A-Za-z_])[xyz](?![A-Za-z_])", text))


def each_once(option: str, text: str, known: Collection[str]) -> tuple[str, ...]:
    """Names that an option gives, joined by commas, in capitals or not.

    Raises
    ------
    InvalidInputError
        If one is not known, or given twice.

    Examples
    --------
    >>> each_once("--format", "csv, MAT", ("csv", "mat"))
    ('csv', 'mat')
    """
    spelled = {name.lower(): name for name in known}
    given = [name.strip().lower() for name in text.split(",")]
    if not set(given) <= set(spelled) or len(set(given)) < len(given):
        raise InvalidInputError(f"{option} {text!r}: give some of {', '.join(known)}, each once")
    return tuple(spelled[name] for name in given)


@dataclass(frozen=True)
class Output:
    """Where results of a body are written, and how.

    Attributes
    ----------
    folder : Path
    name : str
        Of the body, for titles.
    formats : tuple of str
        Kinds of tables.
    pictures : bool
    backend : str
        Of pictures in space.
    """

    folder: Path
    name: str
    formats: tuple[str, ...] = ("csv",)
    pictures: bool = True
    backend: str = "auto"


def write_tables(
    stem: Path, formats: Sequence[str], result: Any, *, observed: tuple[Sequence[str], Any] | None = None, **named: Any
) -> list[str]:
    """Write a result, for `write_csv` by its name, as a table of each format; returns the names of the files."""
    from creeping import files

    if "csv" in formats:
        files.write_csv(stem.with_suffix(".csv"), observed=observed, **named)
    if "mat" in formats:
        files.write_mat(stem.with_suffix(".mat"), result, observed=observed)
    return [f"{stem.name}.{kind}" for kind in formats]


def flow_of(kind: str, body: Any, tolerance: float, *, n_rays: int, **asked: Any) -> Any:
    """Flow that carries rays with an rms error of ``tolerance``: "direct", "map", or "auto", what is faster."""
    import creeping as cr

    if kind == "direct":
        # errors of the steps add up and grow along the rays
        return cr.DirectFlow(body, rtol=min(max(1e-4 * tolerance, 1e-13), 1e-8))
    if kind == "map":
        return cr.build_phase_map(body, tolerance=tolerance, **asked)
    return cr.choose_flow(body, n_rays=n_rays, tolerance=tolerance, **asked)
