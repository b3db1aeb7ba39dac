"""Smooth bodies, each also as a reference has it: convex ones, bent ones, one with a neck and one with a hole."""

from collections.abc import Callable
from functools import cache

import numpy as np

import scatterers as sc
from creeping._typing import Any, FloatArray
from tests.reference import clouds


def _two_balls(gap: float) -> tuple[str, Callable[[FloatArray], FloatArray], Callable[[FloatArray], FloatArray]]:
    """Smooth union of two balls with centres on x at plus and minus ``gap``: as an expression, F and grad F."""
    centres = np.array([[gap, 0, 0], [-gap, 0, 0]])

    def weights(x: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-8 * (np.sum((x[..., None, :] - centres) ** 2, axis=-1) - 0.36)))

    def level(x: FloatArray) -> FloatArray:
        return np.asarray(-np.log(weights(x).sum(axis=-1)) / 8)

    def gradient(x: FloatArray) -> FloatArray:
        w = weights(x)
        return np.asarray(np.sum(w[..., None] * 2 * (x[..., None, :] - centres), axis=-2) / w.sum(axis=-1)[..., None])

    text = "+".join(f"exp(-8*((x-{c})**2+y**2+z**2-0.36))" for c in (gap, -gap))
    return f"-log({text})/8", level, gradient


def _egg_level(x: FloatArray) -> FloatArray:
    return np.asarray(np.sum(x**2, axis=-1) + 0.35 * x[..., 2] * (x[..., 0] ** 2 + x[..., 1] ** 2) - 1)


def _egg_gradient(x: FloatArray) -> FloatArray:
    grow = 2 + 0.7 * x[..., 2]
    up = 2 * x[..., 2] + 0.35 * (x[..., 0] ** 2 + x[..., 1] ** 2)
    return np.stack([grow * x[..., 0], grow * x[..., 1], up], axis=-1)


@cache
def bodies() -> dict[str, tuple[Any, clouds.Spread, float]]:
    """Body, the same for the reference, and the depth of the reference's sources, L."""
    peanut, level, gradient = _two_balls(0.5)
    return {
        "sphere": (sc.Ellipsoid(1, 1, 1), clouds.ellipsoid(1, 1, 1), 0.2),
        "triaxial": (sc.Ellipsoid(1, 0.8, 0.6), clouds.ellipsoid(1, 0.8, 0.6), 0.12),
        "slender": (sc.Ellipsoid(0.5, 0.5, 1.1), clouds.ellipsoid(0.5, 0.5, 1.1), 0.1),
        "flat": (sc.Ellipsoid(1, 1, 0.6), clouds.ellipsoid(1, 1, 0.6), 0.12),
        "egg": (
            sc.Implicit("x**2 + y**2 + z**2 + 0.35*z*(x**2 + y**2) - 1", bounds=[[-1.3] * 3, [1.3] * 3]),
            clouds.star(_egg_level, _egg_gradient, (0, 1)),
            0.12,
        ),
        "twisted": (sc.TwistedEllipsoid(), clouds.twisted_ellipsoid(), 0.12),
        "peanut": (sc.Implicit(peanut), clouds.star(level, gradient, (0, 1, 2)), 0.3),
        "torus": (sc.Torus(), clouds.Torus(1.0, 0.5), 0.12),
    }


DIPOLE_DEPTHS = {
    "triaxial": 0.2,
    "slender": 0.15,
    "flat": 0.2,
    "egg": 0.2,
    "twisted": 0.12,
    "peanut": 0.3,
    "torus": 0.2,
}
"""Depths of a conductor's dipoles, L."""


def random_directions(rng: np.random.Generator, count: int) -> FloatArray:
    """Unit vectors (count, 3), evenly at random."""
    r = rng.normal(size=(count, 3))
    return np.asarray(r / np.linalg.norm(r, axis=1, keepdims=True))
