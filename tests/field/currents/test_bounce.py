"""One bounce between parts of a body: against plain sums, a convex body, and fundamental solutions."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.currents.radiation import LOW, received, received_vectors
from creeping.geometry.quadrature import body_nodes
from studies.accuracy.bodies import bodies
from tests.reference import dipoles, fundamental

K = 9.0


def plain(x, n, y, m, single, double, soft):
    """The same sum by numpy, pair by pair."""
    off = y[None] - x[:, None]
    R = np.linalg.norm(off, axis=2)
    t = np.maximum(np.einsum("jc,jic->ji", n, off) / R, 0.0)
    w = np.minimum(t / LOW, 1.0)
    w = w * w * (3 - 2 * w) * np.exp(1j * K * R) / R
    lean = -np.einsum("ic,jic->ji", m, off) / R
    field = w * (single + double * lean * (1 / R - 1j * K))
    return np.sum((-2j * K * t if soft else 2.0) * field, axis=1)


@pytest.mark.parametrize("soft", [True, False])
def test_kernel_is_the_plain_sum(soft):
    rng = np.random.default_rng(4)
    nodes = body_nodes(sc.Torus(), 4.0)
    x, n = nodes.points[::61], nodes.normals[::61]
    # nodes themselves stand at no distance
    y, m = nodes.points[1::61], nodes.normals[1::61]
    a, b = (rng.normal(size=len(y)) + 1j * rng.normal(size=len(y)) for _ in range(2))
    found = received((x, n), (y, m), a, b, K, soft=soft)
    assert np.allclose(found, plain(x, n, y, m, a, b, soft), rtol=1e-10, atol=1e-10 * np.max(np.abs(found)))
    assert np.any(found != 0)


def plain_vectors(x, n, y, J):
    """What a conductor's points receive, by numpy: 2 n x (grad G x J), G = e^{ikR}/R."""
    off = y[None] - x[:, None]
    R = np.linalg.norm(off, axis=2)
    t = np.maximum(np.einsum("jc,jic->ji", n, off) / R, 0.0)
    w = np.minimum(t / LOW, 1.0)
    slope = (w * w * (3 - 2 * w) * (1 / R - 1j * K) * np.exp(1j * K * R) / R)[..., None] * off / R[..., None]
    field = np.cross(slope[:, :, None], np.moveaxis(J, 1, 2)[None])
    return np.moveaxis(2 * np.sum(np.cross(n[:, None, None], field), axis=1), 1, 2)


def test_kernel_of_vectors_is_the_plain_sum():
    rng = np.random.default_rng(5)
    nodes = body_nodes(sc.Torus(), 4.0)
    x, n = nodes.points[::61], nodes.normals[::61]
    y, m = nodes.points[1::61], nodes.normals[1::61]
    J = rng.normal(size=(len(y), 3, 2)) + 1j * rng.normal(size=(len(y), 3, 2))
    found = received_vectors((x, n), (y, m), J, K)
    assert found.shape == (len(x), 3, 2)
    assert np.allclose(found, plain_vectors(x, n, y, J), rtol=1e-10, atol=1e-10 * np.max(np.abs(found)))
    # tangential, and something
    assert np.max(np.abs(np.einsum("jc,jcp->jp", n, found))) < 1e-10 * np.max(np.abs(found))
    assert np.any(found != 0)
    one = received_vectors((x, n), (y, m), J[:, :, 1:], K)
    assert np.allclose(one[:, :, 0], found[:, :, 1], rtol=1e-12, atol=0)


def test_convex_body_receives_nothing():
    nodes = body_nodes(sc.Ellipsoid(1, 0.8, 0.6), 6.0)
    pair = nodes.points[::7], nodes.normals[::7]
    ones = np.ones(len(pair[0]), dtype=complex)
    assert np.max(np.abs(received(pair, pair, ones, ones, K, soft=False))) < 1e-12 * len(ones)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_peanut_against_fundamental_solutions(boundary, monkeypatch):
    body, cloud, depth = bodies()["peanut"]
    d = np.array([0.2, 0.5, 0.85]) / np.linalg.norm([0.2, 0.5, 0.85])
    r = cr.fibonacci_directions(200)
    solution = fundamental.scatter(cloud, 14.0, d[None], boundary, depth=depth, per_wavelength=7.0)
    exact = solution.far_field(r)[:, 0]
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-7), cr.shadow_line(body, direction=d), length=3.0, n_rays=32)
    currents = cr.surface_currents(fan, wavenumber=14.0, boundary=boundary, solve=False)
    monkeypatch.setattr("creeping.field.body_currents.self_reflects", lambda part: False)
    without = cr.surface_currents(fan, wavenumber=14.0, boundary=boundary, solve=False)
    off, before = (np.sqrt(np.mean(np.abs(one.far(r) - exact) ** 2)) for one in (currents, without))
    assert off < 0.75 * before
    assert currents.extinction < without.extinction
    assert np.mean(np.abs(currents.far(r) - exact) <= currents.error(r)) > 0.9


@pytest.mark.slow
def test_conducting_torus_against_dipoles(monkeypatch):
    body, cloud, depth = bodies()["torus"]
    d = np.array([0.2, 0.5, 0.85]) / np.linalg.norm([0.2, 0.5, 0.85])
    r = cr.fibonacci_directions(200)
    exact = dipoles.scatter(cloud, 8.0, d[None], depth=depth, per_wavelength=8.0).far_field(r)[:, 0]
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-7), cr.shadow_line(body, direction=d), length=3.0, n_rays=32)
    currents = cr.surface_currents(fan, wavenumber=8.0, boundary="pec", solve=False)
    monkeypatch.setattr("creeping.field.body_currents.self_reflects", lambda part: False)
    without = cr.surface_currents(fan, wavenumber=8.0, boundary="pec", solve=False)
    off, before = (np.sqrt(np.mean(np.abs(one.far(r) - exact) ** 2)) for one in (currents, without))
    assert off < 0.95 * before
    assert currents.extinction < without.extinction
    assert np.mean(np.abs(currents.far(r) - exact) <= currents.error(r)) > 0.9
