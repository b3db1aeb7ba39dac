"""Records of arrays that have as many rows each: some of the rows, and several records as one."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from creeping._typing import Any


@dataclass(frozen=True, eq=False)
class Rows:
    """A record whose fields are arrays of one first axis, or such records; a number is the same for all rows.

    Examples
    --------
    >>> @dataclass(frozen=True, eq=False)
    ... class Places(Rows):
    ...     points: np.ndarray
    ...     unit: float
    >>> places = Places(np.arange(6.0).reshape(3, 2), 0.5)
    >>> places[1:].points.tolist(), Places.joined([places[:1], places[2:]]).points.tolist()
    ([[2.0, 3.0], [4.0, 5.0]], [[0.0, 1.0], [4.0, 5.0]])
    """

    def __getitem__(self, index: Any) -> Self:
        """Some of the rows, by an index of the first axis."""
        values = (getattr(self, one.name) for one in fields(self))
        return type(self)(*(value if isinstance(value, float) else value[index] for value in values))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All rows of one record or more, one after the other."""

        def whole(values: list[Any]) -> Any:
            first = values[0]
            if isinstance(first, float):
                return first
            return type(first).joined(values) if isinstance(first, Rows) else np.concatenate(values)

        return cls(*(whole([getattr(part, one.name) for part in parts]) for one in fields(cls)))
