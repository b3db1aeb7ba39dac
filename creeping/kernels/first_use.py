"""The first use of kernels: it is said that they are compiled, and another process compiles ahead on a second core.

A compiled kernel is kept on disk, so this happens once an installation. numba compiles in one thread at a time, but a
process finds what another one has put into the cache: `creeping.commands.upkeep` runs a small job of its own
with the kernels that the caller comes to later. It ends with the process that has started it, and what becomes of it
changes no result: what it has not compiled is compiled where it is needed.
"""

import atexit
import gc
import logging
import multiprocessing
import os
import subprocess
import sys
import threading
from importlib.metadata import version
from pathlib import Path

from numba.core import event as events

from creeping._typing import Any
from creeping.kernels.threads import thread_count

AHEAD = "creeping.commands.upkeep"
"""Module that compiles ahead; by name, for it stands above."""
STAMP = "ahead.done"
"""File that says for which sources all has been compiled."""
PATIENT = 50_000, 50, 100
"""Thresholds of the garbage collector while kernels are compiled: a compiler's objects live long, and there are many;
with those of Python it takes an eighth of the time."""


_watching: list["_FirstUse"] = []


class _FirstUse(events.Listener):  # type: ignore[misc]
    """Hears of every compilation, and of those within it; kernels may be compiled in several threads."""

    def __init__(self, folder: Path, digest: str) -> None:
        self.folder, self._digest = folder, digest
        self._lock, self.depth, self._told, self._begun = threading.Lock(), 0, False, False
        self._thresholds = gc.get_threshold()

    def on_start(self, event: Any) -> None:
        """Tell of the first kernel, start to compile ahead, and let the garbage wait."""
        with self._lock:
            self.depth += 1
            if self.depth == 1:
                self._thresholds = gc.get_threshold()
                if gc.isenabled():
                    gc.set_threshold(*PATIENT)
            function = getattr(event.data["dispatcher"], "py_func", None)
            module = getattr(function, "__module__", None) or ""
            if self._told or not module.startswith("creeping."):
                return
            self._told = True
        if multiprocessing.parent_process() is not None:
            return
        # commands say it themselves
        if AHEAD not in sys.modules:
            logging.getLogger("creeping").warning(
                "creeping: compiling kernels, once for this installation: half a minute"
            )
        self.begin(module)

    def begin(self, first: str) -> None:
        """Compile ahead from now on, once."""
        if not self._begun and may_start(self.folder, self._digest):
            self._begun = True
            start(first, self.folder, self._digest)

    def on_end(self, event: Any) -> None:
        """Have the garbage collected as before."""
        with self._lock:
            self.depth -= 1
            if self.depth == 0:
                gc.set_threshold(*self._thresholds)


def watch(folder: Path, digest: str) -> None:
    """Tell of compilations from now on; ``folder`` keeps compiled kernels of the sources with this ``digest``."""
    versions = f"{digest} numba {version('numba')} {sys.implementation.cache_tag}"
    _watching.append(_FirstUse(folder, versions))
    events.register("numba:compile", _watching[-1])


def begin(first: str) -> None:
    """Compile ahead for who comes to the kernels of the module ``first`` soon, where those of rays are not yet kept."""
    for listener in _watching:
        # kernels in the same folder that every trace of rays has
        if not any(listener.folder.glob("exponential.*.nbi")):
            listener.begin(first)


def is_compiling() -> bool:
    """Whether a kernel is being compiled."""
    return any(listener.depth > 0 for listener in _watching)


def is_done(folder: Path, digest: str) -> bool:
    """Whether all that is compiled ahead has been."""
    try:
        return (folder / STAMP).read_text() == digest
    except OSError:
        return False


def may_start(folder: Path, digest: str) -> bool:
    """Whether there is a second core, work to do, a cache to keep it in, and a Python to start.

    Not under tests, which start many processes.
    """
    return (
        thread_count() > 1
        and "pytest" not in sys.modules
        and not is_done(folder, digest)
        and os.access(next(path for path in (folder, *folder.parents) if path.exists()), os.W_OK)
        # of a program that has Python built in, sys.executable is that program
        and Path(sys.executable or "").name.lower().startswith("python")
    )


def start(first: str, folder: Path, digest: str) -> None:
    """Start the process; ``first`` is the module of the kernel that this one compiles first."""
    # modules come from where this process has them, and not from the folder it happens to be in
    arguments = f"{first!r}, {str(folder)!r}, {digest!r}"
    code = f"import sys; sys.path[:] = {sys.path!r}; from {AHEAD} import main; main({arguments})"
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            # it ends when this pipe does, however this process ends
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"CREEPING_THREADS": "1"},
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError:
        return
    atexit.register(_end, process)


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.communicate()
