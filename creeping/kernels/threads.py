"""Work on rays in slices, in as many threads as pay, that an interrupt ends within about a second.

Compiled kernels release the interpreter, and no handler of a signal runs before they return. So they are given slices
of some SLICE seconds, by the time that the last one took, the first of them short; slices end at multiples of the
kernels' block, and results depend neither on them nor on the number of threads. Kernels whose single block may take
longer return by themselves after a number of steps, and are called until they are done, with `pause` in between.
"""

import os
import threading
from collections.abc import Callable
from functools import cache
from time import perf_counter

from creeping._typing import Any
from creeping.errors import InvalidInputError

BLOCK = 64
"""Rays of a kernel's block. Slices end at multiples of it: results do not depend on them."""
SLICE = 0.1
"""Seconds that a kernel may keep the signals waiting."""


class _Stopped(BaseException):
    """Ends the work of a thread whose caller has given up."""


_team = threading.local()
_PROCESS = os.getpid()


def pause() -> None:
    """Between two calls of a kernel: let a thread end if its caller has been interrupted or another one has failed."""
    stop = getattr(_team, "stop", None)
    if stop is not None and stop.is_set():
        raise _Stopped


def thread_count() -> int:
    """Threads to use: $CREEPING_THREADS, or the cores this process may run on.

    Raises
    ------
    InvalidInputError
        If $CREEPING_THREADS is not a whole number >= 1.
    """
    named = os.environ.get("CREEPING_THREADS")
    if named is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    if not named.isdigit() or int(named) < 1:
        raise InvalidInputError(f"CREEPING_THREADS = {named!r} is not a whole number >= 1")
    return int(named)


def openmp_threads(most: int) -> int:
    """Threads of a library that works by OpenMP: up to ``most``, but one in a forked process.

    There GNU's OpenMP waits for ever for the threads of the process that was forked.
    """
    return min(most, thread_count()) if os.getpid() == _PROCESS else 1


@cache
def _pool(threads: int, process: int) -> Any:
    """Threads of a process: a fork has the pool of its parent, but not its threads."""
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(threads, thread_name_prefix="creeping")


class _Slices:
    """Slices of range(count), handed out one after the other; unless ``even``, as long as their time allows."""

    def __init__(self, count: int, first: int, most: int, multiple: int, *, even: bool) -> None:
        self._count, self._most, self._multiple, self._even = count, max(multiple, most), multiple, even
        self._next, self._size = 0, self._whole(most if even else first)
        self._lock = threading.Lock()

    def _whole(self, rows: float) -> int:
        return max(self._multiple, int(min(rows, self._most)) // self._multiple * self._multiple)

    def work(self, work: Callable[[slice], None]) -> None:
        """Call ``work`` on slices until none is left."""
        while True:
            pause()
            with self._lock:
                part = slice(self._next, min(self._next + self._size, self._count))
                self._next = part.stop
            if part.start >= part.stop:
                return
            began = perf_counter()
            work(part)
            if not self._even:
                share = SLICE / max(perf_counter() - began, 1e-9)
                self._size = self._whole((part.stop - part.start) * min(4.0, max(0.25, share)))


def in_slices(work: Callable[[slice], None], count: int, *, multiple: int = BLOCK) -> None:
    """Call ``work`` on slices that cover range(count), one after the other, in this thread.

    Parameters
    ----------
    work : callable
        What it does for a row must not depend on the slice.
    count : int
    multiple : int
        Slices end at multiples of this.
    """
    _Slices(count, BLOCK, count + multiple, multiple, even=False).work(work)


def in_threads(
    work: Callable[[slice], None],
    count: int,
    *,
    least: int = 2048,
    multiple: int = BLOCK,
    first: int = BLOCK,
    most: int | None = None,
    even: bool = False,
) -> None:
    """Do what `in_slices` does, in as many threads as pay, at least ``least`` rows a thread.

    An interrupt, or an error in one thread, ends the others after their slices.

    Parameters
    ----------
    work, count, multiple
        As for `in_slices`.
    least : int
        Fewest rows worth a thread; of rays by default.
    first : int
        Rows of the first slice, before it is known what one takes.
    most : int, optional
        Rows of the longest slice.
    even : bool
        Whether slices are equal, for kernels that come up by themselves.
    """
    threads = min(thread_count(), max(1, count // least))
    if getattr(_team, "stop", None) is not None:
        # threads that wait for threads of their own pool would wait for ever
        threads = 1
    longest = count + multiple
    if threads > 1:
        # more slices than threads: rays of one region may cost more than those of another
        longest = -(-count // (4 * threads * multiple)) * multiple
    longest = min(longest, most or longest)
    slices = _Slices(count, first, longest, multiple, even=even)
    if threads == 1:
        slices.work(work)
        return
    from concurrent.futures import wait

    stop = threading.Event()

    def join() -> None:
        _team.stop = stop
        try:
            slices.work(work)
        except BaseException:
            stop.set()
            raise
        finally:
            _team.stop = None

    futures = [_pool(thread_count(), os.getpid()).submit(join) for _ in range(threads)]
    try:
        # where a signal does not end a wait it is seen after it
        while wait(futures, timeout=SLICE).not_done:
            continue
    except BaseException:
        # their slices are short, and what they write must not change once this has returned
        stop.set()
        wait(futures)
        raise
    for future in futures:
        failure = future.exception()
        if failure is not None and not isinstance(failure, _Stopped):
            raise failure
