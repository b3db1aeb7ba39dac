"""Where fans' fields are by the integral equation, by themselves or because it is asked for; against exact fields."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.equation import effort
from creeping.geometry.quadrature import body_nodes
from studies.accuracy.bodies import bodies
from studies.accuracy.edges import CASES, spread
from tests.reference import dipoles, fundamental, sphere, stored
from tests.reference.generatrix import pieces_profile
from tests.reference.modal_conductor import scatter_conductor
from tests.reference.revolution import Revolved

K = 10.0
AXES = (0.9, 0.55, 0.7)
OBLIQUE = np.array([0.36, 0.48, 0.8])
DIP = (0.3, 0.5, 0.812)
"""Of the twisted ellipsoid: its shadow line is concave on a part."""


def fan_of(body, d, n_rays=48):
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=4.0, n_rays=n_rays)


@pytest.fixture(scope="module")
def ellipsoid():
    return fan_of(sc.Ellipsoid(*AXES), (0.3, -0.5, 0.8))


@pytest.fixture(scope="module")
def pill():
    d = np.array([np.sin(0.9), 0, np.cos(0.9)])
    exact = dipoles.scatter(Revolved(CASES["capsule 5.3"][1]), 4.0, d[None], depth=0.3, per_wavelength=6.0)
    assert exact.residual.max() < 0.01
    return fan_of(CASES["capsule 5.3"][0], d), exact


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_a_convex_body_in_all_of_space(ellipsoid, boundary):
    exact = stored.read("ellipsoid_equation")
    r, x, y = exact["far"], exact["on"], exact["near"]
    f = exact[f"{boundary} far"]
    far = cr.far_field(ellipsoid, r, wavenumber=K, boundary=boundary, method="equation")
    off = np.abs(far.total - f)
    assert set(far.method) == {"equation"}
    assert np.sqrt(np.mean(off**2)) < 4e-4 * np.abs(f).max() and np.mean(off <= far.error) > 0.95
    u = cr.surface_field(ellipsoid, x, wavenumber=K, boundary=boundary, method="equation")
    unit = K if boundary == "soft" else 1.0
    assert set(u.method) == {"equation"} and np.all(u.ok)
    off = np.abs(u.values - exact[f"{boundary} on"]) / unit
    assert off.max() < 0.01 and np.mean(off <= u.error / unit) > 0.9
    near = cr.near_field(ellipsoid, y, wavenumber=K, boundary=boundary, method="equation")
    assert set(near.method) == {"equation"} and np.all(near.ok)
    off = np.abs(near.values - exact[f"{boundary} near"])
    assert off.max() < 2e-3 and np.mean(off <= near.error) > 0.95


@pytest.mark.slow
def test_the_equation_is_taken_by_itself_where_expansions_leave_much(monkeypatch):
    fan = fan_of(sc.Sphere(), (1, 2, 3))
    assert not cr.surface_currents(fan, wavenumber=K).solved
    solved = cr.surface_currents(fan, wavenumber=3.0, boundary="hard")
    plain = cr.surface_currents(fan, wavenumber=3.0, boundary="hard", solve=False)
    assert solved.solved and not plain.solved and plain.extinction > 5 * solved.extinction
    # 4.4934 is a resonance, j_1 = 0
    fan, r = fan_of(sc.Sphere(), OBLIQUE), cr.fibonacci_directions(40)
    currents = cr.surface_currents(fan, wavenumber=4.4934094579, boundary="hard", solve=True)
    found = currents.on_body(r).values
    np.testing.assert_allclose(found, sphere.surface_field(4.4934094579, 1.0, r @ OBLIQUE, "hard"), atol=2e-3)
    # concave ground: one bounce where it would take too long
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    assert not cr.surface_currents(fan_of(sc.TwistedEllipsoid(), DIP), wavenumber=4.0, boundary="hard").solved


@pytest.mark.parametrize("k, kind", [(0.1, "hard"), (0.3, "pec")])
def test_a_small_sphere_against_its_series(k, kind):
    r = cr.fibonacci_directions(60)
    far = cr.far_field(fan_of(sc.Sphere(), OBLIQUE), r, wavenumber=k, boundary=kind)
    if kind == "pec":
        exact = np.linalg.norm(np.abs(sphere.pec_far_field(k, 1.0, r @ OBLIQUE)), axis=0)
        off, error = np.abs(np.linalg.norm(far.total, axis=(1, 2)) - exact), np.linalg.norm(far.error, axis=(1, 2))
    else:
        exact = sphere.far_field(k, 1.0, r @ OBLIQUE, kind)
        off, error = np.abs(far.total - exact), far.error
    assert off.max() < 2e-3 * np.abs(exact).max() and np.mean(off <= error) > 0.95
    assert not np.any(far.unresolved)


def test_a_disc_and_a_needle_have_fields():
    """Second surfaces and points inside are where there is room for them."""
    for axes in ((1, 1, 0.1), (0.1, 0.12, 1)):
        found = cr.solve(sc.Ellipsoid(*axes), OBLIQUE, wavenumber=4.0, boundary="hard")
        assert found.nodes < 4000 and found.currents().extinction < 3e-3 and found.steps < 30


@pytest.mark.slow
def test_what_it_refuses(ellipsoid, monkeypatch):
    with pytest.raises(cr.InvalidInputError, match="method 'equation' has no order 1"):
        cr.far_field(ellipsoid, [(0, 0, 1)], wavenumber=K, method="equation", order=1)
    with pytest.raises(cr.InvalidInputError, match="give points"):
        cr.surface_field(ellipsoid, wavenumber=K, method="equation")
    with pytest.raises(cr.InvalidInputError, match="not one of 'auto', 'equation'"):
        cr.surface_field(ellipsoid, [AXES], wavenumber=K, method="currents")
    with pytest.raises(cr.InvalidInputError, match=r"at wavenumber 400: \d+ nodes take"):
        cr.surface_currents(ellipsoid, wavenumber=400.0, solve=True)
    fan = fan_of(CASES["capsule 5.3"][0], (np.sin(0.9), 0, np.cos(0.9)))
    with pytest.raises(cr.InvalidInputError, match="not solved at wavenumber 4: give solve=True"):
        cr.surface_currents(fan, wavenumber=4.0, boundary="pec", solve=False)
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    for ask in (
        lambda: cr.conductor_current(fan, [(0.0, 1.0, 0.0)], wavenumber=4.0),
        lambda: cr.conductor_field(fan, [(3.0, 0, 0)], wavenumber=4.0),
    ):
        with pytest.raises(cr.InvalidInputError, match='method="equation"'):
            ask()
    assert set(cr.far_field(fan, [(0, 0, 1)], wavenumber=4.0, boundary="pec").method) == {"rays+optics"}
    drum = sc.Cylinder(1.0, 3.0)
    edged = cr.launch(cr.DirectFlow(drum), cr.shadow_line(drum, (1, 0.2, 0.3)), length=3.0, n_rays=24)
    with pytest.raises(cr.InvalidInputError, match='method="equation"'):
        cr.surface_field(edged, [(1.0, 0, 0)], wavenumber=6.0, boundary="hard")


def test_next_to_edges_and_on_faces():
    """Fields of a fan are those of the solution, at any distance."""
    drum, d = sc.Cylinder(1.0, 2.0), (0.48, 0.6, -0.64)
    fan = cr.launch(cr.DirectFlow(drum), cr.shadow_line(drum, d), length=2.0, n_rays=24)
    found = cr.solve(drum, d, wavenumber=3.0, boundary="hard")
    x = np.array([[1.0, 0.0, 0.3], [0.5, 0.2, 1.0]])
    y = np.array([[1.0, 1e-3, 1.0 + 1e-3], [0.0, 1.0 + 1e-4, 0.5], [0.0, 0.3, 1.2], [2.0, 0.0, -1.0]])
    u, v = cr.surface_field(fan, x, wavenumber=3.0, boundary="hard"), found.surface_field(x)
    np.testing.assert_allclose(u.values, v.values, atol=1e-6)
    near = cr.near_field(fan, y, wavenumber=3.0, boundary="hard")
    assert set(near.method) == {"equation"} and np.all(near.ok)
    np.testing.assert_allclose(near.values, found.near_field(y).values, atol=1e-6)


@pytest.mark.slow
def test_a_conductor_with_joints(pill, rng):
    fan, exact = pill
    r = cr.fibonacci_directions(200)
    # dipoles inside leave 1e-3 of the boundary's condition at joints; far away modes on the generatrix know it to 1e-9
    corners = [(0.0, 2.65), (1.0, 1.65), (1.0, -1.65), (0.0, -2.65)]
    profile = pieces_profile(corners, {0: (0.0, 1.65), 2: (0.0, -1.65)})
    f = scatter_conductor(profile, 4.0, [0.9]).far_field(r)[:, 0]
    far = cr.far_field(fan, r, wavenumber=4.0, boundary="pec")
    assert set(far.method) == {"equation"} and not np.any(far.unresolved)
    assert np.sqrt(np.mean(np.abs(far.total - f) ** 2)) < 1e-3 * np.abs(f).max()
    assert np.mean(np.abs(far.total - f) <= far.error) > 0.95
    x, n = spread(CASES["capsule 5.3"][1], rng, 200)
    H = exact.total(x)[1][:, :, 0]
    J = cr.conductor_current(fan, x, wavenumber=4.0)
    off = np.linalg.norm(J.values - np.cross(n[:, :, None], H, axis=1), axis=1)
    assert set(J.method.ravel()) == {"equation"} and np.all(J.ok)
    assert np.quantile(off, 0.95) < 0.012 and off.max() < 0.03
    # on the body the dipoles know H no better than what they leave of its condition
    assert np.mean(off <= J.error + exact.residual.max()) > 0.8
    y = x + rng.uniform(0.3, 2.0, 200)[:, None] * 2 * np.pi / 4.0 * n
    field = cr.conductor_field(fan, y, wavenumber=4.0)
    E, H = (its[:, :, 0] for its in exact.total(y))
    off = np.maximum(np.linalg.norm(field.E - E, axis=1), np.linalg.norm(field.H - H, axis=1))
    assert set(field.method.ravel()) == {"equation"} and np.all(field.ok)
    # dipoles err by 2e-4 in the median and 7e-4 at most, as solutions between three times the nodes tell
    assert off.max() < 5e-3 and np.mean(off <= field.error + 1e-3) > 0.95
    close = cr.conductor_field(fan, x + 0.2 * n, wavenumber=4.0)
    assert set(close.method.ravel()) == {"equation"} and np.all(close.ok)


@pytest.mark.slow
def test_the_body_times_s_has_the_field_of_k_over_s():
    def of(s):
        text = f"((x/{s})**2 + (y/{s})**2 + (z/{s})**2 + 0.64)**2 - 2.56*(x/{s})**2 - 0.9**4"
        body = sc.Implicit(text, bounds=[[-1.4 * s] * 3, [1.4 * s] * 3])
        found = cr.solve(body, (0.2, 0.9, 0.4), wavenumber=8.0 / s, boundary="soft")
        return found.far_field(cr.fibonacci_directions(20))

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
    fan, r = fan_of(body, d), cr.fibonacci_directions(200)
    f = np.asarray(exact.far_field(r)).reshape(200, -1)[:, 0]
    found = cr.far_field(fan, r, wavenumber=k, boundary=boundary)
    off = np.abs(found.total - f)
    assert np.sqrt(np.mean(off**2)) < 0.001 * np.abs(f).max()
    assert np.mean(off <= found.error) > 0.95
    points = body_nodes(body, 10.0).points[::20]
    u = cr.surface_field(fan, points, wavenumber=k, boundary=boundary)
    assert np.all(u.method == "equation") and np.all(u.ok)
    if kind != "soft":
        off = np.abs(np.asarray(u) - np.asarray(exact.total(points))[:, 0])
        assert np.mean(off <= u.error) > 0.95 and np.quantile(off, 0.95) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("name, k, direction", [("peanut", 10.0, (0.2, 0.9, 0.4)), ("twisted", 12.0, DIP)])
def test_conductors_against_dipoles(name, k, direction):
    body, cloud, depth = bodies()[name]
    d = np.array(direction) / np.linalg.norm(direction)
    exact = dipoles.scatter(cloud, k, d[None], depth=depth, per_wavelength=6.0)
    fan, r = fan_of(body, d), cr.fibonacci_directions(200)
    f = exact.far_field(r)[:, 0]
    found = cr.far_field(fan, r, wavenumber=k, boundary="pec", method="currents")
    off = np.abs(found.total - f)
    assert np.sqrt(np.mean(off**2)) < 0.002 * np.abs(f).max()
    # dipoles err by 1e-4 of the largest, as solutions of the equation between three times the nodes tell
    assert np.mean(off <= found.error + 1e-4 * np.abs(f).max()) > 0.95
    nodes = body_nodes(body, 10.0).part(np.arange(0, 3000, 11))
    E, H = (field[:, :, 0] for field in exact.total(nodes.points))
    J = np.cross(nodes.normals[:, :, None], H, axis=1)
    current = cr.conductor_current(fan, nodes.points, wavenumber=k)
    assert set(current.method.ravel()) == {"equation"} and np.all(current.ok)
    wrong = np.linalg.norm(current.values - J, axis=1)
    assert np.quantile(wrong, 0.95) < 0.02 and np.mean(wrong <= current.error + exact.residual.max()) > 0.95
    charge = np.abs(current.charge - np.sum(nodes.normals[:, :, None] * E, axis=1))
    assert np.quantile(charge, 0.95) < 0.03 and np.mean(charge <= current.charge_error + exact.residual.max()) > 0.95
