"""Points (x, p) of the unit tangent bundle T1Q = {F(x) = 0, p.grad F(x) = 0, |p| = 1}, and what rays carry from there.

Projection: x <- x - F grad F/|grad F|^2 until |F| is at rounding level, p <- its tangential part, normalised.

What is carried along a ray, by the names of its components:

    x (3), p (3) | M11, M21, M12, M22 | A | t1 | t2, crease

M is the Jacobi matrix of the metric ds/c, A the attenuation integral, t1 the time of detachment (inf before); see
`creeping.geodesics.equations` and `creeping.geodesics.attenuation`. A state has the first 6, 10 or 12 of them; on a
body with creases all 14, the last two the time at which the ray ended at a crease and the number of that (inf and -1
before); see `creeping.geodesics.pieces`.

Sources: [YC06b]; Derivations, R1.
"""

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray, IntArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.geometry.arguments import real_array
from creeping.geometry.evaluators import evaluators, is_compiled, polar_frame
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, normal, project, size
from creeping.kernels.threads import in_threads

OFF_BODY = 1e-3
"""Largest distance of a given point from the body, in units of its size, that projection silently mends."""
NORMAL = 1e-6
"""Least tangential part of a direction."""

X, P = slice(0, 3), slice(3, 6)
M11, M21, M12, M22 = range(6, 10)
ATTENUATION, DETACHMENT = 10, 11
END, CREASE = 12, 13
BARE, WITH_JACOBI, WHOLE, WITH_END = 6, 10, 12, 14
"""Components of a state: (x, p), with the Jacobi matrix, with attenuation and detachment, and with its end."""


def pack(points: FloatArray, directions: FloatArray, *, jacobi: bool = False, lanes: int = BARE) -> FloatArray:
    """States (n, lanes) from (..., 3) points and directions, at the start of their rays.

    6 components are (x, p); then come the identity as Jacobi matrix (``jacobi`` asks for 10), the attenuation integral
    0, the time of detachment inf, the time of an end inf and its crease -1.
    """
    states = np.concatenate([points.reshape(-1, 3), directions.reshape(-1, 3)], axis=1)
    more = [1.0, 0.0, 0.0, 1.0, 0.0, np.inf, np.inf, -1.0][: (WITH_JACOBI if jacobi else lanes) - BARE]
    return np.concatenate([states, np.tile(more, (len(states), 1))], axis=1) if more else states


def checked_states(states: FloatArray) -> FloatArray:
    """States of a caller as a contiguous array (n, 6, 10, 12 or 14).

    Raises
    ------
    InvalidInputError
        If their shape is another.
    """
    found = np.ascontiguousarray(real_array(states, "states"))
    if found.ndim != 2 or found.shape[1] not in (BARE, WITH_JACOBI, ATTENUATION + 1, WHOLE, WITH_END):
        raise InvalidInputError(
            f"states have shape {found.shape}; give rows of {BARE}, {WITH_JACOBI}, {WHOLE} or {WITH_END}"
        )
    return found


def unpack(states: FloatArray, shape: tuple[int, ...], scalar: bool) -> tuple[FloatArray, FloatArray]:
    """Points and directions of states (n, m, 6), in the shape of the starting points; (..., 3) for a scalar time."""
    states = states.reshape(*shape[:-1], states.shape[1], BARE)
    if scalar:
        states = states[..., 0, :]
    return states[..., X].copy(), states[..., P].copy()


def whole_lanes(body: Any) -> int:
    """Components of a state that tell all of a ray of a body."""
    return WITH_END if is_piecewise(body) else WHOLE


def known_steps(states: FloatArray, times: FloatArray) -> IntArray | None:
    """Steps of rays (n,) before each ends at a crease, of states (n, m, lanes); None where rays do not end so."""
    return np.searchsorted(times, states[:, -1, END], side="right") if states.shape[-1] > WHOLE else None


def project_bundle(body: Surface, points: FloatArray, directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bring points, L, and directions onto T1Q: (..., 3), (..., 3) -> (..., 3), (..., 3)."""
    points = project(body, points)
    n = normal(body, points)
    tangent = directions - np.sum(directions * n, axis=-1, keepdims=True) * n
    return points, tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)


def bundle_states(body: Surface, points: ArrayLike, directions: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
    """Check points and directions of a caller, broadcast them together and project them onto T1Q.

    Parameters
    ----------
    body : Surface
    points : (..., 3), L
        Points on the body, or within 1e-3 of its size from it.
    directions : (..., 3)
        Directions, not normal to the body; need not be unit nor exactly tangent.

    Returns
    -------
    states : (n, 6)
    shape : tuple
        (..., 3) of points and directions together.

    Raises
    ------
    InvalidInputError
        On a wrong shape, a value that is not finite, a point off the body, a direction that is zero or normal.
    """
    try:
        x, p = np.broadcast_arrays(real_array(points, "points"), real_array(directions, "directions"))
    except InvalidInputError:
        raise
    except ValueError as error:
        raise InvalidInputError(f"points and directions are not arrays that broadcast together: {error}") from error
    if x.ndim == 0 or x.shape[-1] != 3:
        raise InvalidInputError(f"points have shape {np.shape(points)}; the last axis must hold x, y, z")
    flat = np.ascontiguousarray(x.reshape(-1, 3)), np.ascontiguousarray(p.reshape(-1, 3))
    states = _entered(body, *flat) if is_compiled(body) else None
    return (_checked(body, *flat) if states is None else states), x.shape


def _entered(body: Surface, x: FloatArray, p: FloatArray) -> FloatArray | None:
    """What `_checked` gives, none where it raises."""
    from creeping.geodesics.kernels.flow_derivative import enter

    out, refused, length = np.empty((len(x), 6)), [0], size(body)
    with evaluators(body) as parts:
        level = parts.level, parts.level_parameters

        def run(part: slice) -> None:
            refused.append(enter(*level, x[part], p[part], OFF_BODY * length, 1e-15 * length, NORMAL, out[part]))

        in_threads(run, len(x))
    return None if sum(refused) else out


def _checked(body: Surface, x: FloatArray, p: FloatArray) -> FloatArray:
    """States (n, 6) of points and directions (n, 3), by the body's own methods."""
    for name, values in (("points", x), ("directions", p)):
        bad = ~np.all(np.isfinite(values), axis=-1)
        if bad.any():
            raise InvalidInputError(f"{int(bad.sum())} of {bad.size} {name} are not finite")
    length = np.linalg.norm(p, axis=-1, keepdims=True)
    if np.any(length == 0):
        raise InvalidInputError(f"{int(np.sum(length == 0))} of {length.size} directions are zero")
    x = on_body(body, x)
    n = normal(body, x)
    p = p / length
    tangent = p - np.sum(p * n, axis=-1, keepdims=True) * n
    norm = np.linalg.norm(tangent, axis=-1, keepdims=True)
    if np.any(norm < NORMAL):
        raise InvalidInputError(
            f"{int(np.sum(norm < NORMAL))} of {norm.size} directions are normal to the body; a ray needs a tangent"
        )
    return np.concatenate([x, tangent / norm], axis=1)


def as_points(points: ArrayLike) -> FloatArray:
    """Points of a caller as an array (..., 3).

    Raises
    ------
    InvalidInputError
        If they are not numbers, of another shape, or not finite.
    """
    x = real_array(points, "points")
    if x.ndim == 0 or x.shape[-1] != 3:
        raise InvalidInputError(f"points have shape {x.shape}; the last axis must hold x, y, z")
    # beyond, neither a phase nor a distance has digits left
    bad = ~np.all(np.abs(x) <= 1e15, axis=-1)
    if bad.any():
        raise InvalidInputError(
            f"{int(bad.sum())} of {bad.size} points are not finite, or beyond 1e+15 "
            f"(first: row {int(np.argmax(bad.ravel()))})"
        )
    return x


def on_body(body: Surface, points: FloatArray) -> FloatArray:
    """Put points, L, within 1e-3 body sizes of the body on it: (..., 3) -> (..., 3).

    Raises
    ------
    InvalidInputError
        On a point farther off.
    """
    # to the first order
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.abs(body.level(points)) / np.linalg.norm(body.gradient(points), axis=-1)
    off = ~(distance <= OFF_BODY * size(body))
    if off.any():
        worst = float(np.nanmax(np.where(off, distance, 0.0)))
        raise InvalidInputError(
            f"{int(off.sum())} of {off.size} points are off the body (worst by {worst:.3g} L); project them first",
            count=int(off.sum()),
            worst=worst,
        )
    return project(body, points)


def random_bundle_points(body: Surface, count: int, *, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw points of T1Q uniformly by area and angle: (count, 3), (count, 3).

    A point is drawn in the unit square of a chart and kept if the atlas assigns it to that chart, with a probability
    proportional to |x_u x x_v|.

    Raises
    ------
    SurfaceError
        If no point of the charts is assigned to its own chart.
    """
    charts = body.atlas.charts
    probe = rng.random((64, 2))
    largest = 1.5 * max(float(np.max(_area_element(chart.tangents(probe)))) for chart in charts)
    found: list[FloatArray] = []
    for _ in range(1000):
        number = rng.integers(len(charts), size=4 * count)
        uv = rng.random((4 * count, 2))
        keep = rng.random(4 * count)
        for index, chart in enumerate(charts):
            mine = uv[number == index]
            points = chart.point(mine)
            accepted = _area_element(chart.tangents(mine)) > keep[number == index] * largest
            accepted &= body.atlas.locate(points)[0] == index
            found.append(points[accepted])
        if sum(map(len, found)) >= count:
            break
    else:
        raise SurfaceError("the atlas assigns almost none of its charts' points to their own chart; run check_surface")
    # charts were visited in order: mix before cutting, or the last charts would be missing
    points = rng.permutation(np.concatenate(found))[:count]
    angle = 2 * np.pi * rng.random(count)
    chosen, uv = body.atlas.locate(points)
    directions = np.empty_like(points)
    for k, chart in enumerate(charts):
        mine = chosen == k
        frame = polar_frame(chart.tangents(uv[mine]))
        directions[mine] = frame[..., 0] * np.cos(angle[mine, None]) + frame[..., 1] * np.sin(angle[mine, None])
    return project_bundle(body, points, directions)


def _area_element(tangents: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.cross(tangents[..., 0], tangents[..., 1]), axis=-1))
