"""Options that several commands have: the body, the file that it comes from, the wave, what is written."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

Body = Annotated[
    str,
    Parameter(
        help="Name with parameters, e.g. torus or ellipsoid:a=1.2,b=0.8,c=0.8; a file, e.g. hull.stl or hull.step; "
        "or an expression F(x, y, z), negative inside, or an equation, e.g. 'x**2 + y**4 + z**2 = 1'."
    ),
]
SpeedOption = Annotated[str | None, Parameter(help="Speed c(x, y, z) of the weighted flow, e.g. '1 + x'.")]
OUTPUT, FIELD, ANGLES = Group("Output"), Group("Field"), Group("Angles")
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

    wavenumber: Annotated[float | None, Parameter(help="k, 1/L: asks for the field.")] = None
    frequency: Annotated[
        str | None, Parameter(help='Instead of k, e.g. "10GHz": lengths are metres then. Of coupling also a band.')
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
