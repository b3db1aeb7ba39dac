"""What is done and what is left, on standard error: a bar on a terminal or in a notebook, lines now and then elsewhere.

A clock of its own tells of a stage that takes long, of what deeper levels say that they do, and of kernels that are
being compiled.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

EVERY = 5.0
"""Seconds between lines: as long as one waits without a doubt that something happens."""
BAR = 30
"""Characters of a notebook's bar."""

_words = ""


def say(words: str) -> None:
    """Say what is being done, to whoever shows the progress of it."""
    global _words
    _words = words


def _now() -> str:
    # it stands above
    kernels: Any = sys.modules.get("creeping.kernels.first_use")
    return "compiling kernels, once for this installation" if kernels and kernels.is_compiling() else _words


def duration(seconds: float) -> str:
    """Time as people say it.

    Examples
    --------
    >>> duration(0.02), duration(42.0), duration(600.0), duration(8000.0)
    ('a second', '42 s', '10 min', '2.2 h')
    """
    if seconds < 90:
        return "a second" if seconds < 1.5 else f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.2g} h"


class Progress:
    """Progress of one job; a context.

    Parameters
    ----------
    what : str
        What is counted, e.g. "incidences".
    quiet : bool
        Whether nothing is shown but `message`.
    """

    def __init__(self, what: str = "", *, quiet: bool = False) -> None:
        self.what, self.quiet = what, quiet
        self._stage, self._since = "", time.monotonic()
        self._begun = 0.0
        self._first: tuple[float, float] | None = None
        self._last: tuple[float, int, float] = (0.0, 0, self._since)
        self._shown, self._lock, self._ended = self._since, threading.Lock(), threading.Event()
        self._clock = threading.Thread(target=self._tick, name="creeping progress", daemon=True)
        self._bar: Any = None
        self._bars: Any = nullcontext()
        self._cell: Any = None

    def __enter__(self) -> "Progress":
        say("")
        if self.quiet:
            return self
        self._cell = _notebook_cell()
        if self._cell is None and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
            self._bars = Progress(*columns, console=Console(stderr=True))
            self._bar = self._bars.add_task("starting", total=None)
        self._bars.__enter__()
        self._clock.start()
        return self

    def __exit__(self, *details: Any) -> None:
        self._ended.set()
        if self._clock.is_alive():
            self._clock.join()
        if self._bar is not None or self._cell is not None:
            self._draw()
        self._bars.__exit__(*details)

    def __call__(self, text: str) -> None:
        """Show the stage that is begun."""
        say("")
        self._stage, self._since = text, time.monotonic()
        if self._bar is not None or self._cell is not None:
            self._draw()
        elif not self.quiet:
            self._print(f"{text} ...")

    def note(self, text: str) -> None:
        """Show what is to stay."""
        if not self.quiet:
            self.message(text)

    def message(self, text: str) -> None:
        """Show what must be known, quiet or not."""
        if self._bar is not None:
            self._bars.console.print(f"creeping: {text}", highlight=False, markup=False, soft_wrap=True)
        else:
            self._print(text)

    def begin(self, done: float, total: int) -> None:
        """Say how many are done already."""
        self._begun, self._last, self._since = done, (done, total, time.monotonic()), time.monotonic()

    def told(self, done: float, total: int, _: float = 0.0) -> None:
        """Show how many are done."""
        now = time.monotonic()
        if self._first is None:
            self._first = (done, now)
        self._last = (done, total, now)
        if self._bar is not None or self._cell is not None:
            self._draw()
        elif not self.quiet and (done == total or now - self._shown >= EVERY):
            self._print(self._line())

    @property
    def done_now(self) -> int:
        """How many were done since `begin`."""
        return int(self._last[0] - self._begun)

    def left(self) -> float:
        """Seconds left, by what came after the first part, which may have had to compile; 0 where it is not known."""
        done, total, now = self._last
        first, then = self._first or (0.0, 0.0)
        return (total - done) * (now - then) / (done - first) if done > first else 0.0

    def _line(self) -> str:
        done, total, told = self._last
        now, doing = time.monotonic(), _now()
        if not total:
            return f"{self._stage or 'starting'}, {duration(now - self._since)}" + f": {doing}" * bool(doing)
        rest = max(self.left() - (now - told), 0.0)
        left = f", {duration(rest)} left" if self.left() else f", {duration(now - self._since)} so far" * (done < total)
        doing = doing if done < total else ""
        return f"{int(done)} of {total}{f' {self.what}' if self.what else ''}{left}" + f": {doing}" * bool(doing)

    def _tick(self) -> None:
        while not self._ended.wait(min(EVERY, 1.0)):
            if self._bar is not None or self._cell is not None:
                self._draw()
            elif time.monotonic() - self._shown >= EVERY - 0.5:
                self._print(self._line())

    def _draw(self) -> None:
        done, total, _ = self._last
        line = self._line()
        if self._bar is not None:
            self._bars.update(self._bar, description=line, completed=done, total=total or None)
        else:
            filled = int(BAR * done / total) if total else 0
            with self._lock:
                self._cell({"text/plain": f"[{'=' * filled}{' ' * (BAR - filled)}] {line}"})

    def _print(self, text: str) -> None:
        self._shown = time.monotonic()
        with self._lock:
            print(f"creeping: {text}", file=sys.stderr, flush=True)


@contextmanager
def reporting(progress: Callable[..., None] | bool | None, what: str) -> Iterator[Callable[..., None] | None]:
    """What a call with ``progress=`` tells of its numbers: a function of its own, a bar for True, nothing for None."""
    if progress is True:
        with Progress(what) as bar:
            yield bar.told
    else:
        yield progress or None


@contextmanager
def telling(progress: Callable[[str], None] | bool | None) -> Iterator[Callable[[str], None]]:
    """The same of a call that tells in words."""
    if progress is True:
        with Progress() as bar:
            yield bar
    else:
        yield progress or say


def _notebook_cell() -> Callable[[Any], None] | None:
    """What replaces a text in the output of a notebook's cell; None outside of notebooks."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if not hasattr(shell, "kernel"):
        return None
    from importlib import import_module

    handle = import_module("IPython.display").display({"text/plain": ""}, raw=True, display_id=True)
    return lambda content: handle.update(content, raw=True)
