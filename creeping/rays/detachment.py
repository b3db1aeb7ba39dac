"""Where a creeping ray ends: the first travel time at which kappa_n falls to 0.

Between two steps the ray is traced again to Chebyshev-Lobatto times, and the root of the polynomial through kappa_n
there is found by bisection. A step is searched if kappa_n changes sign over it, or may dip below 0 inside it: if a
parabola through three neighbouring values has a negative minimum.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray
from creeping.phaseflow.geodesic import normal_curvature
from creeping.phaseflow.tracing import pack, trace_states
from creeping.surface import Surface

_NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)


def detachment_times(
    body: Surface, points: FloatArray, directions: FloatArray, curvature: FloatArray, times: FloatArray
) -> FloatArray:
    """First zero of kappa_n along each ray, inf if there is none: (rays,).

    Parameters
    ----------
    points, directions : (rays, steps, 3)
    curvature : (rays, steps)
        kappa_n.
    times : (steps,)
        Equally spaced.
    """
    found = np.full(len(points), np.inf)
    if not len(points):
        return found
    found[curvature[:, 0] <= 0] = times[0]
    suspicious = _suspicious(curvature)
    step = float(times[1] - times[0])
    # in the order of time, so that only rays still on the body are searched
    for k in range(len(times) - 1):
        rays = np.flatnonzero(suspicious[:, k] & np.isinf(found))
        if not len(rays):
            continue
        states = trace_states(body, pack(points[rays, k], directions[rays, k]), step * _NODES, rtol=1e-11)
        kappa = normal_curvature(body, states[..., :3], states[..., 3:6])
        found[rays] = times[k] + step * _first_root(kappa)
    return found


def _suspicious(curvature: FloatArray) -> BoolArray:
    """Steps (rays, steps - 1) inside which kappa_n falls or may fall below 0."""
    before, after = curvature[:, :-1], curvature[:, 1:]
    suspicious = (before > 0) & (after <= 0)
    if curvature.shape[1] > 2:
        left, middle, right = curvature[:, :-2], curvature[:, 1:-1], curvature[:, 2:]
        second = left - 2 * middle + right
        slope = 0.5 * (right - left)
        with np.errstate(divide="ignore", invalid="ignore"):
            # twice the depth of the parabola below its middle value, to be safe
            dips = (second > 0) & (np.abs(slope) <= 1.5 * second) & (middle - slope**2 / second <= 0)
        suspicious[:, :-1] |= dips & (left > 0)
        suspicious[:, 1:] |= dips & (middle > 0)
    return np.asarray(suspicious)


def _first_root(values: FloatArray) -> FloatArray:
    """First zero in [0, 1] of the polynomials through the values at the nodes, inf without one: (n, 9) -> (n,)."""
    fine = np.linspace(0, 1, 65)
    sampled = values @ _lagrange(fine).T
    negative = sampled <= 0
    root = np.full(len(values), np.inf)
    for row in np.flatnonzero(negative.any(axis=1)):
        k = int(np.argmax(negative[row]))
        low, high = fine[max(k - 1, 0)], fine[k]
        for _ in range(50):
            middle = 0.5 * (low + high)
            if float(_lagrange(np.array([middle]))[0] @ values[row]) > 0:
                low = middle
            else:
                high = middle
        root[row] = high
    return root


def _lagrange(at: FloatArray) -> FloatArray:
    """Values of the nodes' Lagrange polynomials: (m,) -> (m, 9)."""
    basis = np.ones((len(at), len(_NODES)))
    for j, node in enumerate(_NODES):
        for k, other in enumerate(_NODES):
            if j != k:
                basis[:, j] *= (at - other) / (node - other)
    return basis
