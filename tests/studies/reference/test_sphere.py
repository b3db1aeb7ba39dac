"""Partial waves of the sphere, against identities that do not use them."""

import ast
from pathlib import Path

import numpy as np
import pytest

from studies.reference import sphere

BOUNDARIES = ["soft", "hard", 0.7 - 0.2j]
ROUNDING = 1e-11
"""Relative; the worst measured is about 1e-12, at ka = 500."""
SECTION = 2e-9
"""Gauss nodes rounded at 1e-16 next to c = 1 feel the forward peak, ka^4 high: 5e-10 at ka = 500."""


def over_directions(values, weights):
    """Integral over all directions of values symmetric about the axis."""
    return 2 * np.pi * np.sum(weights * values)


@pytest.mark.parametrize("ka", [0.01, 1.0, 30.0, 500.0])
@pytest.mark.parametrize("boundary", ["soft", "hard", 0.3j])
def test_optical_theorem(ka, boundary):
    # eta = 0.3i absorbs nothing
    nodes, weights = np.polynomial.legendre.leggauss(int(ka) + 120)
    f = sphere.far_field(ka / 2, 2.0, nodes, boundary)
    forward = sphere.far_field(ka / 2, 2.0, [1.0], boundary)[0]
    section = over_directions(np.abs(f) ** 2, weights)
    assert 4 * np.pi / (ka / 2) * forward.imag == pytest.approx(section, rel=SECTION)


def test_passive_impedance_absorbs():
    nodes, weights = np.polynomial.legendre.leggauss(150)
    scattered = over_directions(np.abs(sphere.far_field(20.0, 1.0, nodes, 1.0)) ** 2, weights)
    taken = 4 * np.pi / 20 * sphere.far_field(20.0, 1.0, [1.0], 1.0)[0].imag
    assert scattered < 0.8 * taken


def test_small_spheres():
    k, a, c = 1e-3, 1.3, np.linspace(-1, 1, 7)
    np.testing.assert_allclose(sphere.far_field(k, a, c, "soft"), -a, rtol=2e-3)
    # Rayleigh: f = (k^2 a^3/3) (3c/2 - 1), monopole and dipole
    rayleigh = k**2 * a**3 / 3 * (1.5 * c - 1)
    np.testing.assert_allclose(sphere.far_field(k, a, c, "hard"), rayleigh, atol=1e-4 * k**2 * a**3)


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


def test_impedance_lies_between_hard_and_soft():
    c = np.linspace(-1, 1, 31)
    for eta, boundary in ((1e-8, "hard"), (1e8, "soft")):
        np.testing.assert_allclose(
            sphere.far_field(25.0, 1.0, c, eta), sphere.far_field(25.0, 1.0, c, boundary), atol=1e-6
        )


@pytest.mark.parametrize(("boundary", "sign"), [("soft", -1), ("hard", 1)])
def test_high_frequency_reflection(boundary, sign):
    theta = np.radians([120.0, 150.0, 180.0])
    f = sphere.far_field(500.0, 1.0, np.cos(theta), boundary)
    np.testing.assert_allclose(f, sign * 0.5 * np.exp(-1000j * np.sin(theta / 2)), atol=0.005)


def test_matched_impedance_sends_nothing_back():
    assert abs(sphere.far_field(500.0, 1.0, [-1.0], 1.0)[0]) < 0.001


def test_mie_high_frequency_reflection():
    theta = np.radians([120.0, 150.0, 180.0])
    across, within = sphere.pec_far_field(500.0, 1.0, np.cos(theta))
    ray = 0.5 * np.exp(-1000j * np.sin(theta / 2))
    np.testing.assert_allclose(across, -ray, atol=0.005)
    np.testing.assert_allclose(within, ray, atol=0.005)


@pytest.mark.parametrize("ka", [0.05, 10.0, 500.0])
def test_mie_optical_theorem(ka):
    nodes, weights = np.polynomial.legendre.leggauss(int(ka) + 120)
    across, within = sphere.pec_far_field(ka, 1.0, nodes)
    section = 0.5 * over_directions(np.abs(across) ** 2 + np.abs(within) ** 2, weights)
    forward = sphere.pec_far_field(ka, 1.0, [1.0])
    assert forward[0] == pytest.approx(forward[1], rel=1e-12)
    assert 4 * np.pi / ka * forward[0].imag == pytest.approx(section, rel=SECTION)


def test_mie_rayleigh_limit():
    # an electric dipole a^3 and a magnetic one -a^3/2
    k, a, c = 1e-2, 1.7, np.linspace(-1, 1, 9)
    across, within = sphere.pec_far_field(k, a, c)
    np.testing.assert_allclose(across, k**2 * a**3 * (1 - c / 2), atol=1e-3 * k**2 * a**3)
    np.testing.assert_allclose(within, k**2 * a**3 * (c - 1 / 2), atol=1e-3 * k**2 * a**3)


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


def test_refusals():
    with pytest.raises(ValueError, match="inside the sphere"):
        sphere.total_field(1.0, 1.0, [[0.5, 0.0, 0.0]], [0, 0, 1.0], "soft")
    with pytest.raises(ValueError, match="hold them"):
        sphere.far_field(1.0, 1.0, [1.1], "soft")
    with pytest.raises(ValueError, match="boundary is"):
        sphere.far_field(1.0, 1.0, [1.0], "firm")
    with pytest.raises(ValueError, match="wavenumber"):
        sphere.far_field(-1.0, 1.0, [1.0], "soft")


def test_references_import_nothing_of_what_they_judge():
    for module in Path(sphere.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not [name for name in names if name.split(".")[0] in ("creeping", "scatterers")], module
