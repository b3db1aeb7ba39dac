"""``creeping coupling``: how strongly antennas on a body couple, over frequency, in decibels with their error.

Ports on a perfect conductor are slots, which have an axis, and short monopoles along the normal; ``--kind point`` asks
for point sources on a hard body. Values are those of `creeping.antenna_coupling` and its like, of unit moments; with
``--size`` (a monopole's height, a slot's length) also mutual impedances or admittances, as Touchstone.
"""

import json
import re
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from creeping._progress import Progress
from creeping.commands import options
from creeping.commands.options import parse_body, title_of
from creeping.errors import InvalidInputError

Port = Annotated[
    list[str],
    Parameter(
        help="NAME=X,Y,Z of a port, or NAME=X,Y,Z/AX,AY,AZ of a slot along an axis; two or more. A port within a "
        "fiftieth of the body's size from it is put on it.",
        negative="",
    ),
]
Kind = Annotated[
    Literal["auto", "monopole", "slot", "point"],
    Parameter(
        help="What ports are: auto takes slots where there is an axis and monopoles elsewhere, on a conductor; point "
        "is of point sources on a hard body."
    ),
]
Size = Annotated[
    float | None,
    Parameter(
        group=options.OUTPUT,
        help="Height of each monopole, or length of each slot, L: coupling.sNp has mutual impedances or admittances "
        "of ports of one kind. "
        "Of points: the distance at which a source on a plane has the transfer ratio 1.",
    ),
]

_VECTOR = r"([^,/=]+),([^,/=]+),([^,/=]+)"


@dataclass(frozen=True)
class Ports:
    """Names, places (n, 3), L, and kinds of ports, slots first; axes of the slots."""

    names: tuple[str, ...]
    points: Any
    kinds: tuple[str, ...]
    axes: Any


def coupling(
    body: options.Body,
    *,
    port: Port,
    kind: Kind = "auto",
    wave: options.WaveOptions = options.NO_WAVE,
    file: options.FileOptions = options.AS_IT_IS,
    size: Size = None,
    output: options.Folder = Path("out"),
    pictures: options.Pictures = True,
    json_: options.Json = False,
) -> int:
    """Coupling of antennas on a body over frequency: coupling.csv, paths.csv of the geodesics, and a picture."""
    import numpy as np

    from creeping.field.ports.coupling_result import Coupling

    started = time.perf_counter()
    ports = parse_ports(port, kind)
    k, hertz = _waves(wave)
    if size is not None and not 0 < size < float("inf"):
        raise InvalidInputError(f"--size {size!r} is not a positive finite number")
    if size is not None and len(set(ports.kinds)) > 1:
        raise InvalidInputError("--size makes a Touchstone file, which has one kind of ports: slots or monopoles")
    if size is not None and hertz is None:
        raise InvalidInputError("--size makes a Touchstone file, which is over frequency: give --frequency")
    if len(k) * len(ports.names) ** 2 > 100_000:
        raise InvalidInputError(f"{len(ports.names)} ports at {len(k)} frequencies: 100000 pairs in all are the most")
    with Progress("frequencies") as progress:
        shape = parse_body(body, options=file, progress=progress.message)
        placed, moved = _on_body(shape, ports)
        if moved:
            progress.message(moved)
        found: list[Coupling] = []
        for number, one in enumerate(np.asarray(k).tolist()):
            of_one = _coupled(shape, ports, placed, one)
            found.append(of_one if hertz is None else replace(of_one, length_unit="m"))
            progress.told(number + 1, len(k))
    output.mkdir(parents=True, exist_ok=True)
    files = _write(output, ports, found, hertz, size, wave.sound_speed)
    from creeping.plotting.coupling_pictures import MOST_CURVES

    pairs = len(ports.names) * (len(ports.names) - 1) // 2
    if pictures and len(found) > 1 and pairs > MOST_CURVES:
        print(f"creeping: no picture: {pairs} pairs are more curves than can be told apart", file=sys.stderr)
    elif pictures:
        _draw(output / "coupling.png", ports, found, hertz, title_of(body))
        files.append("coupling.png")
    states = sum((Counter(one.status_counts) for one in found), Counter[str]())
    # a port with itself
    states["CAUSTIC"] -= len(found) * len(ports.names)
    summary = {
        "body": body,
        "ports": list(ports.names),
        "frequencies": len(found),
        "status": {name: count for name, count in states.items() if count},
        "files": [*files, "summary.json"],
        "seconds": round(time.perf_counter() - started, 2),
    }
    (output / "summary.json").write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(summary, indent=1) if json_ else readable(ports, found, hertz, summary, output))
    return 0


def parse_ports(texts: Sequence[str], kind: str) -> Ports:
    """Ports of the command line, slots first.

    Raises
    ------
    InvalidInputError
        If a text is none of a port, two have one name, or an axis is missing or too much for the kind.
    """
    import numpy as np

    rows: list[tuple[str, list[float], list[float] | None]] = []
    for number, text in enumerate(texts):
        match = re.fullmatch(rf"(?:([^=,/\"']+)=)?{_VECTOR}(?:/{_VECTOR})?", text.replace(" ", ""))
        try:
            values = [float(part) for part in (match.groups()[1:] if match else ()) if part is not None]
        except ValueError:
            match = None
        if match is None or not np.all(np.isfinite(values)):
            raise InvalidInputError(f"--port {text!r}: give NAME=X,Y,Z, or NAME=X,Y,Z/AX,AY,AZ of a slot")
        rows.append((match[1] or str(number + 1), values[:3], values[3:] or None))
    names = [name for name, _, _ in rows]
    if len(rows) < 2 or len(set(names)) < len(names):
        what = "two ports have one name" if len(rows) > 1 else f"there is {len(rows)} port"
        raise InvalidInputError(f"--port: {what}; give two or more, each with a name of its own")
    for name, _, axis in rows:
        if kind == "slot" and axis is None:
            raise InvalidInputError(f"--port {name}: a slot has an axis; give {name}=X,Y,Z/AX,AY,AZ")
        if kind in ("monopole", "point") and axis is not None:
            raise InvalidInputError(f"--port {name}: a {kind} has no axis; leave it out, or ask for --kind slot")
    rows.sort(key=lambda row: row[2] is None)
    kinds = tuple("point" if kind == "point" else "monopole" if axis is None else "slot" for _, _, axis in rows)
    axes = np.array([axis for _, _, axis in rows if axis is not None])
    return Ports(tuple(name for name, _, _ in rows), np.array([place for _, place, _ in rows]), kinds, axes)


def _waves(wave: options.WaveOptions) -> tuple[Any, Any]:
    """Wavenumbers (n,), 1/L, and their frequencies, Hz, or None: of a band FIRST:LAST:STEP, e.g. "8:12:0.1GHz"."""
    import numpy as np

    from creeping.commands.forecast import asked_wavenumber
    from creeping.field.frequency import frequency as hertz_of
    from creeping.field.frequency import wavenumber as wavenumber_of

    speed = wave.sound_speed
    if wave.frequency is not None and wave.wavenumber is None and ":" in wave.frequency:
        k = np.atleast_1d(wavenumber_of(wave.frequency, sound_speed=speed))
        # as typed: k and back leaves rounding
        return k, np.array([float(f"{one:.12g}") for one in np.atleast_1d(hertz_of(k, sound_speed=speed))])
    one, hertz, _ = asked_wavenumber(wave)
    return np.array([one]), None if hertz is None else np.array([float(f"{hertz:.12g}")])


def _on_body(shape: Any, ports: Ports) -> tuple[Any, str]:
    """Ports put on the body (n, 3), and what is said of those that were moved."""
    import numpy as np

    from creeping.geometry.arguments import rays_refused
    from creeping.geometry.checks import unit_of
    from creeping.geometry.surface import project, size, why_no_rays

    if why_no_rays(shape):
        raise InvalidInputError(rays_refused(shape))
    placed = project(shape, ports.points)
    off = np.linalg.norm(placed - ports.points, axis=1)
    # a port is put on the body from a fiftieth of its size
    if bad := [name for name, far in zip(ports.names, off, strict=True) if not far <= 0.02 * size(shape)]:
        raise InvalidInputError(
            f"--port {', '.join(bad)}: off the body by up to {np.nanmax(off):.3g} {unit_of(shape)}; give places on it"
        )
    moved = np.max(off)
    return placed, f"ports moved onto the body, by {moved:.2g} {unit_of(shape)} at most" if moved > 0 else ""


def _coupled(shape: Any, ports: Ports, placed: Any, k: float) -> Any:
    """Coupling at one wavenumber."""
    import creeping as cr

    slots = ports.kinds.count("slot")
    if ports.kinds[0] == "point":
        return cr.coupling(shape, placed, wavenumber=k)
    if slots == len(ports.names):
        return cr.slot_coupling(shape, placed, ports.axes, wavenumber=k)
    if not slots:
        return cr.monopole_coupling(shape, placed, wavenumber=k)
    return cr.antenna_coupling(shape, placed[:slots], ports.axes, placed[slots:], wavenumber=k)


def _write(
    output: Path, ports: Ports, found: Sequence[Any], hertz: Any, size: float | None, sound_speed: float | None
) -> list[str]:
    """Write the tables, and Touchstone where a size makes it one; returns the names of the files."""
    from creeping import files

    files.write_couplings(output / "coupling.csv", found, ports.names, hertz)
    files.write_paths(output / "paths.csv", found, ports.names, hertz)
    names = ["coupling.csv", "paths.csv"]
    if size is not None:
        name = f"coupling.s{len(ports.names)}p"
        asked: dict[str, Any] = {"sound_speed": sound_speed, "names": ports.names}
        files.write_touchstone(output / name, found, reference_distance=size, **asked)
        names.append(name)
    return names


def _draw(path: Path, ports: Ports, found: Sequence[Any], hertz: Any, title: str) -> None:
    """The matrix at one frequency, or the level of each pair over many."""
    from creeping.plotting.coupling_pictures import plot_coupling, plot_coupling_band
    from creeping.plotting.pages import save_figure

    if len(found) == 1:
        ax = plot_coupling(found[0], names=ports.names)
    else:
        ax = plot_coupling_band(found, names=ports.names, hertz=hertz)
    ax.set_title(f"{title}\n{ax.get_title()}", fontsize=9, parse_math=False)
    save_figure(ax.figure, path, 200)


def readable(ports: Ports, found: Sequence[Any], hertz: Any, summary: dict[str, Any], output: Path) -> str:
    """The summary in a few lines: each pair at the first and the last frequency."""
    from creeping.commands.forecast import frequency_words

    def wave(number: int) -> str:
        return f"k = {found[number].wavenumber:g}" if hertz is None else frequency_words(float(hertz[number]))

    ends = dict.fromkeys((0, len(found) - 1))
    lines = []
    for i, j in combinations(range(len(ports.names)), 2):
        levels = ", ".join(f"{_level(found[n], i, j)} at {wave(n)}" for n in ends)
        lines.append(f"{ports.names[i]} to {ports.names[j]}: {levels}")
    states = ", ".join(f"{count} {name}" for name, count in summary["status"].items())
    files = f"{len(summary['files'])} files in {output} ({', '.join(summary['files'])})"
    lines.append(f"decibels re {found[0].unit}, of unit moments; {states}\n{files}, {summary['seconds']:.1f} s")
    return "\n".join(lines)


def _level(found: Any, i: int, j: int) -> str:
    """Level of a pair with its error, in words; a bound where the error is larger."""
    import numpy as np

    size, off = abs(found.values[i, j]), float(found.error[i, j])
    if not off < size:
        return f"below {20 * np.log10(size + off):.1f} dB"
    return f"{20 * np.log10(size):.1f} dB (within {20 * np.log10(1 + off / size):.1f})"
