"""The current and the charge on conductors: Mie, dipoles, caustics, polarisations, statuses."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field.equation import effort
from creeping.field.on_body import crosses
from creeping.field.results.far_result import spherical_frame
from creeping.geometry.quadrature import body_nodes

OBLIQUE = np.array([0.36, 0.48, 0.8])


def wrong(current, x, E, H):
    """|J - n x H| and |q - n.E|, each (n, 2)."""
    J, q = np.cross(x[:, :, None], H, axis=1), np.einsum("nc,nci->ni", x, E)
    return np.linalg.norm(current - J, axis=1), np.abs(current.charge - q)


@pytest.mark.slow
@pytest.mark.parametrize("k, limit", [(30.0, 0.025), (100.0, 0.006)])
def test_sphere_at_all_angles(ball, mie, rng, k, limit):
    x = np.concatenate([directions(rng, 200), OBLIQUE + 0.2 * rng.normal(size=(40, 3))])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    found = cr.conductor_current(ball, x, wavenumber=k)
    off, charge = wrong(found, x, *mie(k, x))
    assert np.mean(found.ok) > 0.98
    assert off[found.ok].max() < limit
    # by differences between points, of which some stand across the edge of a beam
    assert np.quantile(charge[found.ok], 0.99) < limit
    assert np.mean(off[found.ok] <= found.error[found.ok]) > 0.95
    assert np.mean(charge[found.ok] <= found.charge_error[found.ok]) > 0.95
    assert np.median(found.error / off) < 10


@pytest.mark.slow
def test_charge_where_the_equation_is_solved(ball, mie, rng):
    x = directions(rng, 200)
    found = cr.conductor_current(ball, x, wavenumber=8.0, method="equation")
    off, charge = wrong(found, x, *mie(8.0, x))
    assert set(found.method.ravel()) == {"equation"}
    assert off.max() < 1e-3 and charge.max() < 2e-3
    assert np.all(off <= found.error) and np.all(charge <= found.charge_error)
    field = cr.conductor_field(ball, x[:5], wavenumber=8.0, method="equation")
    np.testing.assert_array_equal(field.error, np.maximum(found.error, found.charge_error)[:5])


def test_divergence_of_a_field_on_a_sphere(rng):
    """v = c - (c.n) n has div v = -2 c.n."""
    x, c = directions(rng, 60), np.array([0.3, -0.5, 0.8])
    cross = crosses(sc.Sphere(), OBLIQUE, x, 2.0)
    n = cross.normals
    v = (c - (n @ c)[:, None] * n)[:, :, None] * np.array([1.0, 2j])
    np.testing.assert_allclose(cross.divergence(v), np.outer(-2 * x @ c, [1.0, 2j]), atol=1e-3)


@pytest.mark.slow
def test_the_focus_behind_a_sphere(ball, mie):
    x = OBLIQUE[None] + 1e-3 * np.array([[0.0, 0.0, 0.0], [0.8, -0.6, 0.0], [0.0, 5.0, -3.0]])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    E, H = mie(30.0, x)
    found = cr.conductor_current(ball, x, wavenumber=30.0)
    assert set(found.method.ravel()) == {"march"} and np.all(found.ok)
    off, _ = wrong(found, x, E, H)
    # the current there is a third of the incident wave, by rays infinite
    assert np.linalg.norm(H, axis=1).min() > 0.25 and off.max() < 4e-3 and np.all(off <= found.error)


@pytest.mark.slow
def test_triaxial(triaxial, rng):
    fan, k, solution = triaxial
    nodes = body_nodes(fan.body, 20.0)
    at = rng.choice(len(nodes.points), 150, p=nodes.weights / nodes.weights.sum())
    x, n = nodes.points[at], nodes.normals[at]
    E, H = (part[:, :, 0] for part in solution.total(x))
    found = cr.conductor_current(fan, x, wavenumber=k)
    off, charge = wrong(found, n, E, H)
    assert solution.residual.max() < 1e-2
    assert np.mean(off[found.ok] <= found.error[found.ok]) > 0.95
    assert np.mean(charge[found.ok] <= found.error[found.ok]) > 0.93
    assert np.median(off[found.ok]) < 0.04
    # along the body, to its normals' error
    assert np.max(np.abs(np.einsum("nc,nci->ni", n, found.values))) < 1e-8


@pytest.mark.slow
def test_polarisations(ball, rng):
    x = directions(rng, 8)
    both = cr.conductor_current(ball, x, wavenumber=30.0)
    theta, phi = spherical_frame(OBLIQUE)
    left = (theta + 1j * phi) / np.sqrt(2)
    for given, mix in (
        ("theta", (1, 0)),
        ("phi", (0, 1)),
        (3 * phi, (0, 1)),
        (left, (np.sqrt(0.5), 1j * np.sqrt(0.5))),
    ):
        one = cr.conductor_current(ball, x, wavenumber=30.0, polarisation=given)
        assert one.shape == (8, 3) and one.error.shape == one.charge.shape == one.status.shape == (8,)
        np.testing.assert_allclose(np.linalg.norm(one.incident_electric), 1.0)
        # rays and beams are blended by their error, which is the polarisation's own
        off = np.linalg.norm(one - both @ np.array(mix), axis=1)
        assert np.all(off <= one.error + np.abs(both.error @ np.abs(mix)))
        same = one.method == "lit"
        assert np.any(same) and off[same].max() < 1e-6


@pytest.mark.parametrize(
    "polarisation, message",
    [
        ("vertical", "'vertical' is not 'theta' or 'phi'"),
        ((1, 0), "is not E0 of three finite numbers"),
        ((0, 0, 0), "not all of them 0"),
        ((1, np.nan, 0), "finite"),
        (object(), "is not E0 of three numbers"),
        (OBLIQUE, "100 % of itself along the direction of incidence; give E0 across it"),
    ],
)
def test_bad_polarisations(ball, polarisation, message):
    with pytest.raises(InvalidInputError, match=message):
        cr.conductor_current(ball, [(0, 0, 1)], wavenumber=10.0, polarisation=polarisation)


@pytest.mark.slow
def test_where_rays_end_the_status_says_so(monkeypatch):
    # which is no matter of lit ground
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    body = sc.TwistedEllipsoid()
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=OBLIQUE), length=4.0, n_rays=48)
    nodes = body_nodes(body, 6.0)
    dark = nodes.points[nodes.normals @ OBLIQUE > 0.3][::60]
    found = cr.conductor_current(fan, dark, wavenumber=6.0)
    counts = found.status_counts
    assert counts.get("DETACHED", 0) > 0 and np.all(np.isfinite(found.error))
    short = cr.launch(fan.flow, fan.line, length=0.2, n_rays=48)
    assert "TRUNCATED" in cr.conductor_current(short, dark, wavenumber=6.0).status_counts
