"""What all bodies share: checked parameters, the speed, the fingerprint, and how they show themselves.

F and its derivatives are those of a compiled level, and a sphere map x = psi(s) is a compiled function too: there are
no other versions of them.

Also here: bodies of smooth pieces and where these meet. The level of such a body is on each piece that of the piece;
between pieces it jumps. Of a point near the body the piece counts whose part of the body is nearest.
"""

import math
import reprlib
import sys
from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass, fields
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from creeping._typing import ArrayLike, FloatArray, IntArray
from scatterers.kernels.compiled import SYMMETRIC, Compiled, evaluated, inverted, mapped
from scatterers.speed import as_speed

# for type checkers a property that is computed once is a plain one: not all take the other for one in a protocol
if TYPE_CHECKING:
    cached = property
else:
    cached = cached_property

SHARP = ("edge", "tip")
"""Kinds of creases that no smooth chart covers."""


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


def numbers(values: ArrayLike) -> FloatArray:
    """Array of what a caller gives.

    Raises
    ------
    ValueError, TypeError
        If they are no numbers, or more of them than an array is made of.
    """
    count = values.size if isinstance(values, np.ndarray) else len(values) if isinstance(values, Sized) else 0
    if count > 10**9:
        raise ValueError(f"{count} numbers are more than {10**9}")
    try:
        return np.asarray(values, dtype=float)
    except (OverflowError, RecursionError) as error:
        raise ValueError(str(error)) from None


def numbers_of(name: str, values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Finite numbers of this shape, or ValueError by the name of the argument."""
    try:
        found = numbers(values)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {reprlib.repr(values)} are not numbers; give an array of shape {shape}") from None
    if found.shape != shape or not np.all(np.isfinite(found)):
        raise ValueError(f"{name} = {reprlib.repr(values)} is no array of {shape} finite numbers")
    return found


def box_of(bounds: ArrayLike) -> FloatArray:
    """Corners (2, 3) of a box, or ValueError."""
    box = numbers_of("bounds", bounds, (2, 3))
    if not np.all(box[1] > box[0]):
        raise ValueError(f"bounds {box.tolist()} are no box; give ((x0, y0, z0), (x1, y1, z1)) with x0 < x1 etc.")
    return box


def polar_angles(s: FloatArray) -> FloatArray:
    """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi] of vectors, radians: (..., 3) to (..., 2)."""
    return np.stack([np.arctan2(np.hypot(s[..., 0], s[..., 1]), s[..., 2]), np.arctan2(s[..., 1], s[..., 0])], axis=-1)


def tangents(normals: FloatArray) -> FloatArray:
    """Two orthonormal tangents at unit normals: (n, 3) -> (2, n, 3)."""
    e = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    return np.stack([e, np.cross(normals, e)])


class Shown:
    """A body with a table for notebooks; it has ``bounds``, and ``unit`` if that is known."""

    # no state: bodies stay frozen and pickle as before
    __slots__ = ()

    def _repr_html_(self) -> str:
        body: Any = self
        text, unit = " ".join(repr(body).split()), getattr(body, "unit", "L")
        rows = {
            "body": text if len(text) <= 120 else f"{text[:117]}...",
            "box": f"{' x '.join(f'{side:.4g}' for side in body.bounds[1] - body.bounds[0])} {unit}",
            "lengths": "metres" if unit == "m" else f"{unit}, any unit; wavenumbers are in its inverse",
        }
        if getattr(body, "creases", ()):
            rows["surface"] = f"in smooth pieces, {len(body.creases)} edges, joints or tips"
        if getattr(body, "without_rays", ""):
            rows["rays"] = f"none: {body.without_rays}"
        cells = "".join(f"<tr><th>{name}</th><td>{escape(value)}</td></tr>" for name, value in rows.items())
        return f"<table><caption>{type(body).__name__}</caption><tbody>{cells}</tbody></table>"


def teller(progress: Any) -> Callable[[str], None]:
    """What is called with each line of progress: a function that was given, for True one that shows it.

    Raises
    ------
    TypeError
        If it is neither.
    """
    if progress is True:
        return _show
    if progress is not None and progress is not False and not callable(progress):
        raise TypeError(f"progress = {progress!r} cannot be called; give True or a function of one text")
    return progress or (lambda _: None)


def _show(text: str) -> None:
    print(f"scatterers: {text}", file=sys.stderr)


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


class Body(Shown):
    """Base of the dataclass bodies; each lists its parameters as fields, ``speed`` last.

    ``creases`` are the edges, joints, seams and tips of a body of smooth pieces.
    """

    @property
    def creases(self) -> Sequence[Crease]:
        """Empty: the whole body is smooth."""
        return ()

    @property
    def tiling(self) -> Sequence[Any]:
        """Charts whose unit squares cover the body once and meet along their sides; empty if there are none."""
        return ()

    # fields that need not be positive, or may be left out
    _free: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        given = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "speed"}  # type: ignore[arg-type]
        finite(**{name: given.pop(name) for name in self._free if given[name] is not None})
        positive(**{name: value for name, value in given.items() if name not in self._free})
        self._set_speed()

    def _set_speed(self) -> None:
        object.__setattr__(self, "speed", as_speed(getattr(self, "speed", None)))

    def _shape_texts(self) -> list[str]:
        """Texts that change with the shape."""
        return [f"{f.name}={float(getattr(self, f.name)).hex()}" for f in fields(self) if f.name != "speed"]  # type: ignore[arg-type]

    @property
    def fingerprint(self) -> str | None:
        """Text that identifies shape and speed; None if the speed has no fingerprint."""
        values = self._shape_texts()
        speed: Any = getattr(self, "speed", None)
        if speed is not None:
            named = getattr(speed, "fingerprint", None)
            if named is None:
                return None
            values.append(f"speed={named}")
        return f"{type(self).__name__}({', '.join(values)})"


class Levelled:
    """What a compiled level gives; a subclass has ``compiled`` and ``bounds``."""

    @property
    def compiled(self) -> Compiled:
        """Compiled function that gives F, its gradient and its Hessian."""
        raise NotImplementedError

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        raise NotImplementedError

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: points (..., 3), L, to (...)."""
        return evaluated(self.compiled, points)[0]

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F, unit of F over L: points (..., 3), L, to (..., 3).

        At a tip it is finite, but is the gradient on none of the sides.
        """
        return evaluated(self.compiled, points)[1]

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F, unit of F over L^2: points (..., 3), L, to (..., 3, 3)."""
        return evaluated(self.compiled, points)[2][..., SYMMETRIC]

    def jet(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """F, its gradient and its Hessian, by one evaluation: points (..., 3), L, to (...), (..., 3), (..., 3, 3)."""
        level, gradient, entries = evaluated(self.compiled, points)
        return level, gradient, entries[..., SYMMETRIC]

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi], radians: (..., 3) -> (..., 2).

        They are the angles of each point as seen from the middle of the bounding box, with the box scaled to a cube.
        """
        low, high = self.bounds
        return polar_angles((np.asarray(points, dtype=float) - 0.5 * (low + high)) / (0.5 * (high - low)))


class SphereMapped:
    """A map psi from the unit sphere to the body by its compiled functions; a subclass has these."""

    @property
    def compiled_forward(self) -> Compiled:
        """Compiled function that gives psi and its derivative."""
        raise NotImplementedError

    @property
    def compiled_inverse(self) -> Compiled:
        """Compiled inverse of psi, which gives unit vectors."""
        raise NotImplementedError

    def forward(self, s: FloatArray) -> FloatArray:
        """Points psi(s) of the body, L, for unit vectors s: (..., 3) to (..., 3)."""
        return mapped(self.compiled_forward, s)[0]

    def derivative(self, s: FloatArray) -> FloatArray:
        """Derivative of psi, L, at unit vectors s: (..., 3) to (..., 3, 3)."""
        return mapped(self.compiled_forward, s)[1]

    def inverse(self, points: FloatArray) -> FloatArray:
        """Unit vectors s = psi^-1(x) of points x, L: (..., 3) to (..., 3)."""
        return inverted(self.compiled_inverse, points)


@dataclass(frozen=True)
class NoCharts:
    """Atlas of a body without charts.

    Reading ``charts`` raises the error, reading the atlas does not: a runtime check of a protocol reads all members.

    Attributes
    ----------
    reason : str
    """

    reason: str

    @property
    def charts(self) -> Any:
        """Always an error.

        Raises
        ------
        ValueError
        """
        raise ValueError(self.reason)

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """None of points (..., 3), L.

        Raises
        ------
        ValueError
        """
        raise ValueError(self.reason)


def no_charts(sharp: Sequence[Crease]) -> NoCharts:
    """Atlas of a body that edges, tips or pieces leave without charts."""
    found = f"{len(sharp)} edges and tips, first {sharp[0]!r}" if sharp else "several pieces"
    return NoCharts(f"the body has {found}: no smooth charts cover it; take its tiles")


def normals_of(pieces: Sequence[Levelled], points: FloatArray, which: IntArray) -> FloatArray:
    """Unit normals (n, 3) of pieces with numbers (n,) at points (n, 3), L."""
    found = np.zeros(points.shape)
    for k in np.unique(which):
        gradient = pieces[k].gradient(points[which == k])
        with np.errstate(all="ignore"):
            found[which == k] = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
    return found


class Piece(Levelled):
    """Smooth surface, part of which bounds a body.

    Parameters
    ----------
    compiled : Compiled
    bounds : (2, 3), L
        Of that part.
    """

    def __init__(self, compiled: Compiled, bounds: FloatArray) -> None:
        self._compiled, self._bounds = compiled, bounds

    @property
    def compiled(self) -> Compiled:
        """Compiled function that gives F, its gradient and its Hessian."""
        return self._compiled

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the part that bounds the body, L."""
        return self._bounds

    @property
    def atlas(self) -> "NoCharts":
        """None: asking it for charts raises an error."""
        return NoCharts("a piece of a body goes beyond its edge: no charts cover it; take the tiles of the body")
