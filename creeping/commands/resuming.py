"""Results of a command that come one after the other: kept beside its files until all are there, to go on from.

In the folder of the results ``NAME.parts`` holds what is computed, and ``asked.json`` in it what was asked for. It is
removed when all files are written: ``summary.json`` has then the same under "asked", and "complete" is true.
"""

import json
import shlex
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creeping._progress import EVERY
from creeping._version import __version__
from creeping.errors import CreepingError, InvalidInputError

if TYPE_CHECKING:
    from creeping.storage.parts import Parts

ASKED, SUMMARY = "asked.json", "summary.json"
words: list[str] = []
"""Of the command line that is being run."""


def asked_for(body: str, shape: Any, **options: Any) -> dict[str, Any]:
    """What results depend on, in the words of the command line: the body, options that are given, the version."""
    from creeping.geometry.surface import fingerprint

    named = {f"--{name.replace('_', '-')}": value for name, value in options.items() if value is not None}
    asked = {"body": body, "shape of the body": fingerprint(shape), "version": __version__} | named
    return dict(json.loads(json.dumps(asked, default=str)))


@dataclass
class Unfinished:
    """Parts of a command's results; make one with `begun`.

    Attributes
    ----------
    output : Path
    parts : Path
        Folder of what is computed.
    asked : dict
        See `asked_for`.
    """

    output: Path
    parts: Path
    asked: dict[str, Any]
    _shown: float = field(default_factory=time.monotonic)

    @property
    def again(self) -> str:
        """Command that goes on."""
        return shlex.join(["creeping", *words, *([] if "--resume" in words else ["--resume"])])

    @property
    def has_results(self) -> bool:
        """Whether something of it is stored."""
        return any(self.parts.rglob("c/*")) or any(self.parts.rglob("manifest.json"))

    @property
    def mark(self) -> str:
        """What files say that lack rows."""
        return f"to go on: {self.again}"

    def kept_parts(self) -> "Parts":
        """What keeps arrays by name; see `creeping.storage.parts`."""
        from creeping.storage.parts import Parts

        return Parts(self.parts, self.asked)

    def now_and_then(self, write: Callable[[], None]) -> None:
        """Have what is there written, unless that was done a moment ago."""
        if time.monotonic() - self._shown >= EVERY:
            write()
            self._shown = time.monotonic()

    def write_missing(self, done: int, count: int, file: str) -> None:
        """Write the summary of a file that lacks rows."""
        missing = {"values_done": done, "values": count, "resume": self.again, "files": [file, SUMMARY]}
        self.write_summary(missing, complete=False)

    def write_summary(self, summary: dict[str, Any], *, complete: bool) -> None:
        """Write the summary file, without the seconds, which are those of one run; the parts go when all is written."""
        from creeping.files import write_text

        text = json.dumps({"complete": complete, **_timeless(summary), "asked": self.asked}, indent=1)
        write_text(self.output / SUMMARY, text + "\n")
        if complete:
            shutil.rmtree(self.parts, ignore_errors=True)


def make_folder(folder: Path, asked: Path | None = None) -> None:
    """Make a folder, of results that were ``asked`` for, or in it.

    Raises
    ------
    InvalidInputError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInputError(f"cannot make the folder {asked or folder}: {error}; choose another with -o") from error


def _timeless(value: Any) -> Any:
    """A summary without its seconds."""
    if isinstance(value, dict):
        return {name: _timeless(one) for name, one in value.items() if name != "seconds"}
    return [_timeless(one) for one in value] if isinstance(value, list) else value


def begun(output: Path, name: str, asked: dict[str, Any], *, resume: bool) -> Unfinished | None:
    """Parts of results in a folder, found or to be made by `kept`; None if all was done before.

    Raises
    ------
    InvalidInputError
        If something else was asked for before, or rows are there and ``resume`` is false.
    """
    from creeping.sweeping.plan import differing

    found = Unfinished(output, output / f"{name}.parts", asked)
    before = _read(found.parts / ASKED)
    summary = _read(output / SUMMARY)
    if resume:
        complete = before is None and bool(summary and summary.get("complete"))
        stored = before or (summary or {}).get("asked", {})
        if stored and (names := differing(stored, asked)):
            raise InvalidInputError(f"{output} was begun otherwise: {'; '.join(names)}; give the same, or another -o")
        if complete and stored:
            return None
    elif found.has_results:
        raise InvalidInputError(
            f"{found.parts} has results of a run that has not ended: give --resume to go on with it, or another -o, or "
            "remove it"
        )
    else:
        shutil.rmtree(found.parts, ignore_errors=True)
    return found


def _read(path: Path) -> dict[str, Any] | None:
    from creeping.storage.atomic import bytes_of

    with suppress(OSError, ValueError, RecursionError):
        content = json.loads(bytes_of(path, 10_000_000))
        return content if isinstance(content, dict) else None
    return None


@contextmanager
def kept(unfinished: Unfinished, message: Callable[[str], None]) -> Iterator[None]:
    """Make the folder of the parts, take SIGTERM for an interrupt, and say how to go on where the work is ended."""

    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    from creeping.files import write_text

    make_folder(unfinished.parts, unfinished.output)
    write_text(unfinished.parts / ASKED, json.dumps(unfinished.asked, indent=1) + "\n")
    main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, stop) if main else None
    try:
        yield
    except (KeyboardInterrupt, CreepingError, OSError, MemoryError):
        there = "what is done is kept" if unfinished.has_results else "no value was done yet, so all begins anew"
        message(f"{there}; {unfinished.mark}")
        raise
    finally:
        if main:
            signal.signal(signal.SIGTERM, before)
