"""How much memory may be asked for: what is too much is refused before it is allocated, with its size and a remedy.

The budget is $CREEPING_MEMORY (bytes, or with K, M, G or T), or half of the memory that is free: to the machine, the
container and the process. Also here: libraries of the extras, which an installation may lack.
"""

import os
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from creeping._typing import Any
from creeping.errors import CreepingError, InvalidInputError

UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
UNKNOWN = 8 * 10**9
"""Free memory where the system does not tell."""
ALWAYS = 64 * 10**6
"""Bytes that are not asked about."""


def budget() -> float:
    """Bytes that one array or result may take.

    Raises
    ------
    InvalidInputError
        If $CREEPING_MEMORY is no size.

    Examples
    --------
    >>> budget() > 0
    True
    """
    asked = os.environ.get("CREEPING_MEMORY", "").strip().upper().removesuffix("B")
    if not asked:
        return 0.5 * max(0.0, min(_free(), *_left_to_containers(), *_left_to_the_process()))
    unit = asked[-1] if asked[-1] in UNITS else ""
    try:
        size = float(asked.removesuffix(unit)) * UNITS[unit]
    except ValueError:
        size = -1.0
    if not 0 < size < float("inf"):
        raise InvalidInputError(f"CREEPING_MEMORY = {asked!r} is not a size such as 4G or 500M")
    return size


def within_budget(size: float, what: str, remedy: str, *, asked: float | None = None) -> None:
    """Refuse what would take more bytes than the budget.

    ``asked`` is a number with which the size grows; how much of it fits is said.

    Raises
    ------
    InvalidInputError

    Examples
    --------
    >>> within_budget(1e18, "10000000000 rays", "ask for fewer")
    Traceback (most recent call last):
    ...
    creeping.errors.InvalidInputError: 10000000000 rays would take 1000000000.0 GB...
    """
    if size <= ALWAYS:
        return
    most = budget()
    if not size <= most:
        fits = f" (up to {asked * most / size:.2g})" if asked else ""
        raise InvalidInputError(
            f"{what} would take {size / 1e9:.1f} GB of memory, more than {most / 1e9:.1f} GB; {remedy}{fits}, "
            "or set CREEPING_MEMORY"
        )


def blocks(count: int, each: float) -> list[slice]:
    """Parts of ``count`` rows of ``each`` bytes, as few as fit the budget.

    Examples
    --------
    >>> blocks(5, 1.0)
    [slice(0, 5, None)]
    """
    size = count if count * each <= ALWAYS else max(1, int(max(budget(), ALWAYS) / each))
    return [slice(begin, min(begin + size, count)) for begin in range(0, max(count, 1), max(size, 1))]


def _left_to_containers(
    groups: Path = Path("/proc/self/cgroup"), root: Path = Path("/sys/fs/cgroup")
) -> Iterator[float]:
    """What this process's control ``groups`` and those around them, told of in ``root``, may still take, bytes."""
    try:
        lines = [line.split(":", 2) for line in groups.read_text().splitlines()]
    except OSError:
        return
    for number, kinds, path in lines:
        names = ("memory.max", "memory.current", "inactive_file")
        top = root
        if "memory" in kinds.split(","):
            names, top = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"), root / "memory"
        elif number != "0":
            continue
        # within a container its own group may be called by its name outside, and stand at the top
        below = top / path.lstrip("/")
        for group in {top, below, *below.parents} - set(top.parents):
            # a group without a limit has the word max, the topmost one none
            with suppress(OSError, ValueError):
                most, used = (float((group / name).read_text()) for name in names[:2])
                known = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
                # what the system keeps of files is given up when it is asked for
                yield most - used + float(known.get(names[2], 0))


def _left_to_the_process() -> Iterator[float]:
    """What the limit of its addresses leaves this process, bytes."""
    with suppress(ImportError, OSError, ValueError, IndexError):
        import resource

        most = resource.getrlimit(resource.RLIMIT_AS)[0]
        if most != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
            yield float(most - pages * resource.getpagesize())


def _free() -> float:
    """Memory that is free to the machine, bytes."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024 * float(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return UNKNOWN


def required(package: str, *, use: str, extra: str) -> Any:
    """Import a package of an extra.

    Parameters
    ----------
    package : str
    use, extra : str
        What needs it, and the extra that brings it.

    Raises
    ------
    CreepingError
        If it is missing, with the command that installs it.

    Examples
    --------
    >>> required("json", use="nothing", extra="sweep").dumps(1)
    '1'
    """
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        raise CreepingError(f"{use} {error.name}: pip install 'creeping[{extra}]'") from error
