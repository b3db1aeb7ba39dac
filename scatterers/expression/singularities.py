"""Places of F = 0 that are not smooth: where grad F = 0, where the normal jumps, where the curvature has no bound."""

import numpy as np
from numpy.typing import NDArray

from scatterers.kernels.compiled import Compiled
from scatterers.spline.cloud import step_onto
from scatterers.spline.tensor import SYMMETRIC, evaluated

FloatArray = NDArray[np.float64]
SINGULAR = 1e-6
"""|grad F| on the body, relative to its median there, below which a point is singular."""
SUSPECTS = 200
HALVINGS = 30
CLOSE, EDGE = 1e-6, 1e-3
"""Cells between two points, and the turn of the normal, radians, from one to the other that makes an edge."""
CLOSER = 60
"""Steps of the search for kinks, each 0.7 times as wide as the last: it ends 1e-10 cells from where it leads."""
SHARPEST = 1e8
"""Curvature, in 1/diagonals of the box, beyond which a place is a kink; a disc of thickness 1e-3 radii has 3e6."""


def singular_points(compiled: Compiled, points: FloatArray, size: float) -> FloatArray:
    """Points (m, 3) of the body to which Newton steps on grad F = 0 lead, from where |grad F| is smallest.

    Raises
    ------
    ValueError
        If grad F vanishes or is not finite all over F = 0.
    """
    for _ in range(4):
        value, gradient, _ = evaluated(compiled, points)
        with np.errstate(all="ignore"):
            points = points - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
    points = points[np.all(np.isfinite(points), axis=1)]
    slope = np.linalg.norm(evaluated(compiled, points)[1], axis=1)
    typical = float(np.median(slope))
    if not len(points) or not np.isfinite(typical) or typical == 0:
        raise ValueError("grad F vanishes or is not finite all over F = 0; write F so that it changes sign linearly")
    at = points[np.argsort(slope)[:SUSPECTS]]
    start = at
    for _ in range(30):
        _, gradient, entries = evaluated(compiled, at)
        hessian = entries[:, SYMMETRIC]
        # F may overflow or have poles away from the body
        finite = np.all(np.isfinite(hessian), axis=(1, 2)) & np.all(np.isfinite(gradient), axis=1)
        at, start = at[finite], start[finite]
        with np.errstate(all="ignore"):
            step = -np.einsum("nij,nj->ni", np.linalg.pinv(hessian[finite]), gradient[finite])
        length = np.linalg.norm(step, axis=1, keepdims=True)
        at = at + step * np.minimum(1.0, 0.05 * size / np.maximum(length, 1e-300))
    value, gradient, _ = evaluated(compiled, at)
    near = np.linalg.norm(at - start, axis=1) < 0.2 * size
    flat = np.linalg.norm(gradient, axis=1) < SINGULAR * typical
    found = at[near & flat & (np.abs(value) < SINGULAR * typical * size)]
    _, first = np.unique((found / (1e-6 * size)).round(), axis=0, return_index=True)
    return np.asarray(found[first])


def refuse_edges(compiled: Compiled, points: FloatArray, spacing: float) -> None:
    """ValueError if the normals on both sides of a place do not come together, as pieces of F that do not join do.

    Between neighbours whose normals differ most, the body is halved again and again, towards the larger turn.
    """
    from scipy.spatial import cKDTree

    points = _onto(compiled, points, spacing, 6)
    points = points[np.all(np.isfinite(points), axis=1)]
    _, near = cKDTree(points).query(points, k=min(7, len(points)))
    a, b = (v.ravel() for v in np.broadcast_arrays(near[:, :1], near[:, 1:]))
    turn = np.linalg.norm(_normals(compiled, points[a]) - _normals(compiled, points[b]), axis=1)
    most = np.argsort(-np.nan_to_num(turn))[:SUSPECTS]
    a, b = points[a[most]], points[b[most]]
    for _ in range(HALVINGS):
        middle = _onto(compiled, 0.5 * (a + b), spacing, 6)
        n = [_normals(compiled, one) for one in (a, middle, b)]
        first = np.linalg.norm(n[1] - n[0], axis=1) >= np.linalg.norm(n[2] - n[1], axis=1)
        a, b = np.where(first[:, None], a, middle), np.where(first[:, None], middle, b)
    left = np.linalg.norm(_normals(compiled, a) - _normals(compiled, b), axis=1)
    # across a thin part the middle may lead elsewhere, and nothing is learnt
    left[~(np.linalg.norm(a - b, axis=1) < CLOSE * spacing)] = 0.0
    if np.any(bad := left > EDGE):
        at = tuple(a[np.argmax(np.nan_to_num(left))].round(6).tolist())
        raise ValueError(
            f"F = 0 is not smooth: its normal jumps by up to {np.degrees(np.nanmax(left)):.2g} degrees near {at} "
            f"({int(bad.sum())} of {len(bad)} searches); an edge there has no creeping rays: round it off in F"
        )


def _normals(compiled: Compiled, points: FloatArray) -> FloatArray:
    gradient = evaluated(compiled, points)[1]
    with np.errstate(all="ignore"):
        return np.asarray(gradient / np.linalg.norm(gradient, axis=1, keepdims=True))


def _onto(compiled: Compiled, points: FloatArray, reach: float, steps: int) -> FloatArray:
    """Newton steps along grad F, none longer than ``reach``."""
    for _ in range(steps):
        value, gradient, _ = evaluated(compiled, points)
        step, _ = step_onto(value, gradient, reach)
        points = points + np.where(np.isfinite(step), step, 0.0)
    return points


def refuse_kinks(compiled: Compiled, points: FloatArray, spacing: float, size: float) -> None:
    """ValueError if the curvature grows without bound towards a place where grad F itself need not vanish.

    From where it is largest, points go to the most curved of some places about them, ever closer by.
    """
    reach, rng = spacing, np.random.default_rng(0)
    most, _ = _bend(compiled, points, np.inf)
    chosen = np.argsort(-most)[:SUSPECTS]
    at, most = points[chosen], most[chosen]
    for _ in range(CLOSER):
        tried = at[:, None] + reach * rng.normal(size=(len(at), 8, 3))
        bend, tried = _bend(compiled, tried, reach)
        best = np.argmax(bend, axis=1)
        rows = np.arange(len(at))
        up = bend[rows, best] > most
        at = np.where(up[:, None], tried[rows, best], at)
        most = np.where(up, bend[rows, best], most)
        reach *= 0.7
    if bad := int(np.sum(most * size > SHARPEST)):
        raise ValueError(
            f"F = 0 is not smooth: its curvature has no bound near {tuple(at[np.argmax(most)].round(6).tolist())} "
            f"({bad} of {len(at)} searches); a tip, an edge or a pole of F there: round it off in F"
        )


def _bend(compiled: Compiled, points: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    """|Hessian|/|grad F| (...), 0 where it is not known, at points brought onto the body by steps <= ``reach``."""
    with np.errstate(all="ignore"):
        points = _onto(compiled, points, reach, 2 if np.isfinite(reach) else 0)
        value, gradient, hessian = evaluated(compiled, points)
        slope = np.linalg.norm(gradient, axis=-1)
        bend = np.linalg.norm(hessian, axis=-1) / slope
        known = np.isfinite(bend) & (np.abs(value) < 0.1 * reach * slope)
    return np.where(known, bend, 0.0), points
