"""The equation of the whole body: exact currents satisfy it, resonances do no harm, facing ground is right."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.currents import assembly, whole_solution
from creeping.field.currents.kept import kept_currents
from creeping.field.currents.node_sums import sums_at
from creeping.field.currents.second_kind import twice_incident
from creeping.field.currents.whole_solution import second_surface, solved_at, solved_on_whole_body
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.quadrature import body_nodes
from studies.field_coverage import DIPOLE_DEPTHS, bodies
from studies.reference import dipoles, fundamental, sphere

OBLIQUE = np.array([0.36, 0.48, 0.8])
DIP = (0.3, 0.5, 0.812)
"""Of the twisted ellipsoid: its shadow line is concave on a part."""


def fan_on(body, direction, k):
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, direction), wavenumber=k, n_rays=64)


def on_sphere(kind, k, x):
    """Exact current of the unit sphere at unit vectors (n, 3)."""
    if kind == "pec":
        each = [sphere.pec_total_field(k, 1.0, x, OBLIQUE, e)[1] for e in dipoles.frames(OBLIQUE[None])[0]]
        return np.stack([np.cross(x, H) for H in each], axis=-1)
    series = {"hard": sphere.surface_field, "soft": sphere.surface_derivative}[kind]
    return series(k, 1.0, x @ OBLIQUE, kind)


@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_exact_currents_satisfy_the_equation_on_both_surfaces(kind):
    k, ball = 6.0, sc.Sphere()
    nodes = body_nodes(ball, 2 * k)
    exact = on_sphere(kind, k, nodes.points)
    known = cr.surface_currents(fan_on(ball, OBLIQUE, k), wavenumber=k, boundary=kind, solve=False)
    every, places = np.ones(len(exact), dtype=bool), {"points": nodes.points, "normals": nodes.normals}
    places |= {"weights": nodes.weights, "travel": nodes.normals, "lit": every}
    known = replace(known, **places, values=exact, change=0 * exact)
    at, inner = second_surface(ball, nodes, k)
    assert len(at) == len(exact) and np.allclose(np.linalg.norm(inner, axis=1), 1 - np.pi / (2 * k), atol=1e-6)
    unit, none = np.abs(exact).max(), np.zeros(len(at), dtype=complex)
    received = sums_at(known, inner, nodes.normals, 0.0).total(exact, none)
    assert np.abs(twice_incident(known, inner, nodes.normals) + received).max() < 1e-4 * unit
    gap = solved_at(known, nodes.points, nodes.normals) - exact
    assert np.sqrt(np.mean(np.abs(gap) ** 2)) < 0.003 * unit


@pytest.mark.parametrize("kind", ["hard", *(pytest.param(k, marks=pytest.mark.slow) for k in ("soft", "pec"))])
def test_against_the_series_of_a_sphere_at_its_resonance(kind):
    # waves inside with w = 0 on the sphere (hard, j_1 = 0), dw/dn = 0 (soft, j_1' = 0) or n x H = 0 (pec, j_1 = 0)
    k = {"hard": 4.4934094579, "soft": 5.9403699905, "pec": 4.4934094579}[kind]
    fan, directions = fan_on(sc.Sphere(), OBLIQUE, k), fibonacci_directions(40)
    currents = cr.surface_currents(fan, wavenumber=k, boundary=kind, solve=True)
    assert currents.solved and currents.extinction < 5e-3
    off = np.abs(solved_at(currents, directions, directions) - on_sphere(kind, k, directions))
    assert off.max() < 0.02 * (k if kind == "soft" else 1.0)


@pytest.mark.slow
def test_convex_bodies_are_solved_where_expansions_leave_much_and_others_always(monkeypatch):
    fan = fan_on(sc.Sphere(), (1, 2, 3), 10.0)
    assert not cr.surface_currents(fan, wavenumber=10.0).solved
    solved = cr.surface_currents(fan, wavenumber=3.0, boundary="hard")
    plain = cr.surface_currents(fan, wavenumber=3.0, boundary="hard", solve=False)
    assert solved.solved and not plain.solved and plain.extinction > 5 * solved.extinction
    fan = fan_on(sc.TwistedEllipsoid(), DIP, 8.0)
    monkeypatch.setattr(assembly, "solved_on_whole_body", lambda currents, *_: replace(currents, solved=True))
    assert cr.surface_currents(fan, wavenumber=8.0, boundary="hard").solved


@pytest.mark.parametrize(
    "k, kind", [(0.1, "hard"), *(pytest.param(*c, marks=pytest.mark.slow) for c in ((0.3, "pec"), (0.6, "soft")))]
)
def test_a_small_sphere_against_its_series(k, kind):
    directions = fibonacci_directions(60)
    far = cr.far_field(fan_on(sc.Sphere(), OBLIQUE, 10.0), directions, wavenumber=k, boundary=kind)
    if kind == "pec":
        exact = np.linalg.norm(np.abs(sphere.pec_far_field(k, 1.0, directions @ OBLIQUE)), axis=0)
        off, error = np.abs(np.linalg.norm(far.total, axis=(1, 2)) - exact), np.linalg.norm(far.error, axis=(1, 2))
    else:
        exact = sphere.far_field(k, 1.0, directions @ OBLIQUE, kind)
        off, error = np.abs(far.total - exact), far.error
    assert off.max() < 0.02 * np.abs(exact).max() and np.mean(off <= error) > 0.95
    assert not np.any(far.unresolved)


@pytest.mark.slow
def test_ground_that_is_sharp_but_smooth_has_its_field():
    fan = fan_on(sc.TwistedEllipsoid(), DIP, 6.0)
    points = body_nodes(fan.body, 8.0).points[::40]
    u = cr.surface_field(fan, points, wavenumber=6.0, boundary="hard")
    assert np.all(u.method == "equation") and np.all(u.ok) and np.all(np.isfinite(u.error))


def test_what_is_asked_and_cannot_be_solved_is_refused():
    fan = fan_on(sc.Ellipsoid(1, 0.8, 0.6), (1, 2, 3), 200.0)
    with pytest.raises(cr.InvalidInputError, match="without solve=True"):
        cr.surface_currents(fan, wavenumber=200.0, solve=True)


@pytest.mark.slow
def test_what_would_take_too_long_has_one_bounce(monkeypatch):
    fan = fan_on(sc.TwistedEllipsoid(), DIP, 8.0)
    monkeypatch.setattr(whole_solution, "MOST", 1e6)
    bounced = cr.surface_currents(fan, wavenumber=8.0, boundary="hard")
    assert not bounced.solved
    monkeypatch.undo()
    solved = solved_on_whole_body(bounced, 1e9)
    assert solved.extinction < 0.1 * bounced.extinction
    # what is left of the equation is its change
    assert 0 < np.sqrt(np.mean(np.abs(solved.change) ** 2)) < 0.01
    np.testing.assert_allclose(solved.weights.sum(), body_nodes(fan.body, 16.0).weights.sum())


def test_nodes_that_close_may_be_too_many_where_those_of_the_first_mesh_are_not(monkeypatch):
    """`node_count` is of a mesh that need not close: of a mesh of 250 vertices a twentieth of the pairs that are."""
    fan = fan_on(sc.TwistedEllipsoid(), DIP, 8.0)
    nodes = len(body_nodes(fan.body, whole_solution.RATE * 8.0).points)
    assert whole_solution.too_many(fan.body, 8.0, float(nodes**2)) == ""
    assert f"needs {nodes} nodes, more than {nodes - 1}" in whole_solution.too_many(fan.body, 8.0, (nodes - 1.0) ** 2)
    for most in ("MOST", "ASKED"):
        monkeypatch.setattr(assembly, most, (nodes - 1.0) ** 2)
    assert whole_solution.pairs_of(fan.body, 8.0) == nodes**2
    assert not cr.surface_currents(fan, wavenumber=8.0, boundary="hard").solved
    with pytest.raises(cr.InvalidInputError, match=f"needs {nodes} nodes, more than"):
        cr.surface_currents(fan, wavenumber=8.0, boundary="hard", solve=True)


@pytest.mark.slow
def test_a_thin_body_has_its_second_surface_inside():
    k, disc = 6.0, sc.Ellipsoid(1, 1, 0.3)
    nodes = body_nodes(disc, 2 * k)
    at, inner = second_surface(disc, nodes, k)
    depth = np.linalg.norm(inner - nodes.points[at], axis=1)
    assert np.all(disc.level(inner) < 0) and np.all(depth >= 1.3 * nodes.spacing)
    assert len(at) > 0.5 * len(nodes.points) and depth.min() < 0.7 * np.pi / (2 * k)
    currents = cr.surface_currents(fan_on(disc, OBLIQUE, k), wavenumber=k, boundary="soft", solve=True)
    rest = twice_incident(currents, inner, nodes.normals[at])
    rest += sums_at(currents, inner, nodes.normals[at], 0.0).total(currents.values, 0j * rest)
    assert np.sqrt(np.mean(np.abs(rest) ** 2)) < 0.02 * k


@pytest.mark.slow
def test_the_body_times_s_has_the_field_of_k_over_s():
    def of(s):
        text = f"((x/{s})**2 + (y/{s})**2 + (z/{s})**2 + 0.64)**2 - 2.56*(x/{s})**2 - 0.9**4"
        fan = fan_on(sc.Implicit(text, bounds=[[-1.4 * s] * 3, [1.4 * s] * 3]), (0.2, 0.9, 0.4), 8.0 / s)
        return cr.far_field(fan, fibonacci_directions(20), wavenumber=8.0 / s, boundary="soft", method="currents")

    one, other = of(1.0), of(1000.0)
    np.testing.assert_allclose(other.total / 1000, one.total, rtol=0, atol=1e-6 * np.abs(one.total).max())
    np.testing.assert_allclose(other.error / 1000, one.error, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, k, direction, kind",
    [
        ("peanut", 10.0, (0.2, 0.9, 0.4), "hard"),
        ("peanut", 10.0, (0.2, 0.9, 0.4), "soft"),
        ("peanut", 10.0, (0.2, 0.9, 0.4), 0.5),
        ("twisted", 20.0, DIP, "hard"),
    ],
)
def test_against_fundamental_solutions(name, k, direction, kind):
    body, cloud, depth = bodies()[name]
    boundary = cr.ImpedanceBoundary(kind) if isinstance(kind, float) else kind
    d = np.array(direction) / np.linalg.norm(direction)
    exact = fundamental.scatter(cloud, k, d[None], kind, depth=depth, per_wavelength=7.0)
    fan, directions = fan_on(body, d, k), fibonacci_directions(200)
    f = np.asarray(exact.far_field(directions)).reshape(200, -1)[:, 0]
    found = cr.far_field(fan, directions, wavenumber=k, boundary=boundary, method="currents")
    off = np.abs(found.total - f)
    assert np.sqrt(np.mean(off**2)) < 0.002 * np.abs(f).max()
    assert np.mean(off <= found.error) > 0.95
    points = body_nodes(body, 10.0).points[::20]
    u = cr.surface_field(fan, points, wavenumber=k, boundary=boundary)
    assert np.all(u.method == "equation") and np.all(u.ok)
    if kind != "soft":
        off = np.abs(np.asarray(u) - np.asarray(exact.total(points))[:, 0])
        assert np.mean(off <= u.error) > 0.95 and np.quantile(off, 0.95) < 0.015


@pytest.mark.slow
@pytest.mark.parametrize("name, k, direction", [("peanut", 10.0, (0.2, 0.9, 0.4)), ("twisted", 12.0, DIP)])
def test_conductors_against_dipoles(name, k, direction):
    body, cloud, _ = bodies()[name]
    d = np.array(direction) / np.linalg.norm(direction)
    exact = dipoles.scatter(cloud, k, d[None], depth=DIPOLE_DEPTHS[name], per_wavelength=6.0)
    fan, directions = fan_on(body, d, k), fibonacci_directions(200)
    f = exact.far_field(directions)[:, 0]
    found = cr.far_field(fan, directions, wavenumber=k, boundary="pec", method="currents")
    off = np.abs(found.total - f)
    assert np.sqrt(np.mean(off**2)) < 0.003 * np.abs(f).max()
    assert np.mean(off <= found.error) > 0.95
    nodes = body_nodes(body, 10.0).part(np.arange(0, 3000, 11))
    E, H = (field[:, :, 0] for field in exact.total(nodes.points))
    J = np.cross(nodes.normals[:, :, None], H, axis=1)
    current = cr.conductor_current(fan, nodes.points, wavenumber=k)
    assert kept_currents(fan, k, "pec").solved and np.all(current.ok)
    wrong = np.linalg.norm(current.values - J, axis=1)
    assert np.quantile(wrong, 0.95) < 0.02 and np.mean(wrong <= current.error) > 0.95
    charge = np.abs(current.charge - np.sum(nodes.normals[:, :, None] * E, axis=1))
    assert np.quantile(charge, 0.95) < 0.03 and np.mean(charge <= current.charge_error) > 0.95
