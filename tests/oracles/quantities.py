"""Quantities along the rays of a fan in plain numpy: rays traced again between its steps, splines of degree 7 along."""

import numpy as np
from scipy.interpolate import make_interp_spline

from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack
from creeping.geometry.surface import normal, size
from creeping.rays.quantities import GAUSS, GUARD, LANES, SHARPEST, START_LANES, RayPoints
from creeping.rays.status import RayStatus
from creeping.rays.tracer import TURN
from creeping.shadow.attachment import line_tangents


def ray_points(fan):
    """Points of every ray of a fan at equal steps, no coarser than its own: times (steps,), points (rays, steps)."""
    parts = substeps(fan)
    step = fan.length / ((len(fan.travel_time) - 1) * parts)
    states = _refined(fan, parts, step)
    times = step * np.arange(states.shape[1] - 2 * GUARD)
    inner = slice(GUARD, -GUARD)
    lanes = np.empty((len(states), len(times), LANES))
    lanes[..., 0:8] = states[:, inner]
    scale = size(fan.body)
    lanes[..., 8] = np.unwrap(np.arctan2(-scale * lanes[..., 7], lanes[..., 6]), axis=1)
    if len(states):
        _along(fan, states, step, lanes)
    launched = np.isin(fan.status, (RayStatus.OK, RayStatus.DETACHED, RayStatus.NON_SMOOTH))
    alive = launched[:, None] & (times < fan.detachment[:, None])
    return times, RayPoints(lanes, _starts(fan, lanes), np.broadcast_to(times, alive.shape), alive, scale)


def substeps(fan):
    """Parts of a step of the fan so that the ray turns by no more than TURN in one."""
    step = float(fan.travel_time[1] - fan.travel_time[0])
    steepest = float(np.max(np.abs(fan.curvature), initial=0.0))
    return max(1, int(np.ceil(step * steepest / TURN)), int(np.ceil(16 / (len(fan.travel_time) - 1))))


def _refined(fan, parts, step):
    """x, p, J, J' at the finer steps and GUARD steps beyond both ends: (rays, steps, 8)."""
    rays, steps = fan.spreading.shape
    offsets = step * np.arange(max(parts, GUARD + 1), dtype=float)
    forward = np.concatenate([fan.points, fan.directions], axis=-1).reshape(-1, 6)
    traced = trace_states(fan.body, pack(forward[:, :3], forward[:, 3:], jacobi=True), offsets, rtol=1e-11)
    traced = traced.reshape(rays, steps, len(offsets), 10)
    J, rate = fan.spreading[..., None], fan.spreading_rate[..., None]
    out = np.empty((rays, steps, len(offsets), 8))
    out[..., :6] = traced[..., :6]
    out[..., 6] = J * traced[..., 6] + rate * traced[..., 8]
    out[..., 7] = J * traced[..., 7] + rate * traced[..., 9]
    # behind the launch point: the ray that arrives there, traced back
    back = trace_states(fan.body, pack(fan.points[:, 0], -fan.directions[:, 0], jacobi=True), offsets, rtol=1e-11)
    before = np.concatenate([back[..., :3], -back[..., 3:6], back[..., 6:7], -back[..., 7:8]], axis=-1)
    return np.concatenate(
        [
            before[:, GUARD:0:-1],
            out[:, :-1, :parts].reshape(rays, (steps - 1) * parts, 8),
            out[:, -1, : GUARD + 1],
        ],
        axis=1,
    )


def _starts(fan, lanes):
    starts = np.empty((*lanes.shape[:2], START_LANES))
    starts[..., 0] = fan.eikonal[:, :1]
    n0 = normal(fan.body, fan.points[:, 0])
    b0 = np.cross(n0, fan.line.direction)
    tangents = line_tangents(fan.body, fan.points[:, 0], fan.line.direction)
    starts[..., 1] = np.abs(np.sum(b0 * tangents, axis=-1))[:, None]
    starts[..., 2:5] = lanes[:, :1, 9:12]
    starts[..., 5] = lanes[:, :1, 12]
    starts[..., 6:9] = n0[:, None]
    starts[..., 9] = 0.0
    return starts


def _along(fan, states, step, lanes):
    """Fill κₙ with its derivatives, κ_t and the integrals."""
    x, p = states[..., 0:3], states[..., 3:6]
    gradient = fan.body.gradient(x)
    g = np.linalg.norm(gradient, axis=-1)
    H = fan.body.hessian(x)
    b = np.cross(gradient / g[..., None], p)
    curvatures = np.stack([np.einsum("...i,...ij,...j->...", v, H, v) / g for v in (p, b)], axis=-1)
    t = step * (np.arange(states.shape[1], dtype=float) - GUARD)
    both = make_interp_spline(t, curvatures, k=7, axis=1)
    first, second = both.derivative(1), both.derivative(2)
    inner = t[GUARD:-GUARD]
    lanes[..., 9], lanes[..., 12] = curvatures[:, GUARD:-GUARD, 0], curvatures[:, GUARD:-GUARD, 1]
    lanes[..., 10], lanes[..., 11] = first(inner)[..., 0], second(inner)[..., 0]
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)

    def integral(start, length, rays):
        """Over steps (m,) from their starts: rays x m x 5."""
        at = (start[:, None] + length[:, None] * (nodes + 1) / 2).ravel()
        values = both(at)[rays]
        terms = _integrands(values[..., 0], first(at)[rays][..., 0], second(at)[rays][..., 0], values[..., 1])
        terms = terms.reshape(*terms.shape[:-2], len(start), GAUSS, 5)
        return np.asarray(np.einsum("...mgi,g->...mi", terms, weights / 2) * length[:, None])

    pieces = integral(inner[:-1], np.diff(inner), slice(None))
    # a ray that detaches within a step is integrated up to there
    ends = np.clip(fan.detachment[:, None] - inner[:-1], 0.0, np.diff(inner))
    for ray in np.flatnonzero(fan.detachment < inner[-1]):
        cut = np.flatnonzero(ends[ray] < np.diff(inner))
        if not len(cut):
            continue
        pieces[ray, cut] = 0.0
        pieces[ray, cut[0]] = integral(inner[cut[:1]], ends[ray, cut[:1]], ray)[0]
    lanes[:, 0, 13:18] = 0.0
    lanes[:, 1:, 13:18] = np.cumsum(pieces, axis=1)


def _integrands(kappa, rate, bend, transverse):
    """The five integrands from κₙ, κₙ', κₙ'', κ_t: (...) -> (..., 5)."""
    positive = np.maximum(kappa, 0.0)
    root = np.cbrt(positive)
    with np.errstate(divide="ignore", invalid="ignore"):
        variation = -bend / positive**3 + 4 / 3 * rate**2 / positive**4
    variation = np.clip(np.nan_to_num(variation, nan=0.0), -SHARPEST, SHARPEST)
    return np.stack([root, root**2, root**4, root * transverse, root**4 * variation], axis=-1)
