"""The body given by samples: its spline, its sphere map, their compiled twins, and bad input."""

from functools import cache, partial
from types import SimpleNamespace

import numpy as np
import pytest
from body_checks import assert_locator, assert_sphere_map, call, directions, evaluated_by

import creeping as cr
import scatterers as sc
from creeping.geodesics.states import project_bundle, random_bundle_points
from creeping.geometry.surface import normal
from scatterers.charts.star import Spine
from scatterers.fits.tensor import TensorSpline, coefficients, interpolation_operator
from scatterers.kernels.compiled import SYMMETRIC
from scatterers.kernels.tensor import POWERS

PARENT = sc.TwistedEllipsoid()


@cache
def gridded(nodes):
    return sc.Gridded.sampled(PARENT, nodes)


class Turned:
    """A body whose axes are permuted: its z, the longest side, becomes ``axis``."""

    def __init__(self, axis, parent=PARENT):
        self.parent, self.order = parent, [(axis + 1) % 3, (axis + 2) % 3, axis]
        self.bounds = np.empty((2, 3))
        self.bounds[:, self.order] = parent.bounds

    def level(self, points):
        return self.parent.level(points[..., self.order])


def bow(points):
    """A spheroid bent in two directions, by polynomials that no sixth degree holds exactly, slanted and off centre."""
    x, y, z = np.moveaxis(points, -1, 0)
    z = (z - 0.5) / 1.2
    return (x - 0.3 * z - 0.3 * z**2) ** 2 / 0.3**2 + (y - 0.4 * np.sin(2 * z)) ** 2 / 0.25**2 + z**2 - 1


def slanted(points):
    x, y, z = np.moveaxis(points, -1, 0)
    return ((x - 0.6 * z) ** 2 + y**2) / 0.3**2 + z**2 - 1


BOW = SimpleNamespace(level=bow, bounds=np.array([[-1.0, -1.0, -0.9], [1.0, 1.0, 1.9]]))
SLANTED = SimpleNamespace(level=slanted, bounds=np.array([[-0.9, -0.3, -1.0], [0.9, 0.3, 1.0]]))
MAKE = {
    # a centre aside keeps the radius uneven
    "upright": lambda: sc.Gridded.sampled(sc.Ellipsoid(0.7, 1.0, 0.8), 32, centre=(0.1, -0.2, 0.1)),
    "z": lambda: gridded(32),
    "x": lambda: sc.Gridded.sampled(Turned(0), 32),
    "bow": lambda: sc.Gridded.sampled(BOW, 32),
}
every = pytest.mark.parametrize("name", MAKE)


@cache
def body_of(name):
    return MAKE[name]()


@pytest.mark.parametrize("n", [8, 200])
def test_interpolation_is_scipys_and_stays_well_conditioned(n):
    from scipy.interpolate import make_interp_spline

    nodes, t = np.arange(float(n)), np.linspace(0, n - 1, 333)
    cell = np.minimum(t.astype(int), n - 2)
    c = interpolation_operator(n) @ np.cos(nodes)
    weights = np.vander(t - cell, 6, increasing=True) @ POWERS
    found = np.sum(weights * c[cell[:, None] + np.arange(6)], axis=-1)
    np.testing.assert_allclose(found, make_interp_spline(nodes, np.cos(nodes), k=5)(t), atol=1e-13)


def test_spline_reproduces_quintics(rng):
    origin, spacing, shape = np.array([-1.0, 0.5, 2.0]), np.array([0.2, 0.1, 0.15]), (9, 12, 10)
    nodes = np.moveaxis(np.indices(shape), 0, -1) * spacing + origin
    p, q, r = (np.polynomial.Polynomial(rng.normal(size=6)) for _ in range(3))
    x, y, z = np.moveaxis(nodes, -1, 0)
    spline = TensorSpline(coefficients(p(x) * q(y) * r(z)), origin, spacing)
    points = origin + rng.uniform(0, 1, (300, 3)) * (np.array(shape) - 1) * spacing
    x, y, z = points.T
    dp, dq, dr = p.deriv(), q.deriv(), r.deriv()
    scale = np.max(np.abs(p(x) * q(y) * r(z)))
    np.testing.assert_allclose(spline.level(points), p(x) * q(y) * r(z), atol=1e-12 * scale)
    gradient = np.stack([dp(x) * q(y) * r(z), p(x) * dq(y) * r(z), p(x) * q(y) * dr(z)], axis=-1)
    np.testing.assert_allclose(spline.gradient(points), gradient, atol=1e-12 * np.max(np.abs(gradient)))
    h = spline.hessian(points)
    # in the order of the compiled function
    expected = [dp.deriv()(x) * q(y) * r(z), p(x) * dq.deriv()(y) * r(z), p(x) * q(y) * dr.deriv()(z)]
    expected += [p(x) * dq(y) * dr(z), dp(x) * q(y) * dr(z), dp(x) * dq(y) * r(z)]
    near = 1e-11 * np.max(np.abs(expected))
    np.testing.assert_allclose(h, np.stack(expected, axis=-1)[:, SYMMETRIC], atol=near)


def test_sampled_body_agrees_with_its_parent(rng):
    points = PARENT.forward(directions(rng, 2000))
    body = gridded(64)
    np.testing.assert_allclose(body.level(points), 0, atol=1e-8)
    np.testing.assert_allclose(normal(body, points), normal(PARENT, points), atol=1e-7)
    np.testing.assert_allclose(body.gradient(points), PARENT.gradient(points), atol=1e-6)
    np.testing.assert_allclose(body.hessian(points), PARENT.hessian(points), atol=1e-4)
    for shape in ((4, 25), (0,), ()):
        some = points[: int(np.prod(shape))].reshape(*shape, 3)
        assert body.level(some).shape == shape and body.hessian(some).shape == (*shape, 3, 3)


def test_sampled_body_converges_with_order_six(rng):
    # away from the tips, where the ends of the grid lift the error
    points = PARENT.forward(directions(rng, 2000))
    points = points[np.abs(points[:, 2]) < 0.5]
    coarse, fine = (np.max(np.abs(gridded(n).level(points))) for n in (24, 48))
    assert 5.5 < np.log(coarse / fine) / np.log(47 / 23) < 7.5


@every
def test_check_passes(name):
    report = cr.check_surface(body_of(name))
    assert report.ok and report.genus == 0, report
    if name in "xz":
        assert report.area == pytest.approx(cr.check_surface(PARENT).area, rel=2e-3)


def radii(sphere_map, s):
    """Distance of the body from the middle of its map, in half axes, its spine made upright."""
    x = sphere_map.forward(s)
    return np.linalg.norm((x - sphere_map.spine.shift(x) - sphere_map.centre) / sphere_map.half_axes, axis=-1)


@pytest.mark.parametrize("axis, across", [(2, 1), (0, 2), (1, 0)])
def test_spine_leaves_little_to_the_radius(rng, axis, across):
    sheared = sc.Gridded.sampled(SLANTED, 48).atlas.sphere_map
    assert np.max(np.abs(radii(sheared, directions(rng, 2000)) - 1)) < 1e-2
    sphere_map = sc.Gridded.sampled(Turned(axis), 48).atlas.sphere_map
    assert np.max(np.abs(radii(sphere_map, directions(rng, 2000)) - 1)) < 5e-3
    assert sphere_map.spine.axis == axis
    assert np.all(np.delete(sphere_map.spine.shifts, across, axis=1) == 0)


def test_upright_bodies_have_no_spine(rng):
    body = sc.Ellipsoid(1.0, 0.5, 0.7)
    sphere_map = sc.Gridded.sampled(body, (31, 36, 33)).atlas.sphere_map
    assert sphere_map.spine.upright
    s = directions(rng, 500)
    np.testing.assert_allclose(sphere_map.forward(s), body.forward(s), atol=5e-3)


def test_spine_admits_bodies_that_no_point_sees_whole(monkeypatch):
    banana = sc.TwistedEllipsoid(0.3, 0.3, 1.0, 0.6)
    assert cr.check_surface(sc.Gridded.sampled(banana, 40)).ok
    middle = sc.Gridded.sampled(banana, 40).atlas.sphere_map.centre
    monkeypatch.setattr(Spine, "through", lambda *_: Spine.none())
    with pytest.raises(ValueError, match=r"is not inside|not star-shaped"):
        sc.Gridded.sampled(banana, 40, centre=middle)
    # without a centre it is still a body
    assert not sc.Gridded.sampled(banana, 40).star_shaped


def test_spine_that_spoils_the_body_is_left_out(monkeypatch):
    shifts = np.zeros((7, 3))
    shifts[2, 0] = 9.0
    monkeypatch.setattr(Spine, "through", lambda *_: Spine(2, 0.0, 1.0, shifts))
    assert sc.Gridded.sampled(sc.Sphere(), 20).atlas.sphere_map.spine.upright


@every
def test_sphere_map_and_charts_and_their_compiled_twins(rng, name):
    body, s = body_of(name), directions(rng, 200)
    assert_sphere_map(body.atlas.sphere_map, s)
    assert_locator(body, rng)
    points = body.atlas.sphere_map.forward(s)
    np.testing.assert_allclose(body.level(points), 0, atol=1e-13)
    assert np.all(points > body.bounds[0]) and np.all(points < body.bounds[1])
    theta, phi = np.moveaxis(body.parameters(points), -1, 0)
    angles = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    np.testing.assert_allclose(angles, s, atol=1e-12)


def test_points_off_the_grid_stay_bounded_and_nan_stays_nan():
    body = gridded(32)
    far = np.array([[1e300, 0, 0], [-np.inf, np.inf, 0], [0, 0, 50.0], [0.58, 0.9, -1.2]])
    values, gradients, hessians = evaluated_by(partial(call, body.compiled.function), body.compiled, far)
    assert np.all(np.isfinite(values)) and np.all(np.isfinite(gradients)) and np.all(np.isfinite(hessians))
    nowhere = np.array([[np.nan, 0, 0], [0, np.nan, 0], [0, 0, np.nan], [np.nan, np.nan, np.nan]])
    values, gradients, _ = evaluated_by(partial(call, body.compiled.function), body.compiled, nowhere)
    assert np.all(np.isnan(values)) and np.all(np.isnan(body.level(nowhere)))
    forward = body.atlas.sphere_map.compiled_forward
    x, d = np.empty((3, 4)), np.empty((9, 4))
    call(forward.function, np.ascontiguousarray(nowhere.T), x, d, forward.parameters)
    assert np.all(np.isnan(x).any(axis=0)) and np.all(np.isnan(body.atlas.sphere_map.forward(nowhere)).any(axis=-1))


@cache
def ring(nodes):
    return sc.Gridded.sampled(sc.Torus(), nodes)


def test_rays_on_the_torus_converge_to_those_of_the_parent(rng):
    x, p = random_bundle_points(sc.Torus(), 20, rng=rng)
    exact = np.concatenate(cr.DirectFlow(sc.Torus(), rtol=1e-12).flow(x, p, 2.0), axis=-1)
    off = []
    for nodes in (24, 48):
        body = ring(nodes)
        start, tangent = project_bundle(body, x, p)
        found = np.concatenate(cr.DirectFlow(body, rtol=1e-12).flow(start, tangent, 2.0), axis=-1)
        off.append(np.median(np.linalg.norm(found - exact, axis=-1)))
    # second derivatives of the spline converge with order 4, along a grid that is coarse in z first
    assert off[1] < 2e-4
    assert off[0] / off[1] > 8


def test_shadow_line_of_the_torus():
    lengths = [curve.length for curve in cr.shadow_line(ring(48), (1, 1, 1)).curves]
    np.testing.assert_allclose(lengths, [8.9274357171, 4.6171835804], rtol=1e-4)


def test_speed_and_fingerprint():
    body = sc.Gridded.sampled(sc.Sphere(speed="2 + x"), 12)
    assert body.speed.value(np.zeros((1, 3))) == 2.0
    prints = {sc.Gridded.sampled(sc.Sphere(), *args).fingerprint for args in ((12,), (13,), (12, 0.2))}
    prints |= {sc.Gridded.sampled(sc.Sphere(), 12, centre=(0.1, 0, 0)).fingerprint, body.fingerprint}
    assert len(prints) == 5
    assert body.fingerprint == sc.Gridded.sampled(sc.Sphere(speed="2 + x"), 12).fingerprint
    unnamed = SimpleNamespace(value=lambda x: np.ones(x.shape[:-1]), gradient=np.zeros_like)
    assert sc.Gridded.sampled(sc.Sphere(speed=unnamed), 12).fingerprint is None


BOX = [[-1.5] * 3, [1.5] * 3]
SAMPLES = np.sum(np.moveaxis(np.indices((10, 10, 10)) / 3 - 1.5, 0, -1) ** 2, axis=-1) - 1
SPOILT = np.where(np.arange(1000).reshape(10, 10, 10) == 345, np.nan, SAMPLES)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: sc.Gridded(SAMPLES[0], BOX), "shape"),
        (lambda: sc.Gridded(SAMPLES[:7], BOX), "at least 8"),
        (lambda: sc.Gridded(SPOILT, BOX), "1 of 1000 samples are not finite"),
        (lambda: sc.Gridded(SAMPLES + 5, BOX), "none of 1000"),
        (lambda: sc.Gridded(-SAMPLES, BOX), "faces"),
        (lambda: sc.Gridded(SAMPLES - 2, BOX), "widen the box"),
        (lambda: sc.Gridded(SAMPLES, [[0, 0, 0]]), "bounds"),
        (lambda: sc.Gridded(SAMPLES, BOX, centre=(0, 0)), "centre"),
        (lambda: sc.Gridded(SAMPLES, BOX, centre=(2, 0, 0)), "not inside"),
        (lambda: sc.Gridded.sampled(sc.Torus(), 24, centre=(0, 0, 0)), "not inside"),
        (lambda: sc.Gridded.sampled(sc.Torus(), 24, centre=(1, 0, 0)), "not star-shaped"),
        (lambda: sc.Gridded.sampled(sc.Sphere(), 4), "nodes = 4"),
        (lambda: sc.Gridded.sampled(sc.Sphere(), 12, -0.1), "margin"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_samples_that_take_too_much_memory_are_refused_before_they_are_converted(monkeypatch):
    monkeypatch.setenv("CREEPING_MEMORY", "100M")
    with pytest.raises(ValueError, match=r"a spline through 8000000 samples would take 0.2 GB"):
        sc.Gridded(np.broadcast_to(np.float32(1.0), (200, 200, 200)), [[-1.0] * 3, [1.0] * 3])
