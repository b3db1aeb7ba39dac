"""Bodies of revolution: what they declare of themselves, and whether their charts turn with them.

With S a turn about the axis a through the origin, |a| = 1, F(S x) = F(x), grad F(S x) = S grad F(x), c(S x) = c(x); of
a body x = psi(s) over the sphere psi(S s) = S psi(s), of one doubly periodic chart x(u + t, v) = S x(u, v), S a turn by
2 pi t or -2 pi t. The geodesic flow then commutes with S.

Sources: Derivations, R18.
"""

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import SurfaceError
from creeping.geometry.surface import Surface, memo, size

ROUNDING = 1e-11
"""Departure from the equations above, in sizes of the body, that is rounding: psi may be an iteration."""
UNIT = 1e-12
"""Departure of |a| from 1 that is rounding."""
SAMPLES = 64


def axis_of_revolution(body: Surface) -> FloatArray | None:
    """Unit vector (3,) along the axis that a body declares as ``axis_of_revolution``, None without one.

    A weighted body has it if its speed declares the same axis.

    Raises
    ------
    SurfaceError
        If what is declared is no unit vector.

    Examples
    --------
    >>> import scatterers as sc
    >>> axis_of_revolution(sc.Ellipsoid(2.0, 1.0, 1.0)), axis_of_revolution(sc.Ellipsoid(2.0, 1.0, 0.5))
    (array([1., 0., 0.]), None)
    """
    axis = _declared(body)
    speed = getattr(body, "speed", None)
    if axis is None or speed is None:
        return axis
    own = _declared(speed)
    return axis if own is not None and abs(float(own @ axis)) > 1 - UNIT else None


def charted_axis(body: Surface) -> FloatArray | None:
    """Axis of revolution (3,) of a body whose F and charts turn with it, None of any other.

    What is declared is tried at points of the charts: a wrong declaration costs speed, not rays.

    Examples
    --------
    >>> import scatterers as sc
    >>> charted_axis(sc.Torus()), charted_axis(sc.TwistedEllipsoid())
    (array([0., 0., 1.]), None)
    """

    def found() -> tuple[FloatArray | None]:
        axis = axis_of_revolution(body)
        return (axis if axis is not None and _off(body, axis) <= ROUNDING else None,)

    return memo(body, "axis of revolution", found)[0]


def rotations(axis: FloatArray, angles: ArrayLike) -> FloatArray:
    """Matrices (..., 3, 3) of turns about a unit vector (3,) by angles (...), radians.

    Examples
    --------
    >>> rotations(np.array([0.0, 0.0, 1.0]), np.pi / 2).round(12)[:, 0]            # of x, which becomes y
    array([0., 1., 0.])
    """
    angles = np.asarray(angles, dtype=float)[..., None, None]
    cross = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + np.sin(angles) * cross + (1 - np.cos(angles)) * (cross @ cross))


def _declared(source: Any) -> FloatArray | None:
    declared = getattr(source, "axis_of_revolution", None)
    if declared is None:
        return None
    try:
        axis = np.array(declared, dtype=float)
    except (TypeError, ValueError):
        axis = np.zeros(0)
    if axis.shape != (3,) or not abs(float(np.linalg.norm(axis)) - 1) <= UNIT:
        raise SurfaceError(
            f"axis_of_revolution = {declared!r} of {source!r} is no unit vector; give three numbers of length 1"
        )
    return axis


def _off(body: Surface, axis: FloatArray) -> float:
    """Largest departure from the equations of the module head, in body sizes, at random points; inf without charts."""
    rng = np.random.default_rng(0)
    turns = rng.random(SAMPLES)
    turn = rotations(axis, 2 * np.pi * turns)
    atlas: Any = body.atlas
    source = getattr(atlas, "sphere_map", None)
    if source is not None:
        s = rng.normal(size=(SAMPLES, 3))
        s /= np.linalg.norm(s, axis=1, keepdims=True)
        points, turned = source.forward(s), [source.forward(_times(turn, s))]
    elif len(atlas.charts) == 1 and all(atlas.charts[0].periodic):
        chart, uv = atlas.charts[0], rng.random((SAMPLES, 2))
        points = chart.point(uv)
        along = np.stack([turns, np.zeros(SAMPLES)], axis=1)
        turned = [chart.point(uv + sign * along) for sign in (1.0, -1.0)]
    else:
        return np.inf
    expected = _times(turn, points)
    gaps = [float(np.max(np.abs(one - expected))) / size(body) for one in turned]
    normals, others = body.gradient(points), body.gradient(expected)
    steep = float(np.max(np.linalg.norm(normals, axis=1)))
    return max(min(gaps), float(np.max(np.abs(others - _times(turn, normals)))) / steep)


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors))
