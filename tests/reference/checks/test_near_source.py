"""Point sources beside bodies: fundamental solutions against the series of the sphere, and that against identities."""

import numpy as np
import pytest

from tests.reference import clouds, sphere
from tests.reference.fundamental import beside_source


@pytest.mark.parametrize("boundary", ["soft", "hard", 0.4 - 0.3j])
def test_far_sources_are_plane_waves(boundary):
    k, far, c = 20.0, 1e6, np.cos([0.3, 1.5, 2.9])
    u, slope = sphere.source_on_sphere(k, 1.0, far, -c, boundary)
    scale = 4 * np.pi * far * np.exp(-1j * k * far)
    np.testing.assert_allclose(u * scale, sphere.surface_field(k, 1.0, c, boundary), atol=1e-4)
    np.testing.assert_allclose(slope * scale, sphere.surface_derivative(k, 1.0, c, boundary), atol=1e-3 * k)


def test_flux_through_a_hard_and_a_soft_sphere_of_a_close_source():
    # u of a source on the axis: the mean over the sphere has n = 0 alone, h0(k R)/h0'(ka) and h0(kR)/h0(ka)
    k, a, distance = 5.0, 1.0, 1.02
    nodes, weights = np.polynomial.legendre.leggauss(600)
    x, y = k * a, k * distance
    h0, slope = -1j * np.exp(1j * x) / x, np.exp(1j * x) * (x + 1j) / x**2
    far = -1j * np.exp(1j * y) / y
    scale = 1j / x**2 * 1j * k / (4 * np.pi) * far
    hard, _ = sphere.source_on_sphere(k, a, distance, nodes, "hard")
    _, soft = sphere.source_on_sphere(k, a, distance, nodes, "soft")
    assert 0.5 * weights @ hard == pytest.approx(scale / slope, rel=1e-9)
    assert 0.5 * weights @ soft == pytest.approx(-k * scale / h0, rel=1e-9)


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_fundamental_solutions_on_a_sphere(boundary):
    k, distance = 6.0, 1.5
    found = beside_source(clouds.ellipsoid(1.0, 1.0, 1.0), k, (0.0, 0.0, -distance), boundary, depth=0.25)
    x = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.8, -0.6]])
    u, slope = sphere.source_on_sphere(k, 1.0, distance, -x[:, 2], boundary)
    if boundary == "hard":
        np.testing.assert_allclose(found.total(x), u, rtol=1e-3)
    else:
        assert np.abs(found.total(x)).max() < 1e-4
        np.testing.assert_allclose(found.slope(x, x), slope, atol=1e-3 * np.abs(slope).max())
    assert found.residual < 1e-3
