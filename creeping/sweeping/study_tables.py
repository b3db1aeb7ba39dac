"""Tables of study files: what keys may hold, the mistakes of one that holds something else, and sets of directions."""

import difflib
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from tokenize import TokenError
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import CreepingError, InvalidInputError
from creeping.geometry import directions
from creeping.geometry.directions import MOST
from creeping.storage.atomic import text_of
from creeping.sweeping.plan import short
from creeping.sweeping.request import MOST_WAVENUMBERS


class Kind(NamedTuple):
    """What a value should be, in words; whether one is; and what is made of it."""

    words: str
    fits: Callable[[Any], bool]
    made: Callable[[Any], Any] = lambda value: value


class Key(NamedTuple):
    """One key of a table: kind of its value, or its name in VALUES, default, and whether it must be there."""

    kind: Kind | str
    default: Any = None
    required: bool = False


def one_of(*names: str) -> Kind:
    """Kind of a text out of ``names``."""
    words = " or ".join(f'"{name}"' for name in names)
    return Kind(words, lambda value: isinstance(value, str) and value in names)


def count(most: int) -> Kind:
    """Kind of a whole number from 1 to ``most``."""
    return Kind(f"a whole number from 1 to {most}", lambda value: _whole(value) and 1 <= value <= most)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _finite(value: Any) -> bool:
    if not (_whole(value) or isinstance(value, float)):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        # a whole number that is no float
        return False


def _positive(value: Any) -> bool:
    return _finite(value) and bool(value > 0)


def _plain(value: Any) -> Any:
    """A float instead of a whole number beyond those of numpy."""
    return float(value) if _whole(value) and abs(value) > 2**53 else value


def _vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_finite, value))


def _list_of(value: Any, test: Callable[[Any], bool]) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(map(test, value))


def _wavenumbers(value: Any) -> bool:
    def fits(one: Any) -> bool:
        # whatever the unit of length, from nanometres to the size of the sun: the phase of a larger one has no digits
        return _finite(one) and 1e-12 <= one <= 1e12

    if isinstance(value, dict):
        ends = all(fits(value.get(name)) for name in ("first", "last"))
        return ends and count(MOST_WAVENUMBERS).fits(value.get("count")) and set(value) == {"first", "last", "count"}
    return _list_of(value if isinstance(value, list) else [value], fits)


def _made_wavenumbers(value: Any) -> tuple[float, ...]:
    if isinstance(value, dict):
        return tuple(np.linspace(float(value["first"]), float(value["last"]), value["count"]).tolist())
    return tuple(map(float, value if isinstance(value, list) else [value]))


VALUES = {
    "text": Kind("a text in quotes, not empty", lambda value: isinstance(value, str) and bool(value.strip())),
    "any text": Kind("a text in quotes", lambda value: isinstance(value, str)),
    "texts": Kind(
        "a text in quotes, or a list of them",
        lambda value: isinstance(value, str) or _list_of(value, lambda one: isinstance(one, str)),
        lambda value: (value,) if isinstance(value, str) else tuple(value),
    ),
    "flag": Kind("true or false", lambda value: isinstance(value, bool)),
    "number": Kind("a finite number", _finite, _plain),
    "positive": Kind("a positive finite number", _positive, _plain),
    "length": Kind('a positive finite number or "auto"', lambda value: value == "auto" or _positive(value), _plain),
    "wavenumbers": Kind(
        "a positive number from 1e-12 to 1e+12, a list of them, or "
        f"{{ first = ..., last = ..., count = ... }} with a count up to {MOST_WAVENUMBERS}",
        _wavenumbers,
        _made_wavenumbers,
    ),
    "vector": Kind("three finite numbers, [x, y, z]", _vector),
    "vectors": Kind(f"a list of [x, y, z], at most {MOST}", lambda v: _list_of(v, _vector) and len(v) <= MOST),
}


def read_table(name: str, table: Any, keys: dict[str, Key], mistakes: list[str]) -> dict[str, Any]:
    """Values of a table by key, defaults for those that it lacks; mistakes are added to the list."""
    values = {key: known.default for key, known in keys.items()}
    kinds = {key: VALUES[known.kind] if isinstance(known.kind, str) else known.kind for key, known in keys.items()}
    if not isinstance(table, dict):
        mistakes.append(f"{name} is not a table; write [{name}] above its keys")
        return values
    for key, value in table.items():
        if key not in keys:
            mistakes.append(f"[{name}] {key}: unknown key{nearest(key, keys)}")
        elif not kinds[key].fits(value):
            shown = short(f'"{value}"' if isinstance(value, str) else value)
            mistakes.append(f"[{name}] {key} = {shown} is not {kinds[key].words}")
        else:
            values[key] = kinds[key].made(value)
    mistakes += [
        f"[{name}] {key} is missing: {kinds[key].words}"
        for key, known in keys.items()
        if known.required and key not in table
    ]
    return values


def nearest(word: str, known: Iterable[str]) -> str:
    """What may have been meant, or what there is."""
    names = list(known)
    close = difflib.get_close_matches(word, names, 1, cutoff=0.5)
    return f"; did you mean {close[0]}?" if close else f"; known are {', '.join(names)}"


def _ranges(first: str, second: str) -> dict[str, Key]:
    found: dict[str, Key] = {}
    for name in (first, second):
        found |= {f"{name}_deg_{end}": Key("number", required=True) for end in ("min", "max")}
        found[f"{name}_count"] = _COUNT
    return found


_COUNT = Key(count(MOST), required=True)
KINDS: dict[str, tuple[dict[str, Key], Callable[[dict[str, Any], Path], FloatArray]]] = {
    "fibonacci": ({"count": _COUNT}, lambda given, _: directions.fibonacci_directions(given["count"])),
    "lebedev": ({"order": _COUNT}, lambda given, _: directions.lebedev_directions(given["order"])[0]),
    "grid": (
        {"theta_count": _COUNT, "phi_count": _COUNT},
        lambda given, _: directions.theta_phi_grid(given["theta_count"], given["phi_count"])[0],
    ),
    "theta-phi": (
        _ranges("theta", "phi"),
        lambda given, _: directions.directions_from_angles(*_mesh(given, "theta", "phi")),
    ),
    "azimuth-elevation": (
        _ranges("azimuth", "elevation"),
        lambda given, _: directions.directions_from_azimuth_elevation(*_mesh(given, "azimuth", "elevation")),
    ),
    "great-circle": (
        {name: Key("vector", required=True) for name in ("first", "through")}
        | {"count": _COUNT, "angle_deg_min": Key("number", 0.0), "angle_deg_max": Key("number", 360.0)},
        lambda given, _: _circle(given),
    ),
    "list": (
        {"directions": Key("vectors", required=True)},
        lambda given, _: np.asarray(given["directions"], dtype=float),
    ),
    "file": ({"path": Key("text", required=True)}, lambda given, folder: _from_file(folder / given["path"])),
}
"""Keys of each kind of directions, and what makes these of the values and the folder of the study."""


def read_directions(name: str, table: Any, folder: Path, mistakes: list[str]) -> FloatArray | None:
    """Unit directions of a table; its mistakes are added to the list."""
    kind = table.get("kind") if isinstance(table, dict) else None
    if not isinstance(kind, str) or kind not in KINDS:
        what = "is missing" if kind is None else f"= {kind!r} is unknown"
        mistakes.append(f"[{name}] kind {what}{nearest(str(kind or ''), KINDS)}")
        return None
    before, (keys, made) = len(mistakes), KINDS[kind]
    values = read_table(name, {k: v for k, v in table.items() if k != "kind"}, keys, mistakes)
    if len(mistakes) > before:
        return None
    try:
        return directions.unit_directions(made(values, folder), f"[{name}] directions").reshape(-1, 3)
    except CreepingError as error:
        mistakes.append(f"[{name}] {error}".replace(f"[{name}] [{name}]", f"[{name}]"))
        return None


def _circle(given: dict[str, Any]) -> FloatArray:
    start, stop = np.radians(given["angle_deg_min"]), np.radians(given["angle_deg_max"])
    # a whole circle ends where it began
    ends = abs(stop - start) < 2 * np.pi - 1e-9
    return directions.great_circle(
        given["first"], given["through"], given["count"], start=start, stop=stop, endpoint=ends
    )


def _mesh(values: dict[str, Any], first: str, second: str) -> tuple[FloatArray, FloatArray]:
    """Angles of both axes in radians (n, m), the second running fastest."""
    axes = []
    directions.direction_count(f"{first}_count {second}_count", values[f"{first}_count"] * values[f"{second}_count"])
    for name in (first, second):
        low, high, count = (values[f"{name}_{part}"] for part in ("deg_min", "deg_max", "count"))
        whole = count > 1 and abs(abs(high - low) - 360) < 1e-9
        axes.append(np.radians(np.linspace(low, high, count, endpoint=not whole)))
    one, two = np.meshgrid(*axes, indexing="ij")
    return one, two


def _from_file(path: Path) -> FloatArray:
    """Directions of a .npy file or of a table with three columns, separated by commas; nothing in it is executed."""
    kind = path.suffix.lower()
    if kind not in (".csv", ".npy"):
        raise InvalidInputError(f"path = {str(path)!r} ends neither in .csv nor in .npy")
    try:
        if not path.is_file():
            raise InvalidInputError(f"cannot read directions from {path}: there is no such file")
        # a line of three numbers has at most 100 bytes
        if path.stat().st_size > 100 * MOST:
            raise InvalidInputError(
                f"{path} has {path.stat().st_size / 1e9:.1f} GB, more than {MOST} directions; divide it"
            )
        # mapped, so that a header that promises more than the file holds is an error before memory is asked for
        found = np.lib.format.open_memmap(path, mode="r") if kind == ".npy" else _table(path)
    except (OSError, ValueError, OverflowError, TokenError, SyntaxError, TypeError) as error:
        if isinstance(error, CreepingError):
            raise
        raise InvalidInputError(f"cannot read directions from {path}: {error}") from error
    if found.ndim != 2 or found.shape[1] != 3 or found.dtype.kind not in "fiu":
        raise InvalidInputError(f"{path} holds {found.dtype} {found.shape}, not numbers (n, 3)")
    directions.direction_count(f"{path}: number of directions", len(found))
    return np.array(found, dtype=float)


def _table(path: Path) -> FloatArray:
    """Numbers of a .csv file (n, columns); a line ``x,y,z`` above them is left out."""
    lines = text_of(path, 100 * MOST, "utf-8-sig").splitlines()
    rows = [row for row in (line.partition("#")[0].strip() for line in lines) if row]
    if rows and [word.strip(" \t\"'").lower() for word in rows[0].split(",")] == ["x", "y", "z"]:
        rows = rows[1:]
    if not rows:
        raise InvalidInputError(f"{path} holds no directions; write x,y,z in each line")
    if not any(map(_is_number, rows[0].split(","))):
        raise InvalidInputError(
            f"{path} begins with {short(rows[0])!r}: remove the header line, or give columns x,y,z, separated by commas"
        )
    return np.loadtxt(rows, delimiter=",", ndmin=2)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
