"""What creeping asks of a body: small protocols, satisfied structurally by any class.

The body is Q = {x : F(x) = 0}, F > 0 outside, with outward normal n = grad F/|grad F| and Hessian H.
A chart is a map (u, v) -> x; its part used for look-ups is the unit square, its grid reaches beyond
it by the margin of the spline. The polar frame of a chart with tangents T = [x_u, x_v] (3 x 2) is
the orthogonal polar factor E = T (T^T T)^(-1/2): orthonormal, tangent, and nearest to T.

Sources: Derivations, R1 and B2.

Also here: what is made of a body or a fan once and kept as long as it lives: by identity, as bodies may be equal to
others, or not be hashable.

Bodies without creeping rays, on flat facets or of several parts, have ``bounds``, ``inside(points)``, and in place of F
the corners of their facets (``vertices``, ``triangles``, with ``hidden(points, direction)``), or ``parts``, bodies of
any kind, with ``turns``, ``shifts`` and ``own(number, points)``.
"""

import hashlib
from collections.abc import Callable, Hashable, Sequence
from typing import Protocol, TypeVar, runtime_checkable
from weakref import finalize

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray

T = TypeVar("T")
_KEPT: dict[int, dict[str, Any]] = {}


def memo(owner: object, name: str, make: Callable[[], T]) -> T:
    """What ``make`` gives at the first call for an owner and a name."""
    if id(owner) not in _KEPT:
        try:
            finalize(owner, _KEPT.pop, id(owner), None)
        except TypeError:
            # without weak references the identity may come again
            return make()
        _KEPT[id(owner)] = {}
    own = _KEPT[id(owner)]
    if name not in own:
        own[name] = make()
    found: T = own[name]
    return found


def memo_of(owner: object, name: str, key: Hashable, make: Callable[[], T], most: int) -> T:
    """The same for a name and a key, of which the last ``most`` that were made are kept."""
    known: dict[Hashable, T] = memo(owner, name, dict)
    if key not in known:
        while len(known) >= most:
            known.pop(next(iter(known)))
        known[key] = make()
    return known[key]


def why_no_rays(body: Any) -> str:
    """Why a body has no creeping rays, in words; nothing of one that has.

    Examples
    --------
    >>> import scatterers as sc
    >>> why_no_rays(sc.Sphere())
    ''
    """
    return str(getattr(body, "without_rays", ""))


def is_faceted(body: Any) -> bool:
    """Whether a body is given by the corners of flat facets."""
    return bool(why_no_rays(body)) and hasattr(body, "triangles")


def inside(body: Any, points: FloatArray) -> BoolArray:
    """Whether points (m, 3), L, are inside a body of any kind: (m,)."""
    return np.asarray(body.inside(points) if why_no_rays(body) else body.level(points) < 0)


class Compiled(Protocol):
    """A compiled block function with its parameters; see `scatterers.kernels.compiled.Compiled`.

    A body that offers none is evaluated by its numpy methods: same results, slower. An optional member ``operations``
    says about how many floating-point operations a point takes; those of a closed form are assumed without it.
    """

    @property
    def function(self) -> Any:
        """The compiled function."""
        ...

    @property
    def parameters(self) -> FloatArray:
        """Parameters (k,) of it, in the units of its body."""
        ...


class Chart(Protocol):
    """One smooth map from (u, v) to the body; ``periodic`` says which variables have period 1."""

    @property
    def periodic(self) -> tuple[bool, bool]:
        """Whether u and v have period 1."""
        ...

    def point(self, uv: FloatArray) -> FloatArray:
        """Point of the body: (..., 2) -> (..., 3), L."""
        ...

    def tangents(self, uv: FloatArray) -> FloatArray:
        """Columns x_u, x_v: (..., 2) -> (..., 3, 2), L."""
        ...


class Atlas(Protocol):
    """Charts whose unit squares cover the body, right-handed: x_u x x_v points along n."""

    @property
    def charts(self) -> Sequence[Chart]:
        """All charts, of one kind of periodicity."""
        ...

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Chart number (...) and chart variables (..., 2) of points (..., 3) on the body."""
        ...


class Speed(Protocol):
    """Speed c(x) > 0 of the weighted flow; an optional ``hessian`` (..., 3, 3) spares differencing."""

    def value(self, points: FloatArray) -> FloatArray:
        """Speed, L over time: points (..., 3), L, to (...)."""
        ...

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of the speed, 1/time: points (..., 3), L, to (..., 3)."""
        ...


@runtime_checkable
class Surface(Protocol):
    """A smooth closed body.

    Optional members: ``speed`` (a `Speed`), ``compiled`` (a `Compiled` level), ``fingerprint`` (a string that
    changes with the body), ``jet(points)`` (F, its gradient and its Hessian at once), of its atlas ``compiled`` (a
    locator) and ``margin`` (how far charts reach beyond their unit squares, in half widths; without bound if not
    given), ``non_smooth(points)`` (where it is not smooth enough for creeping rays, (..., 3) -> (...)),
    ``axis_of_revolution`` (a unit vector (3,) along the axis, through the origin, of a body of revolution, whose phase
    map then has no azimuth; None of others), ``tiling`` (charts whose unit squares cover the body once and meet along
    their sides, if it has such), ``squares(at)`` (of a body of pieces: squares that cover it, for
    `creeping.geometry.covering`), ``coarse_fit`` (the same body known less well, a `Surface`: what differs
    on it is uncertain) and ``coarse_factor`` (the error of the body over that difference, 1 if not given).
    """

    @property
    def atlas(self) -> Atlas:
        """Charts that cover the body."""
        ...

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        ...

    def level(self, points: FloatArray) -> FloatArray:
        """F, of any unit, positive outside: points (..., 3), L, to (...)."""
        ...

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F, unit of F over L: points (..., 3), L, to (..., 3)."""
        ...

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F, unit of F over L^2: points (..., 3), L, to (..., 3, 3)."""
        ...

    def parameters(self, points: FloatArray) -> FloatArray:
        """Parameters for display, (theta, phi) or (theta, psi) in radians: (..., 3) -> (..., 2)."""
        ...


class Crease(Protocol):
    """A curve along which two smooth pieces of a body meet, or a point at which one ends.

    ``kind`` is "edge" (the normal jumps), "joint" (the curvature jumps, the normal does not), "tip" (one point) or
    "seam" (nothing jumps: one smooth surface, known by another F from there on).
    """

    @property
    def kind(self) -> str:
        """One of "edge", "joint", "tip" and "seam"."""
        ...

    @property
    def pieces(self) -> tuple[int, int]:
        """Numbers of the pieces on either side, the same one twice at a tip or where a piece meets itself."""
        ...

    @property
    def points(self) -> FloatArray:
        """Points (n, 3), L, in order; the first comes again at the end of a closed curve. One point of a tip."""
        ...


@runtime_checkable
class PiecewiseSurface(Surface, Protocol):
    """A closed body of smooth pieces: its ``level`` is on each piece that of the piece, and jumps between them.

    Each piece is a `Surface` in its own right, smooth where it bounds the body and a little beyond; of it only
    ``level``, ``gradient``, ``hessian`` and ``bounds`` are asked for, and ``compiled`` where it has one.
    """

    @property
    def pieces(self) -> Sequence[Surface]:
        """Smooth surfaces that bound the body, one after the other."""
        ...

    @property
    def creases(self) -> Sequence[Crease]:
        """Where pieces meet or end."""
        ...

    def piece(self, points: FloatArray) -> IntArray:
        """Number of the piece whose part of the body is nearest: points (..., 3), L, near the body, to (...)."""
        ...

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """The body as triangles with sides of about ``edge``, L, at most.

        Returns
        -------
        corners, normals : (m, 3, 3), L and 1
            Counter-clockwise seen from outside; on the piece of the triangle, its normals there.
        pieces : (m,)
            No triangle lies on two.
        """
        ...


def size(body: Surface) -> float:
    """Half the diagonal of the body's box, L: the length that absolute tolerances refer to.

    Examples
    --------
    >>> import scatterers as sc
    >>> round(size(sc.Ellipsoid(2.0, 2.0, 1.0)), 12)
    3.0
    """
    box = np.asarray(body.bounds, dtype=float)
    return float(0.5 * np.linalg.norm(box[1] - box[0]))


def jet(body: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F (...), its gradient (..., 3) and its Hessian (..., 3, 3) at points (..., 3), L, at once where the body can.

    Examples
    --------
    >>> import scatterers as sc
    >>> level, gradient, hessian = jet(sc.Capsule(1.0, 4.0), np.array([1.0, 0.0, 0.5]))
    >>> abs(round(float(level), 12)), gradient.round(6).tolist(), hessian.shape
    (0.0, [1.0, 0.0, 0.0], (3, 3))
    """
    at_once = getattr(body, "jet", None)
    if at_once is not None:
        found: tuple[FloatArray, FloatArray, FloatArray] = at_once(points)
        return found
    return body.level(points), body.gradient(points), body.hessian(points)


def normal(body: Surface, points: FloatArray) -> FloatArray:
    """Outward unit normal n = grad F/|grad F|: points (..., 3), L, to (..., 3).

    Examples
    --------
    >>> import scatterers as sc
    >>> normal(sc.Torus(), np.array([0.5, 0.0, 0.0]))
    array([-1., -0.,  0.])
    """
    gradient = body.gradient(points)
    return np.asarray(gradient / np.linalg.norm(gradient, axis=-1, keepdims=True))


def project(body: Surface, points: FloatArray, *, iterations: int = 8) -> FloatArray:
    """Points brought onto the body by Newton steps x <- x - F grad F/|grad F|^2: (..., 3) -> (..., 3), L.

    Parameters
    ----------
    body : Surface
    points : (..., 3), L
        Near the body.
    iterations : int
        Most steps; each point ends where its |F|/|grad F| is at rounding level, whatever the others do.

    Examples
    --------
    >>> import scatterers as sc
    >>> project(sc.Sphere(), np.array([0.0, 0.0, 1.1])).round(12)
    array([0., 0., 1.])
    """
    points = np.array(points, dtype=float)
    close = 1e-15 * size(body)
    for _ in range(iterations):
        step, distance = step_onto(body.level(points), body.gradient(points))
        moving = ~(np.abs(distance) <= close)
        if not np.any(moving):
            break
        points += np.where(moving[..., None], step, 0.0)
    return points


def step_onto(level: FloatArray, gradient: FloatArray, reach: float = np.inf) -> tuple[FloatArray, FloatArray]:
    """Newton step onto F = 0 along grad F, at most ``reach``, L, and the distance F/|grad F|: (..., 3), (...).

    Where grad F = 0 neither is finite.
    """
    norm = np.linalg.norm(gradient, axis=-1)
    with np.errstate(all="ignore"):
        distance = level / norm
        step = -np.clip(distance, -reach, reach) / norm
    return step[..., None] * gradient, distance


def fingerprint(body: Surface) -> str:
    """Text that tells bodies apart: their own, that of all parts, or a digest of F and speed at points of charts."""
    own = getattr(body, "fingerprint", None)
    if isinstance(own, str):
        return own
    several: Any = body
    if why_no_rays(several) and hasattr(several, "parts"):
        # each, and how it is put
        each = [fingerprint(part) for part in several.parts]
        text = repr([each, several.turns.tolist(), several.shifts.tolist()])
        return f"{type(body).__name__}:{hashlib.blake2b(text.encode(), digest_size=16).hexdigest()}"
    points: FloatArray
    if isinstance(body, PiecewiseSurface) and len(body.creases):
        # charts are not asked of a body with creases; between the corners of its tiles, as F jumps at creases
        points = np.asarray(body.tiles(0.25 * size(body))[0].mean(axis=1))
    else:
        uv = np.stack(np.meshgrid(*[np.linspace(0.03, 0.97, 9)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.concatenate([chart.point(uv) for chart in body.atlas.charts])
    parts: list[FloatArray] = [points, body.level(1.1 * points), body.gradient(points)]
    speed = getattr(body, "speed", None)
    if speed is not None:
        parts += [speed.value(points), speed.gradient(points)]
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        # ten digits: the same on every machine, however its libraries round
        digest.update(" ".join(f"{value:.9e}" for value in np.ravel(part)).encode())
    return f"{type(body).__name__}:{digest.hexdigest()}"
