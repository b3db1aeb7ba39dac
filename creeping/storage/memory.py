"""How much memory may be asked for: what is too much is refused before it is allocated, with its size and a remedy.

The budget is $CREEPING_MEMORY (bytes, or with K, M, G or T), or half of the memory that is free.
"""

import os
from pathlib import Path

from creeping.errors import InvalidInputError

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
        return 0.5 * _free()
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


def _free() -> float:
    """Memory that is free, bytes."""
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
