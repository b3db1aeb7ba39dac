"""Charge and electric field of solved conductors: Mie's series, Gauss's law, what holds on faces, edges."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field.body_currents import cached_currents
from creeping.field.equation.currents import ON_BODY
from creeping.field.equation.solving import asked_solution
from creeping.field.results.far_result import incident_mix
from tests.reference.sphere import pec_far_field, pec_total_field

D = np.array([0.48, 0.6, -0.64])


@pytest.mark.parametrize("k", [pytest.param(0.1, marks=pytest.mark.slow), 3.0])
def test_sphere(k, rng):
    """At no height, and at no wavenumber, is there a place where the equation does not hold."""
    along, electric = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    solution = cr.solve(sc.Sphere(), along, wavenumber=k, boundary="pec")
    currents = solution.currents().polarised(incident_mix(electric, along))
    n = directions(rng, 12)
    E, H = pec_total_field(k, 1.0, n, along, electric)
    charge, error = currents.charge_on_body(n, currents.on_body(n).values)
    off = np.abs(charge[:, 0] - np.sum(n * E, axis=1))
    assert off.max() < 1e-3 and np.all(off <= error[:, 0])
    J = currents.on_body(n)
    off = np.linalg.norm(J.values[:, :, 0] - np.cross(n, H), axis=1)
    assert off.max() < 2e-4 and np.all(off <= J.error[:, 0])
    meridian = np.array([[np.sin(t), 0.0, np.cos(t)] for t in np.linspace(0.3, 2.9, 12)])
    f = solution.far_field(meridian).total
    for found, exact in zip((f[:, 1, 1], f[:, 0, 0]), pec_far_field(k, 1.0, meridian @ along), strict=True):
        np.testing.assert_allclose(found, exact, atol=2e-4)
    for height in (1e-4, 0.3):
        x = (1 + height) * n
        E, H = pec_total_field(k, 1.0, x, along, electric)
        wave = np.exp(1j * k * (x @ along))[:, None]
        np.testing.assert_allclose(currents.scattered_electric(x)[:, :, 0], E - wave * electric, atol=1e-3)
        np.testing.assert_allclose(currents.scattered(x)[:, :, 0], H - wave * np.cross(along, electric), atol=1e-3)


@pytest.fixture(scope="module")
def flat():
    """A cylinder with flat ends, and its fan."""
    body = sc.Cylinder(0.5, 1.0)
    line = cr.shadow_line(body, direction=D)
    return cr.launch(cr.DirectFlow(body, rtol=1e-6), line, length=1.0, n_rays=16)


@pytest.mark.slow
def test_next_to_faces_and_edges(flat):
    k, up, out = 4.0, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    x = np.array([[0.1, 0.2, 0.5 + 1e-4], [-0.3, 0.1, 0.5 + 1e-4], [0.5 + 1e-4, 0.0, 0.2]])
    n = np.stack([up, up, out])
    field = cr.conductor_field(flat, x, wavenumber=k)
    assert np.all(field.ok) and set(field.method.ravel()) == {"equation"}
    # E along the normal and H across it
    across = np.linalg.norm(np.cross(n[:, :, None], field.E, axis=1), axis=1)
    along = np.abs(np.einsum("mx,mxp->mp", n, field.H))
    assert np.all(across < 0.02) and np.all(along < 0.02) and np.all(np.maximum(across, along) <= field.error)
    found = cr.conductor_current(flat, x - 1e-4 * n, wavenumber=k)
    np.testing.assert_allclose(found.charge, np.einsum("mx,mxp->mp", n, field.E), atol=0.02)
    np.testing.assert_allclose(found.values, np.cross(n[:, :, None], field.H, axis=1), atol=0.02)
    # the nearer to the rim the larger is the field, and what is not known of it
    rim = np.array([0.5, 0.0, 0.5]) + np.array([1e-4, 1e-3, 1e-2, 0.1])[:, None] * (up + out)
    field = cr.conductor_field(flat, rim, wavenumber=k, polarisation=np.cross(D, np.cross(D, up)))
    size = np.linalg.norm(field.E, axis=1)
    assert np.all(np.diff(size) < 0) and np.all(np.diff(field.error) < 0) and not field.ok[0] and field.ok[3]


def test_no_charge_is_made(flat):
    currents = cached_currents(flat, 4.0, "pec")
    area = currents.weights.sum()
    assert np.all(np.abs(currents.weights @ currents.charge) < 1e-3 * area)


@pytest.mark.slow
def test_units_scale(flat):
    currents = cached_currents(flat, 4.0, "pec")
    small = cr.solve(sc.Cylinder(0.5e-3, 1e-3), D, wavenumber=4e3, boundary="pec").currents()
    x = np.array([[0.1, 0.0, 0.501], [0.6, 0.0, 0.3]])
    np.testing.assert_allclose(small.scattered_electric(1e-3 * x), currents.scattered_electric(x), atol=1e-4)
    assert ON_BODY * currents.extinction <= currents.error_around(x).max()


@pytest.mark.slow
def test_a_solution_has_the_fields_of_a_fan(flat):
    # that of the fan, solved once
    solution = asked_solution(flat.body, D, 4.0, "pec").solution
    x = np.array([[0.1, 0.0, 0.55], [0.5, 0.0, 0.2], [1.0, 0.4, 0.3]])
    for polarisation in (None, "phi"):
        mine = solution.conductor_field(x, polarisation=polarisation)
        its = cr.conductor_field(flat, x, wavenumber=4.0, polarisation=polarisation, method="equation")
        np.testing.assert_allclose(mine.E, its.E, atol=1e-6)
        np.testing.assert_allclose(mine.H, its.H, atol=1e-6)
        np.testing.assert_allclose(mine.error[0], its.error[0], rtol=1e-4)
        assert mine.status.shape == its.status.shape and np.all(mine.ok)
        mine = solution.conductor_current(x[1:2], polarisation=polarisation)
        its = cr.conductor_current(flat, x[1:2], wavenumber=4.0, polarisation=polarisation, method="equation")
        np.testing.assert_allclose(mine, its, atol=1e-6)
        np.testing.assert_allclose(mine.charge_error, its.charge_error, rtol=1e-3)
    with pytest.raises(InvalidInputError, match="conductor has conductor_field"):
        solution.near_field(x)
    with pytest.raises(InvalidInputError, match="1 of 1 points are inside the body"):
        solution.conductor_field([(0.0, 0.0, 0.0)])
    with pytest.raises(InvalidInputError, match="the soft body has near_field"):
        cr.solve(sc.Sphere(), D, wavenumber=0.5, boundary="soft").conductor_field(x)
