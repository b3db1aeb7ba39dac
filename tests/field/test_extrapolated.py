"""The error of rays where currents cost too much: measured at a lower wavenumber, carried up."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.far import Level, measured_level
from creeping.geometry.directions import fibonacci_directions


@pytest.fixture(scope="module")
def fan():
    body = sc.Ellipsoid(1.1, 0.7, 0.85)
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=(0.3, -0.5, 0.8)), n_rays=128)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard", cr.ImpedanceBoundary(0.5), "pec"], ids=str)
def test_it_covers_rays_at_a_wavenumber_that_it_did_not_see(fan, boundary):
    k, r = 90.0, fibonacci_directions(151)
    level = measured_level(fan, 1e4, boundary)
    assert level.wavenumber < 0.7 * k
    rays, currents = (
        cr.far_field(fan, r, wavenumber=k, boundary=boundary, method=method) for method in ("rays", "currents")
    )
    stated = level.applied(rays).error
    off = np.abs(rays.total - currents.total)
    assert np.mean(off <= stated) > 0.93
    # a conductor's may grow like k where rays lack a term of first order, and then says too much
    assert np.median(stated / off) < (15 if boundary == "pec" else 8)


def test_auto_takes_it_where_currents_cost_too_much(fan):
    r = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    first, second = (cr.far_field(fan, r, wavenumber=k) for k in (3000.0, 1e4))
    assert [f.error_by for f in (first, second)] == ["extrapolated"] * 2
    # many frequencies have one comparison
    assert first.measured_at == second.measured_at < 100
    assert "extrapolation from k" in repr(first)
    plain = cr.far_field(fan, r, wavenumber=3000.0, method="rays")
    assert plain.error_by == "order" and np.isnan(plain.measured_at)
    np.testing.assert_array_equal(plain.total, first.total)


def test_ground_without_rays_does_not_get_better_with_k(fan):
    far = cr.far_field(fan, [[0.0, 0.0, -1.0]], wavenumber=3000.0, method="rays")
    errors = [Level(50.0, 1.0, 0.1, unserved).applied(far).error[0] for unserved in (0.0, 0.2)]
    assert errors[1] > 0.1 > 0.01 > errors[0]
