"""What an attack is: a kind of cases, each known by the seed and its number."""

import traceback
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.random import Generator

REFUSED, ACCEPTED = "refused", "accepted"
CRASH, WRONG, SLOW, SILENT = "crash", "wrong class", "too long", "silent"
FINDINGS = (CRASH, WRONG, SLOW, SILENT)
"""Verdicts that must not come."""


@dataclass(frozen=True)
class Verdict:
    """What came of a case, and the words of the error or of the finding."""

    kind: str
    words: str = ""


class Attack(Protocol):
    """Cases of one kind.

    ``prepare`` is called once in the process that tries the cases, with a folder of its own; it makes the seeds and
    compiles what is compiled at first use. ``attempt`` makes a case with the generator, leaves what it tries in the
    file or folder ``place`` before it tries it, and judges what comes of it.
    """

    def prepare(self, folder: Path) -> None:
        """Make ready."""
        ...

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Make, keep and try a case."""
        ...


def generator(name: str, seed: int, number: int) -> Generator:
    """Source of all chance of a case."""
    return np.random.default_rng([seed, zlib.crc32(name.encode()), number])


def failure(error: BaseException, *allowed: type[BaseException]) -> Verdict:
    """Verdict on an exception: a refusal if its class is allowed, a finding otherwise."""
    words = f"{type(error).__name__}: {error}"[:300]
    if isinstance(error, allowed):
        return Verdict(REFUSED, words)
    last = traceback.extract_tb(error.__traceback__)[-1:]
    where = "".join(f" at {frame.filename}:{frame.lineno}" for frame in last)
    return Verdict(WRONG, words + where)
