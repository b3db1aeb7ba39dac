"""MATLAB files (.mat, versions 5 to 7) read: arrays, texts, cells and structs by name.

Every size that the file states is compared with the bytes that are there before anything is made of it, what is packed
is unpacked no further than the limit, and nothing in the file is executed: objects and functions are refused.
"""

from __future__ import annotations

import math
import os
import struct
import zlib
from pathlib import Path

import numpy as np

from creeping._typing import Any
from creeping.errors import InvalidInputError

MOST_BYTES = 512_000_000
"""Of a file, and of all that its unpacking and its values may take."""
DEEPEST = 32
"""Cells and structs in each other."""
HEAD = 128
OF_AN_OBJECT = 256
"""Bytes that a value of a cell or a struct takes at least."""
_MATRIX, _PACKED, _UTF8, _UTF16, _UTF32 = 14, 15, 16, 17, 18
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CELL, _STRUCT, _TEXT = 1, 2, 4
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_OTHERS = {3: "an object", 5: "a sparse array", 16: "a function", 17: "an object"}
_COMPLEX, _LOGICAL = 0x0800, 0x0200
_CODECS = {1: "ascii", 2: "ascii", 4: "utf-16", _UTF8: "utf-8", _UTF16: "utf-16", _UTF32: "utf-32"}


def read_mat(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a MATLAB file, by `write_mat` or another program.

    Parameters
    ----------
    path : str or path

    Returns
    -------
    dict
        By the names of the variables: arrays with the axes that they have in the file, a vector being a column or a
        row; texts as str, with several rows as a list of them; cells as lists, column by column; structs as dicts.

    Raises
    ------
    InvalidInputError
        If it is no such file, damaged, of version 7.3, larger than half a gigabyte when unpacked, or holds objects.

    Examples
    --------
    >>> import tempfile, creeping as cr, scatterers as sc
    >>> from creeping.files import read_mat, write_mat
    >>> line = cr.shadow_line(sc.Sphere(), (0, 0, 1))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mat(f"{folder}/line.mat", line)
    ...     back = read_mat(f"{folder}/line.mat")
    >>> back["direction"].tolist(), back["units"]["points"], bool((back["points"] == line.curves[0].points).all())
    ([[0.0], [0.0], [1.0]], 'L', True)
    """
    file = Path(path)
    try:
        nbytes = file.stat().st_size
        if nbytes > MOST_BYTES:
            raise InvalidInputError(f"{file} has {nbytes / 1e6:.0f} MB; {MOST_BYTES / 1e6:.0f} are the most")
        raw = file.read_bytes()
    except OSError as error:
        raise InvalidInputError(f"cannot read {file}: {error.strerror or error}") from error
    try:
        return _Reader(raw, _order(raw)).variables()
    except _DamageError as error:
        raise InvalidInputError(f"{file} {error}") from None


class _DamageError(Exception):
    """What is wrong with a file, in words that follow its name."""


def _order(raw: bytes) -> str:
    """Order of the bytes, "<" or ">"."""
    orders = {b"IM": "<", b"MI": ">"}
    order = orders.get(raw[HEAD - 2 : HEAD])
    # version 4 has a zero among its first bytes, where the others have text
    if order is None or 0 in raw[:4]:
        raise _DamageError("is no MATLAB file of versions 5 to 7; save it with -v7")
    version = struct.unpack_from(f"{order}H", raw, HEAD - 4)[0]
    if version != 0x0100:
        raise _DamageError("is of version 7.3; save it with -v7" if version == 0x0200 else f"has version {version:#x}")
    return order


class _Reader:
    """Elements of one file; places are bytes from its beginning, or from that of the packed element they are in."""

    def __init__(self, raw: bytes, order: str) -> None:
        self.raw, self.order, self.left = raw, order, MOST_BYTES

    def variables(self) -> dict[str, Any]:
        """Values by name."""
        found: dict[str, Any] = {}
        at, whole = HEAD, memoryview(self.raw)
        while at < len(whole):
            kind, data, at = self._element(whole, at, padded=False)
            if kind == _PACKED:
                inner = self._unpacked(data)
                kind, data, end = self._element(inner, 0)
                if end < len(inner):
                    raise _DamageError(f"has bytes after a packed variable, before byte {at}")
            if kind != _MATRIX:
                raise _DamageError(f"has an element of type {kind} before byte {at}, where a variable should be")
            name, value = self._matrix(data, 0)
            if not name or name in found:
                raise _DamageError(f"has a variable {'named twice: ' + repr(name) if name else 'without a name'}")
            found[name] = value
        return found

    def _take(self, nbytes: int, what: str) -> None:
        """Count bytes that are about to be taken."""
        self.left -= nbytes
        if self.left < 0:
            raise _DamageError(f"takes more than {MOST_BYTES / 1e6:.0f} MB when read, in {what}")

    def _unpacked(self, data: memoryview) -> memoryview:
        worker = zlib.decompressobj()
        try:
            unpacked = worker.decompress(data, max(self.left, 1))
        except zlib.error as error:
            raise _DamageError(f"has a packed variable that is damaged ({error})") from None
        self._take(len(unpacked), "a packed variable")
        if not worker.eof or worker.unused_data:
            ends = "has bytes after its end" if worker.eof else "is cut off, or larger than is read"
            raise _DamageError(f"has a packed variable that {ends}")
        return memoryview(unpacked)

    def _element(self, data: memoryview, at: int, *, padded: bool = True) -> tuple[int, memoryview, int]:
        """Type and bytes of the element at a place, and where the next one begins."""
        if len(data) - at < 8:
            raise _DamageError(f"is cut off: {len(data) - at} bytes where an element should begin")
        first, second = struct.unpack_from(f"{self.order}II", data, at)
        if first >> 16:
            size, kind, start = first >> 16, first & 0xFFFF, at + 4
            if size > 4:
                raise _DamageError(f"has a short element of {size} bytes")
            return kind, data[start : start + size], at + 8
        size, kind, start = second, first, at + 8
        if size > len(data) - start:
            raise _DamageError(f"states {size} bytes of an element where {len(data) - start} are left")
        # the last one may lack its padding
        end = start + (-(-size // 8) * 8 if padded and kind != _PACKED else size)
        return kind, data[start : start + size], min(end, len(data))

    def _matrix(self, data: memoryview, depth: int) -> tuple[str, Any]:
        """Name and value of a variable, a cell or a field."""
        if not len(data):
            return "", np.zeros((0, 0))
        if depth > DEEPEST:
            raise _DamageError(f"has more than {DEEPEST} cells or structs in each other")
        flags, at = self._numbers(data, 0, "u4")
        shape, at = self._numbers(data, at, "i4")
        name, at = self._letters(data, at)
        if len(flags) != 2 or not 2 <= len(shape) <= DEEPEST or min(shape) < 0:
            raise _DamageError(f"has a variable {name!r} with {len(flags)} flags and dimensions {list(shape)[:4]}")
        kind, dims = int(flags[0]) & 0xFF, tuple(int(n) for n in shape)
        count = math.prod(dims)
        if kind in (_CELL, _STRUCT):
            return name, self._inner(data, at, name, dims, depth, named=kind == _STRUCT)
        if kind == _TEXT:
            return name, self._text(data, at, name, dims)
        if kind not in _CLASSES:
            what = _OTHERS.get(kind, f"of class {kind}")
            raise _DamageError(f"has {name!r}, {what}; save numbers, texts, cells and structs")
        parts = []
        for _ in range(2 if int(flags[0]) & _COMPLEX else 1):
            values, at = self._numbers(data, at)
            if len(values) != count:
                raise _DamageError(f"has {len(values)} values of {name!r}, whose dimensions {dims} ask for {count}")
            if not np.can_cast(values.dtype, _CLASSES[kind]):
                raise _DamageError(f"has {name!r} of {_CLASSES[kind]} in numbers of {values.dtype}")
            self._take(count * np.dtype(_CLASSES[kind]).itemsize, name)
            parts.append(values.astype(_CLASSES[kind]))
        self._ends(data, at, name)
        found = parts[0]
        if len(parts) > 1:
            # a sum with 1j times an infinity is no number
            found = np.empty(count, np.result_type(*parts, np.complex64))
            found.real, found.imag = parts
        return name, _shaped(found != 0 if int(flags[0]) & _LOGICAL else found, dims, name)

    def _numbers(self, data: memoryview, at: int, only: str = "") -> tuple[np.ndarray[Any, Any], int]:
        kind, raw, at = self._element(data, at)
        stored = _STORED.get(kind)
        if stored is None or (only and stored != only):
            raise _DamageError(f"has an element of type {kind} where {only or 'numbers'} should be")
        dtype = np.dtype(f"{self.order}{stored}")
        if len(raw) % dtype.itemsize:
            raise _DamageError(f"has {len(raw)} bytes of numbers of {dtype.itemsize} bytes each")
        return np.frombuffer(raw, dtype), at

    def _letters(self, data: memoryview, at: int) -> tuple[str, int]:
        """Text of a name, and the place after it."""
        kind, raw, at = self._element(data, at)
        try:
            if kind not in (1, _UTF8):
                raise _DamageError(f"has a name in an element of type {kind}")
            return bytes(raw).decode("ascii"), at
        except UnicodeDecodeError:
            raise _DamageError("has a name that is no text") from None

    def _text(self, data: memoryview, at: int, name: str, dims: tuple[int, ...]) -> Any:
        kind, raw, at = self._element(data, at)
        self._ends(data, at, name)
        codec = _CODECS.get(kind)
        if codec is None or len(dims) != 2:
            raise _DamageError(f"has a text {name!r} of type {kind} and {len(dims)} dimensions")
        self._take(4 * len(raw), name)
        ordered = codec if codec in ("ascii", "utf-8") else f"{codec}-{'le' if self.order == '<' else 'be'}"
        try:
            text = bytes(raw).decode(ordered)
        except UnicodeDecodeError:
            raise _DamageError(f"has a text {name!r} that is no {codec}") from None
        rows, columns = dims
        # dimensions count characters, or their parts of two bytes
        if rows * columns not in (len(text), len(text.encode("utf-16-le")) // 2):
            raise _DamageError(f"has {len(text)} characters of {name!r}, whose dimensions {dims} ask for more or fewer")
        if rows <= 1 or not text:
            return text
        if len(text) != rows * columns:
            raise _DamageError(f"has a text {name!r} of {rows} rows with characters of several parts")
        self._take(rows * OF_AN_OBJECT, name)
        return [text[row::rows] for row in range(rows)]

    def _inner(self, data: memoryview, at: int, name: str, dims: tuple[int, ...], depth: int, *, named: bool) -> Any:
        """Values of a cell, or of a struct by their names: a dict if it is one, else a list."""
        names, count = [""], math.prod(dims)
        if named:
            width, at = self._numbers(data, at, "i4")
            letters, at = self._letters(data, at)
            size = int(width[0]) if len(width) == 1 else 0
            if size < 1 or len(letters) % size:
                raise _DamageError(f"has a struct {name!r} with {len(letters)} letters of names of {size}")
            names = [letters[k : k + size].partition("\0")[0] for k in range(0, len(letters), size)]
            if "" in names or len(set(names)) < len(names):
                raise _DamageError(f"has a struct {name!r} with fields of no name, or of one name")
        # each has a head at least; of a struct without fields nothing is there that would tell of a wrong number
        if count * len(names) * 8 > len(data) - at or (not names and count > 1):
            raise _DamageError(
                f"has {len(data) - at} bytes of {name!r}, whose dimensions {dims} ask for {count} values"
            )
        self._take(count * (len(names) + 1) * OF_AN_OBJECT, name)
        found: list[dict[str, Any]] = []
        for _ in range(count):
            row: dict[str, Any] = {}
            for field in names:
                kind, inner, at = self._element(data, at)
                if kind != _MATRIX:
                    raise _DamageError(f"has an element of type {kind} in {name!r}")
                row[field] = self._matrix(inner, depth + 1)[1]
            found.append(row)
        self._ends(data, at, name)
        if not named:
            return [row[""] for row in found]
        return found[0] if len(found) == 1 else found

    def _ends(self, data: memoryview, at: int, name: str) -> None:
        if at < len(data):
            raise _DamageError(f"has {len(data) - at} bytes after the values of {name!r}")


def _shaped(values: np.ndarray[Any, Any], dims: tuple[int, ...], name: str) -> np.ndarray[Any, Any]:
    try:
        return values.reshape(dims, order="F")
    except ValueError:
        # no values, and dimensions that no array has
        raise _DamageError(f"has {name!r} of dimensions {dims}") from None
