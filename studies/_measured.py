"""The number under every figure: the error of one g_T0, and of rays at their ends, against direct integration."""

from dataclasses import asdict

import numpy as np

import creeping as cr
from creeping._typing import Any, FloatArray
from creeping.rays.fan import RayFan

CHECKED_RAYS = 64


def map_card(flow: cr.PhaseMap) -> dict[str, Any]:
    """Parameters of a map for a card."""
    return {
        "T0": flow.horizon,
        "charts": len(flow.leaps[-1].state),
        "nodes": list(flow.grid.nodes),
        "degree": flow.grid.degree,
    }


def end_error(
    flow: cr.PhaseMap, points: FloatArray, directions: FloatArray, ends: FloatArray, time: float
) -> cr.ErrorEstimate:
    """Error of rays at one time, against `trace` at 1e-12.

    Parameters
    ----------
    flow : PhaseMap
    points, directions : (n, 3)
        Where the rays start.
    ends : (n, 6)
        (x, p) that the map found at the time.
    time : float
    """
    some = np.unique(np.linspace(0, len(points) - 1, CHECKED_RAYS).astype(int))
    exact = np.concatenate(cr.trace(flow.body, points[some], directions[some], time, rtol=1e-12), axis=-1)
    error = np.linalg.norm(ends[some] - exact, axis=-1)
    return cr.ErrorEstimate(float(np.sqrt(np.mean(error**2))), float(error.max()), len(some))


def error_card(flow: cr.PhaseMap, rays: cr.ErrorEstimate) -> dict[str, Any]:
    """Errors for a card: of one g_T0 and of the rays."""
    return {"map": asdict(flow.error), "rays": asdict(rays)}


def fans_error(fans: list[RayFan]) -> cr.ErrorEstimate:
    """Error at the ends of several fans together."""
    samples = sum(fan.error.samples for fan in fans)
    squares = sum(fan.error.samples * fan.error.rms**2 for fan in fans)
    return cr.ErrorEstimate(float(np.sqrt(squares / samples)), max(fan.error.max for fan in fans), samples)


def headline(flow: cr.PhaseMap, rays: cr.ErrorEstimate, time: float) -> str:
    """Both errors in words."""
    return (
        f"one g_T0 (T0 = {flow.horizon:g}): rms {flow.error.rms:.1e}; rays at t = {time:g}: rms {rays.rms:.1e}, "
        f"max {rays.max:.1e} ({rays.samples} traced)"
    )
