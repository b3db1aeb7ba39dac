"""Fields of bodies with joints and tips, against rings of sources inside."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field import routes
from creeping.field.equation import effort
from studies.accuracy import edges

PILL = sc.Capsule(1.0, 4.0)


def fan_of(body, d, n_rays=64, length=4.0):
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=length, n_rays=n_rays)


# per cent of the largest value of the field, those off the body of the incident wave
MOST = {
    ("capsule 4", "hard"): {"lit": 1.5, "dark": 4.0, "near": 2.0, "far": 0.6},
    ("cone-sphere 4", "soft"): {"lit": 2.5, "dark": 2.5, "near": 4.0, "far": 1.0},
    ("capsule 4", 0.5): {"lit": 2.0, "dark": 4.0, "near": 1.0, "far": 0.2},
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "boundary", "theta"), [(*case, 1.0 + 0.2 * n) for n, case in enumerate(MOST)])
def test_errors_and_what_is_stated(name, boundary, theta):
    found = edges.joint_row(name, 20.0, boundary if isinstance(boundary, str) else complex(boundary), theta, seed=4)
    for part, most in MOST[name, boundary].items():
        usual, largest, covered = found[part]
        assert largest < most, part
        assert usual < 0.75 * most and covered > 88, part


@pytest.mark.slow
def test_far_field_is_by_the_equation_and_better_than_rays():
    d = np.array([np.sin(1.1), 0, np.cos(1.1)])
    exact = edges.scatter_by_rings(edges.CASES["capsule 4"][1], 12.0, [1.1], "soft")
    fan = fan_of(PILL, d)
    r = np.random.default_rng(2).normal(size=(60, 3))
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    f = exact.far_field(r)[:, 0]
    off = {}
    for method in ("auto", "rays"):
        far = cr.far_field(fan, r, wavenumber=12.0, boundary="soft", method=method)
        off[method] = np.abs(far.total - f)
        assert np.mean(off[method] <= far.error) > 0.9
        assert set(far.method) == {"equation" if method == "auto" else "rays+optics"}
    assert np.max(off["auto"]) < 0.02 * np.max(np.abs(f))
    assert np.max(off["rays"]) > 3 * np.max(off["auto"])


@pytest.mark.slow
def test_each_ray_crosses_joints():
    """Along a ray the wave has no jump where it passes a joint, though the curvature does."""
    fan = fan_of(PILL, (0.8, 0.1, 0.4))
    u = cr.surface_field(fan, wavenumber=20.0, boundary="hard")
    assert set(u.method.ravel()) == {"march"} and np.mean(u.ok) > 0.5
    plain = np.abs(u.values) * np.sqrt(np.abs(fan.spreading))
    ok = u.ok[:, 1:] & u.ok[:, :-1]
    steps = np.abs(np.diff(plain, axis=1))[ok] / plain[:, :-1][ok]
    assert np.quantile(steps, 0.99) < 0.2
    with pytest.raises(InvalidInputError, match="order=2"):
        cr.surface_field(fan, wavenumber=20.0, boundary="hard", order=1)


@pytest.mark.slow
def test_the_unit_of_length_is_no_matter(monkeypatch):
    monkeypatch.setattr(routes, "affordable", lambda *_, **__: False)
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    points = np.array([[1.0, 0.0, 0.1], [0.0, 0.6, 1.05], [0.0, -1.0, -0.2]])
    d = (0.9, 0.0, 0.4)
    small, large = (
        cr.surface_field(
            fan_of(sc.Capsule(1.0 * scale, 2.5 * scale), d, n_rays=16, length=3.0 * scale),
            points * scale, wavenumber=5.0 / scale, boundary="hard",
        )
        for scale in (1.0, 1024.0)
    )  # fmt: skip
    np.testing.assert_allclose(large.values, small.values, atol=1e-10)
    np.testing.assert_allclose(large.error, small.error, rtol=1e-8)


def test_what_has_no_march_is_refused_where_the_equation_is_too_large(monkeypatch):
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    fan = fan_of(PILL, (0.9, 0.0, 0.4))
    for ask in (
        lambda: cr.surface_currents(fan, wavenumber=24.0, boundary="pec"),
        lambda: cr.conductor_field(fan, [(3.0, 0, 0)], wavenumber=24.0),
    ):
        with pytest.raises(InvalidInputError, match="not solved at wavenumber 24"):
            ask()
    far = cr.far_field(fan, [(0, 0, 1)], wavenumber=24.0, boundary="pec")
    assert far.method.tolist() == ["rays+optics"]


# share of the largest |f|
FROM_NOTHING = [
    ("soft", 4.0, 2.5e-3),
    *(pytest.param(kind, 8.0, 2e-3, marks=pytest.mark.slow) for kind in ("soft", "hard")),
]


@pytest.mark.parametrize(("boundary", "k", "most"), FROM_NOTHING)
def test_along_the_axis_the_equation_starts_from_nothing(boundary, k, most):
    """The line is a joint: there are no tubes of rays, and no expansion's currents."""
    profile, fan = edges.CASES["capsule 4"][1], fan_of(PILL, (0, 0, 1), n_rays=16)
    exact, r = edges.scatter_by_rings(profile, k, [0.0], boundary), np.random.default_rng(5).normal(size=(30, 3))
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    f = exact.far_field(r)[:, 0]
    far = cr.far_field(fan, r, wavenumber=k, boundary=boundary)
    assert set(far.method) == {"equation"} and np.abs(far.total - f).max() < most * np.abs(f).max()
    assert np.mean(np.abs(far.total - f) <= far.error) > 0.95
    x, n = edges.spread(profile, np.random.default_rng(6), 30)
    u = cr.surface_field(fan, x, wavenumber=k, boundary=boundary)
    true = (exact.normal_derivative(x, n) if boundary == "soft" else exact.total(x))[:, 0]
    unit = k if boundary == "soft" else 1.0
    assert np.all(u.ok) and np.quantile(np.abs(u.values - true), 0.95) < 0.01 * unit


@pytest.mark.slow
def test_along_the_axis_where_the_equation_is_too_large(monkeypatch):
    """Rays and optics far away, and elsewhere words or a status, no foreign error."""
    monkeypatch.setattr(routes, "affordable", lambda *_, **__: False)
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    fan = fan_of(PILL, (0, 0, 1), n_rays=16)
    far = cr.far_field(fan, [(0, 0, 1.0)], wavenumber=5.0, boundary="hard")
    assert far.method.tolist() == ["rays+optics"] and np.all(np.isfinite(far.total))
    u = cr.surface_field(fan, [(1.0, 0, 0), (0, 0, -2.0)], wavenumber=5.0, boundary="hard")
    assert not np.any(u.ok) and np.all(np.isfinite(u.values))
    with pytest.raises(InvalidInputError, match="more rays"):
        cr.surface_field(fan, wavenumber=5.0, boundary="hard")
    nearly = cr.surface_field(fan_of(PILL, (1e-6, 0, 1), n_rays=16), [(1.0, 0, 0)], wavenumber=5.0, boundary="hard")
    assert np.isfinite(nearly.values[0]) and nearly.error[0] > 0


def test_a_tip_has_no_value(monkeypatch):
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    cone = sc.ConeSphere(1.0, 4.0)
    u = cr.surface_field(fan_of(cone, (0.3, 0, -1), n_rays=16), [(0, 0, 3.0)], wavenumber=12.0, boundary="soft")
    assert u.values[0] == 0 and np.isinf(u.error[0]) and not u.ok[0]


@pytest.mark.slow
def test_beams_of_the_other_side_of_a_thin_body_do_not_count():
    """A prolate spheroid met almost along its axis: dark ground all round, thinner than beams reach."""
    body, k, d = sc.Ellipsoid(0.7, 0.7, 2.5), 12.0, np.array([np.sin(0.1), 0, np.cos(0.1)])
    exact = edges.scatter_by_rings(spheroid(0.7, 2.5), k, [0.1], "hard")
    x, n = edges.spread(spheroid(0.7, 2.5), np.random.default_rng(3), 200)
    dark = n @ d > 0.1
    u = cr.surface_field(fan_of(body, d), x[dark], wavenumber=k, boundary="hard")
    off = np.abs(u.values - exact.total(x[dark])[:, 0])[u.ok]
    assert np.quantile(off, 0.95) < 0.25 * np.abs(exact.total(x)).max()


def spheroid(a, c):
    """The profile of a spheroid by arc length, from a fine table."""
    t = np.linspace(0, np.pi, 20_001)
    s = np.concatenate([[0], np.cumsum(np.hypot(a * np.cos(t[1:] - t[1] / 2), c * np.sin(t[1:] - t[1] / 2)) * t[1])])

    def at(place):
        angle = np.interp(place, s, t)
        n = np.stack([np.sin(angle) / a, np.cos(angle) / c], axis=-1)
        return np.stack([a * np.sin(angle), c * np.cos(angle)], axis=-1), n / np.linalg.norm(n, axis=-1, keepdims=True)

    return edges.Profile(at, float(s[-1]), (), (), a * a / c)
