"""Cases tried in a process of their own, that may die, hang or ask for all memory: each of these is a finding.

The process is started with the name of the attack, the seed and the numbers of the cases; it tells of each case, in a
line, that it begins and what came of it. Whoever is silent for too long is killed, and the next case begun in another.
"""

import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from tests.fuzz.calls import CRASH, FINDINGS, SLOW

LIMIT = 20.0
"""Seconds of a case."""
MEMORY = 4_000_000_000
"""Bytes that the cases may take beyond what the process has when it is ready."""
PREPARING = 600.0
"""Seconds until the first case: kernels are compiled at first use."""
HEAD = f"{'attack':14}" + "".join(
    f"{name:>9} " for name in ("cases", "refused", "accepted", "crash", "class", "too long", "silent")
)


@dataclass
class Finding:
    """A case that did not come out as it must."""

    attack: str
    seed: int
    number: int
    verdict: str
    words: str

    def __str__(self) -> str:
        again = f"python -m tests.fuzz {self.attack} --seed {self.seed} --case {self.number}"
        return f"{self.verdict}: {self.words}\n    {again}"


@dataclass
class Tally:
    """What came of the cases of an attack."""

    attack: str
    counts: Counter[str] = field(default_factory=Counter)
    findings: list[Finding] = field(default_factory=list)
    seconds: float = 0.0
    slowest: float = 0.0

    def row(self) -> str:
        """Line of the table."""
        counts = [self.counts[name] for name in ("refused", "accepted", *FINDINGS)]
        cells = "".join(f"{count:9d} " for count in [sum(self.counts.values()), *counts])
        return f"{self.attack:14}{cells}{self.seconds:8.0f}{self.slowest:9.2f}"


HEAD += f"{'s':>8}{'slowest':>9}"


def run_attack(
    name: str,
    seed: int,
    numbers: range,
    *,
    seconds: float,
    kept: Path | None = None,
    limit: float = LIMIT,
    memory: int = MEMORY,
) -> Tally:
    """Try cases until they or the time are over.

    Parameters
    ----------
    name : str
        Of the attack.
    seed : int
    numbers : range
        Of the cases.
    seconds : float
        Of all cases; what has begun is ended.
    kept : path, optional
        Folder for the inputs of findings.
    limit : float, s
        Of a case.
    memory : int, bytes
        Of the cases.
    """
    tally = Tally(name)
    began = time.monotonic()
    until = began + seconds
    while len(numbers) and time.monotonic() < until:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            child = _Child(name, seed, numbers, Path(folder), memory)
            try:
                at = _follow(child, tally, until, limit, kept)
            finally:
                child.end()
        if at is None:
            break
        numbers = numbers[numbers.index(at) + 1 :]
    tally.seconds = time.monotonic() - began
    return tally


def _follow(child: "_Child", tally: Tally, until: float, limit: float, kept: Path | None) -> int | None:
    """Listen until the process has ended; the case it ended with, or None if all is done."""
    at: int | None = None
    since, patience = time.monotonic(), PREPARING
    while True:
        said = child.line(max(0.0, since + patience - time.monotonic()))
        if said is None or said == {}:
            break
        if "begin" in said:
            at, since, patience = said["begin"], time.monotonic(), limit
        elif "verdict" in said:
            tally.counts[said["verdict"]] += 1
            tally.slowest = max(tally.slowest, said["seconds"])
            if said["verdict"] in FINDINGS:
                _keep(child, tally, said["number"], said["verdict"], said["words"], kept)
            at, since, patience = None, time.monotonic(), limit
            if time.monotonic() > until:
                return None
        elif "done" in said:
            return None
    ended = child.process.poll() if said == {} else None
    if at is None:
        raise RuntimeError(f"the cases of {tally.attack} cannot be prepared: {child.words()}")
    if said is None:
        verdict, words = SLOW, f"more than {limit:g} s"
    else:
        child.process.wait()
        ended = child.process.returncode
        name = signal.Signals(-ended).name if ended < 0 else str(ended)
        verdict, words = CRASH, f"the process ended with {name}: {child.words()}"
    tally.counts[verdict] += 1
    _keep(child, tally, at, verdict, words, kept)
    return at


def _keep(child: "_Child", tally: Tally, number: int, verdict: str, words: str, kept: Path | None) -> None:
    tally.findings.append(Finding(tally.attack, child.seed, number, verdict, words))
    for source in child.folder.glob(f"case-{number}*") if kept is not None else ():
        target = kept / f"{tally.attack}-{child.seed}-{source.name}"  # type: ignore[operator]
        if source.is_dir():
            shutil.copytree(source, target, dirs_exist_ok=True)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)


class _Child:
    """The process that tries cases."""

    def __init__(self, name: str, seed: int, numbers: range, folder: Path, memory: int) -> None:
        self.folder, self.seed = folder, seed
        self.errors: IO[str] = (folder / "errors.txt").open("w+")
        words = [name, str(seed), str(numbers.start), str(numbers.stop), str(numbers.step), str(folder), str(memory)]
        environment = os.environ | {"CREEPING_CACHE": str(folder / "cache")}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.fuzz.child", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            env=environment,
            # what it started ends with it
            start_new_session=True,
        )
        self._selector = selectors.DefaultSelector()
        assert self.process.stdout is not None
        os.set_blocking(self.process.stdout.fileno(), False)
        self._selector.register(self.process.stdout, selectors.EVENT_READ)
        self._held = b""

    def line(self, patience: float) -> dict[str, Any] | None:
        """Next line; empty at the end, None if none comes in time."""
        until = time.monotonic() + patience
        while b"\n" not in self._held:
            if not self._selector.select(max(0.0, until - time.monotonic())):
                return None
            assert self.process.stdout is not None
            more = self.process.stdout.read()
            if not more:
                return {}
            self._held += more
        first, _, self._held = self._held.partition(b"\n")
        return dict(json.loads(first))

    def words(self) -> str:
        """End of what it said on standard error."""
        self.errors.flush()
        return (self.folder / "errors.txt").read_text(errors="replace")[-600:].strip()

    def end(self) -> None:
        """End it and what it started."""
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        self._selector.close()
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.errors.close()
