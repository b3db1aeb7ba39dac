"""The current of a conductor by marched waves: the condition of E on the body, Mie, and what modes do not reach."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.boundary import ELECTRIC_HARD, HARD
from creeping.field.equation import effort
from creeping.field.marching.fan_waves import fan_waves, modes_on_strip
from creeping.geometry.quadrature import body_nodes
from creeping.rays.ends import RayStatus
from studies.accuracy import point_coverage

K = 20.0


def test_the_wave_with_e_along_the_normal_has_a_condition_of_its_own(ball):
    """Against its creeping modes, exact to second order: u_n = 0 would be off by what kappa_t brings."""
    found, other = (fan_waves(ball, wavenumber=K, boundary=kind).marched for kind in (ELECTRIC_HARD, HARD))
    strip = fan_waves(ball, wavenumber=K, boundary=ELECTRIC_HARD).strips[0]
    times = np.linspace(0.4, 2.2, 10)
    modes = modes_on_strip(strip, times, K, ELECTRIC_HARD)[0][0]
    off, wrong = (np.abs(one.at(0, times) / modes - 1) for one in (found, other))
    assert off.max() < 0.03 and np.all(wrong > 4 * off)


def test_marching_is_mie_on_the_sphere(ball, mie, rng):
    x = rng.normal(size=(60, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    found = cr.conductor_current(ball, x, wavenumber=K)
    J = np.cross(x[:, :, None], mie(K, x)[1], axis=1)
    off = np.linalg.norm(found - J, axis=1)
    by_march = np.char.endswith(found.method, "march")
    assert np.mean(by_march) > 0.3 and np.all(found.ok[by_march])
    assert off[by_march].max() < 0.03
    assert np.mean(off[by_march] <= found.error[by_march]) > 0.95


@pytest.fixture(scope="module")
def twisted():
    body = sc.TwistedEllipsoid()
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0.8, -0.3, 0.5)), wavenumber=K, n_rays=48)


@pytest.mark.slow
def test_ground_behind_rays_that_have_detached_has_its_current(twisted, rng, monkeypatch):
    # the march is asked here, not lit ground
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    nodes = body_nodes(twisted.body, K)
    dark = nodes.normals @ twisted.line.direction > 0.1
    at = rng.choice(np.flatnonzero(dark), 50)
    assert np.mean(twisted.status == RayStatus.DETACHED) > 0.2
    found = cr.conductor_current(twisted, nodes.points[at], wavenumber=K)
    assert np.mean(found.ok) > 0.6 and np.sum(found.method[found.ok] == "march") > 16
    size = np.linalg.norm(found.values, axis=1)[found.ok]
    assert np.all((size > 0) & (size < 2))
    along = np.einsum("nc,nci->ni", nodes.normals[at], found.values)
    np.testing.assert_allclose(along, 0.0, atol=1e-6)


def test_no_points_have_no_current(ball):
    assert cr.conductor_current(ball, np.zeros((0, 3)), wavenumber=K).shape == (0, 3, 2)


@pytest.mark.slow
def test_the_twisted_ellipsoid_is_covered():
    """Against electric dipoles, an incidence that no factor was set on: half of it was without a current."""
    found = point_coverage.row("twisted", K, "pec", 41)
    assert found["dark"] > 93 and found["dark error"] < 20
    assert found["on"] < 25
