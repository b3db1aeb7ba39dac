"""The exact fields that `studies.reference.stored` keeps: bodies, waves and points of each, and how they are solved."""

import numpy as np

from studies.reference import slots
from studies.reference.clouds import ellipsoid
from studies.reference.stored import Arrays

HEIGHTS = (0.05, 0.08, 0.11, 0.14)
"""Of sources above their ports, L."""


def ellipsoid_slots() -> Arrays:
    """Slots along two tangents at a port of the ellipsoid (0.75, 0.9, 1.15), k = 12, at points all about it."""
    rng = np.random.default_rng(1)
    sources, points = rng.normal(size=(1, 3)), rng.normal(size=(60, 3))
    sources, points = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (sources, points))
    # off the planes of symmetry, where the dipoles would meet their images
    sources = np.sign(sources) * np.maximum(np.abs(sources), 0.3)
    sources /= np.linalg.norm(sources, axis=1, keepdims=True)
    points = points[np.max(points @ sources.T, axis=1) < 0.95]
    found = slots.coupled_slots(ellipsoid(0.75, 0.9, 1.15), 12.0, sources, points, depth=0.25, heights=HEIGHTS)
    return {"ports": found.ports, "points": found.points, "tangents": found.tangents, "values": found.values}
