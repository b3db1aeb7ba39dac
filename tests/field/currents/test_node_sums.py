"""Sums over the nodes of conductors: exact currents satisfy the equation of the magnetic field, lit ground is found."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.conductor.equation import by_a_step
from creeping.field.currents import node_sums
from creeping.field.currents.lit_solution import solved_on_lit_ground
from creeping.field.currents.node_sums import sums_at
from creeping.field.currents.second_kind import stepped, twice_incident
from creeping.field.kernels.vector_sums import patches, vectors_from_nodes
from creeping.field.served import measured_field
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
    currents = cr.surface_currents(fan, wavenumber=k, boundary="pec")
    return replace(currents, **places, values=values, change=values, lit=every if lit is None else lit, bare=None)


def gap(currents, at, window):
    """What the equation leaves of the currents at some of their nodes (n, p)."""
    points, normals, values = currents.points[at], currents.normals[at], currents.values[at]
    received = sums_at(currents, points, normals, window).total(currents.values, values)
    return np.linalg.norm(twice_incident(currents, points, normals) + received - values, axis=1)


@pytest.mark.parametrize("k", [10.0, 20.0])
def test_exact_currents_of_a_sphere_satisfy_the_equation(ball, k):
    nodes = body_nodes(ball.body, 2 * k)
    currents = known(ball, k, nodes.points, nodes.normals, nodes.weights, mie(k, nodes.points))
    off = gap(currents, np.arange(0, len(nodes.points), 61), 0.8 / k)
    assert np.sqrt(np.mean(off**2)) < 1e-3 and np.max(off) < 5e-3


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
    at = np.arange(0, count, 11)
    assert max(np.sqrt(np.mean(gap(currents, at, a / k) ** 2)) for a in (0.8, 1.2, 1.6)) < 4e-3


def test_what_stands_far_off_is_summed_as_what_is_beside(ball, monkeypatch):
    nodes = body_nodes(ball.body, 20.0)
    currents = known(ball, 10.0, nodes.points, nodes.normals, nodes.weights, mie(10.0, nodes.points))
    x, J = nodes.points[::997], currents.values[::997]
    found = stepped(currents, x, x, J)
    monkeypatch.setattr(node_sums, "NEIGHBOURS", 6.0)
    np.testing.assert_allclose(stepped(currents, x, x, J), found, atol=1e-7)


def test_kernels_are_their_sums_in_numpy(rng):
    m, n, k, reach, near = 9, 300, 7.0, 0.3, 0.9
    y, sides = rng.normal(size=(2, 3, n))
    x, normals = np.concatenate([y[:, :2], rng.normal(size=(3, m - 2))], axis=1), rng.normal(size=(3, m))
    alike, weights, J = rng.random(n) < 0.6, rng.random(n), rng.normal(size=(2, 6, n))
    out, patch = np.empty((m, 2, 6)), np.empty((m, 10))
    vectors_from_nodes(x, normals, y, alike, J, k, near, 0, m, out)
    patches(x, normals, y, sides, weights, alike, reach, 1e-9, near, 0, m, patch)

    away = y[:, None] - x[:, :, None]
    R = np.linalg.norm(away, axis=0)
    touching = R < 1e-9
    R[touching] = 1.0
    h = np.where(alike | (R > near), 1.0, 1 - np.exp(-((k * R) ** 2))) * ~touching
    g = away / R * h * (1 / R - 1j * k) * np.exp(1j * k * R) / R
    for q in range(2):
        sent = np.cross(g, (J[q, :3] + 1j * J[q, 3:])[:, None], axis=0).sum(axis=2)
        want = 2 * np.cross(normals, sent, axis=0)
        np.testing.assert_allclose(out[:, q, :3] + 1j * out[:, q, 3:], want.T, atol=TWIN * np.abs(want).max())
    chi = np.where(alike & ((R <= near) | touching), weights * np.exp(-(np.where(touching, 0, R / reach) ** 2)), 0.0)
    np.testing.assert_allclose(patch[:, 0], chi.sum(axis=1), atol=TWIN)
    static = chi * ~touching / R**3
    T = np.einsum("amn,bn,mn->mab", away, sides, static)
    T += np.einsum("am,amn,mn->m", normals, away, static)[:, None, None] * np.eye(3)
    np.testing.assert_allclose(patch[:, 1:].reshape(-1, 3, 3), T, atol=TWIN * np.abs(T).max())


def test_lit_ground_is_found_from_exact_dark_ground(ball):
    k, count = 4.0, 4000
    x = fibonacci_directions(count)
    exact, lit = mie(k, x), x @ OBLIQUE < 0
    start = np.where(lit[:, None, None], 0.3 * exact, exact)
    solved = solved_on_lit_ground(known(ball, k, x, x, np.full(count, 4 * np.pi / count), start, lit))
    assert solved.solved and not np.any(solved.bare)
    np.testing.assert_array_equal(solved.values[~lit], exact[~lit])
    assert np.sqrt(np.mean(np.abs(solved.values - exact)[lit] ** 2)) < 0.03


def test_a_step_puts_lit_points_right_and_tells_of_dark_ones(ball):
    k = 10.0
    nodes = body_nodes(ball.body, 2 * k)
    currents = known(ball, k, nodes.points, nodes.normals, nodes.weights, mie(k, nodes.points))
    x = fibonacci_directions(40)
    around = np.tile(x, (5, 1))
    total, lit = 1.2 * mie(k, around), x @ OBLIQUE < 0
    served = [measured_field(total[:40, :, i], np.full(40, 0.01), "lit", "expansion") for i in range(2)]
    share = np.tile(lit.astype(float), 5)
    found, moved = by_a_step(currents, served, total, (around, around, share), np.full(2, 0.01))
    for i, one in enumerate(found):
        off = np.linalg.norm(one.values - total[:40, :, i] / 1.2, axis=1)
        assert np.max(off[lit]) < 0.05
        np.testing.assert_array_equal(one.values[~lit], total[:40, :, i][~lit])
        wrong = np.linalg.norm(total[:40, :, i], axis=1) / 6
        assert np.mean((one.error >= 0.8 * wrong)[~lit]) == 1.0 and np.all(off <= one.error + 0.002)
        # around a lit point as much is taken as there
        np.testing.assert_allclose(moved[:, :, i], np.tile(one.values, (5, 1)), atol=1e-12)
