"""Bytes and texts changed at random: what storage, transport and editors do to files, and what an attacker would.

All chance comes from the generator that is given, so that a case is known by its numbers.
"""

import re
from collections.abc import Callable

import numpy as np
from numpy.random import Generator

NUMBERS = (
    "0", "-0", "-1", "1e308", "1e309", "-1e400", "1e-320", "nan", "NaN", "inf", "-Infinity", "99999999999999999999",
    "2147483648", "-2147483649", "18446744073709551616", "0x10", "1_000", "1,5", "1e", "--1", "1.2.3", "\u0661", "",
)  # fmt: skip
"""What stands in a text where a number stood."""
WORDS = 8
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


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
