"""Lit ground by the integral equation: exact currents satisfy it, ground that faces itself and dips come out right."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.currents import lit_solution
from creeping.field.currents.kept import kept_currents
from creeping.field.currents.lit_solution import WINDOW, solved_on_lit_ground, with_bare_ground
from creeping.field.currents.node_sums import NodeSums
from creeping.field.currents.second_kind import stepped, twice_incident
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.quadrature import body_nodes
from creeping.shadow.occlusion import occluded
from studies.field_coverage import DIPOLE_DEPTHS, bodies
from studies.reference import dipoles, fundamental, sphere

K = 10.0
DIP = (0.3, 0.5, 0.812)
"""Of the twisted ellipsoid: its shadow line is concave on a part."""


def fan_on(body, direction, k=K):
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, direction), wavenumber=k, n_rays=64)


@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_exact_currents_satisfy_the_equation(kind):
    d = np.array([0.36, 0.48, 0.8])
    nodes = body_nodes(sc.Sphere(), 2 * K)
    currents = cr.surface_currents(fan_on(sc.Sphere(), d), wavenumber=K, boundary=kind)
    series = sphere.surface_field if kind == "hard" else sphere.surface_derivative
    exact = series(K, 1.0, nodes.normals @ d, kind)
    places = {"points": nodes.points, "normals": nodes.normals, "weights": nodes.weights, "travel": nodes.normals}
    whole = replace(currents, **places, values=exact, change=exact, lit=np.ones(len(exact), dtype=bool))
    at = np.arange(0, len(exact), 7)
    points, normals = nodes.points[at], nodes.normals[at]
    rest, own = NodeSums(whole, points, normals, WINDOW / K).of(exact)
    gap = twice_incident(whole, points, normals) + rest + (own - 1) * exact[at]
    assert np.sqrt(np.mean(np.abs(gap) ** 2)) < 0.015 * np.abs(exact[at]).max()


def test_convex_bodies_are_not_solved_and_others_are():
    assert not cr.surface_currents(fan_on(sc.Ellipsoid(1, 0.8, 0.6), (1, 2, 3)), wavenumber=K).solved
    assert cr.surface_currents(fan_on(sc.TwistedEllipsoid(), DIP, 8.0), wavenumber=8.0, boundary="hard").solved


def test_what_would_take_too_long_has_one_bounce(monkeypatch):
    fan = fan_on(sc.TwistedEllipsoid(), DIP, 8.0)
    monkeypatch.setattr(lit_solution, "MOST", 1e6)
    bounced = cr.surface_currents(fan, wavenumber=8.0, boundary="hard")
    assert not bounced.solved
    monkeypatch.undo()
    solved = solved_on_lit_ground(bounced)
    rays = np.flatnonzero(~bounced.lit)
    np.testing.assert_array_equal(solved.values[rays], bounced.values[rays])
    # the step that is left is small against what was changed
    points, normals, values = solved.points[solved.even], solved.normals[solved.even], solved.values[solved.even]
    rest, own = NodeSums(solved, points, normals, WINDOW / 8.0).of(solved.values)
    left = twice_incident(solved, points, normals) + rest + (own - 1) * values
    changed = np.linalg.norm(values[: bounced.lit.sum()] - bounced.values[bounced.lit])
    assert 0 < np.linalg.norm(left) < 0.05 * changed


def test_dark_ground_to_which_no_ray_comes_has_nodes(monkeypatch):
    fan = fan_on(sc.TwistedEllipsoid(), (0.3, 0.2, 0.9), 8.0)
    monkeypatch.setattr(lit_solution, "MOST", 1.0)
    currents = cr.surface_currents(fan, wavenumber=8.0, boundary="hard")
    whole = with_bare_ground(currents)
    assert currents.unserved > 0.1 and np.sum(whole.bare) > 300 and not np.any(whole.bare & whole.lit)
    # dark, and no nearer to other nodes than these are to each other but at its edge
    assert np.all(whole.normals[whole.bare] @ fan.line.direction > -0.3)
    area = body_nodes(fan.body, 16.0).weights.sum()
    assert 0.005 * area < whole.weights[whole.bare].sum() < 0.1 * area
    np.testing.assert_array_equal(whole.values[whole.bare], 0.0)


@pytest.mark.slow
def test_the_body_times_s_has_the_field_of_k_over_s():
    def of(s):
        text = f"((x/{s})**2 + (y/{s})**2 + (z/{s})**2 + 0.64)**2 - 2.56*(x/{s})**2 - 0.9**4"
        fan = fan_on(sc.Implicit(text, bounds=[[-1.4 * s] * 3, [1.4 * s] * 3]), (0.2, 0.9, 0.4), 8.0 / s)
        return cr.far_field(fan, fibonacci_directions(20), wavenumber=8.0 / s, boundary="soft", method="currents")

    one, other = of(1.0), of(1000.0)
    np.testing.assert_allclose(other.total / 1000, one.total, rtol=0, atol=1e-6 * np.abs(one.total).max())
    np.testing.assert_allclose(other.error / 1000, one.error, rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, direction, kind, far",
    [
        ("peanut", (0.2, 0.9, 0.4), "hard", 0.03),
        ("peanut", (0.2, 0.9, 0.4), "soft", 0.01),
        ("twisted", DIP, "hard", 0.03),
    ],
)
def test_against_fundamental_solutions(name, direction, kind, far):
    body, cloud, depth = bodies()[name]
    k = 10.0 if name == "peanut" else 20.0
    d = np.array(direction) / np.linalg.norm(direction)
    exact = fundamental.scatter(cloud, k, d[None], kind, depth=depth, per_wavelength=7.0)
    fan = fan_on(body, d, k)
    directions = fibonacci_directions(200)
    f = np.asarray(exact.far_field(directions)).reshape(200, -1)[:, 0]
    found = cr.far_field(fan, directions, wavenumber=k, boundary=kind, method="currents")
    off = np.abs(found.total - f)
    assert np.sqrt(np.mean(off**2)) < far * np.abs(f).max()
    assert np.mean(off <= found.error) > 0.95
    if kind == "hard":
        currents = cr.surface_currents(fan, wavenumber=k, boundary=kind)
        lit = currents.lit & (currents.normals @ d < -0.1)
        u = np.asarray(exact.total(currents.points[lit]))[:, 0]
        wrong = np.abs(currents.values[lit] - u) ** 2
        assert np.sqrt(np.average(wrong, weights=currents.weights[lit])) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, k, direction, lit_error, gain",
    [("peanut", 10.0, (0.2, 0.9, 0.4), 0.12, 0.9), ("twisted", 20.0, DIP, 0.15, 0.8)],
)
def test_conductors_against_dipoles(name, k, direction, lit_error, gain, monkeypatch):
    """One bounce errs by .46 and .80 on lit ground."""
    body, cloud, _ = bodies()[name]
    d = np.array(direction) / np.linalg.norm(direction)
    exact = dipoles.scatter(cloud, k, d[None], depth=DIPOLE_DEPTHS[name], per_wavelength=6.0)
    fan, directions = fan_on(body, d, k), fibonacci_directions(200)
    f = exact.far_field(directions)[:, 0]
    found = cr.far_field(fan, directions, wavenumber=k, boundary="pec", method="currents")
    off = np.abs(found.total - f)
    monkeypatch.setattr(lit_solution, "MOST", 1.0)
    bounced = cr.surface_currents(fan, wavenumber=k, boundary="pec")
    monkeypatch.undo()
    assert np.sqrt(np.mean(off**2)) < gain * np.sqrt(np.mean(np.abs(bounced.far(directions) - f) ** 2))
    assert np.mean(off <= found.error) > 0.97
    nodes = body_nodes(body, 2 * k)
    lit = np.flatnonzero(nodes.normals @ d < -0.1)
    lit = lit[:: len(lit) // 200]
    lit = lit[~occluded(body, nodes.points[lit], d)]
    J = np.cross(nodes.normals[lit][:, :, None], exact.total(nodes.points[lit])[1][:, :, 0], axis=1)
    current = cr.conductor_current(fan, nodes.points[lit], wavenumber=k)
    wrong = np.linalg.norm(current.values - J, axis=1)
    assert np.quantile(wrong, 0.95) < lit_error
    assert np.mean(wrong <= current.error) > 0.97
    # what a step would change on dark ground stands in its error
    dark = np.flatnonzero(nodes.normals @ d > 0.2)
    dark = dark[:: len(dark) // 200]
    shadow = cr.conductor_current(fan, nodes.points[dark], wavenumber=k)
    currents = kept_currents(fan, k, "pec")
    step = stepped(currents, nodes.points[dark], nodes.normals[dark], shadow.values) - shadow.values
    assert currents.solved and np.all(shadow.error >= 0.99 * np.linalg.norm(step, axis=1))
