"""The field on the body where rays merge and beyond where they end: against series and fundamental solutions."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field import on_body
from creeping.field.boundary import HARD
from creeping.field.equation import effort
from creeping.field.marching.fan_waves import fan_waves
from creeping.field.waves.beams import beam_sums
from creeping.rays.shedding import shed_on
from tests.reference import clouds, fundamental, sphere, stored


def fan_of(body, direction, length, n_rays=96):
    line = cr.shadow_line(body, direction=direction)
    return cr.launch(cr.DirectFlow(body, rtol=1e-9), line, length=length, n_rays=n_rays)


@pytest.fixture(scope="module")
def ball():
    return fan_of(sc.Sphere(), (0, 0, 1), 4.0, 48)


@pytest.mark.parametrize(
    ("k", "limit", "boundary"),
    [
        (10.0, 2.5, "soft"),
        (100.0, 0.4, "hard"),
        *(pytest.param(*c, marks=pytest.mark.slow) for c in ((10.0, 2.5, "hard"), (100.0, 0.4, "soft"))),
    ],
)
def test_focus_behind_a_sphere(ball, k, limit, boundary, monkeypatch):
    """Per cent of the field at the focus, up to 30 degrees from it: rays alone are infinite there."""
    # by rays also where the equation would be solved
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    theta = np.radians([0.0, 0.1, 0.5, 2.0, 5.0, 10.0, 20.0, 30.0])
    points = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    exact = (sphere.surface_derivative if boundary == "soft" else sphere.surface_field)(k, 1.0, points[:, 2], boundary)
    found = cr.surface_field(ball, points, wavenumber=k, boundary=boundary)
    error = np.abs(np.asarray(found) - exact)
    assert 100 * np.max(error) < limit * np.max(np.abs(exact))
    assert np.mean(error <= found.error) > 0.85
    assert set(found.method) <= {"march", "rays"}


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_cusped_caustic_of_an_ellipsoid(boundary):
    """Points of the whole shadow of a body that nothing here was set on, none left out; modes are infinite between."""
    solving = stored.read("ellipsoid_caustic")
    fan = fan_of(sc.Ellipsoid(0.9, 0.7, 1.0), solving["direction"], 3.4)
    exact = solving[boundary]
    found = cr.surface_field(fan, solving["points"], wavenumber=16.0, boundary=boundary)
    error, top = np.abs(np.asarray(found) - exact), np.median(np.abs(exact))
    assert np.median(error) < 0.035 * top and np.max(error) < 0.3 * top
    assert np.mean(error <= found.error) > 0.93 and np.mean(found.ok) > 0.97


@pytest.mark.slow
def test_where_rays_have_ended(monkeypatch):
    """On the twisted ellipsoid marching goes on past detachment, where modes have nothing."""
    body, k = sc.TwistedEllipsoid(), 30.0
    d = np.array([0.273, -0.755, -0.596])
    fan = fan_of(body, d, 2.5, 128)
    d = fan.line.direction
    rays = np.flatnonzero(fan.status == cr.RayStatus.DETACHED)
    assert len(rays) > 3
    times = fan.travel_time
    past = [(ray, step) for ray in rays for step in np.flatnonzero(times > fan.detachment[ray])[:12:4]]
    points = np.array([fan.points[ray, step] for ray, step in past if times[step] < 1.2])
    reference = fundamental.scatter(clouds.twisted_ellipsoid(), k, d[None], "hard", depth=0.12, per_wavelength=5.0)
    exact = reference.total(points)[:, 0]
    # as where the integral equation would cost too much
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    found = cr.surface_field(fan, points, wavenumber=k, boundary="hard")
    monkeypatch.setattr(on_body, "marches", lambda *_: False)
    modes = cr.surface_field(fan, points, wavenumber=k, boundary="hard")
    size = np.maximum(np.abs(exact), 0.3 * np.median(np.abs(exact)))
    error, before = (np.median(np.abs(np.asarray(v) - exact) / size) for v in (found, modes))
    # the tip that they come to has k rho = 8: marched waves err by a third there, modes by all of it
    assert error < 0.5 * before and error < 0.45
    assert not np.any(modes.ok) and np.mean(np.abs(np.asarray(found) - exact) <= found.error) > 0.9


@pytest.mark.slow
def test_ground_that_the_body_hides():
    """Behind the waist of a peanut along the wave the field is nearly the incident one, and no creeping ray comes."""
    peanut, k = sc.Implicit("(x**2 + y**2 + z**2 + 0.64)**2 - 2.56*x**2 - 0.9**4"), 20.0
    fan = fan_of(peanut, (1, 0.05, 0.02), 3.0, 48)
    known = stored.read("peanut_shadow")
    x, exact = known["points"], known["values"]
    with pytest.MonkeyPatch.context() as patch:
        # as where the integral equation would cost too much
        patch.setattr(effort, "SECONDS", 0.0)
        found = cr.surface_field(fan, x, wavenumber=k, boundary="hard")
        patch.setattr(on_body, "marches", lambda *_: False)
        modes = cr.surface_field(fan, x, wavenumber=k, boundary="hard")
    bare = np.asarray(modes) == 0
    assert np.sum(bare) > 50 and np.median(np.abs(exact[bare])) > 0.5
    error = np.abs(np.asarray(found) - exact)
    # the residual of the reference is 0.036
    assert np.median(error[bare]) < 0.02 and np.quantile(error[bare], 0.95) < 0.1
    assert np.all(error[bare] <= found.error[bare])


def test_beams_give_back_rays_that_stand_alone(ball):
    """Away from the axis their sum is that over the two rays through a point, whatever their width."""
    k = 60.0
    waves = fan_waves(ball, wavenumber=k, boundary=HARD)
    theta = np.radians([35.0, 45.0, 55.0])
    points = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    found = shed_on(waves.strips, ball.body, points)
    y = waves.at(0, found.sigma, found.rays.time)
    own = y / np.sqrt(np.abs(found.rays.spreading))
    own = own * np.exp(1j * (k * found.rays.eikonal - 0.5 * np.pi * found.rays.caustics))
    rays = np.array([own[found.observer == i].sum() for i in range(3)])
    for factor in (0.6, 1.0, 1.8):
        (sums,) = beam_sums(ball, waves, points, (factor,), None)
        np.testing.assert_allclose(sums.sum(axis=0), rays, rtol=0.02)


def test_waves_on_closed_strips_wrap(ball):
    waves = fan_waves(ball, wavenumber=20.0, boundary=HARD)
    strip = waves.strips[0]
    s = np.array([0.7, 0.7])
    one, other = waves.at(0, np.array([0.3, 0.3 + strip.period]), s)
    assert one == pytest.approx(other)
    assert fan_waves(ball, wavenumber=20.0, boundary=HARD) is waves
