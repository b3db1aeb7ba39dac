"""Rays of a body with creases: where they are, where they ended, and where they went on from piece to piece."""

from typing import NamedTuple

from creeping._typing import FloatArray, IntArray


class Passages(NamedTuple):
    """Where rays went on across joints: ray number, travel time and number of the crease, each (n,)."""

    ray: IntArray
    travel_time: FloatArray
    crease: IntArray


class PieceTrace(NamedTuple):
    """Rays of a body with creases.

    Attributes
    ----------
    states : (n, m, lanes)
        At the times.
    end : (n,)
        Travel time at which each ended, inf if it did not.
    crease : (n,) of int
        At which; -1 if it did not end.
    passages : Passages
    """

    states: FloatArray
    end: FloatArray
    crease: IntArray
    passages: Passages
