"""Packed tables: displacement, Jacobi matrix and attenuation of a leap in eight lanes, read by one contraction.

    (q1, q2, q3, M11, M21, M12, M22, A),   q0 = (1 - |q|^2)^(1/2),   A = int_0^T0 g(c^(3/2) kappa_n)^(2/3) dt

g(k) = k above a threshold, and bends smoothly to a positive constant below it, so that A is a smooth function of the
ray even where kappa_n vanishes and the ray detaches. What A lacks there is told cell by cell: random rays of each are
carried over one leap by A and by the curvature itself, and where one of them differs by more than the tolerance, or
detaches, the cell is flagged and the kernel takes the curvature.

With S the regularised incomplete beta function of (7, 4) and I its integral, g(k) = t [1 - 2 I(1) + 2 I((k + t)/2t)],
whose first four derivatives are those of k at the threshold t, and whose first seven are 0 at -t.

Sources: Derivations, R17.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geodesics.attenuation import kernel_rules
from creeping.geodesics.states import ATTENUATION, DETACHMENT, WHOLE, pack
from creeping.geometry.surface import size
from creeping.phaseflow.coordinates.rotation import AngleModel, CompiledModel
from creeping.phaseflow.grid import Grid, Leap

SHORTEST = 0.2
"""Least q0 of a displacement: nearer to 0 it is not known well from q."""
LOW, OF_LEAST = 0.1, 0.5
"""Threshold over the largest curvature of the nodes; and over the least, where that is positive."""
TESTED = 4
"""Random rays of a cell."""


def packed_lanes(model: CompiledModel, values: FloatArray, matrices: FloatArray, bent: FloatArray, time: float) -> Any:
    """Lanes (n, 8) at the nodes of displacements, matrices (n, 4) and curvatures (n, 8); None if they are too long."""
    q = values[:, :3]
    if not isinstance(model, AngleModel):
        turned = np.where(values[:, :1] < 0, -values, values)
        if turned[:, 0].min() < SHORTEST:
            return None
        q = turned[:, 1:]
    sampling, _, points, weights, _ = kernel_rules()
    curvature = bent @ sampling[: len(points)].T
    most, least = float(bent.max()), float(curvature.min())
    threshold = min(LOW * most, OF_LEAST * least) if least > 0 else LOW * most
    attenuation = time * (bent_floor(curvature, threshold) ** (2 / 3) @ weights)
    return np.concatenate([q, matrices, attenuation[:, None]], axis=1)


def bent_floor(curvature: FloatArray, threshold: float) -> FloatArray:
    """g of curvatures (...), 1/L, with the threshold, 1/L: (...)."""
    at = np.clip((curvature + threshold) / (2 * threshold), 0.0, 1.0)
    powers = at[..., None] ** np.arange(12)
    bent = threshold * (1 + 2 * (powers @ _integral() - _integral().sum()))
    return np.asarray(np.where(curvature >= threshold, curvature, bent))


@cache
def _integral() -> FloatArray:
    """Coefficients (12,) of I: S is the polynomial of degree 10 whose derivative is t^6 (1 - t)^3 over its integral."""
    density = np.polynomial.Polynomial([0] * 6 + [1]) * np.polynomial.Polynomial([1, -1]) ** 3
    share = density.integ() / density.integ()(1.0)
    return np.asarray(share.integ().coef)


def with_flags(model: CompiledModel, grid: Grid, leap: Leap, tolerance: float) -> Leap:
    """The packed leap with its cells judged, ``tolerance`` of attenuation over a leap in body sizes^(1/3)."""
    allowed = tolerance * size(model.body) ** (1 / 3)
    rng, cells, origin = np.random.default_rng(0), grid.cells.astype(int), grid.origin.astype(int)
    trusting = replace(leap, flagged=np.zeros(leap.jacobi.shape[:4], dtype=np.uint8))
    careful = replace(leap, flagged=np.ones(leap.jacobi.shape[:4], dtype=np.uint8))
    # beyond the unit square no ray is sought, and none is tested
    flagged = np.ones(leap.jacobi.shape[:4], dtype=np.uint8)
    corner = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1).reshape(-1, 3)
    place = corner + np.array([*origin, 0])
    one = np.array([1])
    for chart in range(model.charts):
        bad = np.zeros(len(corner), dtype=bool)
        for _ in range(TESTED):
            u, v, turns = ((corner + rng.random(corner.shape)) / cells).T
            states = model.states(model.at(chart, u, v, 2 * np.pi * turns))
            states = pack(states[:, :3], states[:, 3:], lanes=WHOLE)
            quick, exact = (model.flow(grid, table, states, one)[:, 0] for table in (trusting, careful))
            bad |= ~(np.abs(quick[:, ATTENUATION] - exact[:, ATTENUATION]) <= allowed)
            bad |= np.isfinite(exact[:, DETACHMENT])
        flagged[chart, place[:, 0], place[:, 1], place[:, 2]] = bad
    return replace(leap, flagged=flagged)
