"""Where rays come to a place at which the body, by its own word (`Surface.rough`), is not smooth enough for them."""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geometry.surface import Surface, size

ROUGH_SPACING = 0.005
"""Spacing at which rays are looked at for rough ground, in sizes of the body,"""
ROUGH_BLOCK = 64
"""so many rays at a time."""


def rough_from(body: Surface, points: FloatArray, times: FloatArray) -> FloatArray:
    """Travel time (rays,) of the last place before rough ground, inf on rays that do not come there."""
    rough: Any = getattr(body, "rough", None)
    if rough is None or not points.size:
        return np.full(len(points), np.inf)
    # between the steps on chords: rough places may be small
    parts = int(np.ceil(np.max(np.diff(times), initial=0.0) / (ROUGH_SPACING * size(body)))) or 1
    fine = np.interp(np.arange((len(times) - 1) * parts + 1) / parts, np.arange(len(times)), times)
    share = (np.arange(parts) / parts)[:, None]
    found = np.full(len(points), np.inf)
    for first in range(0, len(points), ROUGH_BLOCK):
        path = points[first : first + ROUGH_BLOCK, :, None]
        dense = path[:, :-1] + share * (path[:, 1:] - path[:, :-1])
        dense = np.concatenate([dense.reshape(len(path), -1, 3), path[:, -1]], axis=1)
        met = rough(dense)
        before = np.maximum(np.argmax(met, axis=1) - 1, 0)
        found[first : first + ROUGH_BLOCK] = np.where(met.any(axis=1), fine[before], np.inf)
    return found
