"""Keys of study files: what a table may hold, and the mistakes of one that holds something else."""

import difflib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creeping._typing import Any

WORDS = {
    "text": "a text in quotes",
    "texts": "a text in quotes, or a list of them",
    "flag": "true or false",
    "count": "a whole number >= 1",
    "number": "a finite number",
    "positive": "a positive finite number",
    "numbers": "a positive number, a list of them, or { first = ..., last = ..., count = ... }",
    "vector": "three finite numbers, [x, y, z]",
    "vectors": "a list of [x, y, z]",
}


@dataclass(frozen=True)
class Key:
    """One key of a table: kind of its value, default, the only values allowed, and the largest count."""

    kind: Literal["text", "texts", "flag", "count", "number", "positive", "numbers", "vector", "vectors"]
    default: Any = None
    required: bool = False
    choices: tuple[str, ...] = ()
    most: int = 100_000_000


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
            mistakes.append(f"[{name}] {key} = {_short(value)} is not {reason}")
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
        "text": lambda: isinstance(value, str),
        "texts": lambda: isinstance(value, str) or _list_of(value, lambda v: isinstance(v, str)),
        "flag": lambda: isinstance(value, bool),
        "count": lambda: isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= key.most,
        "number": lambda: _finite(value),
        "positive": lambda: _finite(value) and value > 0,
        "numbers": lambda: _positives(value),
        "vector": lambda: _vector(value),
        "vectors": lambda: _list_of(value, _vector),
    }
    fits = tests[key.kind]() and (not key.choices or value in key.choices)
    return None if fits else _wanted(key)


def _wanted(key: Key) -> str:
    if key.choices:
        return " or ".join(f'"{choice}"' for choice in key.choices)
    if key.kind == "count" and key.most < 100_000_000:
        return f"a whole number from 1 to {key.most}"
    return WORDS[key.kind]


def _converted(value: Any, kind: str) -> Any:
    if kind == "texts":
        return (value,) if isinstance(value, str) else tuple(value)
    if kind == "numbers" and isinstance(value, dict):
        return tuple(np.linspace(value["first"], value["last"], value["count"]).tolist())
    if kind == "numbers":
        return tuple(map(float, value if isinstance(value, list) else [value]))
    return value


def _positives(value: Any) -> bool:
    if isinstance(value, dict):
        count = value.get("count")
        ends = all(_finite(value.get(name)) and value[name] > 0 for name in ("first", "last"))
        whole = isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= 100_000
        return ends and whole and set(value) == {"first", "last", "count"}
    return _list_of(value if isinstance(value, list) else [value], lambda v: _finite(v) and v > 0)


def _finite(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and bool(np.isfinite(value))


def _vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_finite, value))


def _list_of(value: Any, test: Any) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(map(test, value))


def _short(value: Any) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
