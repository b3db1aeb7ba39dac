"""The fan of one incidence at sweep speed is that of `launch`."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.rays.preview import quick_fan

CASES = [
    (sc.TwistedEllipsoid(), (1, 1, 1)),
    (sc.TwistedEllipsoid(), (0.3, -0.9, 0.2)),
    (sc.Torus(), (0.4, 0.2, 0.9)),
    (sc.Sphere(speed="1 + 0.3*x"), (0, 0.6, 0.8)),
]


@pytest.mark.parametrize("body, direction", CASES)
def test_rays_are_those_of_the_tracer(body, direction):
    fan = quick_fan(cr.DirectFlow(body, rtol=1e-10), direction, length=2.0, n_rays=64, n_steps=16)
    starts, d = fan.points[:, 0], fan.line.direction
    assert fan.points.shape == (64, 17, 3)
    normals = body.gradient(starts)
    assert np.max(np.abs(normals @ d) / np.linalg.norm(normals, axis=1)) < 1e-9
    points, directions = cr.trace(body, starts, np.broadcast_to(d, starts.shape), fan.travel_time, rtol=1e-12)
    np.testing.assert_allclose(fan.points, points, rtol=0, atol=1e-8)
    np.testing.assert_allclose(fan.directions, directions, rtol=0, atol=1e-8)
    np.testing.assert_allclose(fan.eikonal, (starts @ d)[:, None] + fan.travel_time, rtol=0, atol=1e-12)
    assert fan.error.samples == 0


@pytest.mark.parametrize("body, direction", CASES)
def test_what_rides_along_is_that_of_launch(body, direction):
    flow = cr.DirectFlow(body, rtol=1e-10)
    fan = quick_fan(flow, direction, length=2.0, n_rays=64, n_steps=16)
    # a closed curve may be counted from anywhere: neighbours on a dense fan are compared
    exact = cr.launch(flow, cr.shadow_line(body, direction), length=2.0, n_rays=4096, n_steps=16, max_gap=np.inf)
    apart = np.linalg.norm(fan.points[:, None, 0] - exact.points[None, :, 0], axis=-1)
    pairs = np.argmin(apart, axis=1)
    assert np.max(np.min(apart, axis=1)) < 2e-3
    for name in ("spreading", "spreading_rate", "attenuation", "curvature"):
        other = getattr(exact, name)[pairs]
        np.testing.assert_allclose(getattr(fan, name), other, rtol=0, atol=0.01 * np.ptp(other) + 1e-12, err_msg=name)
    for name in ("status", "caustic_index", "curve_index"):
        assert np.mean(getattr(fan, name) == getattr(exact, name)[pairs]) > 0.97
    assert sorted(fan.closed_arcs) == sorted(exact.closed_arcs)
    levels = [0.5, 1.0]
    for one, other in zip(cr.iso_phase_curves(fan, levels), cr.iso_phase_curves(exact, levels), strict=True):
        assert one.closed == other.closed


def test_trouble_is_named():
    flow = cr.DirectFlow(sc.Torus())
    with pytest.raises(cr.SingularIncidenceError, match="crosses itself"):
        quick_fan(flow, (1, 0, 0), length=1.0, n_rays=8, n_steps=2)
    with pytest.raises(cr.InvalidInputError):
        quick_fan(flow, (0, 0, np.nan), length=1.0, n_rays=8, n_steps=2)
