"""Arrays that grow row by row."""

import numpy as np

from creeping._typing import Any
from creeping.sweeping.sweeper import Arrays


class Rows:
    """Arrays of one length whose room doubles when it is spent, so that no row is copied many times.

    Parameters
    ----------
    empty : dict
        Arrays without rows, of the shapes and kinds of those to come.

    Examples
    --------
    >>> rows = Rows({"a": np.zeros((0, 2))})
    >>> for n in range(3):
    ...     rows.add({"a": np.full((1, 2), n)})
    >>> rows["a"][:, 0].tolist()
    [0.0, 1.0, 2.0]
    """

    def __init__(self, empty: Arrays) -> None:
        self._arrays, self._count, self._room = empty, 0, 0

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, name: str) -> np.ndarray[Any, Any]:
        return self._arrays[name][: self._count]

    @property
    def nbytes(self) -> int:
        """Bytes of the rows that there are."""
        return sum(self[name].nbytes for name in self._arrays)

    def add(self, rows: Arrays) -> None:
        """Rows to come after the others."""
        count = self._count + len(next(iter(rows.values())))
        if count > self._room:
            self._room = max(count, 2 * self._room)
            for name, old in self._arrays.items():
                new = np.empty((self._room, *old.shape[1:]), dtype=old.dtype)
                new[: self._count] = old[: self._count]
                self._arrays[name] = new
        for name, values in self._arrays.items():
            values[self._count : count] = rows[name]
        self._count = count
