"""Where smooth pieces of a body meet or end."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Crease:
    """A curve along which two pieces meet, or a tip.

    Attributes
    ----------
    kind : {"edge", "joint", "tip", "seam"}
        The normal jumps; the curvature or a derivative of it jumps, the normal does not; one point, without a normal;
        nothing jumps, the same smooth surface is known by another F.
    pieces : (int, int)
        On either side; the same twice at a tip, or where a piece meets itself.
    points : (n, 3), L
        In order; the first comes again at the end of a closed curve.
    angle : float
        Largest angle between the normals of both sides, radians; 0 of a joint.

    Examples
    --------
    >>> import numpy as np
    >>> rim = Crease("edge", (0, 1), np.array([[1.0, 0, 0], [0, 1, 0], [1, 0, 0]]), np.pi / 2)
    >>> rim
    Crease(edge between pieces 0 and 1, 90 degrees, length 2.83 L, closed)
    """

    kind: str
    pieces: tuple[int, int]
    points: FloatArray
    angle: float = 0.0

    @property
    def closed(self) -> bool:
        """Whether the curve comes back to its first point."""
        return len(self.points) > 2 and bool(np.array_equal(self.points[0], self.points[-1]))

    @property
    def length(self) -> float:
        """Length of the polygon through the points, L."""
        return float(np.sum(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))

    def __repr__(self) -> str:
        if self.kind == "tip":
            return f"Crease(tip of piece {self.pieces[0]} at {tuple(self.points[0].round(6).tolist())})"
        sides = " and ".join(map(str, self.pieces))
        turn = f", {np.degrees(self.angle):.3g} degrees" if self.kind == "edge" else ""
        ring = ", closed" if self.closed else ""
        return f"Crease({self.kind} between pieces {sides}{turn}, length {self.length:.3g} L{ring})"
