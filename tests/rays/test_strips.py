"""Strips: interpolation against direct traces, slopes against differences, wrapping, open arcs."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import normal_curvature
from tolerances import STRIP, STRIP_SLOPE

import creeping as cr
from creeping.geometry.surface import normal
from creeping.rays.strips import gather, strips_of

INCIDENCE = (0.3, 0.5, 0.81)


@pytest.fixture(scope="module")
def fans():
    def launched(body, n_rays, direction):
        line = cr.shadow_line(body, direction)
        return cr.launch(cr.DirectFlow(body, rtol=1e-11), line, length=3.0, n_rays=n_rays, max_gap=np.inf)

    return {
        "triaxial": launched(sc.Ellipsoid(1.0, 0.8, 0.6), 96, INCIDENCE),
        "torus": launched(sc.Torus(), 200, (1, 1, 1)),
    }


def direct(fan, curve, sigma, s):
    """Position and tangent of traced rays from σ to s."""
    curve = fan.line.curves[curve]
    d = fan.line.direction
    found = [
        cr.trace(fan.body, curve.at(np.array([a % curve.length]))[0], d, b, rtol=1e-12)
        for a, b in zip(sigma, s, strict=True)
    ]
    return tuple(np.array(v) for v in zip(*found, strict=True))


def test_points_between_rays_are_those_of_a_direct_trace(fans, rng):
    fan = fans["triaxial"]
    (strip,) = strips_of(fan)
    assert strip.closed
    sigma, s = rng.uniform(0, strip.period, 20), rng.uniform(0, 3, 20)
    at = strip.at(sigma, s)
    x, p = direct(fan, 0, sigma, s)
    np.testing.assert_allclose(at.points, x, atol=STRIP)
    np.testing.assert_allclose(at.directions, p, atol=STRIP)
    b = np.cross(normal(fan.body, x), p)
    np.testing.assert_allclose(at.curvature[1], normal_curvature(fan.body, x, p), atol=30 * STRIP)
    np.testing.assert_allclose(at.transverse[1], normal_curvature(fan.body, x, b), atol=30 * STRIP)
    x0, _ = direct(fan, 0, sigma, np.zeros(20))
    np.testing.assert_allclose(at.eikonal, x0 @ fan.line.direction + s, atol=STRIP)
    np.testing.assert_allclose(strip.first_normals(sigma), normal(fan.body, x0), atol=STRIP)
    assert np.all(at.alive)
    for ray in (0, 17, 95):
        at = strip.at(np.full(len(strip.times), strip.positions[ray]), strip.times)
        np.testing.assert_allclose(at.lanes, strip.rays.lanes[ray], atol=1e-9)
        np.testing.assert_allclose(at.starts, strip.rays.starts[ray], atol=1e-9)


@pytest.mark.parametrize("name", ["triaxial", "torus"])
def test_slopes_are_differences(fans, name, rng):
    for strip in strips_of(fans[name]):
        low, high = strip.positions[[0, -1]]
        sigma, s, h = rng.uniform(low + 0.01, high - 0.01, 15), rng.uniform(0.01, 2.99, 15), 1e-4
        across, along = strip.slopes(sigma, s)[:, :6], strip.slopes(sigma, s, 1)[:, :6]
        for slope, (a, b) in ((across, (h, 0)), (along, (0, h))):
            after, before = strip.at(sigma + a, s + b), strip.at(sigma - a, s - b)
            difference = np.concatenate([after.points - before.points, after.directions - before.directions], axis=1)
            np.testing.assert_allclose(slope, difference / (2 * h), atol=STRIP_SLOPE)


def test_along_the_ray_the_slope_is_the_tangent(fans, rng):
    (strip,) = strips_of(fans["triaxial"])
    sigma, s = rng.uniform(0, strip.period, 15), rng.uniform(0.1, 2.9, 15)
    across, along = strip.slopes(sigma, s)[:, :6], strip.slopes(sigma, s, 1)[:, :6]
    at = strip.at(sigma, s)
    np.testing.assert_allclose(along[:, :3], at.directions, atol=1e-6)
    # b.dx/dσ = J dσ⊥/dσ, up to the sense of σ
    b = np.cross(normal(fans["triaxial"].body, at.points), at.directions)
    apart = np.abs(np.sum(b * across[:, :3], axis=1))
    np.testing.assert_allclose(apart, np.abs(at.spreading) * at.width, atol=1e-5)


def test_closed_strip_is_periodic(fans, rng):
    (strip,) = strips_of(fans["triaxial"])
    sigma, s = rng.uniform(0, strip.period, 10), rng.uniform(0, 3, 10)
    for turns in (-2, -1, 1, 3):
        np.testing.assert_allclose(strip.at(sigma + turns * strip.period, s).lanes, strip.at(sigma, s).lanes, atol=1e-9)
    low, high = strip.span
    assert high - low == pytest.approx(fans["triaxial"].line.curves[0].length)
    # smooth across the seam, in value and slope
    seam, t = strip.positions[0] + np.array([-1e-7, 1e-7]), np.full(2, 1.3)
    np.testing.assert_allclose(*strip.at(seam, t).points, atol=1e-6)
    np.testing.assert_allclose(*strip.slopes(seam, t)[:, :6], atol=1e-5)


def test_open_arcs_of_the_torus(fans, rng):
    fan = fans["torus"]
    strips = strips_of(fan)
    assert sum(len(strip.positions) for strip in strips) == len(fan.points)
    assert not all(strip.closed for strip in strips)
    for number, strip in enumerate(strips):
        assert np.all(np.diff(strip.positions) > 0)
        gap = np.diff(strip.positions).max()
        low, high = strip.span
        if not strip.closed:
            assert low < strip.positions[0] < strip.positions[-1] < high
            assert high - strip.positions[-1] <= gap
            sigma = rng.uniform(strip.positions[0], strip.positions[-1], 6)
            np.testing.assert_array_equal(strip.wrap(sigma), sigma)
        else:
            sigma = rng.uniform(low, high, 6)
        s = rng.uniform(0, 1.0, 6)
        x, _ = direct(fan, fan.curve_index[fan.arc_index == number][0], sigma, s)
        # beside the ends of an open arc the rays' curvature falls to 0
        np.testing.assert_allclose(strip.at(sigma, s).points, x, atol=1e-4)


def test_points_between_a_living_and_a_dead_ray_are_dead(fans):
    fan = fans["torus"]
    for number, strip in enumerate(strips_of(fan)):
        detachment = fan.detachment[fan.arc_index == number]
        for ray in np.flatnonzero(np.isfinite(detachment[:-1]))[::9]:
            middle = strip.positions[ray : ray + 2].mean()
            first = detachment[ray : ray + 2].min()
            step = strip.times[1]
            before, after = strip.at(np.full(2, middle), np.array([first - step, min(first + step, 3.0)])).alive
            assert before or first < step
            assert not after


def test_gather_keeps_the_order(fans, rng):
    strips = strips_of(fans["torus"])
    which = rng.integers(0, len(strips), 25)
    sigma = np.array([strips[k].positions.mean() for k in which])
    s = rng.uniform(0, 3, 25)
    together = gather(strips, which, sigma, s)
    for k in range(25):
        alone = strips[which[k]].at(sigma[k : k + 1], s[k : k + 1])
        np.testing.assert_allclose(together.lanes[k], alone.lanes[0], atol=1e-12)
        assert together.alive[k] == alone.alive[0]
    np.testing.assert_array_equal(together.time, s)
    for some in (strips, ()):
        empty = gather(some, which[:0], sigma[:0], s[:0])
        assert empty.points.shape == (0, 3) and empty.integrals.shape == (0, 5)


@pytest.mark.parametrize("n_rays", [1, 3, 6])
def test_few_rays_make_a_strip_all_the_same(n_rays):
    body = sc.Sphere()
    line = cr.shadow_line(body, (0, 0, 1))
    fan = cr.launch(cr.DirectFlow(body), line, length=1.0, n_rays=n_rays, max_gap=np.inf)
    for strip in strips_of(fan):
        at = strip.at(strip.positions, np.full(n_rays, 0.5))
        np.testing.assert_allclose(at.points[:, 2], np.sin(0.5), atol=1e-6)
