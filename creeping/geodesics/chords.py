"""Rays between the states to which they are traced, coarsely: cubics with the directions at both ends, and chords.

Enough to ask on which piece of a body a ray is, SAMPLE by SAMPLE; `hermite` is what integrals are taken along.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.geodesics.states import P, X


def windows(times: FloatArray, most: float) -> list[tuple[FloatArray, list[tuple[int, int]]]]:
    """Runs of stops from 0 through ascending times, no longer than ``most``, and which of each are which of the times.

    Examples
    --------
    >>> [(stops.tolist(), wanted) for stops, wanted in windows(np.array([0.0, 1.0, 4.0]), 2.0)]
    [([0.0, 1.0], [(0, 0), (1, 1)]), ([1.0, 2.5], []), ([2.5, 4.0], [(1, 2)])]
    """
    now, runs, stops = 0.0, [], [0.0]
    wanted: list[tuple[int, int]] = []
    for column, time in enumerate(times):
        while time - now > most * (1 + 1e-9):
            parts = np.ceil((time - now) / most)
            if len(stops) > 1:
                runs.append((np.array(stops), wanted))
                now, stops, wanted = stops[-1], [stops[-1]], []
                continue
            now += (time - now) / parts
            runs.append((np.array([stops[0], now]), wanted))
            stops, wanted = [now], []
        if time > stops[-1]:
            stops.append(float(time))
        wanted = [*wanted, (len(stops) - 1, column)]
    runs.append((np.array(stops), wanted))
    return runs


def cubics(a: FloatArray, b: FloatArray, long: FloatArray, shares: FloatArray) -> FloatArray:
    """Points at shares (m,) of the cubics between neighbouring states (n, k, lanes), ``long`` (n, k): (n, k, m, 3)."""
    u, h = shares[:, None], long[..., None, None]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[..., None, X] + u**2 * (3 - 2 * u) * b[..., None, X]
    return np.asarray(ends + h * u * (1 - u) * ((1 - u) * a[..., None, P] - u * b[..., None, P]))


def cubic_at(a: FloatArray, b: FloatArray, long: FloatArray, share: FloatArray) -> FloatArray:
    """Point at a share (n,) of each cubic: (n, 3)."""
    u, h = share[:, None], long[:, None]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[:, X] + u**2 * (3 - 2 * u) * b[:, X]
    return np.asarray(ends + h * u * (1 - u) * ((1 - u) * a[:, P] - u * b[:, P]))


def nearest_on(path: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of each chord of paths (n, m + 1, 3) at which it is nearest to a point, and how near: (n, m), (n, m)."""
    along, away = np.diff(path, axis=1), point - path[:, :-1]
    with np.errstate(invalid="ignore"):
        share = np.clip(np.sum(away * along, axis=-1) / np.maximum(np.sum(along**2, axis=-1), 1e-300), 0.0, 1.0)
        return share, np.asarray(np.linalg.norm(away - share[..., None] * along, axis=-1))
