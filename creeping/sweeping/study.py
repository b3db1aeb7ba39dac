"""Study files: a sweep written down in TOML, angles in degrees, units in the names of keys.

All mistakes are told at once, with the key that may have been meant. See `EXAMPLE`.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.surface import Surface, size, why_no_rays
from creeping.rays.reach import AUTO
from creeping.storage.atomic import text_of
from creeping.sweeping import request as requests
from creeping.sweeping.plan import too_large
from creeping.sweeping.request import SweepRequest, sweep_length
from creeping.sweeping.study_tables import Key, count, nearest, one_of, read_directions, read_table

EXAMPLE = """\
[study]
name = "monostatic, twisted ellipsoid"
body = "twisted-ellipsoid"            # as on the command line; a file is sought beside this one
quantity = "monostatic"               # or "bistatic", "rays"
boundary = ["soft", "hard"]
wavenumbers_per_length = [20.0, 40.0] # 1/L; or { first = 10.0, last = 40.0, count = 31 }
rays = 256
length = "auto"                       # till waves have died away; or 6.0, or length_in_body_sizes = 3.0

[incidences]
kind = "fibonacci"
count = 1000

[flow]
kind = "auto"                         # or "map", "direct"
tolerance = 1e-6

[run]
output = "sweep.zarr"
"""
FILE = {
    "strict": Key("flag", False),
    "part": Key("text"),
    "cap": Key("positive"),
    "union": Key("flag", False),
    "subdivide": Key("text"),
    "sew": Key("positive"),
    "surface": Key(one_of("smooth", "facets", "auto")),
}
"""Options of a body from a file."""
BODY = {
    "name": Key("any text", ""),
    "body": Key("text", required=True),
    "units": Key("text"),
    "speed": Key("text"),
}
TABLES: dict[str, dict[str, Key]] = {
    "study": {
        "quantity": Key(one_of(*requests.QUANTITIES), "monostatic"),
        "boundary": Key("texts"),
        "wavenumbers_per_length": Key("wavenumbers", ()),
        "rays": Key(count(requests.MOST_RAYS), 256),
        "steps": Key(count(requests.MOST_STEPS)),
        "order": Key(count(2)),
        "method": Key(one_of(*requests.METHODS)),
        "accuracy": Key("positive"),
        "length": Key("length"),
        "length_in_body_sizes": Key("positive"),
    },
    "flow": {"kind": Key(one_of("auto", "map", "direct"), "auto"), "tolerance": Key("positive", 1e-6)},
    "run": {"chunk": Key(count(1_000_000)), "workers": Key(count(10_000)), "output": Key("text")},
}


@dataclass(frozen=True, eq=False)
class Study:
    """A study file, read and checked.

    Attributes
    ----------
    name : str
    body : str
        As on the command line; with ``units``, ``speed`` and, in ``file``, the other options of a file.
    request : SweepRequest
        Its ``length`` as ``length_in`` says, and 1 if that is "auto".
    length_in : {"L", "body sizes", "auto"}
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
    file: dict[str, Any]
    request: SweepRequest
    length_in: Literal["L", "body sizes", "auto"]
    incidences: FloatArray
    flow: str
    tolerance: float
    chunk: int | None
    workers: int | None
    output: str | None
    text: str
    folder: Path

    def request_for(self, body: Surface) -> SweepRequest:
        """Request with the length of the rays in L; for a body without rays one that does not ask for them."""
        if why_no_rays(body) and self.request.method == "rays" and self.request.quantity != "rays":
            return replace(self.request, method="auto")
        if self.length_in == AUTO:
            return replace(self.request, length=sweep_length(body, AUTO, self.request.wavenumbers))
        unit = 1.0 if self.length_in == "L" else size(body)
        return replace(self.request, length=self.request.length * unit)


def read_study(path: str | Path) -> Study:
    """Read a study file.

    Raises
    ------
    InvalidInputError
        If it cannot be read, or with all its mistakes, as ``mistakes`` too.
    """
    path = Path(path)
    try:
        text = text_of(path, 100_000_000)
    except FileNotFoundError as error:
        raise InvalidInputError(
            f"cannot read the study {path}: there is no such file; name another, or write one to start from with "
            f"'creeping sweep --example > study.toml'"
        ) from error
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
    except (ValueError, RecursionError) as error:
        # also of numbers with thousands of digits, and of brackets in brackets in brackets
        raise InvalidInputError(f"{name} is not TOML: {error}") from error
    if not tables:
        raise InvalidInputError(f"{name} is empty; start from what 'creeping sweep --example' prints")
    mistakes: list[str] = []
    known = ("study", "incidences", "observation", "flow", "run")
    for key, value in tables.items():
        if key not in known:
            what = "unknown table" if isinstance(value, dict) else "a key outside of the tables"
            mistakes.append(f"{key}: {what}{nearest(key, known)}")
    mistakes += [f"the table [{key}] is missing" for key in ("study", "incidences") if key not in tables]
    table = tables.get("study", {"body": "?"})
    as_list = 'write [{}] and below it kind = "list" and directions = [[x, y, z], ...], or another kind'
    observed: bool | None = "observation" in tables
    if isinstance(table, dict) and "observation" in table and not observed:
        table = {key: value for key, value in table.items() if key != "observation"}
        mistakes.append(f"[study] observation is a table of its own: {as_list.format('observation')}")
        observed = None
    main = read_table("study", table, BODY | FILE | TABLES["study"], mistakes)
    flow = read_table("flow", tables.get("flow", {}), TABLES["flow"], mistakes)
    run = read_table("run", tables.get("run", {}), TABLES["run"], mistakes)
    if not 1e-12 <= flow["tolerance"] <= 1e-1:
        mistakes.append(f"[flow] tolerance = {flow['tolerance']:g} is not between 1e-12 and 1e-1")
    sets: dict[str, FloatArray | None] = {}
    for key in known[1:3]:
        if isinstance(tables.get(key), dict):
            sets[key] = read_directions(key, tables[key], folder, mistakes)
        elif key in tables:
            mistakes.append(f"{key} is not a table: {as_list.format(key)}")
            observed = None if key == "observation" else observed
    if main["length"] is not None and main["length_in_body_sizes"] is not None:
        mistakes.append("[study] length and length_in_body_sizes are both given; give one")
    request = _request(main, observed, sets.get("observation"), mistakes)
    if mistakes or request is None:
        count = "1 mistake" if len(mistakes) == 1 else f"{len(mistakes)} mistakes"
        raise InvalidInputError(f"{name} has {count}:\n  " + "\n  ".join(mistakes), mistakes=mistakes)
    incidences = sets["incidences"]
    assert incidences is not None
    return Study(
        **{key: main[key] for key in BODY},
        file={key: main[key] for key in FILE},
        request=request,
        length_in=_length_in(main),
        incidences=incidences,
        flow=flow["kind"],
        tolerance=flow["tolerance"],
        **run,
        text=text,
        folder=folder,
    )


def _length_in(main: dict[str, Any]) -> Literal["L", "body sizes", "auto"]:
    if main["length_in_body_sizes"] is not None:
        return "body sizes"
    return AUTO if main["length"] in (None, AUTO) else "L"


def _request(
    main: dict[str, Any], observed: bool | None, seen: FloatArray | None, mistakes: list[str]
) -> SweepRequest | None:
    """Request of the table [study]; its mistakes are added to the list.

    ``observed`` says whether there is a table [observation], None if one is meant and a mistake is told already.
    """
    quantity, fields = main["quantity"], main["quantity"] != "rays"
    for key in ("steps", "speed") if fields else ("order", "method"):
        if main[key] is not None:
            mistakes.append(f'[study] {key} goes with {"quantity" if fields else "a field, not"} "rays"')
    if observed is not None and (quantity == "bistatic") != observed:
        there = (
            'is missing: quantity "bistatic" needs it' if not observed else f'goes with "bistatic", not "{quantity}"'
        )
        mistakes.append(f"the table [observation] {there}")
    boundary = ("soft",) * fields if main["boundary"] is None else main["boundary"]
    try:
        request = requests.sweep_request(
            quantity,
            length=1.0 if _length_in(main) == AUTO else main["length_in_body_sizes"] or main["length"],
            n_rays=main["rays"],
            n_steps=main["steps"] or 1,
            wavenumbers=main["wavenumbers_per_length"],
            boundary=list(boundary),
            # a mistake of its own is told already
            observation=seen if seen is not None or quantity != "bistatic" else (0, 0, 1),
            order=main["order"] or 2,
            method=(fields and main["method"]) or "rays",
            accuracy=main["accuracy"],
        )
    except InvalidInputError as error:
        reasons = getattr(error, "mistakes", [str(error)])
        # what follows from a mistake that is told already is none of its own
        unsure = any(text.startswith(("[study] wavenumbers", "[study] quantity")) for text in mistakes)
        needs = "needs wavenumbers"
        reasons = [reason for reason in reasons if not ("observation" in reason or (unsure and needs in reason))]
        mistakes += [f"[study] {reason.replace(needs, needs + '_per_length')}" for reason in reasons]
        return None
    reason = too_large(request)
    if reason:
        mistakes.append(f"[study] {reason}")
    return request
