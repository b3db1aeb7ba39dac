"""Rays of the length "auto": until their waves have died away, by closed forms on a sphere and by hand on others."""

from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc
from scipy.special import ai_zeros

import creeping as cr
from creeping.field.boundary import HARD, modes_of
from creeping.geometry.surface import size
from creeping.rays.reach import (
    DECAY,
    GRAIN,
    HARD_DECAY,
    LONGEST,
    SPARED,
    body_length,
    decayed_lengths,
    ray_length,
    weighted_length,
)
from creeping.shadow.status import NO_RAY


def test_the_decay_is_that_of_the_slowest_mode_of_a_hard_body():
    assert pytest.approx(float(np.min(modes_of(HARD, np.ones(1)).tau.imag)), rel=1e-14) == HARD_DECAY
    assert pytest.approx(-ai_zeros(1)[1][0] * np.sin(np.pi / 3), rel=1e-14) == HARD_DECAY


@pytest.mark.parametrize("radius", [1.0, 3e-3])
@pytest.mark.parametrize("ka", [10.0, 400.0])
def test_a_sphere(radius, ka):
    ball = sc.Sphere(radius=radius)
    fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (1, 2, 3)), wavenumber=ka / radius, n_rays=8)
    exact = radius * DECAY / (np.cbrt(ka / 2) * HARD_DECAY)
    assert 0 <= fan.length - exact < 1.01 * GRAIN * size(ball)
    assert body_length(ball, ka / radius) == pytest.approx(fan.length, rel=1e-12)
    # without a wavenumber k rho is ten
    assert ka > 10 or ray_length(fan.line) == ray_length(fan.line, wavenumber=ka / radius)


def test_it_depends_neither_on_the_number_of_rays_nor_on_the_flow():
    body = sc.TwistedEllipsoid()
    line = cr.shadow_line(body, (1, 1, 1))
    flow = cr.build_phase_map(body, horizon=0.5, grid=(24, 32), degree=3, cache=False)
    lengths = [
        cr.launch(carrier, line, wavenumber=30.0, n_rays=n, max_gap=np.inf, measured=False).length
        for carrier, n in ((cr.DirectFlow(body), 8), (cr.DirectFlow(body), 200), (flow, 33))
    ]
    assert lengths[0] == lengths[1] == lengths[2]


@pytest.mark.parametrize("body", [sc.TwistedEllipsoid(), sc.Ellipsoid(1.0, 0.6, 0.4), sc.Torus()], ids=repr)
def test_the_wave_has_died_away_on_all_but_a_tenth_of_the_rays(body):
    k, line = 40.0, cr.shadow_line(body, (1, 1, 1))
    fan = cr.launch(cr.DirectFlow(body), line, wavenumber=k, n_rays=200, max_gap=np.inf)
    died = (np.cbrt(k / 2) * HARD_DECAY * fan.attenuation[:, -1] >= DECAY) | (fan.detachment <= fan.length)
    assert abs(np.mean(died) - (1 - SPARED)) < 0.04


@pytest.mark.slow
def test_at_most_four_sizes():
    body = sc.Ellipsoid(0.1, 2.0, 2.0)
    assert ray_length(cr.shadow_line(body, (0.1, 1, 0)), wavenumber=0.2) == pytest.approx(LONGEST * size(body))


def test_the_length_of_a_body_serves_all_incidences():
    body = sc.Ellipsoid(1.0, 0.6, 0.4)
    whole = body_length(body, 25.0)
    each = [ray_length(cr.shadow_line(body, d), wavenumber=25.0) for d in cr.fibonacci_directions(24)]
    assert max(each) < 1.1 * whole
    assert whole <= 1.02 * max(each)


def test_a_weighted_body_has_a_travel_time():
    ball = sc.Sphere(speed="1/2 + 0*x")
    fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1)), n_rays=8)
    assert fan.length == weighted_length(ball) == pytest.approx(2 * 1.5 * np.sqrt(3))
    with pytest.raises(cr.InvalidInputError, match="constant speed"):
        cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1)), wavenumber=3.0)


@pytest.mark.parametrize(
    "name, value",
    [
        *(("length", v) for v in ("long", 0.0, np.nan, None, True)),
        *(("wavenumber", v) for v in (-2.0, np.inf, "30")),
    ],
)
def test_bad_numbers_are_named(name, value):
    ball = sc.Sphere()
    with pytest.raises(cr.InvalidInputError, match=rf"{name} = .* is not a positive finite number"):
        cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1), n_points=64), **{name: value})


def test_an_incidence_that_launches_nothing_has_a_length():
    ball = sc.Sphere()
    launch = cr.shadow_line(ball, (0, 0, 1)).launch_points(16)
    none = replace(launch, curve_index=np.full_like(launch.curve_index, NO_RAY), points=np.full((1, 16, 3), np.nan))
    assert decayed_lengths(ball, none, 10.0) == pytest.approx(LONGEST * size(ball))


def test_a_fan_says_its_least_radius():
    body = sc.Ellipsoid(1.0, 0.6, 0.4)
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (1, 0, 0)), n_rays=64)
    # on the line, the ellipse of 0.6 and 0.4, the radii along d are a^2/b and a^2/c
    assert fan.least_radius <= 1.0 / 0.6 * 1.01
    assert f"radius of curvature {fan.least_radius:.3g} L" in repr(fan)
