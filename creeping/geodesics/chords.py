"""Rays between the states to which they are traced, coarsely: cubics with the directions at both ends, and chords.

Enough to ask on which piece of a body a ray is, SAMPLE by SAMPLE; `hermite` is what integrals are taken along.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.geodesics.states import P, X


def windows(times: FloatArray, gap: float, most: float) -> list[tuple[FloatArray, list[tuple[int, int]]]]:
    """Stops from 0 through ascending times, ``gap`` apart at most, in runs no longer than ``most``.

    Of each run the stops, and which of them are which of the times.

    Examples
    --------
    >>> [(stops.tolist(), wanted) for stops, wanted in windows(np.array([0.0, 1.0, 4.0]), 2.0, 3.0)]
    [([0.0, 1.0, 2.5], [(0, 0), (1, 1)]), ([2.5, 4.0], [(1, 2)])]
    """
    stops, places = [0.0], []
    for time in times:
        parts = int(np.ceil((time - stops[-1]) / gap * (1 - 1e-9)))
        stops.extend(np.linspace(stops[-1], time, max(parts, 0) + 1)[1:].tolist())
        places.append(len(stops) - 1)
    every, runs, begin = np.array(stops), list[tuple[FloatArray, list[tuple[int, int]]]](), 0
    while True:
        end = int(np.searchsorted(every, every[begin] + most * (1 + 1e-9), side="right")) - 1
        end = min(max(end, begin + 1), len(every) - 1)
        wanted = [(at - begin, column) for column, at in enumerate(places) if begin < at <= end or at == begin == 0]
        runs.append((every[begin : end + 1], wanted))
        if end == len(every) - 1:
            return runs
        begin = end


def cubics(a: FloatArray, b: FloatArray, long: FloatArray, shares: FloatArray) -> FloatArray:
    """Points at shares (m,) of the cubics between neighbouring states (n, k, lanes), ``long`` (n, k): (n, k, m, 3)."""
    u, h = shares[:, None], long[..., None, None]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[..., None, X] + u**2 * (3 - 2 * u) * b[..., None, X]
    return np.asarray(ends + h * u * (1 - u) * ((1 - u) * a[..., None, P] - u * b[..., None, P]))


def cubic_at(a: FloatArray, b: FloatArray, long: FloatArray, share: FloatArray) -> FloatArray:
    """Points at shares (n, m) of each cubic: (n, m, 3)."""
    u, h = share[..., None], long[:, None, None]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[:, None, X] + u**2 * (3 - 2 * u) * b[:, None, X]
    return np.asarray(ends + h * u * (1 - u) * ((1 - u) * a[:, None, P] - u * b[:, None, P]))


def nearest_on(path: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of each chord of paths (n, m + 1, 3) at which it is nearest to a point, and how near: (n, m), (n, m)."""
    along, away = np.diff(path, axis=1), point - path[:, :-1]
    with np.errstate(invalid="ignore"):
        share = np.clip(np.sum(away * along, axis=-1) / np.maximum(np.sum(along**2, axis=-1), 1e-300), 0.0, 1.0)
        return share, np.asarray(np.linalg.norm(away - share[..., None] * along, axis=-1))
