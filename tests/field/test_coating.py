"""Admittances that vary over the body: against an exact sphere, a constant one, and dumb inputs."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field import routes
from creeping.field.fock import surface_function
from tests.reference import sphere, sphere_admittance

K = 25.0
ETA = (0.4 + 0.1j, 0.25)
D = np.array([0.48, -0.6, 0.64])
STEP = cr.ImpedanceBoundary(lambda x: np.where(x[:, 2] < 0.15, 0.2, 0.9 - 0.3j))


def coated(points):
    return ETA[0] + ETA[1] * points[:, 2]


BOUNDARY = cr.ImpedanceBoundary(coated)


def spread(count):
    i = np.arange(count) + 0.5
    z, angle = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    return np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)


@pytest.fixture(scope="module")
def fan():
    ball = sc.Sphere()
    return cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, direction=D), length=3.3, n_rays=24)


def test_reference_is_the_series_of_a_constant_admittance():
    points = spread(60)
    found = sphere_admittance.surface_field(8.0, 1.0, D, (0.7, 0.0), points)
    assert np.allclose(found, sphere.surface_field(8.0, 1.0, points @ D, 0.7), atol=1e-12)


@pytest.mark.parametrize("judged", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_field_on_the_body_is_that_of_the_exact_sphere(fan, judged, monkeypatch):
    """Without currents, which only judge it, values are the same and more errors are bounds."""
    if not judged:
        monkeypatch.setattr(routes, "affordable", lambda *_, **__: False)
    points = spread(150)
    found = cr.surface_field(fan, points, wavenumber=K, boundary=BOUNDARY)
    exact = sphere_admittance.surface_field(K, 1.0, D, ETA, points)
    off = np.abs(found.values - exact)
    assert found.ok.any() and np.max(off[found.ok] if judged else off) < 0.02  # of the incident wave; 0.03 asked for
    assert np.mean(off <= found.error) > 0.9
    assert set(found.method) <= {"lit", "march", "lit+march"}


@pytest.mark.slow
def test_a_step_of_the_admittance():
    """Expansions smear it, and the equation of the body stands for them: u has a kink there, and its slope a jump."""
    zones, k, r = sphere_admittance.Zones((0.2, 0.9 - 0.3j), (0.15,)), 8.0, spread(250)
    ball = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, direction=D), length=3.3, n_rays=48)
    exact = sphere_admittance.far_field(k, 1.0, D, zones, r)
    far = cr.far_field(fan, r, wavenumber=k, boundary=STEP)
    assert set(far.method) == {"equation"}
    assert np.max(np.abs(far.total - exact)) < 0.003 * np.max(np.abs(exact))
    assert np.mean(np.abs(far.total - exact) <= far.error) > 0.85
    u = cr.surface_field(fan, r, wavenumber=k, boundary=STEP)
    off = np.abs(u.values - sphere_admittance.surface_field(k, 1.0, D, zones, r))
    assert set(u.method) == {"equation"} and np.all(u.ok)
    assert np.quantile(off, 0.95) < 0.025 and np.max(off) < 0.08 and np.mean(off <= u.error) > 0.85


@pytest.mark.slow
def test_a_step_is_of_the_equation(fan):
    assert cr.surface_currents(fan, wavenumber=4.0, boundary=STEP).solved


def test_zones_of_one_admittance_are_its_series():
    points = spread(60)
    found = sphere_admittance.surface_field(8.0, 1.0, D, sphere_admittance.Zones((0.7, 0.7), (0.3,)), points)
    assert np.allclose(found, sphere.surface_field(8.0, 1.0, points @ D, 0.7), atol=1e-12)


@pytest.mark.slow
def test_far_and_near_fields_are_those_of_the_exact_sphere(fan):
    boundary = BOUNDARY
    r = spread(200)
    far = cr.far_field(fan, r, wavenumber=K, boundary=boundary)
    exact = sphere_admittance.far_field(K, 1.0, D, ETA, r)
    assert np.max(np.abs(far.total - exact)) < 0.005 * np.max(np.abs(exact))
    assert np.mean(np.abs(far.total - exact) <= far.error) > 0.95
    # far away the field near the body is the far field
    near = cr.near_field(fan, 2e4 * r[:20], wavenumber=K, boundary=boundary)
    scattered = near.values - np.exp(1j * K * 2e4 * (r[:20] @ D))
    assert np.allclose(scattered * 2e4 * np.exp(-2e4j * K), far.total[:20], atol=2e-3 * np.max(np.abs(exact)))


@pytest.mark.slow
def test_a_function_that_is_constant_is_a_constant(fan):
    points = spread(60)
    lit = points @ D < -0.4
    constant = cr.surface_field(fan, points, wavenumber=K, boundary=cr.ImpedanceBoundary(0.4))
    varying = cr.surface_field(fan, points, wavenumber=K, boundary=cr.ImpedanceBoundary(lambda x: 0.4 + 0 * x[:, 0]))
    assert np.allclose(varying.values[lit], constant.values[lit], rtol=1e-9)
    assert np.all(np.abs(varying.values - constant.values) <= varying.error + constant.error)


def test_expressions_and_functions_agree():
    points = spread(20)
    text = sc.Coating("0.3 + 0.1*z", "0.2*x")
    assert np.allclose(text.value(points), 0.3 + 0.1 * points[:, 2] + 0.2j * points[:, 0], rtol=1e-15)
    assert cr.ImpedanceBoundary(text) == cr.ImpedanceBoundary(sc.Coating("0.3 + 0.1*z", "0.2*x"))
    with pytest.raises(ValueError, match="contains"):
        sc.Coating("__import__('os')")


def test_fock_functions_take_parameters_of_many_arguments():
    q = 2.0 * np.exp(1j * np.linspace(0.2, 1.4, 400))
    xi = np.linspace(-2.0, 2.0, 400)
    together = surface_function(xi, q)
    alone = [surface_function(xi[i : i + 1], q[i : i + 1])[0] for i in range(0, 400, 50)]
    assert np.allclose(together[::50], alone, rtol=1e-9)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (lambda x: -0.1 + 0 * x[:, 0], "gives energy off at"),
        (lambda x: np.nan * x[:, 0], "is not finite at"),
        (lambda x: x, "one number for each row"),
    ],
)
def test_bad_coatings_are_named(fan, given, told):
    with pytest.raises(cr.InvalidInputError, match=told):
        cr.surface_field(fan, [(0.0, 0.0, 1.0)], wavenumber=K, boundary=cr.ImpedanceBoundary(given))


def test_what_goes_by_modes_says_what_does_not(fan):
    with pytest.raises(cr.InvalidInputError, match="method='currents'"):
        cr.far_field(fan, [(0, 0, 1)], wavenumber=K, boundary=BOUNDARY, method="rays")
    with pytest.raises(cr.InvalidInputError, match="order=2"):
        cr.surface_field(fan, wavenumber=K, boundary=BOUNDARY, order=1)


def test_each_ray_is_marched(fan, monkeypatch):
    """Where a single ray passes, its own wave is the field."""
    monkeypatch.setattr(routes, "affordable", lambda *_, **__: False)
    own = cr.surface_field(fan, wavenumber=K, boundary=BOUNDARY)
    step = int(np.searchsorted(fan.travel_time, 0.8))
    ok = own.ok[:, step]
    whole = cr.surface_field(fan, fan.points[ok, step], wavenumber=K, boundary=BOUNDARY)
    assert ok.any() and set(own.method[own.ok]) == {"march"}
    np.testing.assert_allclose(own.values[ok, step], whole.values, atol=0.02)


def test_a_fingerprint_tells_admittances_apart():
    prints = {sc.Coating(*of).fingerprint for of in (("0.3",), ("0.3", "0.2"), ("0.3", "0.1"), ("0.3 + 0.1*z",))}
    assert len(prints) == 4 and sc.Coating("0.3").fingerprint == sc.Coating("0.3", "0").fingerprint
