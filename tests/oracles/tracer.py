"""The tracer in plain numpy: all rays together, with one common step."""

import numpy as np
from scipy.integrate import DOP853

from creeping.geodesics.bundle import project_bundle
from creeping.geodesics.equations import vector_field
from creeping.geodesics.integrator import MAX_STEPS, error_scale
from creeping.geodesics.kernels.integrator import LANDING, STRETCHED
from creeping.geometry.curvature import gaussian_curvature, normal_curvature
from creeping.geometry.speed import speed_hessian, speed_of, speed_values


def metric_curvature(body, points):
    """Curvature G of the metric ds/c, 1/time^2; the Gaussian K without a weight: (..., 3) -> (...)."""
    gauss = gaussian_curvature(body, points)
    speed = speed_of(body)
    if speed is None:
        return gauss
    g, h = body.gradient(points), body.hessian(points)
    norm = np.linalg.norm(g, axis=-1)
    n = g / norm[..., None]
    c, dc, ddc = speed.value(points), speed.gradient(points), speed_hessian(body, points)
    along_n = np.sum(n * dc, axis=-1)
    mean = (np.trace(h, axis1=-2, axis2=-1) - np.einsum("...i,...ij,...j->...", n, h, n)) / norm
    laplacian = np.trace(ddc, axis1=-2, axis2=-1) - np.einsum("...i,...ij,...j->...", n, ddc, n) - mean * along_n
    return c**2 * gauss + c * laplacian - (np.sum(dc * dc, axis=-1) - along_n**2)


def derivative(body, states):
    """Time derivative of states (n, 6, 10 or 11)."""
    k = np.empty_like(states)
    k[:, :3], k[:, 3:6] = vector_field(body, states[:, :3], states[:, 3:6])
    if states.shape[1] > 6:
        curvature = metric_curvature(body, states[:, :3])
        k[:, 6], k[:, 8] = states[:, 7], states[:, 9]
        k[:, 7], k[:, 9] = -curvature * states[:, 6], -curvature * states[:, 8]
    if states.shape[1] > 10:
        kappa = normal_curvature(body, states[:, :3], states[:, 3:6])
        k[:, 10] = speed_values(body, states[:, :3]) * np.maximum(kappa, 0.0) ** (2 / 3)
    return k


def trace(body, states, times, method, *, rtol, step):
    """Trace all states with one common step; arguments as for `trace_states`, and a tableau."""
    y = np.array(states, dtype=float)
    out = np.full((len(y), len(times), y.shape[1]), np.nan)
    scale = error_scale(body, y.shape[1])
    goal, left, h, m, used = 0.0, 0.0, step, 0, 0
    while True:
        if left == 0:
            while m < len(times) and times[m] <= goal:
                out[:, m], m = y, m + 1
            if m == len(times):
                return out
            left, goal, used = float(times[m]) - goal, float(times[m]), 0
            equal = max(1, int(np.ceil(left / step - 1e-9)))
        trial = left / (np.ceil(left / (STRETCHED * h)) if rtol > 0 else equal - used)
        ahead = left + (float(times[-1]) - goal)
        if rtol > 0 and y.shape[1] <= 10 and trial < LANDING * h:
            trial = min(h, ahead)
        with np.errstate(all="ignore"):
            new, error, k = _step(body, y, trial, method, rtol, scale)
        used += 1
        if used > MAX_STEPS or (trial < 1e-12 * step and trial < left) or (rtol == 0 and not np.all(np.isfinite(new))):
            return out
        if rtol > 0 and not error < 1:
            h = trial * (max(0.2, 0.9 * error**-0.125) if np.isfinite(error) else 0.2)
            continue
        if trial > left:
            interpolant = _interpolant(body, y, new, trial, k)
            now = goal - left
            goal = float(times[-1]) if trial >= ahead else min(now + trial, float(times[-1]))
            while times[m] < goal:
                out[:, m] = _projected(body, interpolant((times[m] - now) / trial))
                m += 1
            left, goal, used = float(times[m]) - goal, float(times[m]), 0
        else:
            left -= trial
        y = _projected(body, new)
        if rtol > 0:
            longer = np.sqrt(h * trial) * min(5.0, (0.25 / max(error, 1e-8)) ** (1 / 16))
            h = max(h, longer) if trial < 0.5 * h else longer


def _projected(body, states):
    out = states.copy()
    out[:, :3], out[:, 3:6] = project_bundle(body, states[:, :3], states[:, 3:6])
    return out


def _step(body, y, h, method, rtol, scale):
    """One step, its largest error in units of the tolerance, and its stages."""
    stages = len(method.b)
    k = np.empty((stages + 1, *y.shape))
    k[0] = derivative(body, y)
    for s in range(1, stages):
        k[s] = derivative(body, y + h * np.tensordot(method.a[s, :s], k[:s], 1))
    new = y + h * np.tensordot(method.b, k[:stages], 1)
    if rtol == 0:
        return new, 0.0, k
    k[stages] = derivative(body, new)
    tolerance = rtol * np.maximum(scale, np.maximum(np.abs(y), np.abs(new)))
    sum3 = np.sum((np.tensordot(method.e3, k, 1) / tolerance) ** 2, axis=1)
    sum5 = np.sum((np.tensordot(method.e5, k, 1) / tolerance) ** 2, axis=1)
    denominator = np.sqrt((sum5 + 0.01 * sum3) * y.shape[1])
    error = np.divide(h * sum5, denominator, out=np.zeros_like(sum5), where=denominator != 0)
    return new, float(np.max(error)), k


def _interpolant(body, y, new, h, stages):
    """States at fractions of an order-8 step, as scipy evaluates them: by nested factors theta and 1 - theta."""
    k = np.concatenate([stages, np.empty((3, *y.shape))])
    for s, weights in enumerate(DOP853.A_EXTRA, start=13):
        k[s] = derivative(body, y + h * np.tensordot(weights[:s], k[:s], 1))
    change = new - y
    parts = [change, h * k[0] - change, 2 * change - h * (k[12] + k[0]), *h * np.tensordot(DOP853.D, k, 1)]

    def at(theta):
        total = np.zeros_like(y)
        for i, part in enumerate(reversed(parts)):
            total = (total + part) * (theta if i % 2 == 0 else 1 - theta)
        return y + total

    return at
