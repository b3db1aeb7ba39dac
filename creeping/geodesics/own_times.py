"""Rays traced each to a time of its own, in one call; those that get into trouble are NaN and stop no others.

The attenuation integral is a lane of the trace where kappa_n stays well above 0; elsewhere `attenuation` finds where
the ray detaches. Where kappa_n <= 0 at the start, the ray detaches there.

Sources: Derivations, R3 and R13.
"""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import IntegrationError
from creeping.geodesics.attenuation import DIP, curvature_values, with_attenuation
from creeping.geodesics.integrator import error_scale
from creeping.geodesics.states import ATTENUATION, DETACHMENT, WHOLE
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import size
from creeping.kernels.threads import CHUNK, in_slices

STEPS = 500
"""Steps after which a ray is given up: an interval takes a few, next to a tip some tens."""


def trace_own(body: Any, states: FloatArray, times: FloatArray, *, rtol: float) -> FloatArray:
    """Trace states (n, 6, 10 or 12) of an unweighted body, each to its time (n,): (n, the same), NaN where it fails.

    Each ray has steps of its own by the relative tolerance, so that it does not depend on its company.
    """
    if states.shape[1] < WHOLE:
        return _traced(body, states, times, rtol)
    out = np.empty(states.shape)
    lanes = ATTENUATION + 1
    out[:, :lanes] = _traced(body, states[:, :lanes], times, rtol)
    out[:, DETACHMENT] = states[:, DETACHMENT]
    creeping = np.isinf(states[:, DETACHMENT]) & np.all(np.isfinite(out[:, :lanes]), axis=1)
    first, last = curvature_values(body, states), curvature_values(body, np.nan_to_num(out))
    parted = creeping & ~(first > 0)
    out[parted, DETACHMENT] = 0.0
    stays = parted | np.isfinite(states[:, DETACHMENT])
    out[stays, ATTENUATION] = states[stays, ATTENUATION]
    low = creeping & (first > 0) & (np.minimum(first, last) < DIP * np.maximum(first, last))
    for time in np.unique(times[low]):
        rows = np.flatnonzero(low & (times == time))
        try:
            found = with_attenuation(body, states[rows], np.array([time]), rtol=rtol, step=None)[:, 0]
            out[rows, ATTENUATION:] = found[:, ATTENUATION:]
        except IntegrationError:
            out[rows] = np.nan
    return out


def _traced(body: Any, states: FloatArray, times: FloatArray, rtol: float) -> FloatArray:
    from creeping.geodesics.kernels.integrator import integrate_own

    states, out = np.ascontiguousarray(states, dtype=float), np.empty(states.shape)
    times = np.ascontiguousarray(times, dtype=float)
    controls = error_scale(body, states.shape[1]), rtol, 0.05 * size(body), STEPS
    with evaluators(body) as parts, np.errstate(all="ignore"):
        in_slices(
            lambda some: integrate_own(*parts, states[some], times[some], *controls, out[some]),
            len(states),
            multiple=CHUNK,
        )
    return out
