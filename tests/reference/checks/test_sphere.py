"""Partial waves of the sphere, against identities that do not use them."""

import numpy as np
import pytest

from tests.reference import sphere

BOUNDARIES = ["soft", "hard", 0.7 - 0.2j]
ROUNDING = 1e-11
"""Relative; the worst measured is about 1e-12, at ka = 500."""
SECTION = 2e-9
"""Gauss nodes rounded at 1e-16 next to c = 1 feel the forward peak, ka^4 high: 5e-10 at ka = 500."""


def over_directions(values, weights):
    """Integral over all directions of values symmetric about the axis."""
    return 2 * np.pi * np.sum(weights * values)


@pytest.mark.parametrize("ka", [0.01, 30.0, 500.0])
@pytest.mark.parametrize("boundary", ["soft", "hard", 0.3j])
def test_optical_theorem(ka, boundary):
    # eta = 0.3i absorbs nothing
    nodes, weights = np.polynomial.legendre.leggauss(int(ka) + 120)
    f = sphere.far_field(ka / 2, 2.0, nodes, boundary)
    forward = sphere.far_field(ka / 2, 2.0, [1.0], boundary)[0]
    section = over_directions(np.abs(f) ** 2, weights)
    assert 4 * np.pi / (ka / 2) * forward.imag == pytest.approx(section, rel=SECTION)


@pytest.mark.parametrize("ka", [3.0, 60.0, 500.0])
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_boundary_condition(ka, boundary):
    a, d = 1.5, np.array([2.0, -1.0, 2.0]) / 3
    k = ka / a
    n = np.random.default_rng(7).normal(size=(40, 3))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    u = sphere.total_field(k, a, a * n, d, boundary)
    # one-sided: no point is inside the sphere
    h = 2e-3 / k
    weights = np.array([-25 / 12, 4, -3, 4 / 3, -1 / 4]) / h
    du = sum(w * sphere.total_field(k, a, (a + j * h) * n, d, boundary) for j, w in enumerate(weights))
    np.testing.assert_allclose(sphere.surface_field(k, a, n @ d, boundary), u, atol=ROUNDING)
    np.testing.assert_allclose(sphere.surface_derivative(k, a, n @ d, boundary), du, atol=1e-8 * k)
    if boundary == "soft":
        assert np.max(np.abs(u)) < ROUNDING
    else:
        eta = 0.0 if boundary == "hard" else boundary
        assert np.max(np.abs(du + 1j * k * eta * u)) < 1e-8 * k


def test_helmholtz_and_far_field():
    k, a, d = 4.0, 1.0, np.array([0.0, 0.6, 0.8])
    x, h = np.array([0.5, -1.1, 0.9]), 1e-2
    shifts = h * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3), 2 * np.eye(3), -2 * np.eye(3)])
    u = sphere.total_field(k, a, x + shifts, d, "hard")
    laplacian = (-90 * u[0] + 16 * u[1:7].sum() - u[7:].sum()) / (12 * h**2)
    assert abs(laplacian + k**2 * u[0]) < 1e-5 * k**2
    r = x / np.linalg.norm(x)
    far = 1e4
    scattered = sphere.total_field(k, a, far * r[None], d, "hard") - np.exp(1j * k * far * (r @ d))
    f = sphere.far_field(k, a, [r @ d], "hard")
    np.testing.assert_allclose(scattered * far * np.exp(-1j * k * far), f, atol=2e-3)


@pytest.mark.parametrize("ka", [0.05, 10.0, 500.0])
def test_mie_optical_theorem(ka):
    nodes, weights = np.polynomial.legendre.leggauss(int(ka) + 120)
    across, within = sphere.pec_far_field(ka, 1.0, nodes)
    section = 0.5 * over_directions(np.abs(across) ** 2 + np.abs(within) ** 2, weights)
    forward = sphere.pec_far_field(ka, 1.0, [1.0])
    assert forward[0] == pytest.approx(forward[1], rel=1e-12)
    assert 4 * np.pi / ka * forward[0].imag == pytest.approx(section, rel=SECTION)
    if ka == 500.0:
        # rays that are reflected
        theta = np.radians([120.0, 150.0, 180.0])
        ray = 0.5 * np.exp(-1000j * np.sin(theta / 2))
        for found, sign in zip(sphere.pec_far_field(ka, 1.0, np.cos(theta)), (-1, 1), strict=True):
            np.testing.assert_allclose(found, sign * ray, atol=0.005)


def test_mie_near_field_meets_the_boundary_and_maxwells_equations(rng):
    k, d = 6.0, np.array([0.36, 0.48, 0.8])
    e = np.cross(d, (1.0, 0.0, 0.0)) / np.linalg.norm(np.cross(d, (1.0, 0.0, 0.0)))
    x = rng.normal(size=(8, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    E, H = sphere.pec_total_field(k, 1.0, x, d, e)
    assert np.max(np.abs(np.cross(x, E))) < 1e-13 and np.max(np.abs(np.sum(x * H, axis=1))) < 1e-13
    first, second = sphere.pec_surface_field(k, 1.0, x @ d)
    size = np.hypot(np.abs(first * (x @ np.cross(d, e))), np.abs(second * (x @ e))) / np.sqrt(1 - (x @ d) ** 2)
    np.testing.assert_allclose(np.linalg.norm(H, axis=1), size, rtol=1e-9)
    step = 1e-4
    ends = np.concatenate([1.4 * x + sign * step * axis for axis in np.eye(3) for sign in (1, -1)])
    fields = sphere.pec_total_field(k, 1.0, ends, d, e)
    exact = sphere.pec_total_field(k, 1.0, 1.4 * x, d, e)
    for mine, other, sign in ((0, 1, 1), (1, 0, -1)):
        values = fields[mine].reshape(3, 2, 8, 3)
        slope = (values[:, 0] - values[:, 1]) / (2 * step)
        curl = np.stack([slope[(i + 1) % 3][:, (i + 2) % 3] - slope[(i + 2) % 3][:, (i + 1) % 3] for i in range(3)], 1)
        np.testing.assert_allclose(curl, sign * 1j * k * exact[other], atol=1e-5)
