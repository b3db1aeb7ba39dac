"""The compiled sum over modes against the plain formula, from fans of bodies that vary in all that it takes."""

from functools import cache

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.arguments import fock_parameter
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT, HARD, SOFT, Boundary
from creeping.field.fock import SERIES
from creeping.field.waves.far_geometry import far_geometry
from creeping.field.waves.shed_wave import SECOND_ORDER, shed_orders, shed_wave
from creeping.geometry.directions import fibonacci_directions

BODIES = {"ellipsoid": sc.Ellipsoid(1.2, 0.7, 0.9), "torus": sc.Torus(1.0, 0.4)}


@cache
def rays_of(name):
    body = BODIES[name]
    line = cr.shadow_line(body, np.array([0.48, 0.6, 0.64]))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-7), line, length=3.0, n_rays=64)
    return far_geometry(fan, fibonacci_directions(300)).shed.rays


@pytest.mark.parametrize("boundary", [SOFT, HARD, ELECTRIC_SOFT, ELECTRIC_HARD], ids=lambda b: b.kind)
@pytest.mark.parametrize("weight", [0.25, 0.5])
@pytest.mark.parametrize("k", [3.0, 40.0])
@pytest.mark.parametrize("name", BODIES)
def test_both_orders_are_those_of_the_plain_formula(name, k, weight, boundary):
    rays = rays_of(name)
    found = shed_orders(rays, k, boundary, transverse_weight=weight)
    for order, one in zip((1, 2), found, strict=True):
        plain = shed_wave(rays, k, boundary, order, transverse_weight=weight)
        np.testing.assert_allclose(one, plain, rtol=0, atol=2e-13 * np.abs(plain[np.isfinite(plain)]).max())


def test_rays_are_early_between_and_deep():
    xi = np.concatenate([fock_parameter(rays_of(name), k) for name in BODIES for k in (3.0, 40.0)])
    for some in (xi < SECOND_ORDER[0], (xi > SECOND_ORDER[1]) & (xi < SERIES), xi > SERIES):
        assert some.sum() > 10
    assert any((~rays_of(name).alive).any() for name in BODIES)


def test_deep_waves_keep_their_digits():
    rays = rays_of("ellipsoid")
    deep = rays[rays.alive & (fock_parameter(rays, 40.0) > 4)]
    first, second = shed_orders(deep, 40.0, SOFT)
    np.testing.assert_allclose(first, shed_wave(deep, 40.0, SOFT, 1), rtol=1e-9)
    np.testing.assert_allclose(second, shed_wave(deep, 40.0, SOFT, 2), rtol=1e-9)


def test_rays_have_the_same_wave_in_any_company():
    rays = rays_of("ellipsoid")
    some = slice(7, 40)
    for alone, together in zip(shed_orders(rays[some], 9.0, HARD), shed_orders(rays, 9.0, HARD), strict=True):
        np.testing.assert_array_equal(alone, together[some])


def test_modes_that_differ_go_by_the_plain_formula():
    rays, boundary = rays_of("torus"), Boundary("impedance", 0.4 + 0.1j)
    for order, one in zip((1, 2), shed_orders(rays, 20.0, boundary), strict=True):
        np.testing.assert_array_equal(one, shed_wave(rays, 20.0, boundary, order))
