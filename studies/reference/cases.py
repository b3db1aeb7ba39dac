"""The exact fields that `studies.reference.stored` keeps: bodies, waves and points of each, and how they are solved."""

import numpy as np

from studies.reference import dipoles, fundamental, slots
from studies.reference._boundary import FloatArray
from studies.reference.clouds import Body, ellipsoid
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


def capsule(radius: float, half: float) -> Body:
    """A capsule along z, its cylinder from -half to half: where rays from its middle leave it."""

    def to_body(X: FloatArray) -> FloatArray:
        across, z = np.hypot(X[..., 0], X[..., 1]), np.abs(X[..., 2])
        side = radius / np.maximum(across, 1e-12)
        end = half * z + np.sqrt(np.maximum(radius**2 - (half * across) ** 2, 0))
        return np.asarray(np.where(side * z > half, end, side)[..., None] * X)

    def gradient(x: FloatArray) -> FloatArray:
        return np.asarray(x - np.clip(x, -half, half) * [0, 0, 1])

    return Body(to_body, gradient, (0, 1, 2))


def capsule_echoes() -> Arrays:
    """Backscatter, L, of the capsule of radius 0.4 and length 1.8, k = 20, by elevation above broadside, degrees."""
    elevation = np.array([0.0, 15.0, 25.0, 45.0, 80.0])
    e, body = np.radians(elevation), capsule(0.4, 0.5)
    r = np.stack([np.cos(e), 0 * e, np.sin(e)], axis=1)
    soft = fundamental.scatter(body, 20.0, -r, "soft", depth=0.1).far_field(r)
    pec = dipoles.scatter(body, 20.0, -r, depth=0.1).far_field(r)
    return {"elevation": elevation} | {
        name: np.stack([values[i, i] for i in range(len(r))]) for name, values in (("soft", soft), ("pec", pec))
    }
