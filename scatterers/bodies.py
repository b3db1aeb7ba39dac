"""Several bodies at once, each where it is put: their field is that of all together."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from creeping._typing import ArrayLike, BoolArray, FloatArray
from scatterers.body import Shown


class Bodies(Shown):
    """Several bodies that scatter together; no two may touch.

    Parameters
    ----------
    parts : sequence of bodies
        Of any kind: smooth, of pieces, on facets.
    at : (n, 3), L, optional
        Position of the origin of each body.
    turned : (n, 3, 3), optional
        Rotation of each body about its own origin, applied before the shift.

    Attributes
    ----------
    parts : tuple of bodies
        As they were given.
    shifts : (n, 3), L
    turns : (n, 3, 3)
    bounds : (2, 3), L

    Raises
    ------
    ValueError
        If no body is given, shapes do not match, a matrix is not a rotation, or units differ.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> two = sc.Bodies([sc.Sphere(1.0), sc.Sphere(0.5)], at=[(0, 0, 0), (0, 0, 2)])
    >>> solution = cr.solve(two, (1, 0, 0), wavenumber=2.0, boundary="soft")
    >>> solution.far_field([(1, 0, 0), (0, 0, 1)]).total.shape
    (2,)
    """

    without_rays = "it is of several bodies, which throw rays on each other"
    """Why there are no creeping rays on it."""

    def __init__(self, parts: Sequence[Any], *, at: ArrayLike | None = None, turned: ArrayLike | None = None) -> None:
        self.parts = tuple(parts)
        n = len(self.parts)
        if not n:
            raise ValueError("there are no bodies; give one at least")
        self.shifts = np.zeros((n, 3)) if at is None else np.array(at, dtype=float)
        self.turns = np.tile(np.eye(3), (n, 1, 1)) if turned is None else np.array(turned, dtype=float)
        if self.shifts.shape != (n, 3) or self.turns.shape != (n, 3, 3) or not np.all(np.isfinite(self.shifts)):
            raise ValueError(
                f"at has shape {self.shifts.shape} and turned {self.turns.shape}; give finite (n, 3) and (n, 3, 3) "
                f"of n = {n} bodies"
            )
        off = np.abs(self.turns @ np.swapaxes(self.turns, 1, 2) - np.eye(3)).max(axis=(1, 2))
        if np.any(bad := ~(off < 1e-9) | ~(np.linalg.det(self.turns) > 0)):
            raise ValueError(f"turned[{int(np.argmax(bad))}] is no rotation")
        units = {getattr(part, "unit", "L") for part in self.parts}
        if len(units) > 1:
            raise ValueError("some of the bodies are in metres and some are not; give units= to all that are files")
        self.unit = units.pop()
        corners = []
        for part, turn, shift in zip(self.parts, self.turns, self.shifts, strict=True):
            box = np.asarray(part.bounds, dtype=float)
            ends = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
            corners.append(ends @ turn.T + shift)
        self.bounds = np.stack([np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))])

    def __repr__(self) -> str:
        return f"Bodies({len(self.parts)}: {', '.join(type(part).__name__ for part in self.parts[:6])})"

    def own(self, number: int, points: FloatArray) -> FloatArray:
        """Points (m, 3), L, in the coordinates of one body: (m, 3), L."""
        return np.asarray((points - self.shifts[number]) @ self.turns[number])

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are inside any of the bodies: (m,)."""
        found = np.zeros(len(points), dtype=bool)
        for number, part in enumerate(self.parts):
            x = self.own(number, points)
            low, high = np.asarray(part.bounds, dtype=float)
            near = np.flatnonzero(np.all((x >= low) & (x <= high), axis=1))
            mine = x[near]
            found[near] |= part.inside(mine) if hasattr(part, "inside") else np.asarray(part.level(mine)) < 0
        return found
