"""E and H near conductors: Mie, dipoles, what holds on the body, Maxwell's equations, statuses, messages."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field import near, routes
from creeping.field.body_currents import cached_currents
from creeping.field.routes import Problem
from creeping.shadow.attachment import occluded

OBLIQUE = np.array([0.36, 0.48, 0.8])
K = 30.0


def wrong(field, E, H):
    """The larger error of E and H (n, 2)."""
    return np.maximum(np.linalg.norm(field.E - E, axis=1), np.linalg.norm(field.H - H, axis=1))


@pytest.fixture(scope="module")
def places():
    """Points off the sphere, from a hundredth of a wavelength to two radii, all about and behind it."""
    rng = np.random.default_rng(5)
    height = np.exp(rng.uniform(np.log(0.01 * 2 * np.pi / K), np.log(2.0), 100))
    axis = rng.uniform(1.02, 3.0, 20)[:, None] * OBLIQUE + 0.1 * rng.normal(size=(20, 3))
    axis = axis[np.linalg.norm(axis, axis=1) > 1.01]
    return np.concatenate([(1 + height[:, None]) * directions(rng, 100), axis])


@pytest.fixture(scope="module")
def field(ball, places):
    return cr.conductor_field(ball, places, wavenumber=K)


def test_sphere(field, places, mie):
    off = wrong(field, *mie(K, places))
    assert np.mean(field.ok) > 0.99 and {"currents", "layer"} <= set(field.method.ravel())
    assert off[field.ok].max() < 0.06 and np.quantile(off[field.ok], 0.95) < 0.02
    assert np.mean(off[field.ok] <= field.error[field.ok]) > 0.95
    assert np.median(field.error / off) < 6


def test_parts_add_up(field, places, ball):
    wave = np.exp(1j * K * (places @ OBLIQUE))
    incident = np.where(field.method == "rays", 0.0, wave[:, None])
    np.testing.assert_allclose(np.linalg.norm(field.incident.E, axis=1), np.abs(incident), atol=1e-12)
    np.testing.assert_allclose(field.E, field.incident.E + field.scattered.E + field.creeping.E)
    # of a plane wave E x H* is d
    alone = field.method[:, 0] != "rays"
    flow = np.cross(field.incident.E[alone, :, 0], field.incident.H[alone, :, 0].conj()).real
    np.testing.assert_allclose(flow, np.broadcast_to(OBLIQUE, flow.shape), atol=1e-12)
    assert field.power_flow.shape == field.E.shape


@pytest.mark.slow
def test_triaxial(triaxial, rng):
    fan, k, solution = triaxial
    x = directions(rng, 200) * (1.0, 0.8, 0.6) * (1 + np.exp(rng.uniform(-4, 1, (200, 1))))
    E, H = (part[:, :, 0] for part in solution.total(x))
    found = cr.conductor_field(fan, x, wavenumber=k)
    off = wrong(found, E, H)
    assert np.mean(off[found.ok] <= found.error[found.ok]) > 0.95
    assert np.mean(found.ok) > 0.85 and np.median(off) < 0.03


def test_onto_the_body_the_field_is_that_on_it(ball, rng):
    """E along the normal and H across it on the body; the layer comes to that from above."""
    x = directions(rng, 60)
    on, above = (cr.conductor_field(ball, s * x, wavenumber=K) for s in (1.0, 1.0 + 1e-5))
    assert np.max(np.linalg.norm(np.cross(x[:, :, None], on.E, axis=1), axis=1)) < 1e-12
    assert np.max(np.abs(np.einsum("nc,nci->ni", x, on.H))) < 1e-12
    good = on.ok & above.ok & (above.method == "layer")
    assert np.mean(good) > 0.9
    for mine, its in ((on.E, above.E), (on.H, above.H)):
        assert np.linalg.norm(mine - its, axis=1)[good].max() < 1e-3


def test_currents_radiate_by_maxwells_equations(ball, rng):
    """The sums for E and for H are two kernels: curl E = ikH and curl H = -ikE between them."""
    currents = cached_currents(ball, 8.0, "pec")
    x = 1.5 * directions(rng, 6)
    step = 1e-3
    ends = np.concatenate([x + sign * step * axis for axis in np.eye(3) for sign in (1, -1)])
    for first, second, sign in (
        (currents.scattered_electric, currents.scattered, 1),
        (currents.scattered, currents.scattered_electric, -1),
    ):
        values = first(ends).reshape(3, 2, 6, 3, 2)
        slope = (values[:, 0] - values[:, 1]) / (2 * step)
        curl = np.stack([slope[(i + 1) % 3][:, (i + 2) % 3] - slope[(i + 2) % 3][:, (i + 1) % 3] for i in range(3)], 1)
        np.testing.assert_allclose(curl, sign * 8j * second(x), atol=1e-4 * np.abs(curl).max())


def test_far_shadow_by_rays(mie):
    """Deep in the shadow and far from the body rays err by shares of a field that is a few thousandths."""
    body = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=OBLIQUE), length=5.5, n_rays=128)
    side = np.cross(OBLIQUE, (1, 0, 0)) / np.linalg.norm(np.cross(OBLIQUE, (1, 0, 0)))
    angle, r = np.meshgrid(np.radians([20, 25, 30, 35]), [1.3, 1.6])
    x = (r * np.cos(angle)).reshape(-1, 1) * OBLIQUE + (r * np.sin(angle)).reshape(-1, 1) * side
    k = 60.0
    for i, name in enumerate(("theta", "phi")):
        E, H = (part[..., i] for part in mie(k, x))
        problem = Problem(fan, k, "pec", mix=np.eye(2, dtype=complex)[:, [i]])
        alone = near.rays_alone(near.shed_sums(problem, x)[0], np.zeros(len(x), dtype=bool))
        off = np.maximum(*(np.linalg.norm(alone.values[:, part] - exact, axis=1) for part, exact in parts(E, H)))
        ok = alone.status == cr.FieldStatus.OK
        assert np.any(ok) and np.all(occluded(body, x, OBLIQUE)), name
        assert np.mean(off[ok] <= alone.error[ok]) > 0.9
        assert np.all(off[ok] < 0.25 * np.linalg.norm(E, axis=1)[ok])


def parts(E, H):
    return (slice(0, 3), E), (slice(3, 6), H)


def test_without_currents_rays_alone_say_what_they_lack(ball, monkeypatch):
    monkeypatch.setattr(routes, "affordable", lambda *_, **__: False)
    found = cr.conductor_field(ball, [-1.5 * OBLIQUE, (1.6, 0.0, 1.2)], wavenumber=60.0, polarisation="theta")
    assert found.status_counts["LIT"] >= 1 and found.error[0] > 1
    assert not found.ok[0] and set(found.method) == {"rays"}


def test_one_point_and_none(ball):
    one = cr.conductor_field(ball, (0.0, 2.0, 0.0), wavenumber=K, polarisation=(0.8, -0.6, 0))
    assert one.E.shape == one.H.shape == (3,) and one.error.shape == () and bool(one.ok)
    many = cr.conductor_field(ball, [[(0.0, 2.0, 0.0)] * 2], wavenumber=K, polarisation=(0.8, -0.6, 0))
    assert many.E.shape == (1, 2, 3) and many.status.shape == (1, 2)
    np.testing.assert_allclose(many.E[0, 1], one.E)
    none = cr.conductor_field(ball, np.zeros((0, 3)), wavenumber=K)
    assert none.E.shape == (0, 3, 2) and "0 points" in repr(none)


def test_tables_and_words(field, ball):
    data = field.to_xarray()
    assert dict(data.sizes) == {"point": len(field.points), "component": 3, "polarisation": 2}
    np.testing.assert_array_equal(data["E"].values, field.E)
    assert data["error"].dims == ("point", "polarisation") and data["E"].attrs["units"] == "of the incident E"
    current = cr.conductor_current(ball, [OBLIQUE, -OBLIQUE], wavenumber=K, polarisation="phi")
    table = current.to_dataframe()
    assert {"J", "charge", "error", "method"} <= set(table.columns) and len(table) == 6
    assert repr(field).startswith(f"ConductorField({len(field.points)} points, k = 30, pec, order 2)")
    assert "currents (" in field._repr_html_() and "lit (" in current._repr_html_()


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda fan: cr.conductor_field(fan, [(0, 0, 0.5)], wavenumber=9.0), "1 of 1 points are inside the body"),
        (lambda fan: cr.conductor_field(fan, [(0, 0, 2)], wavenumber=-1.0), "wavenumber"),
        (lambda fan: cr.conductor_current(fan, [(0, 0, 2)], wavenumber=9.0), "points"),
        (lambda fan: cr.near_field(fan, [(0, 0, 2)], wavenumber=9.0, boundary="pec"), "conductor_field"),
        (lambda fan: cr.surface_field(fan, [(0, 0, 1)], wavenumber=9.0, boundary="pec"), "conductor_current"),
    ],
)
def test_messages(ball, call, message):
    with pytest.raises(InvalidInputError, match=message):
        call(ball)
