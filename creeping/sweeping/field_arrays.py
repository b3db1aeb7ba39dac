"""Far fields of n incidences with m observers each, as a sweep stores them; those of one incidence may be replaced."""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, IntArray
from creeping.field.arguments import UNRESOLVED
from creeping.field.far_result import FarField

BY_OBSERVER = ("total", "creeping", "reflected", "forward", "error", "unresolved")


@dataclass(frozen=True, eq=False)
class FieldArrays:
    """Arrays (n, m) or (n, m, 2, 2), by name.

    Attributes
    ----------
    arrays : dict
        Field and its parts, L, NaN where they are not known apart, its error, L, ``unresolved``, ``by_currents``.
    """

    arrays: dict[str, np.ndarray[Any, Any]]

    @classmethod
    def of(cls, field: FarField, incidences: int) -> "FieldArrays":
        """Arrays of a far field whose rows are the observers of one incidence after the other."""
        arrays = {name: getattr(field, name) for name in BY_OBSERVER}
        arrays = {name: np.array(v).reshape(incidences, -1, *v.shape[1:]) for name, v in arrays.items()}
        by_currents = np.isin(field.method, ("currents", "equation")).reshape(arrays["unresolved"].shape)
        return cls(arrays | {"by_currents": by_currents})

    @property
    def unclear(self) -> IntArray:
        """Incidences with an observer that is unresolved, or whose error is large or not known."""
        total = np.abs(self.arrays["total"])
        size, error = (v.reshape(*v.shape[:2], -1).max(axis=2, initial=0.0) for v in (total, self.arrays["error"]))
        off = ~(error < UNRESOLVED * size.max(axis=1, keepdims=True, initial=0.0))
        return np.flatnonzero(np.any(off | self.arrays["unresolved"], axis=1))

    def improved_by(self, number: int, field: FarField) -> bool:
        """Whether another far field has the smaller error, rms over the observers, than that of an incidence."""
        mine, its = (np.sqrt(np.mean(np.asarray(error) ** 2)) for error in (self.arrays["error"][number], field.error))
        return bool(its < mine) or not np.isfinite(mine)

    def replace(self, number: int, field: FarField) -> None:
        """Put another far field in the place of one incidence's."""
        for name in BY_OBSERVER:
            self.arrays[name][number] = getattr(field, name)
        self.arrays["by_currents"][number] = True
