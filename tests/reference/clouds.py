"""Points spread evenly over smooth closed bodies that are maps of the unit sphere.

A body is x = map(X), |X| = 1, with the gradient of its level set for the normals. Points stand in bands along z, each
of area h times its length, evenly by area in every band, so that each point answers for one area h²:

    dA = |x_z x x_phi| dz dphi,    X = (sqrt(1 - z²) cos phi, sqrt(1 - z²) sin phi, z)

A torus is no such map; it has bands of its own. A body that is its own mirror image in the planes x_i = 0, i in
mirrors, has points on the sides x_i > 0 only, none on a plane; the other points are their images.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Protocol

import numpy as np

from tests.reference.conditions import FloatArray

GRID = 240
"""Cells along z and phi of the area table; linear interpolation in it moves a point by less than a tenth of h."""


Field = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Cloud:
    """Points and outward unit normals.

    Attributes
    ----------
    points, normals : (n, 3), L and 1
    """

    points: FloatArray
    normals: FloatArray

    def __len__(self) -> int:
        return len(self.points)


class Spread(Protocol):
    """What references ask of a body: its area, points on it and its mirrors."""

    @property
    def mirrors(self) -> tuple[int, ...]:
        """Axes i whose plane x_i = 0 is a mirror of the body."""

    def area(self) -> float:
        """Area of the whole body, L²."""

    def spread(self, spacing: float) -> Cloud:
        """Points a spacing apart, L, on the sides x_i > 0 of the mirrors."""


@dataclass(frozen=True)
class Body:
    """Smooth closed body, the image of the unit sphere.

    Attributes
    ----------
    map, gradient : (n, 3) -> (n, 3)
        Unit vectors X to points x, L; points to grad F, outward and of any length.
    mirrors : tuple of int
        Axes i whose plane x_i = 0 is a mirror of map and body.
    """

    map: Field
    gradient: Field
    mirrors: tuple[int, ...] = ()

    def area(self) -> float:
        """Area of the whole body, L²."""
        _, _, cells = self._cells()
        return float(cells.sum()) * int(2 ** len(self.mirrors))

    def spread(self, spacing: float) -> Cloud:
        """Points a spacing h apart, L, on the sides x_i > 0 of the mirrors."""
        z, phi, cells = self._cells()
        edges = self._band_edges(z, phi, spacing)
        table = np.concatenate([np.zeros((1, len(phi) - 1)), np.cumsum(cells, axis=0)])
        upright: list[FloatArray] = []
        periodic = not {0, 1} & set(self.mirrors)
        for band, (low, high) in enumerate(pairwise(edges.tolist())):
            share = np.array([np.interp(high, z, column) - np.interp(low, z, column) for column in table.T])
            filled = np.concatenate([[0.0], np.cumsum(share)])
            count = max(1, round(filled[-1] / spacing**2))
            # without a mirror along phi the bands are turned by the golden ratio, lest they line up
            shift = (0.618034 * band) % 1.0 if periodic else 0.5
            angles = np.interp((np.arange(count) + shift) / count * filled[-1], filled, phi)
            upright.append(np.stack([np.full(count, 0.5 * (low + high)), angles], axis=-1))
        chosen = np.concatenate(upright)
        points = self.map(_unit(chosen[:, 0], chosen[:, 1]))
        normals = self.gradient(points)
        return Cloud(points, normals / np.linalg.norm(normals, axis=-1, keepdims=True))

    def _cells(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Grid z (n+1,), phi (n+1,) over the fundamental domain, and cell areas (n, n), L²."""
        # polar angles are even, so that cells do not grow long at the poles
        z = -np.cos(np.linspace(np.pi / 2 if 2 in self.mirrors else 0.0, np.pi, GRID + 1))
        low, high = {(): (0, 4), (0,): (-1, 1), (1,): (0, 2), (0, 1): (0, 1)}[tuple(sorted({0, 1} & set(self.mirrors)))]
        phi = np.linspace(low * np.pi / 2, high * np.pi / 2, GRID + 1)
        x = self.map(_unit(*np.meshgrid(z, phi, indexing="ij")).reshape(-1, 3)).reshape(GRID + 1, GRID + 1, 3)
        crossed = np.cross(x[1:, 1:] - x[:-1, :-1], x[1:, :-1] - x[:-1, 1:])
        return z, phi, np.asarray(0.5 * np.linalg.norm(crossed, axis=-1))

    def _band_edges(self, z: FloatArray, phi: FloatArray, spacing: float) -> FloatArray:
        """Edges in z of bands of even mean height about h."""
        x = self.map(_unit(*np.meshgrid(z, phi, indexing="ij")).reshape(-1, 3)).reshape(GRID + 1, GRID + 1, 3)
        steps = np.mean(np.linalg.norm(np.diff(x, axis=0), axis=-1), axis=1)
        height = np.concatenate([[0.0], np.cumsum(steps)])
        bands = max(1, round(height[-1] / spacing))
        return np.asarray(np.interp(np.linspace(0, height[-1], bands + 1), height, z))


@dataclass(frozen=True)
class Torus:
    """Torus about z with a centre circle of radius R and a tube of radius r, L."""

    R: float
    r: float
    mirrors: tuple[int, ...] = (0, 1, 2)

    def area(self) -> float:
        """Area of the whole body, L²."""
        return 4 * np.pi**2 * self.R * self.r

    def spread(self, spacing: float) -> Cloud:
        """Points a spacing h apart, L, on the sides x_i > 0 of all three mirrors."""
        bands = max(1, round(np.pi * self.r / spacing))
        points, normals = [], []
        for theta in (np.arange(bands) + 0.5) * np.pi / bands:
            reach = self.R + self.r * np.cos(theta)
            count = max(1, round(0.5 * np.pi**2 * self.r * reach / bands / spacing**2))
            psi = (np.arange(count) + 0.5) * 0.5 * np.pi / count
            around = np.stack([np.cos(psi), np.sin(psi), 0 * psi], axis=-1)
            up = np.array([0.0, 0.0, np.sin(theta)])
            points.append(reach * around + self.r * up)
            normals.append(np.cos(theta) * around + up)
        return Cloud(np.concatenate(points), np.concatenate(normals))


def _unit(z: FloatArray, phi: FloatArray) -> FloatArray:
    """Unit vectors: (...), (...) -> (..., 3)."""
    rim = np.sqrt(np.maximum(1 - z**2, 0.0))
    return np.stack([rim * np.cos(phi), rim * np.sin(phi), z], axis=-1)


def images(mirrors: tuple[int, ...]) -> FloatArray:
    """Signs of the three axes for the group of reflections, the identity first: (2^m, 3)."""
    signs = np.ones((2 ** len(mirrors), 3))
    for row, choice in enumerate(product((1.0, -1.0), repeat=len(mirrors))):
        signs[row, list(mirrors)] = choice
    return signs


def ellipsoid(a: float, b: float, c: float) -> Body:
    """Ellipsoid of half-axes a, b, c, L."""
    axes = np.array([a, b, c])
    return Body(lambda X: np.asarray(X * axes), lambda x: np.asarray(x / axes**2), (0, 1, 2))


def twisted_ellipsoid() -> Body:
    """x²/0.25 + (y - 0.2 cos πz)²/0.25 + z² = 1, concave near z = 0, y < 0."""

    def to_body(X: FloatArray) -> FloatArray:
        bend = 0.2 * np.cos(np.pi * X[..., 2])
        return np.stack([0.5 * X[..., 0], 0.5 * X[..., 1] + bend, X[..., 2]], axis=-1)

    def gradient(x: FloatArray) -> FloatArray:
        off = 4 * (x[..., 1] - 0.2 * np.cos(np.pi * x[..., 2]))
        return np.stack([4 * x[..., 0], off, x[..., 2] + 0.2 * np.pi * np.sin(np.pi * x[..., 2]) * off], axis=-1)

    return Body(to_body, gradient, (0, 2))


def star(level: Field, gradient: Field, mirrors: tuple[int, ...] = (), start: float = 1.0) -> Body:
    """Body F(x) < 0 that every ray from the origin leaves once.

    Parameters
    ----------
    level, gradient : (n, 3) -> (n,) and (n, 3)
        F, negative inside, and grad F.
    mirrors : tuple of int
    start : float
        First guess of the radius, L.
    """

    def to_body(X: FloatArray) -> FloatArray:
        r = np.full(X.shape[:-1], start)
        for _ in range(60):
            x = r[..., None] * X
            step = level(x) / np.sum(gradient(x) * X, axis=-1)
            # a step is held to half the radius: Newton does not cross the origin
            r = r - np.clip(step, -0.5 * r, 0.5 * r)
            if np.max(np.abs(step)) < 1e-13 * start:
                return np.asarray(r[..., None] * X)
        lost = np.abs(step) > 1e-13 * start
        raise RuntimeError(
            f"{lost.sum()} of {r.size} rays found no surface (last step {np.abs(step).max():.1e}); "
            "the body must be star-shaped about the origin"
        )

    return Body(to_body, gradient, mirrors)
