"""Bytes and texts changed at random: what storage, transport and editors do to files, and what an attacker would.

All chance comes from the generator that is given, so that a case is known by its numbers.

Also here: values that no caller means: of another kind, size, shape or type than was asked for.
"""

import datetime
import decimal
import fractions
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.random import Generator

NUMBERS = (
    "0", "-0", "-1", "1e308", "1e309", "-1e400", "1e-320", "nan", "NaN", "inf", "-Infinity", "99999999999999999999",
    "2147483648", "-2147483649", "18446744073709551616", "0x10", "1_000", "1,5", "1e", "--1", "1.2.3", "\u0661", "",
)  # fmt: skip
"""What stands in a text where a number stood."""
WORDS = 8
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")

MANY = 10**12


def mutated(data: bytes, rng: Generator, *, other: bytes | None = None, text: bool = False) -> bytes:
    """The bytes after one to four changes, never the same bytes.

    Parameters
    ----------
    data : bytes
    rng : numpy.random.Generator
    other : bytes, optional
        Another file of the kind, parts of which are spliced in.
    text : bool
        Also change numbers and lines as a text's.
    """
    changes: list[Callable[[bytes, Generator], bytes]] = [
        _flipped,
        _overwritten,
        _deleted,
        _inserted,
        _repeated,
        _truncated,
        _zeroed,
    ]
    if text:
        # as often as all changes of bytes together
        changes += [_renumbered] * 4 + [_lines_swapped, _line_dropped, _line_repeated]
    if other is not None:
        changes.append(lambda d, r: _spliced(d, other, r))
    found = data
    for _ in range(int(rng.choice([1, 1, 1, 2, 4]))):
        found = changes[int(rng.integers(len(changes)))](found or b"\0", rng)
    return found if found != data else data + bytes([int(rng.integers(256))])


def _span(data: bytes, rng: Generator) -> tuple[int, int]:
    """Place of a part, usually short."""
    start = int(rng.integers(len(data)))
    longest = int(rng.choice([1, 4, 64, len(data)]))
    return start, min(len(data), start + int(rng.integers(1, longest + 1)))


def _flipped(data: bytes, rng: Generator) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]


def _overwritten(data: bytes, rng: Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:start] + rng.bytes(stop - start) + data[stop:]


def _deleted(data: bytes, rng: Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:start] + data[stop:]


def _inserted(data: bytes, rng: Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:start] + rng.bytes(min(stop - start, 64)) + data[start:]


def _repeated(data: bytes, rng: Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:stop] + data[start:stop] * int(rng.integers(1, WORDS)) + data[stop:]


def _truncated(data: bytes, rng: Generator) -> bytes:
    return data[: int(rng.integers(len(data)))]


def _zeroed(data: bytes, rng: Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:start] + b"\0" * (stop - start) + data[stop:]


def _spliced(data: bytes, other: bytes, rng: Generator) -> bytes:
    start, stop = _span(other, rng)
    at, end = _span(data, rng)
    return data[:at] + other[start:stop] + data[end:]


def _renumbered(data: bytes, rng: Generator) -> bytes:
    places = list(_NUMBER.finditer(data))
    if not places:
        return data
    found = places[int(rng.integers(len(places)))]
    kinds = (
        lambda: NUMBERS[int(rng.integers(len(NUMBERS)))].encode(),
        # a number like the one that stood there
        lambda: f"{rng.normal():.6g}".encode(),
        lambda: str(int(rng.integers(0, 300))).encode(),
        lambda: found[0] + rng.choice([b"0", b"9" * 30, b"e5", b"e999", b"."]),
        lambda: b"-" + found[0],
    )
    return data[: found.start()] + kinds[int(rng.integers(len(kinds)))]() + data[found.end() :]


def _line_at(data: bytes, rng: Generator) -> tuple[list[bytes], int]:
    lines = data.split(b"\n")
    return lines, int(rng.integers(len(lines)))


def _lines_swapped(data: bytes, rng: Generator) -> bytes:
    lines, at = _line_at(data, rng)
    other = int(rng.integers(len(lines)))
    lines[at], lines[other] = lines[other], lines[at]
    return b"\n".join(lines)


def _line_dropped(data: bytes, rng: Generator) -> bytes:
    lines, at = _line_at(data, rng)
    return b"\n".join(lines[:at] + lines[at + 1 :])


def _line_repeated(data: bytes, rng: Generator) -> bytes:
    lines, at = _line_at(data, rng)
    return b"\n".join(lines[: at + 1] + [lines[at]] * int(rng.integers(1, WORDS)) + lines[at + 1 :])


def shuffled_array(array: np.ndarray, rng: Generator) -> np.ndarray:
    """An array with some values replaced by such as kernels do not expect, or of another shape or type."""
    kind = int(rng.integers(5))
    if not array.size:
        return array.astype(np.float32)
    if kind == 0:
        return array[: int(rng.integers(len(array) + 1))]
    if kind == 1:
        return array.astype(rng.choice(["float32", "int8", "complex128", ">f8"]))
    if kind == 2:
        return array.reshape(-1)
    found = np.array(array)
    values = [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e-300, 0.0, -1.0]
    flat = found.reshape(-1)
    chosen = rng.integers(flat.size, size=max(1, flat.size // int(rng.choice([1, 10, 1000]))))
    with np.errstate(all="ignore"):
        flat[chosen] = np.array(rng.choice(values, size=len(chosen))).astype(flat.dtype)
    return found


def _nested(depth: int) -> list[Any]:
    found: list[Any] = []
    for _ in range(depth):
        found = [found]
    return found


def _in_itself() -> list[Any]:
    found: list[Any] = []
    found.append(found)
    return found


def _numbers() -> dict[str, Callable[[], Any]]:
    nan, inf = float("nan"), float("inf")
    plain = [None, True, False, 0, -1, 1, 2, 3, 7, -2.5, 0.5, nan, inf, -inf, 1e300, -1e300, 1e-300, 1e16, 1e-9, -0.0]
    large = [2**31, 2**63, MANY, -MANY, 10**400]
    other = [1j, 2 + 3j, complex(nan, 0), np.float32(2.5), np.longdouble(2.5), np.int8(-3), np.complex64(1 + 1j)]
    other += [np.bool_(True), decimal.Decimal("2.5"), decimal.Decimal("NaN"), fractions.Fraction(5, 2)]
    other += [datetime.datetime(2020, 1, 1), datetime.timedelta(1), np.datetime64("2020-01-01"), np.timedelta64(3, "s")]
    return {_short(value): lambda value=value: value for value in [*plain, *large, *other]}  # type: ignore[misc]


def _texts() -> dict[str, Callable[[], Any]]:
    texts = ["", " ", "abc", "1.0", "soft", "pec", "auto", "nan", "x", "x**2", "\0", "a\nb", "é" * 40, "/proc", "m"]
    found: dict[str, Callable[[], Any]] = {repr(text): lambda text=text: text for text in texts}  # type: ignore[misc]
    found |= {"long text": lambda: "x" * 10**6, "bytes": lambda: b"1.0", "bytearray": lambda: bytearray(24)}
    return found | {
        "no such file": lambda: Path("/nonexistent/file.stl"),
        "a folder of nobody": lambda: Path("/proc"),
        "null device": lambda: Path("/dev/null"),
        "endless device": lambda: Path("/dev/zero"),
        "path with a null": lambda: Path("a\0b"),
        "long name": lambda: Path("a" * 5000),
    }


def _containers() -> dict[str, Callable[[], Any]]:
    return {
        "[]": list,
        "[[]]": lambda: [[]],
        "()": tuple,
        "{}": dict,
        "set": lambda: {1, 2, 3},
        "dict": lambda: {"x": 1.0, "y": 2.0},
        "[1, 2]": lambda: [1, 2],
        "[1, 2, 3]": lambda: [1, 2, 3],
        "[3, 2, 1]": lambda: [3.0, 2.0, 1.0],
        "[0, 0, 0]": lambda: [0, 0, 0],
        "[0, 0, 1e-320]": lambda: [0, 0, 1e-320],
        "[1e300]*3": lambda: [1e300] * 3,
        "four numbers": lambda: [1, 2, 3, 4],
        "[1, nan, 0]": lambda: [1.0, float("nan"), 0.0],
        "[None]*3": lambda: [None] * 3,
        "texts": lambda: ["a", "b", "c"],
        "number texts": lambda: ["1", "0", "0"],
        "[True]*3": lambda: [True, False, False],
        "ragged": lambda: [[1.0, 2.0, 3.0], [4.0]],
        "ragged deep": lambda: [[[1, 2, 3]], [[1, 2, 3], [4, 5, 6]]],
        "deep": lambda: _nested(200),
        "in itself": _in_itself,
        "range": lambda: range(3),
        "huge range": lambda: range(MANY),
        "generator": lambda: (k for k in range(3)),
        "iterator": lambda: iter([1, 2, 3]),
        "map of numbers": lambda: map(float, "123"),
        "many lists": lambda: [[0.0, 0.0, 1.0]] * 300,
        "pair": lambda: ("soft", "hard"),
        "big grid": lambda: (10**6, 10**6),
        "small grid": lambda: (1, 1),
        "negative grid": lambda: (-4, 8),
        "fractions of a grid": lambda: (16.5, 16.5),
    }


def _arrays() -> dict[str, Callable[[], Any]]:
    ones = np.ones((2, 3))
    return {
        "(0,)": lambda: np.zeros(0),
        "(0, 3)": lambda: np.zeros((0, 3)),
        "(3, 0)": lambda: np.zeros((3, 0)),
        "(3,) zeros": lambda: np.zeros(3),
        "0-d": lambda: np.array(2.5),
        "0-d object": lambda: np.array(None),
        "(1, 1)": lambda: np.ones((1, 1)),
        "(2, 2)": lambda: np.ones((2, 2)),
        "(2, 3)": ones.copy,
        "(2, 3) zeros": lambda: np.zeros((2, 3)),
        "(2, 4)": lambda: np.ones((2, 4)),
        "(1, 2, 3)": lambda: np.ones((1, 2, 3)),
        "(5, 1, 1, 1, 3)": lambda: np.ones((5, 1, 1, 1, 3)),
        "(3, 2)": lambda: np.ones((3, 2)),
        "(3, 3)": lambda: np.eye(3),
        "(2, 6)": lambda: np.ones((2, 6)),
        "(2, 10)": lambda: np.ones((2, 10)),
        "(2, 12) nan": lambda: np.full((2, 12), np.nan),
        "(6, 6, 6)": lambda: np.linspace(-1, 1, 216).reshape(6, 6, 6),
        "all nan": lambda: np.full((2, 3), np.nan),
        "all inf": lambda: np.full((2, 3), np.inf),
        "one nan": lambda: np.array([[0.0, 0.0, 1.0], [0.0, np.nan, 1.0]]),
        "all 1e300": lambda: np.full((2, 3), 1e300),
        "all 1e-300": lambda: np.full((2, 3), 1e-300),
        "complex": lambda: ones + 1j,
        "complex without imaginary part": lambda: ones + 0j,
        "objects": lambda: np.array([[object()] * 3]),
        "numbers as objects": lambda: np.array([[1.0, 0.0, 0.0]], dtype=object),
        "None as objects": lambda: np.array([None, None, None]),
        "text array": lambda: np.array([["a", "b", "c"]]),
        "bytes array": lambda: np.array([b"1", b"0", b"0"]),
        "bool array": lambda: np.array([[True, False, False]]),
        "int8": lambda: np.ones((2, 3), dtype=np.int8),
        "uint64": lambda: np.full((2, 3), 2**64 - 1, dtype=np.uint64),
        "half": lambda: np.ones((2, 3), dtype=np.float16),
        "big endian": lambda: np.ones((2, 3), dtype=">f8"),
        "longdouble": lambda: np.ones((2, 3), dtype=np.longdouble),
        "records": lambda: np.zeros(3, dtype=[("x", float), ("y", float)]),
        "dates": lambda: np.array(["2020-01-01"] * 3, dtype="datetime64[D]"),
        "durations": lambda: np.array([[1, 2, 3]], dtype="timedelta64[s]"),
        "masked": lambda: np.ma.masked_array(ones, mask=ones * [0, 1, 0] > 0),
        "all masked": lambda: np.ma.masked_array(ones, mask=True),
        "matrix": lambda: np.asmatrix(ones),
        "strided": lambda: np.ones((8, 9))[::4, ::3],
        "reversed": lambda: ones[::-1, ::-1],
        "read-only": lambda: np.broadcast_to(np.array([0.0, 0.0, 1.0]), (2, 3)),
        "huge view (n, 3)": lambda: np.broadcast_to(np.array([0.0, 0.0, 1.0]), (MANY, 3)),
        "huge view (n,)": lambda: np.broadcast_to(1.0, (MANY,)),
        "ascending": lambda: np.linspace(0, 1, 5),
        "descending": lambda: np.linspace(1, 0, 5),
        "negative times": lambda: np.array([-1.0, 0.0, 1.0]),
    }


def _things() -> dict[str, Callable[[], Any]]:
    return {
        "object": object,
        "class": lambda: int,
        "function": lambda: len,
        "lambda": lambda: lambda *a, **k: None,
        "lambda of three": lambda: lambda a, b, c: None,
        "module": lambda: np,
        "slice": lambda: slice(3),
        "ellipsis": lambda: ...,
        "not implemented": lambda: NotImplemented,
        "exception": lambda: ValueError("x"),
        "memoryview": lambda: memoryview(bytes(24)),
        "memoryview of numbers": lambda: memoryview(np.zeros(3)),  # type: ignore[arg-type]
        "weak thing": lambda: SimpleNamespace(vertices=None, faces=None),
        "thing with arrays": lambda: SimpleNamespace(vertices=np.zeros((3, 3)), faces=[[0, 1, 9]]),
        "thing like a body": lambda: SimpleNamespace(level=None, gradient=None, hessian=None, bounds=None, atlas=None),
        "thing like a flow": lambda: SimpleNamespace(body=None, flow=None, apply=None, horizon=1.0, error=None),
        "thing like a fan": lambda: SimpleNamespace(points=np.zeros((2, 2, 3)), body=None, line=None),
    }


def _short(value: Any) -> str:
    text = f"{type(value).__name__} {value!r}" if not isinstance(value, (int, float)) else repr(value)
    return text if len(text) < 40 else text[:36] + "..."


def bad_values() -> dict[str, Callable[[], Any]]:
    """Makers of the values by name."""
    groups = (_numbers(), _texts(), _containers(), _arrays(), _things())
    found = {name: value for group in groups for name, value in group.items()}
    assert len(found) == sum(map(len, groups)), "two values have one name"
    return found
