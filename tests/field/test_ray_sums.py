"""What rays say of their own sums: at a fold by Airy's function, at a caustic point by Bessel's, beyond a fan's end."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.boundary import HARD
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.ray_sums import MERGING, fan_decay, fold_share, merging_error, ray_sum, tube_share
from creeping.rays.shedding import shed_near, shed_on

K = 30.0


@pytest.fixture(scope="module")
def fan():
    body = sc.Ellipsoid(1, 0.8, 0.6)
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0.3, 0.5, 0.812)), length=3.0, n_rays=192)


def test_next_term_at_a_fold_is_that_of_airys_function(fan):
    """Ai at phase difference kD of two rays: each is off by 5/36/(kD) of itself."""
    rng = np.random.default_rng(0)
    y = fan.line.direction * rng.uniform(1.5, 3, (3000, 1)) + 0.25 * rng.normal(size=(3000, 3))
    shed = shed_near(fan_strips(fan), fan.body, y[fan.body.level(y) > 0])
    bend = fold_share(fan_strips(fan), shed, K)
    width = tube_share(shed.rays, shed.reach)
    length = shed.rays.eikonal + shed.reach
    ratios = []
    for observer in np.unique(shed.observer):
        mine = np.flatnonzero(shed.observer == observer)
        mine = mine[np.argsort(width[mine])[:2]]
        if len(mine) == 2 and width[mine].max() < 0.15:
            expected = 5 / 36 / (K * abs(np.diff(length[mine])[0]))
            ratios.append(np.mean(bend[mine]) / expected)
    assert len(ratios) > 10
    # a point beside a cusp belongs to two folds
    assert 0.7 < np.median(ratios) < 1.5


def test_pairs_are_those_with_a_caustic_between_them():
    ball = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1)), length=4.0, n_rays=64)
    # a point beside the axis, at angle theta: the two great circles differ by 2 theta in length
    theta = 0.05
    y = np.array([[np.sin(theta), 0.0, np.cos(theta)]])
    found = shed_on(fan_strips(fan), ball, y)
    pair = np.sort(found.rays.eikonal)
    assert np.diff(pair)[0] == pytest.approx(2 * theta, rel=1e-6)
    error = merging_error(found, np.ones(2), K, 1)
    assert error[0] == pytest.approx(2 * MERGING / (K * 2 * theta), rel=1e-6)


def test_a_ray_beyond_the_end_counts_by_its_decay(fan):
    short = cr.launch(cr.DirectFlow(fan.body), fan.line, length=0.8, n_rays=64)
    x = fan.points[::9, 10]
    found = shed_on(fan_strips(short), short.body, x)
    one = np.ones(len(found.observer), dtype=complex)
    total = ray_sum(short, found, len(x), one, 0 * one.real, K, HARD)
    decay, end = fan_decay(short, K, HARD)
    assert 0.7 < decay < 1.1
    own = np.cbrt(K / 2) * found.rays.integrals[..., 1]
    single = np.bincount(found.observer, minlength=len(x))[found.observer] == 1
    lost = np.exp(-decay * (end - own))[single]
    assert np.all(total.error[found.observer[single]] >= 0.999 * lost)
