"""Each ray's own wave in the fan of a point source, against exact fields; and what such a fan does not serve."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.on_rays import ray_envelope
from creeping.geometry.surface import normal
from tests.reference import clouds
from tests.reference.fundamental import beside_source
from tests.reference.sphere import source_on_sphere

# relative errors, %, at 5 to 50 degrees behind the line: distance in radii, k a
SPHERE = {
    ("hard", 30, 1.5): 1.0,
    ("hard", 100, 30.0): 0.3,
    ("soft", 30, 1.5): 1.3,
    ("soft", 100, 3.0): 0.2,
}


def exact_on_sphere(k, distance, cosine, boundary):
    return source_on_sphere(k, 1.0, distance, cosine, boundary)[0 if boundary == "hard" else 1]


@pytest.mark.parametrize(
    ("boundary", "k", "distance"),
    [pytest.param(*case, marks=() if case[1] == 30 else pytest.mark.slow) for case in SPHERE],
)
def test_wave_on_a_sphere(boundary, k, distance):
    ball = sc.Sphere()
    line = cr.shadow_line(ball, source=cr.PointSource((0, 0, -distance)))
    first = np.arccos(1 / distance)
    # beyond, the wave the other way round has its share
    ends = np.radians(min(50.0, 112.0 - np.degrees(first)))
    fan = cr.launch(cr.DirectFlow(ball, rtol=1e-10), line, length=ends, n_rays=6, n_steps=90, max_gap=np.inf)
    field = cr.surface_field(fan, wavenumber=k, boundary=boundary)
    late = fan.travel_time > np.radians(5)
    exact = exact_on_sphere(k, distance, np.cos(first + fan.travel_time), boundary)
    off = np.abs(np.array(field.values)[0] - exact)
    assert 100 * np.max((off / np.abs(exact))[late]) < SPHERE[boundary, k, distance]
    assert np.all(field.status == cr.FieldStatus.OK)
    assert np.mean((off < field.error[0])[late]) > 0.9


@pytest.mark.parametrize("boundary", ["hard", "soft"])
def test_errors_grow_where_the_source_is_near(boundary):
    ball, k, distance = sc.Sphere(), 30.0, 1.1
    line = cr.shadow_line(ball, source=cr.PointSource((0, 0, -distance)))
    fan = cr.launch(cr.DirectFlow(ball, rtol=1e-10), line, length=1.4, n_rays=6, n_steps=90, max_gap=np.inf)
    field = cr.surface_field(fan, wavenumber=k, boundary=boundary)
    exact = exact_on_sphere(k, distance, np.cos(np.arccos(1 / distance) + fan.travel_time), boundary)
    off = np.abs(np.array(field.values)[0] - exact)
    assert np.mean(off < field.error[0]) > 0.95
    assert np.median(field.error[0] / np.abs(exact)) > 0.03


@pytest.mark.parametrize(("boundary", "most"), [("hard", 8.0), pytest.param("soft", 13.0, marks=pytest.mark.slow)])
def test_wave_on_an_ellipsoid(boundary, most):
    axes, k, source = (1.1, 0.7, 0.9), 12.0, np.array([0.5, 1.1, -0.8])
    exact = beside_source(clouds.ellipsoid(*axes), k, source, boundary, depth=0.12)
    assert exact.residual < 3e-3
    body = sc.Ellipsoid(*axes)
    line = cr.shadow_line(body, source=cr.PointSource(source))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-9), line, length=0.6, n_rays=12, n_steps=30, max_gap=np.inf)
    field = cr.surface_field(fan, wavenumber=k, boundary=boundary)
    flat = fan.points.reshape(-1, 3)
    of = exact.total(flat) if boundary == "hard" else exact.slope(flat, normal(body, flat))
    ok = field.ok
    off = np.abs(np.array(field.values) - of.reshape(field.shape)) / np.abs(of.reshape(field.shape))
    assert 100 * np.median(off[ok]) < most
    assert np.mean((off * np.abs(of.reshape(field.shape)) < field.error)[ok]) > 0.9
    assert np.mean(ok) > 0.5


def test_far_source_is_a_plane_wave():
    body, d, far, k = sc.Ellipsoid(1.0, 0.8, 0.6), np.array([0.48, 0.6, 0.64]), 1e5, 15.0
    flow = cr.DirectFlow(body, rtol=1e-11)
    fans = [
        cr.launch(flow, line, length=1.5, n_rays=12, n_steps=40, max_gap=np.inf)
        for line in (cr.shadow_line(body, direction=d), cr.shadow_line(body, source=cr.PointSource(-far * d)))
    ]
    for boundary in ("hard", "soft", cr.ImpedanceBoundary(0.3 - 0.2j)):
        plane, sent = (np.array(cr.surface_field(fan, wavenumber=k, boundary=boundary).values) for fan in fans)
        ratio = sent * 4 * np.pi * far * np.exp(-1j * k * far) / plane
        assert np.median(np.abs(ratio - 1)) < 2e-4 and np.max(np.abs(ratio - 1)) < 5e-3


def test_rays_that_detach_end():
    body = sc.TwistedEllipsoid()
    line = cr.shadow_line(body, source=cr.PointSource((0.5, 1.5, 1.0)))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-9), line, length=2.0, n_rays=24)
    assert "DETACHED" in fan.status_counts
    field = cr.surface_field(fan, wavenumber=20.0, boundary="hard")
    gone = field.status == cr.FieldStatus.DETACHED
    assert gone.any() and not np.any(np.array(field.values)[gone])


@pytest.fixture(scope="module")
def fan():
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    line = cr.shadow_line(body, source=cr.PointSource((0, 0, -1.5)))
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), line, length=1.5, n_rays=24)


OUT, ON, LOOK, K = [(0.0, 0.2, 1.5)], [(0.0, 0.0, 0.6)], [(0.0, 0.6, -0.8)], {"wavenumber": 12.0}
NOBODY = np.zeros((0, 3))
REFUSED = {
    "surface_field at points": lambda fan: cr.surface_field(fan, ON, **K),
    "surface_field nowhere": lambda fan: cr.surface_field(fan, NOBODY, **K),
    "surface_field, coated": lambda fan: cr.surface_field(
        fan, wavenumber=12.0, boundary=cr.ImpedanceBoundary(lambda x: 0.3 + 0.1 * x[:, 0])
    ),
    **{
        f"near_field by {m}": lambda fan, m=m: cr.near_field(fan, OUT, method=m, **K)
        for m in ("auto", "rays", "currents")
    },
    "near_field on the body": lambda fan: cr.near_field(fan, ON, **K),
    **{
        f"far_field by {m}": lambda fan, m=m: cr.far_field(fan, LOOK, method=m, **K)
        for m in ("auto", "rays", "currents")
    },
    "far_field of a conductor": lambda fan: cr.far_field(fan, LOOK, wavenumber=12.0, boundary="pec"),
    "far_field nowhere": lambda fan: cr.far_field(fan, NOBODY, **K),
    "field_cut": lambda fan: cr.field_cut(fan, step=0.3, **K),
    "surface_currents": lambda fan: cr.surface_currents(fan, **K),
    "conductor_field": lambda fan: cr.conductor_field(fan, OUT, polarisation="theta", **K),
    "conductor_current": lambda fan: cr.conductor_current(fan, ON, polarisation="theta", **K),
    "ray_envelope": lambda fan: ray_envelope(fan, boundary="soft", **K),
    "direction": lambda fan: fan.line.direction,
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_such_fans_do_not_serve_is_refused(name, fan):
    with pytest.raises(cr.InvalidInputError, match=r"source_pattern.*coupling"):
        REFUSED[name](fan)


def test_every_public_function_of_a_fan_is_looked_at():
    import inspect

    served = {"launch", "iso_phase_curves", "validity", "body_uncertainty", "surface_field"}
    # of a body that is known exactly there is none to tell; of others it is far_field's
    served |= {"far_field_uncertainty"}
    takes = set()
    for name in dir(cr):
        thing = getattr(cr, name)
        if inspect.isfunction(thing) and {"fan", "line"} & set(inspect.signature(thing).parameters):
            takes.add(name)
    looked = served | {name.split()[0] for name in REFUSED}
    assert takes <= looked, takes - looked


def test_uncertainty_of_a_fitted_body_is_refused_too(fan, monkeypatch):
    monkeypatch.setattr(type(fan.body), "coarse_fit", sc.Ellipsoid(1.0, 0.8, 0.601), raising=False)
    found = cr.body_uncertainty(fan)
    assert found is not None and 0 < found.points < 0.1
    with pytest.raises(cr.InvalidInputError, match="source_pattern"):
        cr.far_field_uncertainty(fan, LOOK, **K)
