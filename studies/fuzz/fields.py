"""Mutated files of fields: FEKO text.

What is accepted is read a second time, by code of its own, strictly. The same numbers must come of both, else it is
"silent".
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from studies.fuzz import seeds
from studies.fuzz.attack import ACCEPTED, REFUSED, SILENT, Verdict
from studies.fuzz.mutation import mutated
from studies.fuzz.readers import UnclearError

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)")


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
