"""The field on a sphere through the whole chain, against exact series."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from studies.accuracy import field as field_sphere
from tests.reference import sphere

FACTOR = 1.5
LIMITS = {
    "creeping rays, soft, first order": (17, 8, 3.4, 2.7),
    "creeping rays, soft": (3, 0.9, 0.3, 0.08),
    "creeping rays, hard, first order": (62, 47, 29, 19),
    "creeping rays, hard": (9, 3, 0.8, 0.3),
    "back axis, soft, first order": (23, 10, 4.3, 2.7),
    "back axis, soft": (1.3, 0.35, 0.08, 0.02),
    "back axis, hard, first order": (76, 51, 33, 23),
    "back axis, hard": (8, 2.6, 0.7, 0.24),
    "forward, soft": (2.6, 0.7, 0.15, 0.04),
    "forward, hard": (10, 2.2, 0.4, 0.1),
    "total at 60 deg, soft": (1.5, 0.5, 0.09, 0.01),
    "total at 60 deg, hard": (18, 6, 2, 0.7),
    "near field in the shadow, soft": (6, 3, 1.4, 1.4),
    "near field in the shadow, hard": (7, 8, 3, 0.9),
    "PEC, E in the plane, from 20 deg": (39, 7, 2, 0.4),
    "PEC, E across the plane, from 20 deg": (33, 11, 4, 1.6),
}
"""Figures of a prototype of the same formulas, per cent, as rounded there, for each ka."""


@pytest.fixture(scope="module")
def fan():
    return cr.launch(
        cr.DirectFlow(sc.Sphere(), rtol=1e-10), cr.shadow_line(sc.Sphere(), (0, 0, 1)), length=6.2, n_rays=128
    )


@pytest.mark.parametrize("k", [k if k == 30.0 else pytest.param(k, marks=pytest.mark.slow) for k in field_sphere.KA])
@pytest.mark.parametrize(
    "row", [pytest.param(row, marks=pytest.mark.slow) if "first order" in row else row for row in LIMITS]
)
def test_errors_have_not_grown(fan, row, k):
    """A regression, no law: errors against the series stay within 1.5 times those of a prototype of the formulas."""
    limit = LIMITS[row][field_sphere.KA.index(k)]
    # the last row of "back axis, soft" is printed with one digit, 0.02: half a unit of it belongs to the figure
    limit += 0.005 * (limit == 0.02)
    assert field_sphere.row_functions()[row](fan, k) <= FACTOR * limit


@pytest.mark.parametrize("boundary", ["soft", pytest.param("hard", marks=pytest.mark.slow)])
def test_second_order_falls_with_frequency(fan, boundary):
    """The error of creeping rays falls at least like 1/ka."""
    errors = [field_sphere.creeping_rays(fan, k, boundary, 2) for k in (30.0, 300.0)]
    assert errors[1] < errors[0] / 9


@pytest.mark.parametrize(("method", "k"), [("rays", 30.0), pytest.param("currents", 10.0, marks=pytest.mark.slow)])
def test_impedance_passes_to_hard(fan, method, k):
    r = field_sphere.observers(np.radians(np.arange(0, 181, 10.0)))
    hard = cr.far_field(fan, r, wavenumber=k, boundary="hard", method=method).total
    nearly = cr.far_field(fan, r, wavenumber=k, boundary=cr.ImpedanceBoundary(1e-7), method=method).total
    assert nearly == pytest.approx(hard, rel=1e-4)


@pytest.mark.slow
def test_conductor_ahead_and_behind(fan):
    """The radar cross sections that are measured most; no polarisation is turned."""
    ff = cr.far_field(fan, [[0, 0, 1.0], [0, 0, -1.0]], wavenumber=100.0, boundary="pec")
    _, within = sphere.pec_far_field(100.0, 1.0, np.array([1.0, -1.0]))
    assert np.abs(ff.total[0, 0, 0]) == pytest.approx(abs(within[0]), rel=2e-3)
    assert np.abs(ff.total[1, 0, 0]) == pytest.approx(abs(within[1]), rel=2e-3)
    assert np.abs(ff.total[:, 0, 1]).max() < 1e-3 * abs(within[1])
