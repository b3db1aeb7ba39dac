"""What is kept with a fan: not the fan, and nothing a caller can change."""

import gc
import weakref

import numpy as np
import pytest

import creeping as cr
import scatterers as sc


def small_fan():
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0, 0, 1)), length=3.0, n_rays=32)


def test_a_fan_is_let_go():
    fan = small_fan()
    cr.far_field(fan, [[1.0, 0, 0]], wavenumber=20.0)
    watch = weakref.ref(fan)
    del fan
    gc.collect()
    assert watch() is None


def test_changing_a_result_changes_nothing_kept():
    fan = small_fan()
    r = [[1.0, 0, 0.3], [0, -0.4, -1]]
    first = cr.far_field(fan, r, wavenumber=20.0)
    total = first.total.copy()
    first.directions[:] *= -1
    assert cr.far_field(fan, r, wavenumber=20.0).total == pytest.approx(total, rel=1e-12)


def test_a_coarse_fan_still_finds_its_points():
    body = sc.Ellipsoid(1, 0.8, 0.6)
    line = cr.shadow_line(body, (1, 0.2, 0.3))
    fine, coarse = (cr.launch(cr.DirectFlow(body), line, length=3.0, n_rays=n, max_gap=np.inf) for n in (64, 16))
    points = fine.points[::2, 12]
    found = cr.surface_field(coarse, points, wavenumber=20.0, boundary="hard")
    assert np.all(found != 0)
