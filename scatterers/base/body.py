"""What all bodies share: checked parameters, the speed, the fingerprint."""

import math
import sys
from collections.abc import Sequence, Sized
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scatterers.speed import as_speed

if TYPE_CHECKING:
    from scatterers.pieces.crease import Crease

MOST_NUMBERS = 10**9


def finite(**values: float) -> None:
    """Raise ValueError unless every named value is a finite number."""
    for name, value in values.items():
        # of a whole number that is no float math knows nothing
        number = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
        if not number or not math.isfinite(value):
            raise ValueError(f"{name} = {value!r} is not a finite number")


def positive(**values: float) -> None:
    """Raise ValueError unless every named value is a positive finite number."""
    finite(**values)
    for name, value in values.items():
        if value <= 0:
            raise ValueError(f"{name} = {value!r} is not positive; give a length > 0")


def numbers(values: ArrayLike) -> NDArray[np.float64]:
    """Array of what a caller gives.

    Raises
    ------
    ValueError, TypeError
        If they are no numbers, or more of them than an array is made of.
    """
    count = values.size if isinstance(values, np.ndarray) else len(values) if isinstance(values, Sized) else 0
    if count > MOST_NUMBERS:
        raise ValueError(f"{count} numbers are more than {MOST_NUMBERS}")
    try:
        return np.asarray(values, dtype=float)
    except (OverflowError, RecursionError) as error:
        raise ValueError(str(error)) from None


class Body:
    """Base of the dataclass bodies; each lists its parameters as fields, ``speed`` last.

    ``creases`` are the edges, joints, seams and tips of a body of smooth pieces.
    """

    @property
    def creases(self) -> Sequence["Crease"]:
        """None: the body is smooth as a whole."""
        return ()

    @property
    def tiling(self) -> Sequence[Any]:
        """Charts whose unit squares cover the body once and meet along their sides; none if it has no such charts."""
        return ()

    def _set_speed(self) -> None:
        object.__setattr__(self, "speed", as_speed(getattr(self, "speed", None)))

    def _shape_texts(self) -> list[str]:
        """Texts that change with the shape."""
        return [f"{f.name}={float(getattr(self, f.name)).hex()}" for f in fields(self) if f.name != "speed"]  # type: ignore[arg-type]

    @property
    def fingerprint(self) -> str | None:
        """Text that changes with the shape or the speed; None if the speed cannot be named."""
        values = self._shape_texts()
        speed: Any = getattr(self, "speed", None)
        if speed is not None:
            named = getattr(speed, "fingerprint", None)
            if named is None:
                return None
            values.append(f"speed={named}")
        return f"{type(self).__name__}({', '.join(values)})"
