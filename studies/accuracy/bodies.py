"""Smooth bodies, each also as a reference has it: convex ones, bent ones, one with a neck and one with a hole."""

from collections.abc import Callable
from functools import cache

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from tests.reference import clouds, dipoles, fundamental, sphere


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


class Ball:
    """Series of the unit sphere by the names of the other references, `fundamental.Solution` and `dipoles`."""

    def __init__(self, k: float, incidences: FloatArray, boundary: Any) -> None:
        self.k, self.directions, self.boundary = k, incidences, boundary
        self.residual = np.zeros(len(incidences))

    def far_field(self, r: FloatArray) -> ComplexArray:
        """Far field (m, d), of a conductor scattered and incident along theta and phi (m, d, 2, 2)."""
        if self.boundary == "pec":
            return np.stack([conducting_ball(self.k, d, r) for d in self.directions], axis=1)
        return np.stack([sphere.far_field(self.k, 1.0, r @ d, self.boundary) for d in self.directions], axis=1)

    def total(self, x: FloatArray) -> Any:
        """Total field (n, d), of a conductor E and H (n, 3, d, 2); on the sphere too."""
        if self.boundary != "pec":
            each = [sphere.total_field(self.k, 1.0, x, d, self.boundary) for d in self.directions]
            return np.stack(each, axis=1)
        pairs = [
            [sphere.pec_total_field(self.k, 1.0, x, d, e) for e in dipoles.frames(d[None])[0]] for d in self.directions
        ]
        return tuple(np.stack([np.stack([one[f] for one in both], -1) for both in pairs], 2) for f in range(2))

    def normal_derivative(self, x: FloatArray, _: FloatArray) -> ComplexArray:
        """du/dn on the sphere (n, d), 1/L."""
        each = [sphere.surface_derivative(self.k, 1.0, x @ d, self.boundary) for d in self.directions]
        return np.stack(each, axis=1)


def conducting_ball(k: float, d: FloatArray, r: FloatArray) -> ComplexArray:
    """Far field of the unit ball, theta and phi scattered by theta and phi incident: (3,), (m, 3) -> (m, 2, 2)."""
    across = np.cross(r, d)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    before, after = dipoles.frames(d[None])[0], dipoles.frames(r)
    total = np.zeros((len(r), 2, 2), dtype=complex)
    # across and in the plane of scattering, as `tests.reference.sphere` has them
    waves = (across, np.cross(across, d)), (across, np.cross(across, r))
    for amplitude, e, s in zip(sphere.pec_far_field(k, 1.0, r @ d), *waves, strict=True):
        total += amplitude[:, None, None] * np.einsum("moc,mc->mo", after, s)[:, :, None] * (e @ before.T)[:, None]
    return total


def reference_of(name: str, k: float, boundary: Any, incidences: FloatArray) -> Any:
    """Fields of a body for incidences (d, 3): by series, dipoles or fundamental solutions, 6 or 8 a wavelength."""
    if name == "sphere":
        return Ball(k, incidences, boundary)
    _, body, depth = bodies()[name]
    dense = 8.0 if k < 20 else 6.0
    if boundary == "pec":
        # a conductor's dipoles lie deeper than the scalar sources of some bodies
        depth = {"triaxial": 0.2, "slender": 0.15, "flat": 0.2, "egg": 0.2, "torus": 0.2}.get(name, depth)
        return dipoles.scatter(body, k, incidences, depth=depth, per_wavelength=dense)
    return fundamental.scatter(body, k, incidences, boundary, depth=depth, per_wavelength=dense)


def kind_of(boundary: Any) -> Any:
    """A boundary as creeping takes it, of one that is an admittance too."""
    return boundary if isinstance(boundary, str) else cr.ImpedanceBoundary(boundary)


def rms(values: Any) -> float:
    """Root mean square of absolute values, NaN of none."""
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if np.size(values) else float("nan")


def random_directions(rng: np.random.Generator, count: int) -> FloatArray:
    """Unit vectors (count, 3), evenly at random."""
    r = rng.normal(size=(count, 3))
    return np.asarray(r / np.linalg.norm(r, axis=1, keepdims=True))
