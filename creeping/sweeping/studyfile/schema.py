"""Keys of study files: what a table may hold, and the mistakes of one that holds something else."""

import difflib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creeping._typing import Any
from creeping.sweeping.plan import short

LEAST_WAVENUMBER, LARGEST_WAVENUMBER = 1e-12, 1e12
"""Whatever the unit of length, from nanometres to the size of the sun: the phase of a larger one has no digits left."""
WORDS = {
    "text": "a text in quotes, not empty",
    "texts": "a text in quotes, or a list of them",
    "flag": "true or false",
    "count": "a whole number >= 1",
    "number": "a finite number",
    "positive": "a positive finite number",
    "length": 'a positive finite number or "auto"',
    "wavenumbers": f"a positive number from {LEAST_WAVENUMBER:g} to {LARGEST_WAVENUMBER:g}, a list of them, or "
    "{ first = ..., last = ..., count = ... } with a count up to 100000",
    "vector": "three finite numbers, [x, y, z]",
}


@dataclass(frozen=True)
class Key:
    """One key of a table: kind of its value, default, the only values allowed, and the largest count or length."""

    kind: Literal["text", "texts", "flag", "count", "number", "positive", "length", "wavenumbers", "vector", "vectors"]
    default: Any = None
    required: bool = False
    choices: tuple[str, ...] = ()
    most: int = 100_000_000
    blank: bool = False


def read_table(name: str, table: Any, keys: dict[str, Key], mistakes: list[str]) -> dict[str, Any]:
    """Values of a table by key, defaults for those that it lacks; mistakes are added to the list."""
    values = {key: known.default for key, known in keys.items()}
    if not isinstance(table, dict):
        mistakes.append(f"{name} is not a table; write [{name}] above its keys")
        return values
    for key, value in table.items():
        if key not in keys:
            mistakes.append(f"[{name}] {key}: unknown key{nearest(key, keys)}")
        elif (reason := _mistake(value, keys[key])) is not None:
            mistakes.append(f"[{name}] {key} = {_shown(value)} is not {reason}")
        else:
            values[key] = _converted(value, keys[key].kind)
    for key, known in keys.items():
        if known.required and key not in table:
            mistakes.append(f"[{name}] {key} is missing: {_wanted(known)}")
    return values


def nearest(word: str, known: Iterable[str]) -> str:
    """What may have been meant, or what there is."""
    names = list(known)
    close = difflib.get_close_matches(word, names, 1, cutoff=0.5)
    return f"; did you mean {close[0]}?" if close else f"; known are {', '.join(names)}"


def _mistake(value: Any, key: Key) -> str | None:
    """What the value should be and is not."""
    tests: dict[str, Callable[[], bool]] = {
        "text": lambda: isinstance(value, str) and (key.blank or bool(value.strip())),
        "texts": lambda: isinstance(value, str) or _list_of(value, lambda v: isinstance(v, str)),
        "flag": lambda: isinstance(value, bool),
        "count": lambda: isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= key.most,
        "number": lambda: _finite(value),
        "positive": lambda: _finite(value) and value > 0,
        "length": lambda: value == "auto" or (_finite(value) and value > 0),
        "wavenumbers": lambda: _wavenumbers(value),
        "vector": lambda: _vector(value),
        "vectors": lambda: _list_of(value, _vector) and len(value) <= key.most,
    }
    fits = tests[key.kind]() and (not key.choices or value in key.choices)
    return None if fits else _wanted(key)


def _wanted(key: Key) -> str:
    if key.choices:
        return " or ".join(f'"{choice}"' for choice in key.choices)
    if key.kind == "count" and key.most < 100_000_000:
        return f"a whole number from 1 to {key.most}"
    if key.kind == "vectors":
        return f"a list of [x, y, z], at most {key.most} of them"
    return WORDS[key.kind]


def _converted(value: Any, kind: str) -> Any:
    if kind == "texts":
        return (value,) if isinstance(value, str) else tuple(value)
    if kind == "wavenumbers" and isinstance(value, dict):
        return tuple(np.linspace(float(value["first"]), float(value["last"]), value["count"]).tolist())
    if kind in ("number", "positive", "length") and isinstance(value, int) and abs(value) > 2**53:
        # beyond the whole numbers of numpy
        return float(value)
    if kind == "wavenumbers":
        return tuple(map(float, value if isinstance(value, list) else [value]))
    return value


def _wavenumbers(value: Any) -> bool:
    if isinstance(value, dict):
        count = value.get("count")
        ends = all(_wavenumber(value.get(name)) for name in ("first", "last"))
        whole = isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= 100_000
        return ends and whole and set(value) == {"first", "last", "count"}
    return _list_of(value if isinstance(value, list) else [value], _wavenumber)


def _wavenumber(value: Any) -> bool:
    return _finite(value) and bool(LEAST_WAVENUMBER <= value <= LARGEST_WAVENUMBER)


def _finite(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        # a whole number that is no float
        return False


def _vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_finite, value))


def _list_of(value: Any, test: Any) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(map(test, value))


def _shown(value: Any) -> str:
    return short(f'"{value}"' if isinstance(value, str) else value)
