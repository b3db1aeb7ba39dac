"""Places of F = 0 that are not smooth: where grad F = 0, where the normal jumps, where the curvature has no bound.

Such a place is a tip if close by it looks like one end of a cone: on a small sphere about it F < 0 in one region, and
F > 0 in one, and their shares are those on a smaller one.

Also here: where the body of an expression lies: the smallest cube about the origin that holds one body, and nothing
beyond.
"""

import numpy as np

from creeping._typing import FloatArray
from scatterers.charts.samples import Samples, towards
from scatterers.exact.switches import ExpressionSpace
from scatterers.kernels.compiled import SYMMETRIC, Compiled, evaluated
from scatterers.triangles.topology import components

SUSPECTS = 200
AROUND = 4000
"""Points of a small sphere about a place."""
SIZES = 2.0 ** np.arange(-8, 13)
"""Half widths of the cubes about the origin in which a body is looked for."""
COARSE, FINE = 33, 65
"""Nodes along a side of those cubes, and along the longest side of the box that is examined."""


def singular_points(compiled: Compiled, points: FloatArray, size: float) -> FloatArray:
    """Points (m, 3) of the body to which Newton steps on grad F = 0 lead, from where |grad F| is smallest.

    Raises
    ------
    ValueError
        If grad F vanishes or is not finite all over F = 0.
    """
    # |grad F| relative to its median below which a point is singular
    singular = 1e-6
    points = towards(compiled, points, 4)
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
    flat = np.linalg.norm(gradient, axis=1) < singular * typical
    found = at[near & flat & (np.abs(value) < singular * typical * size)]
    _, first = np.unique((found / (1e-6 * size)).round(), axis=0, return_index=True)
    return np.asarray(found[first])


def refuse_edges(compiled: Compiled, points: FloatArray, spacing: float) -> None:
    """ValueError if the normals on both sides of a place do not come together, as pieces of F that do not join do.

    Between neighbours whose normals differ most, the body is halved again and again, towards the larger turn.
    """
    from scipy.spatial import cKDTree

    points = towards(compiled, points, 6, spacing)
    points = points[np.all(np.isfinite(points), axis=1)]
    _, near = cKDTree(points).query(points, k=min(7, len(points)))
    a, b = (v.ravel() for v in np.broadcast_arrays(near[:, :1], near[:, 1:]))
    turn = np.linalg.norm(_normals(compiled, points[a]) - _normals(compiled, points[b]), axis=1)
    most = np.argsort(-np.nan_to_num(turn))[:SUSPECTS]
    a, b = points[a[most]], points[b[most]]
    for _ in range(30):
        middle = towards(compiled, 0.5 * (a + b), 6, spacing)
        n = [_normals(compiled, one) for one in (a, middle, b)]
        first = np.linalg.norm(n[1] - n[0], axis=1) >= np.linalg.norm(n[2] - n[1], axis=1)
        a, b = np.where(first[:, None], a, middle), np.where(first[:, None], middle, b)
    left = np.linalg.norm(_normals(compiled, a) - _normals(compiled, b), axis=1)
    # cells apart; across a thin part the middle may lead elsewhere, and nothing is learnt
    left[~(np.linalg.norm(a - b, axis=1) < 1e-6 * spacing)] = 0.0
    if np.any(bad := left > 1e-3):
        at = tuple(a[np.argmax(np.nan_to_num(left))].round(6).tolist())
        raise ValueError(
            f"F = 0 is not smooth: its normal jumps by up to {np.degrees(np.nanmax(left)):.2g} degrees near {at} "
            f"({int(bad.sum())} of {len(bad)} searches); an edge there has no creeping rays: round it off in F"
        )


def _normals(compiled: Compiled, points: FloatArray) -> FloatArray:
    gradient = evaluated(compiled, points)[1]
    with np.errstate(all="ignore"):
        return np.asarray(gradient / np.linalg.norm(gradient, axis=1, keepdims=True))


def kinks(compiled: Compiled, points: FloatArray, spacing: float, size: float) -> tuple[FloatArray, FloatArray]:
    """Places (m, 3) towards which the curvature grows without bound, grad F need not vanish there, and curvatures (m,).

    From where it is largest, points go to the most curved of some places about them, ever closer by.
    """
    reach, rng = spacing, np.random.default_rng(0)
    most, _ = _bend(compiled, points, np.inf)
    chosen = np.argsort(-most)[:SUSPECTS]
    at, most = points[chosen], most[chosen]
    # each 0.7 times as wide as the last: it ends 1e-10 cells from where it leads
    for _ in range(60):
        tried = at[:, None] + reach * rng.normal(size=(len(at), 8, 3))
        bend, tried = _bend(compiled, tried, reach)
        best = np.argmax(bend, axis=1)
        rows = np.arange(len(at))
        up = bend[rows, best] > most
        at = np.where(up[:, None], tried[rows, best], at)
        most = np.where(up, bend[rows, best], most)
        reach *= 0.7
    # a disc of thickness 1e-3 radii has 3e6
    bad = most * size > 1e8
    return at[bad], most[bad]


def distinct(places: FloatArray, bends: FloatArray, size: float) -> FloatArray:
    """One of the places (m, 3), L, from each group 1e-4 diagonals wide, that with the largest bend (m,)."""
    left, found = np.argsort(-bends), []
    while len(left):
        found.append(places[left[0]])
        left = left[np.linalg.norm(places[left] - found[-1], axis=1) > 1e-4 * size]
    return np.array(found).reshape(-1, 3)


def polished(compiled: Compiled, place: FloatArray, size: float) -> FloatArray:
    """Tip (3,), L, of a cone near a place: along the mean of grad F about it, its axis, to F = 0."""
    directions = np.random.default_rng(0).normal(size=(AROUND, 3))
    directions = np.concatenate([directions, -directions])
    # radius of a sphere about the tip, in diagonals of the box
    directions *= 1e-6 * size / np.linalg.norm(directions, axis=1, keepdims=True)
    for _ in range(12):
        axis = evaluated(compiled, place + directions)[1].mean(axis=0)
        square = float(axis @ axis)
        if not square > 0:
            break
        place = place - float(evaluated(compiled, place)[0]) / square * axis
    return place


def is_tip(compiled: Compiled, place: FloatArray, size: float) -> bool:
    """Whether the body ends at a place (3,), L, like a cone at its tip, or has a dent like one."""
    from scipy.spatial import cKDTree

    # equal areas along a spiral
    k = np.arange(AROUND) + 0.5
    height, phi = 1 - 2 * k / AROUND, np.pi * (1 + np.sqrt(5.0)) * k
    ring = np.sqrt(1 - height**2)
    sphere = np.stack([ring * np.cos(phi), ring * np.sin(phi), height], axis=-1)
    near = cKDTree(sphere).query(sphere, k=8)[1][:, 1:]
    shares = []
    for radius in (2e-3, 2e-4):
        inside = evaluated(compiled, place + radius * size * sphere)[0] < 0
        shares.append(float(np.mean(inside)))
        for part in (inside, ~inside):
            rows = np.repeat(np.flatnonzero(part), near.shape[1])
            columns = near[part].ravel()
            kept = part[columns]
            if len(np.unique(components(AROUND, rows[kept], columns[kept])[1][part])) != 1:
                return False
    # of a cusp the share falls with the radius
    return min(shares) > 0.7 * max(shares)


def _bend(compiled: Compiled, points: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    """|Hessian|/|grad F| (...), 0 where it is not known, at points brought onto the body by steps <= ``reach``."""
    with np.errstate(all="ignore"):
        points = towards(compiled, points, 2 if np.isfinite(reach) else 0, reach)
        value, gradient, hessian = evaluated(compiled, points)
        slope = np.linalg.norm(gradient, axis=-1)
        bend = np.linalg.norm(hessian, axis=-1) / slope
        known = np.isfinite(bend) & (np.abs(value) < 0.1 * reach * slope)
    return np.where(known, bend, 0.0), points


def samples_of(space: ExpressionSpace, box: FloatArray, nodes: int) -> Samples:
    """F on a grid of nearly cubic cells with ``nodes`` along the longest side."""
    side = box[1] - box[0]
    counts = np.clip(np.ceil(side / side.max() * (nodes - 1)).astype(int) + 1, 17, nodes)
    axes = [np.linspace(box[0, k], box[1, k], counts[k]) for k in range(3)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    with np.errstate(all="ignore"):
        values = np.asarray(space.functions.value(x, y, z)[0], dtype=float)
    return Samples(np.broadcast_to(values, x.shape).copy(), box[0], side / (counts - 1))


def found_box(space: ExpressionSpace) -> FloatArray:
    """Box (2, 3), L, around the one body, from the smallest cube about the origin that holds it.

    Raises
    ------
    ValueError
        If there is no body, it is open, or no cube of a known size holds it alone.
    """
    open_cubes = 0
    for k, half in enumerate(SIZES):
        samples = samples_of(space, np.array([[-half] * 3, [half] * 3]), COARSE)
        if not np.any(samples.values < 0):
            continue
        if np.any(samples.on_faces() < 0):
            open_cubes += 1
            continue
        for larger in SIZES[k + 1 : k + 6]:
            around = samples_of(space, np.array([[-larger] * 3, [larger] * 3]), COARSE)
            away = np.any(around.values < 0, axis=(1, 2)).sum()
            if np.any(around.on_faces() < 0) or (away > 0 and _beyond(around, half)):
                raise ValueError(
                    f"F < 0 inside the cube of half width {half:g} about the origin, and again beyond it: "
                    "several bodies or an unbounded one; give bounds around the one you mean"
                )
        return tightened(space, samples)
    if open_cubes:
        raise ValueError(
            f"F < 0 reaches the faces of every cube about the origin up to half width {SIZES[-1]:g}: F = 0 is open, "
            "unbounded or has the sign turned; F must be positive outside the body, or give bounds"
        )
    raise ValueError(
        f"F is nowhere negative on grids of {COARSE} nodes a side about the origin, half widths {SIZES[0]:g} to "
        f"{SIZES[-1]:g}: no body, the sign turned, or a body too small or too far off; give bounds"
    )


def _beyond(samples: Samples, half: float) -> bool:
    """Whether F < 0 at a node outside the cube of this half width."""
    where = samples.origin + np.argwhere(samples.values < 0) * samples.spacing
    return bool(np.any(np.abs(where) > half))


def tightened(space: ExpressionSpace, samples: Samples) -> FloatArray:
    """Box (2, 3), L, just around the nodes with F < 0, sampled again four times."""
    for _ in range(4):
        low, high = samples.inside
        # wider than the body by a part of its half widths
        reach = 0.12 * 0.5 * (high - low) + 1.5 * samples.spacing
        box = np.stack([low - reach, high + reach])
        samples = samples_of(space, box, COARSE)
    return box


def examine(expression: str, samples: Samples, given: bool) -> None:
    """ValueError unless F is finite in the box, positive on its faces, and F < 0 and F > 0 are connected."""
    values = samples.values
    if bad := int(np.sum(~np.isfinite(values))):
        raise ValueError(
            f"F = {expression} is not finite at {bad} of {values.size} points of its box; "
            "write it without poles and roots of negative numbers around the body, or give bounds"
        )
    if not np.any(values < 0):
        raise ValueError(f"F is nowhere negative at {values.size} points of the bounds: no body, or the sign turned")
    if bad := int(np.sum(samples.on_faces() < 0)):
        remedy = "give wider bounds, or turn the sign" if given else "give bounds"
        raise ValueError(f"F < 0 at {bad} points on the faces of the bounds: F = 0 is open or cut there; {remedy}")
    if len(bodies := samples.middles()) > 1:
        places = "; ".join(f"{count} grid points about {tuple(m.round(4).tolist())}" for count, m in bodies[:4])
        raise ValueError(f"F = 0 has {len(bodies)} bodies ({places}); give bounds around one of them")
    if samples.has_cavity():
        raise ValueError("F > 0 in a cavity inside the body; its wall is a body of its own: give F of the outer wall")
