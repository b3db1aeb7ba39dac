"""What creeping asks of a body: small protocols, satisfied structurally by any class.

The body is Q = {x : F(x) = 0}, F > 0 outside, with outward normal n = grad F/|grad F| and Hessian H.
A chart is a map (u, v) -> x; its part used for look-ups is the unit square, its grid reaches beyond
it by the margin of the spline. The isometric frame of a chart with tangents T = [x_u, x_v] (3 x 2) is
the orthogonal polar factor E = T (T^T T)^(-1/2): orthonormal, tangent, and nearest to T.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from creeping._errors import InvalidInputError, SurfaceError
from creeping._typing import Any, ArrayLike, FloatArray, IntArray
from creeping.triangulation import triangulate


class Compiled(Protocol):
    """A compiled block function with its parameters; see `scatterers._compile.Compiled`.

    A body that offers none is evaluated by its numpy methods: same results, slower.
    """

    @property
    def function(self) -> Any:
        """The compiled function."""
        ...

    @property
    def parameters(self) -> FloatArray:
        """Its parameters (k,)."""
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
        """Speed: (..., 3) -> (...)."""
        ...

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of the speed: (..., 3) -> (..., 3)."""
        ...


@runtime_checkable
class Surface(Protocol):
    """A smooth closed body.

    Optional members: ``speed`` (a `Speed`), ``compiled`` (a `Compiled` level), ``fingerprint`` (a string that
    changes with the body), of its atlas ``compiled`` (a locator) and ``margin`` (how far charts reach beyond their unit
    squares, in half widths; without bound if not given), ``rough(points)`` (where it is not smooth enough for
    creeping rays, (..., 3) -> (...)), and ``coarser`` (the same body known less well, a `Surface`: what differs on it
    is uncertain).
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


@dataclass(frozen=True)
class Check:
    """One property of a body: the worst value found, its limit, and what to do about a failure."""

    name: str
    worst: float
    limit: float
    remedy: str

    @property
    def ok(self) -> bool:
        """Whether the worst value is within the limit (NaN is not)."""
        return self.worst <= self.limit


@dataclass(frozen=True, repr=False)
class SurfaceReport:
    """What `check_surface` found.

    Attributes
    ----------
    checks : tuple of Check
    genus : int
        Handles of the body.
    area : float
        L^2, of a triangulation: a few digits.
    """

    checks: tuple[Check, ...]
    genus: int
    area: float

    @property
    def ok(self) -> bool:
        """Whether every check passed."""
        return all(check.ok for check in self.checks)

    def require(self) -> None:
        """Raise SurfaceError naming every failed check."""
        failed = [f"{c.name}: {c.worst:.3g} > {c.limit:.3g} ({c.remedy})" for c in self.checks if not c.ok]
        if failed:
            raise SurfaceError(f"{len(failed)} of {len(self.checks)} checks of the body failed: " + "; ".join(failed))

    def __repr__(self) -> str:
        rows = [f"  {'ok ' if c.ok else 'BAD'} {c.name}: {c.worst:.2g} (limit {c.limit:.2g})" for c in self.checks]
        return "\n".join([f"SurfaceReport(genus {self.genus}, area {self.area:.4g} L^2)", *rows])


def check_surface(body: Surface) -> SurfaceReport:
    """Verify a body numerically: derivatives, closedness, orientation, cover and overlap of its charts.

    Parameters
    ----------
    body : Surface

    Returns
    -------
    SurfaceReport

    Raises
    ------
    SurfaceError
        If F = 0 cannot be triangulated at all: empty, open, not finite, or not smooth.
    """
    mesh = triangulate(body.level, body.gradient, body.bounds)
    points = mesh.vertices
    corners = points[mesh.triangles]
    doubled_area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    components = mesh.components
    return SurfaceReport(
        checks=(
            Check("components beyond one", float(components - 1), 0, "give one body at a time"),
            *_derivative_checks(body, points),
            *_atlas_checks(body, points),
        ),
        genus=components - mesh.euler_characteristic // 2,
        area=float(doubled_area.sum() / 2),
    )


def _derivative_checks(body: Surface, points: FloatArray) -> list[Check]:
    """Analytic against central differences, relative to the largest value."""
    step = 6e-6 * size(body)
    level, gradient, hessian = body.level, body.gradient(points), body.hessian(points)
    axes = step * np.eye(3)
    by_level = np.stack([level(points + e) - level(points - e) for e in axes], axis=-1) / (2 * step)
    by_gradient = np.stack([body.gradient(points + e) - body.gradient(points - e) for e in axes], axis=-1) / (2 * step)
    checks = [
        Check("gradient against differences of F", _relative(gradient, by_level), 1e-6, "mend gradient()"),
        Check("Hessian against differences of the gradient", _relative(hessian, by_gradient), 1e-6, "mend hessian()"),
    ]
    speed = getattr(body, "speed", None)
    if speed is not None:
        value, slope = speed.value(points), speed.gradient(points)
        by_value = np.stack([speed.value(points + e) - speed.value(points - e) for e in axes], axis=-1) / (2 * step)
        checks += [
            Check("negative speed", float(np.max(-value)), 0, "give c(x) > 0 on the body"),
            Check(
                "speed gradient against differences", _relative(slope, by_value), 1e-6, "mend the speed's gradient()"
            ),
        ]
    return checks


def _atlas_checks(body: Surface, points: FloatArray) -> list[Check]:
    """Cover (every point in the unit square of its chart), inverse, tangents and orientation."""
    index, uv = body.atlas.locate(points)
    charts = body.atlas.charts
    outside, gap, tangent, turned, off = 0.0, 0.0, 0.0, 0.0, 0.0
    step = 1e-5
    for k, chart in enumerate(charts):
        mine = uv[index == k]
        if not len(mine):
            continue
        free = [axis for axis in (0, 1) if not chart.periodic[axis]]
        if free:
            outside = max(outside, float(np.max(np.maximum(-mine[:, free], mine[:, free] - 1))))
        back = chart.point(mine)
        gap = max(gap, float(np.max(np.linalg.norm(back - points[index == k], axis=-1))) / size(body))
        off = max(
            off, float(np.max(np.abs(body.level(back)) / np.linalg.norm(body.gradient(back), axis=-1))) / size(body)
        )
        columns = chart.tangents(mine)
        shifts = np.eye(2) * step
        differences = np.stack([chart.point(mine + e) - chart.point(mine - e) for e in shifts], axis=-1) / (2 * step)
        tangent = max(tangent, _relative(columns, differences))
        facing = np.sum(np.cross(columns[..., 0], columns[..., 1]) * body.gradient(back), axis=-1)
        turned = max(turned, float(np.mean(~(facing > 0))))
    return [
        Check("share of points in no chart", float(np.mean((index < 0) | (index >= len(charts)))), 0, "mend locate()"),
        Check("points outside the unit square of their chart", outside, 1e-9, "widen the charts or mend locate()"),
        Check("chart inverse, in body sizes", gap, 1e-9, "make locate() the inverse of point()"),
        Check("chart points off the body, in body sizes", off, 1e-9, "make point() satisfy F = 0"),
        Check("tangents against differences", tangent, 1e-6, "mend tangents()"),
        Check("share of chart points turned inside out", turned, 0, "swap u and v, or the sign of F"),
    ]


def _relative(given: FloatArray, expected: FloatArray) -> float:
    if given.shape != expected.shape:
        return float("nan")
    return float(np.max(np.abs(given - expected)) / max(float(np.max(np.abs(expected))), 1e-300))
