"""Currents of the lit side against the exact series of the sphere and of the cylinder."""

import numpy as np
import pytest

from creeping.field.boundary import HARD, SOFT, Boundary
from creeping.field.currents.lit import Ground, lit_currents
from tests.reference import section, sphere

# largest error as a share of the largest current, by k: about one and a half times what is reached
BOUNDARIES = {
    "soft": (SOFT, "soft", {12.0: 2e-3, 40.0: 3e-4}),
    "hard": (HARD, "hard", {12.0: 0.025, 40.0: 5e-3}),
    "impedance": (Boundary("impedance", 0.7), 0.7, {12.0: 5e-3, 40.0: 1e-3}),
    "reactive": (Boundary("impedance", 0.3 - 0.5j), 0.3 - 0.5j, {12.0: 0.025, 40.0: 5e-3}),
}


def of_the_sphere(kind, given, k, c):
    one = np.ones_like(c)
    mine = lit_currents(Ground(c, one, one, *np.zeros((3, len(c)))), k, kind) * np.exp(-1j * k * c)
    exact = (sphere.surface_derivative if given == "soft" else sphere.surface_field)(k, 1.0, -c, given)
    return mine, exact


@pytest.mark.parametrize("name", BOUNDARIES)
def test_sphere(name):
    kind, given, limits = BOUNDARIES[name]
    c = np.linspace(-0.02, 1, 300)
    for k, limit in limits.items():
        mine, exact = of_the_sphere(kind, given, k, c)
        assert np.max(np.abs(mine - exact)) < limit * np.max(np.abs(exact))


@pytest.mark.parametrize("name", ["soft", "hard"])
def test_order_on_the_sphere(name):
    # what is left out is of order m^-4, k^(-4/3), where the wave grazes, and k^-2 where it does not
    kind, given, _ = BOUNDARIES[name]
    c = np.linspace(0.0, 1, 200)
    errors = []
    for k in (20.0, 80.0):
        mine, exact = of_the_sphere(kind, given, k, c)
        errors.append(np.max(np.abs(mine - exact)) / np.max(np.abs(exact)))
    assert np.log(errors[0] / errors[1]) / np.log(4) > 1.2


@pytest.mark.parametrize("name", ["soft", "hard"])
def test_cylinder(name):
    # kappa_b = 0
    kind, given, limits = BOUNDARIES[name]
    phi = np.linspace(np.pi / 2, np.pi, 150)
    c = -np.cos(phi)
    one = np.ones_like(c)
    for k, limit in limits.items():
        mine = lit_currents(Ground(c, one, *np.zeros((4, len(c)))), k, kind) * np.exp(-1j * k * c)
        exact = (section.surface_derivative if name == "soft" else section.surface_field)(k, 1.0, phi, given)
        assert np.max(np.abs(mine - exact)) < limit * np.max(np.abs(exact))


@pytest.mark.parametrize("kind", [SOFT, HARD, Boundary("impedance", 0.02), Boundary("impedance", 0.01 - 0.02j)])
def test_what_varying_curvature_adds_falls_off_towards_the_light(kind):
    # the factors of Dg and g_q follow from this; each term alone grows like xi^8
    k, c = 1e6, np.array([0.1, 0.2])
    one = np.ones_like(c)
    plain, *varied = (
        lit_currents(Ground(c, one, one, twist * one, rate * one, bend * one), k, kind)
        for twist, rate, bend in ((0, 0, 0), (0, 1, 0), (0, 0, 1), (0, 2, 3), (1, 0, 0))
    )
    m = np.cbrt(k / 2)
    assert np.all(m * c > 7)
    for other in varied:
        assert np.max(np.abs(other / plain - 1)) < 1e-5


def test_soft_is_the_limit_of_a_large_admittance():
    c, one = np.linspace(0.05, 1, 40), np.ones(40)
    k, eta = 30.0, 1e5
    u = lit_currents(Ground(c, one, one, *np.zeros((3, len(c)))), k, Boundary("impedance", eta))
    slope = lit_currents(Ground(c, one, one, *np.zeros((3, len(c)))), k, SOFT)
    np.testing.assert_allclose(-1j * k * eta * u, slope, rtol=2e-3)


def test_hard_is_the_limit_of_a_small_one():
    c, one = np.linspace(0.0, 1, 40), np.ones(40)
    mine = [
        lit_currents(Ground(c, one, one, *np.zeros((3, len(c)))), 30.0, b) for b in (Boundary("impedance", 1e-7), HARD)
    ]
    np.testing.assert_allclose(*mine, atol=1e-5)


def test_concave_and_flat_regions_are_of_optics():
    k, c = 20.0, np.array([0.7, 0.9])
    for along in (0.0, -0.5):
        kappa = np.full(2, along)
        u = lit_currents(Ground(c, kappa, kappa, *np.zeros((3, len(c)))), k, HARD)
        z = 1j * kappa * (1 / c**2 + 1) / (2 * k * c)
        np.testing.assert_allclose(u, 2 * (1 - z), rtol=2e-3)
