"""The series of the cylinder, against identities that do not use it."""

import numpy as np
import pytest

from tests.reference import section

BOUNDARIES = ["soft", "hard", 0.7 - 0.2j]


@pytest.mark.parametrize("ka", [0.1, 20.0, 500.0])
@pytest.mark.parametrize("boundary", ["soft", "hard", 0.3j])
def test_optical_theorem(ka, boundary):
    k = ka / 2
    phi = 2 * np.pi * np.arange(4 * int(ka) + 200) / (4 * int(ka) + 200)
    width = 2 * np.pi * np.mean(np.abs(section.far_field(k, 2.0, phi, boundary)) ** 2)
    forward = section.far_field(k, 2.0, [0.0], boundary)[0] * np.exp(-0.25j * np.pi)
    assert np.sqrt(8 * np.pi / k) * forward.imag == pytest.approx(width, rel=1e-10)


@pytest.mark.parametrize("ka", [3.0, 60.0, 500.0])
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_boundary_condition(ka, boundary):
    a = 1.5
    k, phi = ka / a, np.linspace(0, np.pi, 41)
    h = 2e-3 / k

    def total(r):
        return np.exp(1j * k * r * np.cos(phi)) + section.scattered_field(k, a, r, phi, boundary)

    u = total(a)
    du = sum(w * total(a + j * h) for j, w in enumerate(np.array([-25 / 12, 4, -3, 4 / 3, -1 / 4]) / h))
    np.testing.assert_allclose(section.surface_field(k, a, phi, boundary), u, atol=1e-11)
    np.testing.assert_allclose(section.surface_derivative(k, a, phi, boundary), du, atol=1e-8 * k)
    if boundary == "soft":
        assert np.max(np.abs(u)) < 1e-11
    else:
        eta = 0.0 if boundary == "hard" else boundary
        assert np.max(np.abs(du + 1j * k * eta * u)) < 1e-8 * k


def test_far_field_is_the_limit():
    phi, r = np.linspace(0, np.pi, 9), 1e5
    near = section.scattered_field(5.0, 1.0, r, phi, "hard") * np.sqrt(r) * np.exp(-5j * r)
    np.testing.assert_allclose(near, section.far_field(5.0, 1.0, phi, "hard"), atol=1e-4)
