"""What creeping asks of a body: small protocols, satisfied structurally by any class.

The body is Q = {x : F(x) = 0}, F > 0 outside, with outward normal n = grad F/|grad F| and Hessian H.
A chart is a map (u, v) -> x; its part used for look-ups is the unit square, its grid reaches beyond
it by the margin of the spline. The isometric frame of a chart with tangents T = [x_u, x_v] (3 x 2) is
the orthogonal polar factor E = T (T^T T)^(-1/2): orthonormal, tangent, and nearest to T.
"""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from creeping._errors import InvalidInputError
from creeping._typing import Any, ArrayLike, FloatArray, IntArray


class Compiled(Protocol):
    """A compiled block function with its parameters; see `scatterers._compile.Compiled`.

    A body that offers none is evaluated by its numpy methods: same results, slower.
    """

    @property
    def function(self) -> Any: ...
    @property
    def parameters(self) -> FloatArray: ...


class Chart(Protocol):
    """One smooth map from (u, v) to the body; ``periodic`` says which variables have period 1."""

    @property
    def periodic(self) -> tuple[bool, bool]: ...
    def point(self, uv: FloatArray) -> FloatArray:
        """Point of the body: (..., 2) -> (..., 3), L."""
        ...

    def tangents(self, uv: FloatArray) -> FloatArray:
        """Columns x_u, x_v: (..., 2) -> (..., 3, 2), L."""
        ...


class Atlas(Protocol):
    """Charts whose unit squares cover the body, right-handed: x_u x x_v points along n."""

    @property
    def charts(self) -> Sequence[Chart]: ...
    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Chart number (...) and chart variables (..., 2) of points (..., 3) on the body."""
        ...


class Speed(Protocol):
    """Speed c(x) > 0 of the weighted flow; an optional ``hessian`` (..., 3, 3) spares differencing."""

    def value(self, points: FloatArray) -> FloatArray:
        """Speed: (..., 3) -> (...)."""
        ...

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of the speed: (..., 3) -> (..., 3)."""
        ...


@runtime_checkable
class Surface(Protocol):
    """A smooth closed body.

    Optional members: ``speed`` (a `Speed`), ``compiled`` (a `Compiled` level), ``fingerprint`` (a string that
    changes with the body), and ``compiled`` of its atlas (a locator).
    """

    @property
    def atlas(self) -> Atlas: ...
    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        ...

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: (..., 3) -> (...)."""
        ...

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F: (..., 3) -> (..., 3)."""
        ...

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F: (..., 3) -> (..., 3, 3)."""
        ...

    def parameters(self, points: FloatArray) -> FloatArray:
        """Parameters for display, (theta, phi) or (theta, psi) in radians: (..., 3) -> (..., 2)."""
        ...


def size(body: Surface) -> float:
    """Half the diagonal of the body's box, the length that absolute tolerances refer to."""
    box = np.asarray(body.bounds, dtype=float)
    return float(0.5 * np.linalg.norm(box[1] - box[0]))


def normal(body: Surface, points: FloatArray) -> FloatArray:
    """Outward unit normal n = grad F/|grad F|: (..., 3) -> (..., 3)."""
    gradient = body.gradient(points)
    return np.asarray(gradient / np.linalg.norm(gradient, axis=-1, keepdims=True))


def project(body: Surface, points: FloatArray, *, iterations: int = 8) -> FloatArray:
    """Newton steps x <- x - F grad F/|grad F|^2 until |F| is at rounding level: (..., 3) -> (..., 3)."""
    points = np.array(points, dtype=float)
    for _ in range(iterations):
        gradient = body.gradient(points)
        step = body.level(points) / np.sum(gradient * gradient, axis=-1)
        points -= step[..., None] * gradient
        moved = np.abs(step) * np.linalg.norm(gradient, axis=-1)
        if np.all(moved <= 1e-15 * size(body)):
            break
    return points


def polar_frame(tangents: FloatArray) -> FloatArray:
    """Isometric frame E = T (T^T T)^(-1/2) of chart tangents: (..., 3, 2) -> (..., 3, 2).

    The 2 x 2 root is closed: G^(1/2) = (G + s)/t with s = sqrt(det G), t = sqrt(tr G + 2 s).
    """
    gram = np.swapaxes(tangents, -1, -2) @ tangents
    p, q, r = gram[..., 0, 0], gram[..., 0, 1], gram[..., 1, 1]
    s = np.sqrt(p * r - q * q)
    t = np.sqrt(p + r + 2 * s)
    # inverse of (G + s)/t; its determinant is s t^2
    scale = 1.0 / (s * t)
    root = np.empty_like(gram)
    root[..., 0, 0] = (r + s) * scale
    root[..., 1, 1] = (p + s) * scale
    root[..., 0, 1] = root[..., 1, 0] = -q * scale
    return np.asarray(tangents @ root)


def unit_direction(direction: ArrayLike) -> FloatArray:
    """Return an incidence direction as a unit vector (3,).

    Raises
    ------
    InvalidInputError
        If it has not three finite components or is zero.
    """
    try:
        d = np.asarray(direction, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"direction {direction!r} is not three numbers") from error
    if d.shape != (3,):
        raise InvalidInputError(f"direction has shape {d.shape}; give three numbers, e.g. (1, 1, 1)")
    if not np.all(np.isfinite(d)):
        raise InvalidInputError(f"direction {tuple(d.tolist())} is not finite; give three finite numbers")
    largest = float(np.max(np.abs(d)))
    if largest == 0.0:
        raise InvalidInputError("direction is the zero vector; give where the wave travels, e.g. (1, 1, 1)")
    d = d / largest
    return np.asarray(d / np.linalg.norm(d))
