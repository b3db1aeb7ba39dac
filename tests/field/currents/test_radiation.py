"""Sums over currents against plain numpy and against exact currents of the sphere."""

import numpy as np
import pytest

import scatterers as sc
from creeping.field.currents.radiation import (
    far_of_scalar,
    far_of_vector,
    field_of_scalar,
    field_of_vector,
    grid_cells,
    phase_sums,
    transformed,
)
from creeping.geometry.quadrature import body_nodes
from tests.reference import sphere

K = 9.0
D = np.array([0.48, -0.6, 0.64])


def directions(rng, n):
    r = rng.normal(size=(n, 3))
    return r / np.linalg.norm(r, axis=1, keepdims=True)


def test_phase_sums_are_the_plain_ones(rng):
    x, w, r = rng.normal(size=(3000, 3)) * 50, rng.normal(size=(4, 3000, 2)) @ [1, 1j], directions(rng, 70)
    plain = np.exp(-1j * K * (r @ x.T)) @ w.T
    np.testing.assert_allclose(phase_sums(x, w, r, K), plain, atol=1e-10)


def test_a_map_of_many_directions_is_the_plain_one(rng):
    # by a transform: 4000 nodes, 3000 directions, a long body
    x = rng.uniform(-1, 1, size=(4000, 3)) * [0.3, 0.5, 2.0] + [5.0, 0.0, -3.0]
    w, r = rng.normal(size=(3, 4000, 2)) @ [1, 1j], directions(rng, 3000)
    cells = grid_cells(np.ptp(x, axis=0), K)
    assert transformed(4000, 3000, cells) and not transformed(4000, 300, cells)
    assert not transformed(4000, 3000, grid_cells(np.ptp(x, axis=0), 1e4))
    plain = np.exp(-1j * K * (r @ x.T)) @ w.T
    np.testing.assert_allclose(phase_sums(x, w, r, K), plain, atol=1e-8 * np.abs(plain).max())
    one_by_one = np.concatenate([phase_sums(x, w, part, K) for part in np.split(r, 10)])
    np.testing.assert_allclose(phase_sums(x, w, r, K), one_by_one, atol=1e-8 * np.abs(plain).max())


def test_vector_sums_are_the_plain_ones(rng):
    x, J, y = rng.normal(size=(200, 3)), rng.normal(size=(200, 3, 2)) @ [1, 1j], 5 + rng.normal(size=(40, 3))
    R = y[:, None] - x
    length = np.linalg.norm(R, axis=2, keepdims=True)
    G = np.exp(1j * K * length) / (4 * np.pi * length)
    plain = np.sum(np.cross(G * (1j * K - 1 / length) * R / length, J[None]), axis=1)
    np.testing.assert_allclose(field_of_vector(x, J, y, K, electric=False), plain, atol=1e-11)
    # far away it is ik r x f e^{ikR}/R with the f of the currents
    r = directions(rng, 20)
    f = far_of_vector(x, J, r, K)
    far = field_of_vector(x, J, 1e7 * r, K, electric=False) * 1e7 * np.exp(-1j * K * 1e7)
    np.testing.assert_allclose(far, np.cross(r, f), atol=1e-4)
    np.testing.assert_allclose(np.sum(f * r, axis=1), 0, atol=1e-12)


@pytest.mark.parametrize("boundary", ["soft", "hard", 0.4 + 0.3j])
def test_exact_currents_radiate_the_exact_field(boundary, rng):
    nodes = body_nodes(sc.Ellipsoid(1.0, 1.0, 1.0), 2 * K)
    c = nodes.normals @ D
    u = None if boundary == "soft" else sphere.surface_field(K, 1.0, c, boundary) * nodes.weights
    slope = None
    if boundary != "hard":
        slope = sphere.surface_derivative(K, 1.0, c, boundary) * nodes.weights
    r = directions(rng, 100)
    f = far_of_scalar((nodes.points, nodes.normals), u, slope, r, K)
    exact = sphere.far_field(K, 1.0, r @ D, boundary)
    np.testing.assert_allclose(f, exact, atol=1e-6 * np.abs(exact).max())
    # inside they cancel the wave, outside they are the scattered field
    inside = 0.5 * directions(rng, 40)
    left = field_of_scalar((nodes.points, nodes.normals), u, slope, inside, K) + np.exp(1j * K * (inside @ D))
    assert np.max(np.abs(left)) < 1e-6
    outside = 1.7 * directions(rng, 40)
    field = field_of_scalar((nodes.points, nodes.normals), u, slope, outside, K) + np.exp(1j * K * (outside @ D))
    exact = sphere.total_field(K, 1.0, outside, D, boundary)
    np.testing.assert_allclose(field, exact, atol=1e-6)
