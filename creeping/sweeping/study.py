"""Study files: a sweep written down in TOML, angles in degrees, units in the names of keys.

All mistakes are told at once, with the key that may have been meant. See `EXAMPLE`.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from creeping._errors import CreepingError, InvalidInputError
from creeping._typing import Any, FloatArray
from creeping.phaseflow.storing import content_digest
from creeping.surface import Surface, size
from creeping.sweeping.directions import (
    directions_from_angles,
    directions_from_azimuth_elevation,
    fibonacci_directions,
    great_circle,
    lebedev_directions,
    theta_phi_grid,
    unit_directions,
)
from creeping.sweeping.planning import array_digest
from creeping.sweeping.request import MOST_RAYS, MOST_STEPS, QUANTITIES, SweepRequest, sweep_request
from creeping.sweeping.study_keys import Key, nearest, read_table

EXAMPLE = """\
[study]
name = "monostatic, twisted ellipsoid"
body = "twisted-ellipsoid"            # as on the command line; a file is sought beside this one
quantity = "monostatic"               # or "bistatic", "rays"
boundary = ["soft", "hard"]
wavenumbers_per_length = [20.0, 40.0] # 1/L; or { first = 10.0, last = 40.0, count = 31 }
rays = 256
length_in_body_sizes = 3.0            # or length = 6.0

[incidences]
kind = "fibonacci"
count = 1000

[flow]
kind = "auto"                         # or "map", "direct"
tolerance = 1e-6

[run]
output = "sweep.zarr"
"""
STUDY = {
    "name": Key("text", ""),
    "body": Key("text", "", required=True),
    "units": Key("text"),
    "speed": Key("text"),
    "allow_rough": Key("flag", False),
    "quantity": Key("text", "monostatic", choices=QUANTITIES),
    "boundary": Key("texts"),
    "wavenumbers_per_length": Key("numbers", ()),
    "rays": Key("count", 256, most=MOST_RAYS),
    "steps": Key("count", 1, most=MOST_STEPS),
    "order": Key("count", 2, most=2),
    "length": Key("positive"),
    "length_in_body_sizes": Key("positive"),
}
FLOW = {"kind": Key("text", "auto", choices=("auto", "map", "direct")), "tolerance": Key("positive", 1e-6)}
RUN = {
    "chunk": Key("count", most=1_000_000),
    "workers": Key("count", most=10_000),
    "output": Key("text"),
}
_COUNT = {"count": Key("count", 1, required=True)}


def _ranges(first: str, second: str) -> dict[str, Key]:
    found: dict[str, Key] = {}
    for name in (first, second):
        found |= {
            f"{name}_deg_min": Key("number", 0.0, required=True),
            f"{name}_deg_max": Key("number", 0.0, required=True),
            f"{name}_count": Key("count", 1, required=True),
        }
    return found


KINDS: dict[str, dict[str, Key]] = {
    "fibonacci": _COUNT,
    "lebedev": {"order": Key("count", 3, required=True)},
    "grid": {"theta_count": Key("count", 1, required=True), "phi_count": Key("count", 1, required=True)},
    "theta-phi": _ranges("theta", "phi"),
    "azimuth-elevation": _ranges("azimuth", "elevation"),
    "great-circle": {
        "first": Key("vector", required=True),
        "through": Key("vector", required=True),
        **_COUNT,
        "angle_deg_min": Key("number", 0.0),
        "angle_deg_max": Key("number", 360.0),
    },
    "list": {"directions": Key("vectors", required=True)},
    "file": {"path": Key("text", "", required=True)},
}


@dataclass(frozen=True, eq=False)
class Study:
    """A study file, read and checked.

    Attributes
    ----------
    name : str
    body : str
        As on the command line; with ``units``, ``speed`` and ``allow_rough``.
    request : SweepRequest
        Its ``length`` in body sizes if ``in_body_sizes``.
    in_body_sizes : bool
    incidences : (n, 3)
        Unit directions.
    flow, tolerance : str, float
        "auto", "map" or "direct".
    chunk, workers, output : int, int, str or None
        What changes no result.
    text : str
        Of the file.
    folder : Path
        Of the file; paths in it are relative to it.
    """

    name: str
    body: str
    units: str | None
    speed: str | None
    allow_rough: bool
    request: SweepRequest
    in_body_sizes: bool
    incidences: FloatArray
    flow: str
    tolerance: float
    chunk: int | None
    workers: int | None
    output: str | None
    text: str
    folder: Path

    @property
    def asked(self) -> dict[str, Any]:
        """What led to body and flow, as text and numbers."""
        named = ("body", "units", "speed", "allow_rough", "flow", "tolerance")
        return {name: getattr(self, name) for name in named}

    @property
    def digest(self) -> str:
        """Of all that changes results: not of the name, comments, or how the sweep is run."""
        return content_digest(
            {
                **self.asked,
                "request": repr(self.request),
                "in_body_sizes": self.in_body_sizes,
                "incidences": array_digest(self.incidences),
            }
        )

    def request_for(self, body: Surface) -> SweepRequest:
        """Request with the length of the rays in L."""
        return replace(self.request, length=self.request.length * size(body)) if self.in_body_sizes else self.request


def read_study(path: str | Path) -> Study:
    """Read a study file.

    Raises
    ------
    InvalidInputError
        If it cannot be read, or with all its mistakes, as ``mistakes`` too.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInputError(f"cannot read the study {path}: {error}") from error
    return parse_study(text, folder=path.parent, name=str(path))


def parse_study(text: str, *, folder: Path, name: str = "the study") -> Study:
    """Read the text of a study file, whose paths are relative to ``folder``.

    Examples
    --------
    >>> study = parse_study(EXAMPLE, folder=Path("."))
    >>> study.request.quantity, len(study.incidences), study.request.boundaries
    ('monostatic', 1000, ('soft', 'hard'))
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InvalidInputError(f"{name} is not TOML: {error}") from error
    mistakes: list[str] = []
    known = ("study", "incidences", "observation", "flow", "run")
    for key, value in tables.items():
        if key not in known:
            what = "unknown table" if isinstance(value, dict) else "a key outside of the tables"
            mistakes.append(f"{key}: {what}{nearest(key, known)}")
    mistakes += [f"the table [{key}] is missing" for key in ("study", "incidences") if key not in tables]
    main = read_table("study", tables.get("study", {"body": ""}), STUDY, mistakes)
    flow = read_table("flow", tables.get("flow", {}), FLOW, mistakes)
    run = read_table("run", tables.get("run", {}), RUN, mistakes)
    if not 1e-12 <= flow["tolerance"] <= 1e-1:
        mistakes.append(f"[flow] tolerance = {flow['tolerance']:g} is not between 1e-12 and 1e-1")
    sets = {key: _directions(key, tables[key], folder, mistakes) for key in known[1:3] if key in tables}
    if main["length"] is not None and main["length_in_body_sizes"] is not None:
        mistakes.append("[study] length and length_in_body_sizes are both given; give one")
    request = _request(main, "observation" in tables, sets.get("observation"), mistakes)
    if mistakes or request is None:
        count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
        raise InvalidInputError(f"{name} has {count}:\n  " + "\n  ".join(mistakes), mistakes=mistakes)
    kept = {key: main[key] for key in ("name", "body", "units", "speed", "allow_rough")}
    incidences = sets["incidences"]
    assert incidences is not None
    return Study(
        **kept,
        request=request,
        in_body_sizes=main["length"] is None,
        incidences=incidences,
        flow=flow["kind"],
        tolerance=flow["tolerance"],
        **run,
        text=text,
        folder=folder,
    )


def _request(main: dict[str, Any], observed: bool, seen: FloatArray | None, mistakes: list[str]) -> SweepRequest | None:
    """Request of the table [study]; its mistakes are added to the list."""
    quantity = main["quantity"]
    if quantity != "rays" and main["speed"] is not None:
        mistakes.append(f'[study] speed goes with quantity "rays"; a field ("{quantity}") is for constant speed')
    if (quantity == "bistatic") != observed:
        there = (
            'is missing: quantity "bistatic" needs it' if not observed else f'goes with "bistatic", not "{quantity}"'
        )
        mistakes.append(f"the table [observation] {there}")
    boundary = main["boundary"]
    if boundary is None:
        boundary = () if quantity == "rays" else ("soft",)
    try:
        return sweep_request(
            quantity,
            length=main["length"] or main["length_in_body_sizes"] or 3.0,
            n_rays=main["rays"],
            n_steps=main["steps"],
            wavenumbers=main["wavenumbers_per_length"],
            boundary=list(boundary),
            # a mistake of its own is told already
            observation=seen if seen is not None or quantity != "bistatic" else (0, 0, 1),
            order=main["order"],
        )
    except InvalidInputError as error:
        told = getattr(error, "mistakes", [str(error)])
        # what follows from a mistake that is told already is none of its own
        unsure = any(text.startswith(("[study] wavenumbers", "[study] quantity")) for text in mistakes)
        needs = "needs wavenumbers"
        told = [reason for reason in told if not (reason.startswith("observation") or (unsure and needs in reason))]
        mistakes += [f"[study] {reason.replace(needs, needs + '_per_length')}" for reason in told]
        return None


def _directions(name: str, table: Any, folder: Path, mistakes: list[str]) -> FloatArray | None:
    """Unit directions of a table; its mistakes are added to the list."""
    kind = table.get("kind") if isinstance(table, dict) else None
    if not isinstance(kind, str) or kind not in KINDS:
        told = "is missing" if kind is None else f"= {kind!r} is unknown"
        mistakes.append(f"[{name}] kind {told}{nearest(str(kind or ''), KINDS)}")
        return None
    before = len(mistakes)
    values = read_table(name, {k: v for k, v in table.items() if k != "kind"}, KINDS[kind], mistakes)
    if len(mistakes) > before:
        return None
    try:
        return unit_directions(_made(kind, values, folder), f"[{name}] directions").reshape(-1, 3)
    except CreepingError as error:
        mistakes.append(f"[{name}] {error}".replace(f"[{name}] [{name}]", f"[{name}]"))
        return None


def _made(kind: str, values: dict[str, Any], folder: Path) -> FloatArray:
    if kind == "fibonacci":
        return fibonacci_directions(values["count"])
    if kind == "lebedev":
        return lebedev_directions(values["order"])[0]
    if kind == "grid":
        return theta_phi_grid(values["theta_count"], values["phi_count"])[0]
    if kind == "theta-phi":
        return directions_from_angles(*_mesh(values, "theta", "phi"))
    if kind == "azimuth-elevation":
        return directions_from_azimuth_elevation(*_mesh(values, "azimuth", "elevation"))
    if kind == "great-circle":
        start, stop = np.radians(values["angle_deg_min"]), np.radians(values["angle_deg_max"])
        # a whole circle ends where it began
        ends = abs(stop - start) < 2 * np.pi - 1e-9
        return great_circle(values["first"], values["through"], values["count"], start=start, stop=stop, endpoint=ends)
    if kind == "list":
        return np.asarray(values["directions"], dtype=float)
    return _from_file(folder / values["path"])


def _mesh(values: dict[str, Any], first: str, second: str) -> tuple[FloatArray, FloatArray]:
    """Angles of both axes in radians (n, m), the second running fastest."""
    axes = []
    for name in (first, second):
        low, high, count = (values[f"{name}_{part}"] for part in ("deg_min", "deg_max", "count"))
        whole = count > 1 and abs(abs(high - low) - 360) < 1e-9
        axes.append(np.radians(np.linspace(low, high, count, endpoint=not whole)))
    grids = np.meshgrid(*axes, indexing="ij")
    return grids[0], grids[1]


def _from_file(path: Path) -> FloatArray:
    """Directions of a .npy file or of a table with three columns, separated by commas; nothing in it is executed."""
    try:
        if path.suffix.lower() == ".npy":
            found = np.load(path, allow_pickle=False)
        elif path.suffix.lower() == ".csv":
            found = np.loadtxt(path, delimiter=",", ndmin=2)
        else:
            raise InvalidInputError(f"path = {str(path)!r} ends neither in .csv nor in .npy")
    except (OSError, ValueError) as error:
        if isinstance(error, CreepingError):
            raise
        raise InvalidInputError(f"cannot read directions from {path}: {error}") from error
    if found.ndim != 2 or found.shape[1] != 3 or found.dtype.kind not in "fiu":
        raise InvalidInputError(f"{path} holds {found.dtype} {found.shape}, not numbers (n, 3)")
    return np.asarray(found, dtype=float)
