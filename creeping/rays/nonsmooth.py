"""Where rays come to a place at which the body (`Surface.non_smooth`) is not smooth enough for them."""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geometry.surface import Surface, size

NON_SMOOTH_SPACING = 0.005
"""Spacing at which rays are looked at for non-smooth regions, in sizes of the body,"""
NON_SMOOTH_BLOCK = 64
"""so many rays at a time."""


def non_smooth_from(body: Surface, points: FloatArray, times: FloatArray) -> FloatArray:
    """Travel time (rays,) of the last place before a non-smooth region, inf on rays that do not come there."""
    non_smooth: Any = getattr(body, "non_smooth", None)
    if non_smooth is None or not points.size:
        return np.full(len(points), np.inf)
    # between the steps on chords: non-smooth places may be small
    parts = int(np.ceil(np.max(np.diff(times), initial=0.0) / (NON_SMOOTH_SPACING * size(body)))) or 1
    fine = np.interp(np.arange((len(times) - 1) * parts + 1) / parts, np.arange(len(times)), times)
    share = (np.arange(parts) / parts)[:, None]
    found = np.full(len(points), np.inf)
    for first in range(0, len(points), NON_SMOOTH_BLOCK):
        path = points[first : first + NON_SMOOTH_BLOCK, :, None]
        dense = path[:, :-1] + share * (path[:, 1:] - path[:, :-1])
        dense = np.concatenate([dense.reshape(len(path), -1, 3), path[:, -1]], axis=1)
        met = non_smooth(dense)
        before = np.maximum(np.argmax(met, axis=1) - 1, 0)
        found[first : first + NON_SMOOTH_BLOCK] = np.where(met.any(axis=1), fine[before], np.inf)
    return found
