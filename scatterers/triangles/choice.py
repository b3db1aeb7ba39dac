"""What of a file is the body, and what is done to make it one closed surface."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.parts import capped, chosen_part, united
from scatterers.triangles.sheets import taken_apart
from scatterers.triangles.topology import cleaned, oriented

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Choice:
    """What of a file is the body, and what may be done to it.

    Attributes
    ----------
    part : str, int or None
        "largest", a number from 1, or a name; None: there is to be one only.
    cap : float or None
        Holes up to this size, m, are closed.
    union : bool
        The outer surface of all parts is taken.
    subdivide : "auto", int or None
        Loop's subdivision, so many times.
    every : bool
        All closed parts are the body, where none is chosen.
    """

    part: str | int | None = None
    cap: float | None = None
    union: bool = False
    subdivide: str | int | None = None
    every: bool = False

    def __post_init__(self) -> None:
        part, cap, times = self.part, self.cap, self.subdivide
        if part is not None and (isinstance(part, bool) or not isinstance(part, (str, int)) or part in ("", 0)):
            raise ValueError(f'part = {part!r}; give "largest", a number from 1, or a name of the file')
        if cap is not None and (isinstance(cap, bool) or not isinstance(cap, (int, float)) or not cap > 0):
            raise ValueError(f"cap = {cap!r} is no size in m; give that of the largest hole to be closed, inf for all")
        if not isinstance(self.union, bool):
            raise ValueError(f"union = {self.union!r} is neither True nor False")
        if isinstance(times, bool) or times not in (None, "auto", 1, 2, 3):
            raise ValueError(f'subdivide = {times!r}; give 1, 2 or 3 times, or "auto"')

    @property
    def text(self) -> list[Any]:
        """Plain values that change with it."""
        return [self.part, None if self.cap is None else float(self.cap), self.union, self.subdivide]


def whole_body(
    name: str,
    vertices: FloatArray,
    triangles: IntArray,
    choice: Choice,
    scale: float,
    note: Callable[[str], None],
    *,
    named: bool = False,
) -> tuple[FloatArray, IntArray]:
    """The body that is chosen, with its holes closed, in the unit of the file."""
    vertices, triangles = taken_apart(name, vertices, triangles, note)
    if choice.part is not None and not named:
        if isinstance(choice.part, str) and choice.part != "largest":
            raise ValueError(f'{name} has no part {choice.part!r}; give "largest" or a number from 1')
        vertices, triangles = chosen_part(name, vertices, triangles, choice.part, scale, note)
    if choice.cap is not None:
        vertices, triangles = capped(name, vertices, triangles, choice.cap, scale, note)
    if choice.union:
        vertices, triangles = united(name, vertices, triangles, lambda x, t: oriented(name, x, t, silent), note)
        vertices, triangles = cleaned(name, vertices, triangles, silent, silent)
        vertices, triangles = taken_apart(name, vertices, triangles, silent)
    return vertices, triangles


def silent(_: str) -> None:
    """Note of what needs no telling."""
