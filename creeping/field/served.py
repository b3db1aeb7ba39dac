"""What serves at points: a field in two parts with its error, and the rule by which another takes its place.

Sources: Derivations, F20.
"""

from dataclasses import dataclass, fields

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.point_result import FieldStatus

Words = np.ndarray[Any, np.dtype[np.str_]]


@dataclass(frozen=True, eq=False)
class Served:
    """Field at points (n,), and by what it came.

    Attributes
    ----------
    wave : (n,) complex
        The incident wave and what it excites by currents or on lit ground; 0 where creeping rays alone serve.
    creeping : (n,) complex
        Of creeping rays.
    error : (n,)
    error_by, method : (n,) of str
    status : (n,) of int
        As of `creeping.field.point_result.PointField`, but for what `judged` says of a whole field.
    """

    wave: ComplexArray
    creeping: ComplexArray
    error: FloatArray
    error_by: Words
    status: IntArray
    method: Words

    @property
    def values(self) -> ComplexArray:
        """Sum of the parts (n,)."""
        return np.asarray(self.wave + self.creeping)

    def __getitem__(self, at: IntArray | BoolArray) -> "Served":
        """Some of the points."""
        return Served(*(getattr(self, one.name)[at] for one in fields(self)))

    def put(self, at: IntArray, other: "Served") -> "Served":
        """Another field in place of this one at the points ``at``."""
        arrays = []
        for one in fields(self):
            mine, its = getattr(self, one.name), getattr(other, one.name)
            # of the longer words
            taken = mine.astype(np.result_type(mine, its))
            taken[at] = its
            arrays.append(taken)
        return Served(*arrays)

    def put_better(self, at: IntArray, other: "Served", *, must: bool) -> "Served":
        """Another one where it must be, or is OK and this one is not, errs more, or may have missed a wave.

        What rays have missed is not in their error: they must agree with currents within what both state.
        """
        mine = self[at]
        gap = np.abs(other.values - mine.values)
        apart = gap.reshape(len(at), int(np.prod(gap.shape[1:]))).max(axis=1, initial=0.0)
        with np.errstate(invalid="ignore"):
            worse = (other.error < mine.error) | (apart > other.error + mine.error)
        better = must | (other.status == FieldStatus.OK) & ((mine.status != FieldStatus.OK) | worse)
        return self.put(at[better], other[better])


def zero_field(count: int, method: str) -> Served:
    """The field 0, exactly: u on a soft body."""
    nothing = np.zeros(count, dtype=complex)
    status = np.full(count, int(FieldStatus.OK), dtype=np.int64)
    return Served(nothing, nothing, np.zeros(count), np.full(count, "expansion"), status, np.full(count, method))


def measured_field(values: ComplexArray, error: FloatArray, method: str, error_by: str) -> Served:
    """Field of currents (n,); where its error is not known nothing is but the size of the wave."""
    known = np.isfinite(error)
    status = np.where(known, FieldStatus.OK, FieldStatus.UNRESOLVED).astype(np.int64)
    return Served(
        wave=values,
        creeping=np.zeros_like(values),
        error=np.where(known, error, 1.0),
        error_by=np.where(known, error_by, "bound"),
        status=status,
        method=np.full(len(values), method),
    )
