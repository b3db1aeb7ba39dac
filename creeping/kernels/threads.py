"""Work on rays in threads: compiled kernels release the interpreter, so chunks of rays run side by side."""

import os
from collections.abc import Callable
from functools import cache

from creeping._typing import Any
from creeping.errors import InvalidInputError

LEAST = 2048
"""Fewest rays worth a thread."""
CHUNK = 64
"""Chunks end at multiples of this, the kernels' block: results do not depend on the number of threads."""


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


@cache
def _pool(threads: int) -> Any:
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(threads, thread_name_prefix="creeping")


def in_threads(work: Callable[[slice], None], count: int, *, least: int = LEAST, multiple: int = CHUNK) -> None:
    """Call ``work`` on slices that cover range(count), at least ``least`` a thread, in as many threads as pay."""
    threads = min(thread_count(), max(1, count // least))
    if threads == 1:
        work(slice(0, count))
        return
    # more chunks than threads: rays of one region may cost more than those of another
    chunk = -(-count // (4 * threads * multiple)) * multiple
    parts = [slice(start, min(start + chunk, count)) for start in range(0, count, chunk)]
    # consume the results, or an exception of a chunk would be lost
    for _ in _pool(thread_count()).map(work, parts):
        pass
