"""Sums over the nodes of conductors: exact currents satisfy the equation of the magnetic field, lit ground is found."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.currents import node_sums
from creeping.field.currents.node_sums import sums_at
from creeping.field.currents.second_kind import stepped, twice_incident
from creeping.field.kernels.vector_sums import patches, vectors_from_nodes
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.quadrature import body_nodes
from studies.reference import clouds, dipoles, sphere
from tests.tolerances import TWIN

OBLIQUE = np.array([0.36, 0.48, 0.8])


@pytest.fixture(scope="module")
def ball():
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, OBLIQUE), length=3.0, n_rays=16)


def mie(k, x):
    """J (n, 3, 2) at points of the unit sphere."""
    each = [sphere.pec_total_field(k, 1.0, x, OBLIQUE, e)[1] for e in dipoles.frames(OBLIQUE[None])[0]]
    return np.stack([np.cross(x, H) for H in each], axis=-1)


def known(fan, k, points, normals, weights, values, lit=None):
    """Currents of a fan with other nodes and values."""
    every = np.ones(len(points), dtype=bool)
    places = {"points": points, "normals": normals, "weights": weights, "travel": normals}
    currents = cr.surface_currents(fan, wavenumber=k, boundary="pec", solve=False)
    return replace(currents, **places, values=values, change=values, lit=every if lit is None else lit)


def gap(currents, at, window):
    """What the equation leaves of the currents at some of their nodes (n, p)."""
    points, normals, values = currents.points[at], currents.normals[at], currents.values[at]
    received = sums_at(currents, points, normals, window).total(currents.values, values)
    return np.linalg.norm(twice_incident(currents, points, normals) + received - values, axis=1)


@pytest.mark.parametrize("k", [10.0])
def test_exact_currents_of_a_sphere_satisfy_the_equation(ball, k):
    nodes = body_nodes(ball.body, 2 * k)
    currents = known(ball, k, nodes.points, nodes.normals, nodes.weights, mie(k, nodes.points))
    off = gap(currents, np.arange(0, len(nodes.points), 61), 0.8 / k)
    assert np.sqrt(np.mean(off**2)) < 1e-3 and np.max(off) < 5e-3


@pytest.mark.slow
def test_those_of_an_ellipsoid_do_whatever_the_window():
    """Its curvatures differ along and across: what is put back turns the current."""
    body, k = sc.Ellipsoid(1.0, 0.8, 0.6), 8.0
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, OBLIQUE), length=3.0, n_rays=16)
    exact = dipoles.scatter(clouds.ellipsoid(1.0, 0.8, 0.6), k, OBLIQUE[None], depth=0.2)
    count, axes = 6000, np.array([1.0, 0.8, 0.6])
    s = fibonacci_directions(count)
    stretch = np.linalg.norm(s / axes, axis=1)
    points, normals, weights = s * axes, s / axes / stretch[:, None], 4 * np.pi / count * np.prod(axes) * stretch
    J = np.cross(normals[:, :, None], exact.total(points)[1][:, :, 0], axis=1)
    currents = known(fan, k, points, normals, weights, J)
    at = np.arange(0, count, 61)
    assert max(np.sqrt(np.mean(gap(currents, at, a / k) ** 2)) for a in (0.8, 1.2, 1.6)) < 4e-3


def test_what_stands_far_off_is_summed_as_what_is_beside(ball, monkeypatch):
    nodes = body_nodes(ball.body, 20.0)
    currents = known(ball, 10.0, nodes.points, nodes.normals, nodes.weights, mie(10.0, nodes.points))
    x, J = nodes.points[::997], currents.values[::997]
    found = stepped(currents, x, x, J)
    monkeypatch.setattr(node_sums, "NEIGHBOURS", 6.0)
    np.testing.assert_allclose(stepped(currents, x, x, J), found, atol=1e-7)


def test_kernels_are_their_sums_in_numpy(rng):
    m, n, k = 9, 300, 7.0
    reach, near = np.linspace(0.2, 0.4, m), np.linspace(0.6, 1.2, m)
    y, sides = rng.normal(size=(2, 3, n))
    x, normals = np.concatenate([y[:, :2], rng.normal(size=(3, m - 2))], axis=1), rng.normal(size=(3, m))
    alike, weights, J, shapes = rng.random(n) < 0.6, rng.random(n), rng.normal(size=(2, 6, n)), rng.normal(size=(6, n))
    out, patch = np.empty((m, 2, 6)), np.empty((m, 15))
    vectors_from_nodes(x, normals, y, alike, J, k, near, 0, m, out)
    patches(x, normals, y, sides, weights, shapes, alike, reach, 1e-9, near, 0, m, patch)

    away = y[:, None] - x[:, :, None]
    R = np.linalg.norm(away, axis=0)
    touching = R < 1e-9
    R[touching] = 1.0
    h = np.where(alike | (R > near[:, None]), 1.0, 1 - np.exp(-((k * R) ** 2))) * ~touching
    g = away / R * h * (1 / R - 1j * k) * np.exp(1j * k * R) / R
    for q in range(2):
        sent = np.cross(g, (J[q, :3] + 1j * J[q, 3:])[:, None], axis=0).sum(axis=2)
        want = 2 * np.cross(normals, sent, axis=0)
        np.testing.assert_allclose(out[:, q, :3] + 1j * out[:, q, 3:], want.T, atol=TWIN * np.abs(want).max())
    wide = np.where(touching, 0, R / reach[:, None])
    chi = np.where(alike & ((R <= near[:, None]) | touching), weights * np.exp(-(wide**2)), 0.0)
    np.testing.assert_allclose(patch[:, :6], chi @ shapes.T, atol=TWIN * np.abs(chi @ shapes.T).max())
    static = chi * ~touching / R**3
    T = np.einsum("amn,bn,mn->mab", away, sides, static)
    T += np.einsum("am,amn,mn->m", normals, away, static)[:, None, None] * np.eye(3)
    np.testing.assert_allclose(patch[:, 6:].reshape(-1, 3, 3), T, atol=TWIN * np.abs(T).max())


def test_the_current_at_a_point_is_closed_with_what_it_gives_itself(ball):
    k = 10.0
    nodes = body_nodes(ball.body, 2 * k)
    currents = known(ball, k, nodes.points, nodes.normals, nodes.weights, mie(k, nodes.points))
    x = fibonacci_directions(40)
    sums, wave = sums_at(currents, x, x, 0.8 / k), twice_incident(currents, x, x)
    own = sums.closed(currents.values, wave)
    np.testing.assert_allclose(wave + sums.total(currents.values, own), own, atol=1e-12)
    assert np.linalg.norm(own - mie(k, x), axis=1).max() < 5e-3
