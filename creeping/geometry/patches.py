"""Squares that cover a body: surfaces that polynomials of degree DEGREE make on 0 <= u, v <= 1.

Source: Derivations, B14.
"""

from dataclasses import dataclass, fields

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.squares import lobatto, on_squares

DEGREE = 6
"""Degree of the polynomials along u and v."""
ENDS = ((0, 3), (1, 2), (0, 1), (3, 2))
"""Of a square's corners (0, 0), (1, 0), (1, 1), (0, 1) those at the ends of its sides u = 0, u = 1, v = 0, v = 1."""


@dataclass(frozen=True, eq=False)
class Patches:
    """Squares that cover a body.

    Attributes
    ----------
    places : (m, q + 1, q + 1, 3), L
        Points by u and v; x_u x x_v points outward.
    pieces : (m,)
        The piece of each, 0 of a smooth body.
    edges : (m, 4) of bool
        Whether the normal jumps across the sides u = 0, u = 1, v = 0, v = 1.
    sides : (m, 4)
        Numbers of these sides: two squares that meet there have the same one.
    spans : (m, 4, 2)
        Where on a side, 0 to 1, each begins and ends, along u or v.
    pointed : (m,) of bool
        Whether the side u = 0 is one point.
    tips : (m,) of bool
        Whether that is a tip of the body.
    off : (m,)
        Distance from the body, L.
    """

    places: FloatArray
    pieces: IntArray
    edges: BoolArray
    sides: IntArray
    spans: FloatArray
    pointed: BoolArray
    tips: BoolArray
    off: FloatArray

    def __getitem__(self, at: Any) -> "Patches":
        """Some of the squares."""
        return Patches(*(getattr(self, one.name)[at] for one in fields(self)))

    @property
    def gap(self) -> float:
        """Integral of the normal as a share of the area: 0 where the squares close."""
        u, w = np.polynomial.legendre.leggauss(len(lobatto(DEGREE)))
        at = np.broadcast_to(0.5 * (1 + u), (len(self.places), len(u)))
        _, along, across = on_squares(self.places, at, at)
        n, share = np.cross(along, across), np.outer(w, w)
        area = float(np.sum(np.linalg.norm(n, axis=-1) * share))
        return float(np.linalg.norm(np.einsum("muvx,uv->x", n, share))) / area

    @property
    def angle(self) -> float:
        """Least sine of the angle between x_u and x_v, but where a square is one point."""
        at = np.broadcast_to(lobatto(DEGREE), (len(self.places), DEGREE + 1))
        _, along, across = on_squares(self.places, at, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = np.linalg.norm(np.cross(along, across), axis=-1)
            sine /= np.linalg.norm(along, axis=-1) * np.linalg.norm(across, axis=-1)
        sine[self.pointed, 0] = 1.0
        return float(np.min(sine))

    @staticmethod
    def joined(parts: list["Patches"]) -> "Patches":
        """Squares of several."""
        return Patches(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Patches)))
