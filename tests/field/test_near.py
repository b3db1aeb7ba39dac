"""The near field against exact fields: inside its error wherever it is OK, and OK wherever currents can serve."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field.results.point_result import FieldStatus
from creeping.field.routes import TRUST
from creeping.shadow.attachment import occluded
from tests.reference import sphere

D = np.array([0.0, 0.0, 1.0])


def fan_of(body=None, length=4.0, d=D, n_rays=64):
    body = sc.Sphere() if body is None else body
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=length, n_rays=n_rays)


@pytest.fixture(scope="module")
def fan():
    return fan_of()


def around(count, seed=0, least=1.2):
    rng = np.random.default_rng(seed)
    r = rng.normal(size=(count, 3))
    return rng.uniform(least, 4.0, (count, 1)) * r / np.linalg.norm(r, axis=1, keepdims=True)


def behind(points):
    return (np.hypot(points[:, 0], points[:, 1]) < 1) & (points[:, 2] > 0)


@pytest.mark.parametrize("boundary", ["soft", 0.7, pytest.param("hard", marks=pytest.mark.slow)])
def test_currents_give_the_total_field_on_all_sides(fan, boundary):
    kind = cr.ImpedanceBoundary(boundary) if boundary == 0.7 else boundary
    y = around(300, least=1.35)
    u = cr.near_field(fan, y, wavenumber=20.0, boundary=kind, method="currents")
    exact = sphere.total_field(20.0, 1.0, y, D, boundary)
    assert set(u.method) == {"currents"} and np.all(u.ok)
    assert set(u.error_by) == {"extinction"}
    off = np.abs(u - exact)
    assert np.mean(off < u.error) > 0.95 and np.median(u.error / off) < 5
    assert off.max() < 0.03
    np.testing.assert_allclose(u.incident, np.exp(20j * y[:, 2]))
    np.testing.assert_array_equal(u.creeping, 0)


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_auto_takes_rays_deep_in_the_shadow_and_currents_elsewhere(fan, boundary):
    axis = np.stack([0 * np.ones(5), 0 * np.ones(5), np.linspace(1.3, 4, 5)], axis=1)
    deep = np.array([[0.6, 0.0, 1.0], [0.0, 0.7, 0.85], [-0.5, 0.5, 1.0]])
    bright = np.array([[0.0, 0.0, -2.0], [1.0, 1.0, -1.0], [0.0, 2.0, 3.0]])
    y = np.concatenate([axis, deep, bright])
    u = cr.near_field(fan, y, wavenumber=40.0, boundary=boundary)
    exact = sphere.total_field(40.0, 1.0, y, D, boundary)
    assert np.all(u.ok) and np.all(u.method[:5] == "currents") and np.all(u.method[8:] == "currents")
    if boundary == "soft":
        assert np.all(u.method[5:8] == "rays")
    assert np.mean(np.abs(u - exact) < u.error) > 0.9
    by_rays, by_currents = (
        cr.near_field(fan, deep, wavenumber=40.0, boundary=boundary, method=m) for m in ("rays", "currents")
    )
    # what auto takes is what states the smaller error
    taken = np.where(u.method[5:8] == "rays", by_rays, by_currents)
    np.testing.assert_allclose(u[5:8], taken, rtol=1e-12)
    assert np.all((u.error[5:8] <= by_currents.error) | (u.error[5:8] < TRUST.fine))


def test_currents_are_not_made_where_rays_are_fine(fan, monkeypatch):
    from creeping.field import near

    def refused(*_):
        raise AssertionError("currents were made")

    monkeypatch.setattr(near, "currents_near", refused)
    y = np.array([[0.6, 0.0, 1.0], [0.0, 0.7, 0.85]])
    assert np.all(cr.near_field(fan, y, wavenumber=40.0, boundary="soft").method == "rays")
    with pytest.raises(AssertionError, match="currents were made"):
        cr.near_field(fan, [[0.0, 0.0, -2.0]], wavenumber=40.0, boundary="soft")


def test_rays_alone_say_what_is_missing(fan):
    y = np.array([[0.0, 0.0, -2.0], [0.0, 0.0, 1.5], [0.5, 0.2, 1.3]])
    u = cr.near_field(fan, y, wavenumber=20.0, boundary="hard", method="rays")
    assert [FieldStatus(s).name for s in u.status] == ["LIT", "CAUSTIC", "OK"]
    assert u.error_by.tolist() == ["bound", "bound", "expansion"]
    exact = sphere.total_field(20.0, 1.0, y, D, "hard")
    assert np.all(np.abs(u - exact) <= u.error)


def test_a_fan_that_is_too_short_says_so():
    short = fan_of(length=0.2)
    y = np.array([[0.05, 0.0, 1.1]])
    u = cr.near_field(short, y, wavenumber=20.0, boundary="hard", method="rays")
    assert u.status_counts == {"TRUNCATED": 1} and u[0] == 0 and u.error[0] == 1
    # currents launch rays of their own
    assert cr.near_field(short, 1.3 * y, wavenumber=20.0, boundary="hard").status_counts == {"OK": 1}


@pytest.mark.parametrize("farther", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_where_rays_have_ended_is_named(farther):
    body = sc.TwistedEllipsoid()
    fan = fan_of(body, d=(1.0, 1.0, 1.0), length=3.0)
    ray, step = np.nonzero(fan.travel_time > fan.detachment[:, None] + 0.05)
    y = fan.points[ray, step] + 0.2 * fan.directions[ray, step]
    y = y[(body.level(y) > 0.05) & occluded(body, y, fan.line.direction)]
    u = cr.near_field(fan, y, wavenumber=15.0, boundary="hard", method="rays")
    assert u.status_counts["DETACHED"] > 0.9 * len(y) > 20
    if farther:
        # off the body currents serve
        y = y + 0.5 * fan.line.direction
        assert np.all(cr.near_field(fan, y, wavenumber=15.0, boundary="hard").ok)


@pytest.mark.parametrize("boundary", ["hard", 0.7, pytest.param("soft", marks=pytest.mark.slow)])
def test_close_to_lit_ground_the_field_is_between_currents_and_the_body(fan, boundary):
    kind = cr.ImpedanceBoundary(boundary) if boundary == 0.7 else boundary
    r = around(200, seed=2)
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    r[:, 2] = -np.abs(r[:, 2])
    y = np.random.default_rng(0).uniform(1.001, 1.06, (200, 1)) * r
    u = cr.near_field(fan, y, wavenumber=20.0, boundary=kind)
    exact = sphere.total_field(20.0, 1.0, y, D, boundary)
    off = np.abs(u - exact)
    assert np.all(u.ok) and np.all(u.method == "layer") and set(u.error_by) == {"extinction+expansion"}
    assert np.mean(off < u.error) > 0.95 and off.max() < 0.03


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_points_on_the_body_have_the_total_field(fan, boundary):
    x = np.array([[0.0, 0.0, -1.0], [0.0, 0.8, -0.6], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0]])
    u = cr.near_field(fan, x, wavenumber=20.0, boundary=boundary)
    exact = sphere.total_field(20.0, 1.0, x, D, boundary)
    assert np.all(u.ok) and np.all(np.abs(u - exact) <= u.error + 1e-12)
    if boundary == "soft":
        np.testing.assert_array_equal(u, 0)


@pytest.mark.slow
def test_no_point_is_not_finite_in_silence(fan):
    rng = np.random.default_rng(3)
    n = 25_000
    edge = np.stack([np.cos(a := rng.uniform(0, 7, n)), np.sin(a), rng.uniform(0.01, 50, n)], axis=1)
    axis = np.stack([np.zeros(n), 1e-7 * rng.normal(size=n), rng.uniform(1.0, 20, n)], axis=1)
    anywhere = around(n, least=1.0001)
    on = anywhere / np.linalg.norm(anywhere, axis=1, keepdims=True)
    for boundary in ("soft", "hard"):
        u = cr.near_field(
            fan, np.concatenate([edge, axis, anywhere, on]), wavenumber=20.0, boundary=boundary, method="rays"
        )
        assert not np.any(np.isnan(u.values)) and not np.any(np.isnan(u.error))
        assert np.all(np.isfinite(u[u.ok])) and np.all(np.isfinite(u.error[u.ok]))
        assert np.all(np.abs(u[u.ok]) < 3)


def test_a_few_of_them_by_default(fan):
    rng = np.random.default_rng(4)
    angle = rng.uniform(0, 7, 70)
    edge = np.stack([np.cos(angle), np.sin(angle), rng.uniform(0.3, 5, 70)], axis=1)
    axis = np.stack([np.zeros(70), np.zeros(70), rng.uniform(1.1, 20, 70)], axis=1)
    y = np.concatenate([edge, axis, around(70, least=1.0001)])
    u = cr.near_field(fan, y, wavenumber=20.0, boundary="hard")
    assert np.all(np.isfinite(u)) and np.all(np.isfinite(u.error))
    exact = sphere.total_field(20.0, 1.0, y, D, "hard")
    assert np.mean(np.abs(u - exact)[u.ok] < u.error[u.ok]) > 0.95


def test_bad_methods_are_named(fan):
    with pytest.raises(InvalidInputError, match="method = 'fast'"):
        cr.near_field(fan, [[0, 0, 2.0]], wavenumber=10.0, method="fast")
    with pytest.raises(InvalidInputError, match="has no order 1"):
        cr.near_field(fan, [[0, 0, 2.0]], wavenumber=10.0, order=1, method="currents")
