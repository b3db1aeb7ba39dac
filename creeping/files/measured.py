"""A measured or published cut of others: levels against an angle or a frequency, by columns under any usual header.

Numbers stand in rows, with commas, semicolons, tabs or spaces between them; lines that begin with #, %, ! or // are
comments. A header names the columns; without one the first is the angle in degrees, the others levels in dB.
"""

import os
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import InvalidInputError
from creeping.storage.atomic import opened

MOST_BYTES = 200_000_000
"""Largest file that is read."""
MOST_ROWS, MOST_NUMBERS = 1_000_000, 20_000_000
"""Rows of a table, and numbers in all of them."""
LONGEST = 65_536
"""Characters of a line."""
HERTZ = {"ghz": 1e9, "mhz": 1e6, "khz": 1e3, "hz": 1.0}
_ANGLE = re.compile(r"(angle|azimuth|phi|elev|theta|aspect|incidence|deg|(?<![a-z])(az|el)(?![a-z]))")
_POLARISATION = re.compile(r"(?<![a-z])(hh|vv|hv|vh)(?![a-z])")


@dataclass(frozen=True, eq=False)
class MeasuredCut:
    """Measured or published levels over an angle or over frequency, an array for each column of the file.

    Attributes
    ----------
    name : str
        Name of the file.
    over : {"angle", "frequency"}
    values : (m,)
        Angles, degrees, or frequencies, Hz, ascending.
    levels : dict of str to (m,), dB
        Levels by name of the column; NaN where the file has no number.
    polar : bool
        Whether the angles are polar angles or elevations, by the name of their column; these have no period of 360.
    """

    name: str
    over: str
    values: FloatArray
    levels: dict[str, FloatArray]
    polar: bool = False

    def of(self, channel: str) -> FloatArray | None:
        """Levels (m,), dB, of a polarisation or boundary, or of the only column; None if there is no such column."""
        for name, levels in self.levels.items():
            found = _POLARISATION.search(name.lower())
            if name.lower() == channel.lower() or (found and found[1] == channel.lower()):
                return levels
        unnamed = [v for name, v in self.levels.items() if not _POLARISATION.search(name.lower())]
        return unnamed[0] if len(unnamed) == 1 == len(self.levels) else None


def read_cut(path: str | os.PathLike[str]) -> MeasuredCut:
    """Read measured or published levels from a table in a text file.

    Parameters
    ----------
    path : str or path
        Text with one row for each angle or frequency. Columns of areas ("sigma (m2)") are converted to decibels.

    Raises
    ------
    InvalidInputError
        If the file holds no such table, or is too large; the message gives the columns found, or the line number.
    """
    file = Path(path)
    header, numbers = _table(file)
    names = header or ["angle", *(f"level {i}" for i in range(1, numbers.shape[1]))]
    at, over, scale = _abscissa(file, names, numbers)
    levels = {}
    other = re.compile(r"(phase|error|uncertain|unresolved|method|(?<![a-z])(re|im)(?![a-z]))")
    for column, name in enumerate(names):
        lower = name.lower()
        if column == at or other.search(lower) or _is_frequency(lower) or (_ANGLE.search(lower) and not _level(lower)):
            continue
        values = numbers[:, column]
        if re.search(r"(m2|m\^2|sqm|sigma|linear)", lower) and "db" not in lower:
            with np.errstate(divide="ignore", invalid="ignore"):
                values = 10 * np.log10(values)
        levels[name] = values
    if not levels:
        raise InvalidInputError(f"{file} has no column of levels; its columns are {_listed(names)}")
    order = np.argsort(numbers[:, at], kind="stable")
    polar = over == "angle" and bool(re.search(r"(elev|theta|(?<![a-z])el(?![a-z]))", names[at].lower()))
    found = {name: v[order] for name, v in levels.items()}
    return MeasuredCut(file.name, over, scale * numbers[order, at], found, polar)


def _table(file: Path) -> tuple[list[str], FloatArray]:
    """Header, empty if there is none, and numbers by row and column, NaN for what is none."""
    headers: list[list[str]] = []
    # a list of lists would take ten times the memory
    numbers, rows, columns, bare = array("d"), 0, 0, False
    for number, line in lines_of(file, MOST_BYTES, LONGEST):
        comment = line.startswith(("#", "%", "!", "//"))
        cells = _cells(line.lstrip("#%!/ ") if comment else line)
        values = [_number(cell) for cell in cells]
        if comment or not any(value is not None for value in values):
            if rows and not comment:
                raise InvalidInputError(f"{file}, line {number}: words after rows of numbers; give one table in a file")
            if not rows:
                headers.append(cells)
                bare |= not comment
                if len(headers) > 10_000:
                    raise InvalidInputError(f"{file}, line {number}: more than 10000 lines above the numbers")
            continue
        if rows and len(values) != columns:
            raise InvalidInputError(f"{file}, line {number}: {len(values)} columns where {columns} were before")
        numbers.extend(np.nan if value is None else value for value in values)
        rows, columns = rows + 1, len(values)
        if rows > MOST_ROWS or len(numbers) > MOST_NUMBERS:
            what = f"{MOST_ROWS} rows" if rows > MOST_ROWS else f"{MOST_NUMBERS} numbers"
            raise InvalidInputError(f"{file}, line {number}: more than {what}; split the file")
    if rows < 2 or columns < 2:
        raise InvalidInputError(f"{file} has no table of two columns and two rows of numbers or more")
    # the last line of words above the numbers that has as many cells names them
    header = next((cells for cells in reversed(headers) if len(cells) == columns), [])
    if bare and not header:
        raise InvalidInputError(f"{file} has {columns} columns, and no line that names as many")
    if len(set(header)) < len(header):
        raise InvalidInputError(f"{file} names columns twice: {_listed(header)}")
    return header, np.array(numbers).reshape(rows, columns)


def lines_of(file: Path, most_bytes: int, longest: int) -> Iterator[tuple[int, str]]:
    """Lines of a text file that are not empty, with their numbers.

    Of a line without an end no more is read than is needed to refuse it.

    Raises
    ------
    InvalidInputError
        If it cannot be read, or a line is too long.
    """
    try:
        with TextIOWrapper(opened(file, most_bytes), encoding="utf-8-sig", errors="replace") as stream:
            for number, raw in enumerate(iter(lambda: stream.readline(longest + 2), ""), 1):
                if len(raw) > longest + 1:
                    raise InvalidInputError(f"{file}, line {number}: more than {longest} characters")
                if line := raw.strip():
                    yield number, line
    except OSError as error:
        raise InvalidInputError(f"cannot read {file}: {error.strerror or error}") from error


def _listed(names: list[str]) -> str:
    """Names as a message has them: the first twelve, each cut if long."""
    more = f", and {len(names) - 12} more" * (len(names) > 12)
    return ", ".join(name[:40] for name in names[:12]) + more


def _cells(line: str) -> list[str]:
    for separator in (";", "\t", ","):
        if separator in line:
            return [cell.strip().strip('"') for cell in line.split(separator)]
    return line.split()


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _is_frequency(name: str) -> bool:
    return "freq" in name or any(re.search(rf"(?<![a-z]){unit}(?![a-z])", name) for unit in HERTZ)


def _abscissa(file: Path, names: list[str], numbers: FloatArray) -> tuple[int, str, float]:
    """Column of the angle or frequency that varies, which of both, and its unit in degrees or Hz."""
    found = []
    for column, name in enumerate(name.lower() for name in names):
        if _is_frequency(name):
            found.append((column, "frequency", next((size for unit, size in HERTZ.items() if unit in name), 1.0)))
        elif _ANGLE.search(name) and not _level(name):
            radians = re.search(r"(?<![a-z])rad(ian)?s?(?![a-z])", name)
            found.append((column, "angle", float(np.degrees(1.0)) if radians else 1.0))
    varied = [one for one in found if len(np.unique(numbers[:, one[0]])) > 1]
    if len(varied) > 1:
        raise InvalidInputError(f"{file} varies {' and '.join(names[one[0]] for one in varied)}; give a cut of one")
    at = (varied or found or [(0, "angle", 1.0)])[0]
    if not np.all(np.isfinite(numbers[:, at[0]])):
        raise InvalidInputError(f"{file} has rows without a number in the column {names[at[0]]}")
    return at


def _level(name: str) -> bool:
    return "db" in name or bool(_POLARISATION.search(name))
