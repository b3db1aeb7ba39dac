"""Mutated files of fields: FEKO text and MATLAB.

What is accepted is read a second time: the text by code of its own, strictly, a MATLAB file by scipy. The same numbers
must come of both, else it is "silent".
"""

import io
import re
import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from studies.fuzz import seeds
from studies.fuzz.attack import ACCEPTED, REFUSED, SILENT, Verdict
from studies.fuzz.mutation import mutated
from studies.fuzz.readers import UnclearError

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)")
CLAIMS = (0, 1, 7, 8, 255, 1 << 16, 1 << 24, (1 << 31) - 8, (1 << 31) - 1, 1 << 31, (1 << 32) - 8, (1 << 32) - 1)
"""Counts and sizes that a header may state."""
HEAD = 128
"""Bytes before the variables of a MATLAB file."""


def described(data: bytes) -> list[tuple[float, Any]]:
    """Frequency and numbers (n, 6) of each block of FEKO text, in the columns' order.

    Raises
    ------
    UnclearError
        If the text has no one meaning.
    """
    blocks: list[tuple[float, Any]] = []
    keys: dict[str, set[str]] = {}
    rows: list[list[float]] = []
    names: list[str] = []
    lines = re.split("\r\n|\r|\n", data.decode(errors="replace"))
    for line in [*map(str.strip, lines), "#"]:
        if not line or line[:2] in ("##", "**"):
            continue
        if not line.startswith("#"):
            words = line.split()
            if len(words) != len(names) or not names:
                raise UnclearError("another number of columns")
            rows.append([_number(words[names.index(name)]) for name in COLUMNS])
            continue
        if rows:
            counts = [int(_only(keys, f"No. of {angle} Samples")) for angle in ("Theta", "Phi")]
            if counts[0] * counts[1] != len(rows):
                raise UnclearError("another number of rows")
            blocks.append((_number(_only(keys, "Frequency")), np.array(rows)))
            keys, rows, names = {}, [], []
        found = re.match(r'#([^:"]*):(.*)', line)
        if found:
            keys.setdefault(found[1].strip(), set()).add(found[2].strip())
        elif '"' in line:
            names = line.split('"')[1::2]
    return blocks


def _only(keys: dict[str, set[str]], name: str) -> str:
    values = keys.get(name, set())
    if len(values) != 1:
        raise UnclearError(f"{len(values)} values of {name}")
    return next(iter(values))


def _number(text: str) -> float:
    if not text.isascii() or "_" in text or not np.isfinite(float(text)):
        raise UnclearError(f"{text!r} is no number")
    return float(text)


class FarFiles:
    """FEKO text (.ffe)."""

    def prepare(self, folder: Path) -> None:
        """Read the file to begin with."""
        self.seed = seeds.far_field_text()
        assert self._compared(self.seed, folder / "seed.ffe") == ""

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change the file and read it twice."""
        from creeping import CreepingError

        try:
            mistake = self._compared(mutated(self.seed, rng, text=True), place.with_suffix(".ffe"))
        except CreepingError as error:
            return Verdict(REFUSED, str(error))
        return Verdict(SILENT, mistake) if mistake else Verdict(ACCEPTED)

    def _compared(self, data: bytes, path: Path) -> str:
        from creeping.files import read_ffe

        path.write_bytes(data)
        found = read_ffe(path)
        try:
            expected = described(data)
        except (UnclearError, ValueError) as error:
            return f"{len(found)} blocks of a file that has no meaning: {error}"
        if len(found) != len(expected):
            return f"{len(found)} blocks, not {len(expected)}"
        for block, (frequency, rows) in zip(found, expected, strict=True):
            field = np.stack([rows[:, 2] - 1j * rows[:, 3], rows[:, 4] - 1j * rows[:, 5]], axis=-1)
            same = block.frequency == frequency and np.array_equal(block.field, field)
            if not (same and np.array_equal(np.stack([block.theta, block.phi], axis=-1), rows[:, :2])):
                return "other numbers than those of the file"
        return ""


class MatFiles:
    """MATLAB files: changed as they are, in what they state of sizes, and within what is packed."""

    def prepare(self, folder: Path) -> None:
        """Read the files to begin with."""
        self.plain, self.packed = seeds.matlab(packed=False), seeds.matlab(packed=True)
        for number, data in enumerate((self.plain, self.packed)):
            assert self._compared(data, folder / f"seed-{number}.mat") == ""

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change a file and read it twice."""
        from creeping import CreepingError

        kinds = (self._bytes, self._bytes, self._claims, self._claims, self._within)
        data = kinds[int(rng.integers(len(kinds)))](rng)
        try:
            mistake = self._compared(data, place.with_suffix(".mat"))
        except CreepingError as error:
            return Verdict(REFUSED, str(error))
        return Verdict(SILENT, mistake) if mistake else Verdict(ACCEPTED)

    def _bytes(self, rng: Generator) -> bytes:
        return mutated(self.plain if rng.random() < 0.8 else self.packed, rng, other=self.packed)

    def _claims(self, rng: Generator) -> bytes:
        """Another number where sizes and dimensions stand."""
        changed = bytearray(self.plain)
        for _ in range(int(rng.choice([1, 1, 2]))):
            at = HEAD + 4 * int(rng.integers((len(changed) - HEAD) // 4))
            struct.pack_into("<I", changed, at, int(rng.choice(CLAIMS)))
        return bytes(changed)

    def _within(self, rng: Generator) -> bytes:
        """One variable changed, and all packed; now and then one that is much larger when unpacked."""
        variables, at = [], HEAD
        while at < len(self.plain):
            size = 8 + struct.unpack_from("<I", self.plain, at + 4)[0]
            variables.append(self.plain[at : at + size])
            at += size
        chosen = int(rng.integers(len(variables)))
        large = rng.random() < 0.05
        variables[chosen] = bytes(int(rng.choice([10**6, 10**9]))) if large else mutated(variables[chosen], rng)
        packed = [zlib.compress(one, 1) for one in variables]
        return self.plain[:HEAD] + b"".join(struct.pack("<II", 15, len(one)) + one for one in packed)

    def _compared(self, data: bytes, path: Path) -> str:
        from scipy.io import loadmat

        from creeping.files import read_mat

        path.write_bytes(data)
        found = read_mat(path)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                expected = loadmat(io.BytesIO(data))
        except Exception as error:
            return f"{', '.join(found)} of a file that scipy does not read: {error!r}"
        names = {name for name in expected if not name.startswith("__")}
        if names != {name for name in found if not name.startswith("__")}:
            return f"variables {sorted(found)}, not {sorted(names)}"
        wrong = [name for name in sorted(names) if not same_values(found[name], expected[name])]
        return f"other values of {', '.join(wrong)}" if wrong else ""


def same_values(found: Any, expected: Any) -> bool:
    """Whether what `creeping.files.read_mat` makes of a variable is what scipy makes of it."""
    if expected.dtype.names is not None:
        rows, theirs = found if isinstance(found, list) else [found], expected.ravel(order="F")
        return len(rows) == len(theirs) and all(
            list(row) == list(expected.dtype.names) and all(same_values(row[name], one[name]) for name in row)
            for row, one in zip(rows, theirs, strict=True)
        )
    if expected.dtype == object:
        items = expected.ravel(order="F")
        return len(items) == len(found) and all(map(same_values, found, items))
    if expected.dtype.kind == "U":
        # numpy drops what is 0 at the end of a text
        rows = [row.rstrip("\0") for row in ([found] if isinstance(found, str) else found)]
        return rows == expected.ravel().tolist() or (not expected.size and not any(rows))
    if isinstance(found, np.ndarray) and found.dtype == bool:
        # scipy gives the numbers behind
        expected = expected != 0
    return bool(np.shape(found) == expected.shape and np.array_equal(found, expected, equal_nan=True))
