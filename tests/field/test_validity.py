"""The two numbers that tell how far a wave is from the limit of short waves."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc


def fan_of(body, d, length=2.0):
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=d), length=length, n_rays=32)


def test_a_slender_body_along_its_axis():
    # rho = c^2/a and kappa_t = 1/a on the equator, where the rays start and are least curved
    a, c, k = 0.6, 1.2, 20.0
    found = cr.validity(fan_of(sc.Ellipsoid(a, a, c), (0, 0, 1), 0.01), wavenumber=k)
    rho = c * c / a
    assert found.least_k_rho == pytest.approx(k * rho, rel=1e-3)
    assert found.largest_transverse == pytest.approx(rho / a / (k * rho / 2) ** (2 / 3), rel=1e-3)


def test_units():
    one, large = (
        cr.validity(fan_of(sc.Ellipsoid(s, 0.8 * s, 0.6 * s), (1, 2, 3), 2 * s), wavenumber=15 / s) for s in (1.0, 1e5)
    )
    assert large == pytest.approx(one, rel=1e-6)


def test_a_fan_without_rays(dark_fan):
    assert np.all(np.isnan(cr.validity(dark_fan, wavenumber=10.0)))


def test_bad_wavenumbers_are_named(ball_fan):
    with pytest.raises(cr.InvalidInputError, match="wavenumber"):
        cr.validity(ball_fan, wavenumber=-1.0)
