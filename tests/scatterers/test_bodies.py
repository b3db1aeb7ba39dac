"""Bodies satisfy their protocol, and their compiled evaluators equal the numpy ones."""

import numpy as np
import pytest
from numba import njit

import creeping as cr
import scatterers as sc
from creeping.geometry.frames import polar_frame
from creeping.geometry.surface import Surface
from scatterers.kernels.trigonometry import cos_pi, sin_pi

COLUMNS = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]


@njit
def call(function, *arguments):
    function(*arguments)


def test_every_body_passes_its_check(body):
    report = cr.check_surface(body)
    assert report.ok, report
    assert report.genus == (1 if isinstance(body, sc.Torus) else 0)
    assert isinstance(body, Surface)


def test_area_of_the_sphere_and_the_torus():
    assert cr.check_surface(sc.Sphere(2.0)).area == pytest.approx(16 * np.pi, rel=2e-3)
    assert cr.check_surface(sc.Torus(1.0, 0.25)).area == pytest.approx(np.pi**2, rel=4e-3)


def evaluate(compiled, points):
    n = len(points)
    values, gradients, hessians = np.empty(n), np.empty((3, n)), np.empty((6, n))
    # the plain Python of the compiled function; the compiled one is exercised by the tracer
    compiled.source(np.ascontiguousarray(points.T), values, gradients, hessians, compiled.parameters)
    return values, gradients.T, hessians.T


def test_compiled_level_equals_numpy(body, rng):
    points = rng.uniform(0.3, 1.0, (50, 3)) * rng.choice([-1, 1], (50, 3))
    values, gradients, hessians = evaluate(body.compiled, points)
    np.testing.assert_allclose(values, body.level(points), atol=1e-13)
    np.testing.assert_allclose(gradients, body.gradient(points), atol=1e-12)
    expected = np.stack([body.hessian(points)[:, i, j] for i, j in COLUMNS], axis=-1)
    np.testing.assert_allclose(hessians, expected, atol=1e-12)


def test_compiled_locator_equals_numpy(body, rng):
    for number, chart in enumerate(body.atlas.charts):
        uv = rng.uniform(0.001, 0.999, (40, 2))
        points = chart.point(uv)
        found, found_uv, frame = np.empty(40, np.int64), np.empty((2, 40)), np.empty((6, 40))
        locator = body.atlas.compiled
        gradients = np.ascontiguousarray(body.gradient(points).T)
        locator.source(np.ascontiguousarray(points.T), gradients, found, found_uv, frame, locator.parameters)
        assert np.all(found == number)
        np.testing.assert_allclose(found_uv.T, uv, atol=1e-13)
        expected = polar_frame(chart.tangents(uv))
        np.testing.assert_allclose(frame[:3].T, expected[..., 0], atol=1e-13)
        np.testing.assert_allclose(frame[3:].T, expected[..., 1], atol=1e-13)


def test_compiled_sphere_map_equals_numpy(body, rng):
    if isinstance(body, sc.Torus):
        pytest.skip("a torus is no image of the sphere")
    sphere_map = body.atlas.sphere_map
    s = rng.normal(size=(50, 3))
    s /= np.linalg.norm(s, axis=-1, keepdims=True)
    forward, inverse = sphere_map.compiled_forward, sphere_map.compiled_inverse
    points, derivatives, back = np.empty((3, 50)), np.empty((9, 50)), np.empty((3, 50))
    forward.source(np.ascontiguousarray(s.T), points, derivatives, forward.parameters)
    np.testing.assert_allclose(points.T, sphere_map.forward(s), atol=1e-14)
    np.testing.assert_allclose(derivatives.T.reshape(-1, 3, 3), sphere_map.derivative(s), atol=1e-14)
    inverse.source(points, back, inverse.parameters)
    np.testing.assert_allclose(back.T, s, atol=1e-14)


@pytest.mark.parametrize("kind", ["level", "forward", "inverse", "locator"])
def test_compiled_functions_equal_their_source(body, kind, rng):
    if isinstance(body, sc.Torus) and kind in ("forward", "inverse"):
        pytest.skip("a torus is no image of the sphere")
    # 37 leaves a remainder for every width of vector
    points = np.ascontiguousarray(body.atlas.charts[0].point(rng.uniform(0.1, 0.9, (37, 2))).T)
    rows = {"level": (0, 3, 6), "forward": (3, 9), "inverse": (3,), "locator": (-1, 2, 6)}[kind]
    compiled = {
        "level": lambda: body.compiled,
        "locator": lambda: body.atlas.compiled,
        "forward": lambda: body.atlas.sphere_map.compiled_forward,
        "inverse": lambda: body.atlas.sphere_map.compiled_inverse,
    }[kind]()

    def outputs():
        return [np.empty((r, 37)) if r > 0 else np.empty(37, np.int64 if r else float) for r in rows]

    fast, plain = outputs(), outputs()
    given = [points, np.ascontiguousarray(body.gradient(points.T).T)] if kind == "locator" else [points]
    call(compiled.function, *given, *fast, compiled.parameters)
    compiled.source(*given, *plain, compiled.parameters)
    for a, b in zip(fast, plain, strict=True):
        np.testing.assert_allclose(a, b, atol=2e-14)


def test_polynomial_cosine_and_sine(rng):
    z = np.concatenate([rng.uniform(-3, 3, 2000), np.arange(-6, 7) / 2])
    np.testing.assert_allclose([cos_pi(v) for v in z], np.cos(np.pi * z), atol=2e-15)
    np.testing.assert_allclose([sin_pi(v) for v in z], np.sin(np.pi * z), atol=2e-15)
    assert cos_pi(0.5) == pytest.approx(0, abs=2e-16)


def test_polar_frame_is_the_nearest_orthonormal_frame(rng):
    tangents = rng.normal(size=(20, 3, 2))
    left, _, right = np.linalg.svd(tangents, full_matrices=False)
    np.testing.assert_allclose(polar_frame(tangents), left @ right, atol=1e-12)


@pytest.mark.parametrize("theta, phi", [(0.3, -2.0), (2.9, 3.1), (1.2, 0.0)])
def test_parameters_are_the_standard_angles(theta, phi):
    s = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    for shape in (sc.Sphere(2.0), sc.Ellipsoid(3.0, 2.0, 1.0), sc.TwistedEllipsoid()):
        np.testing.assert_allclose(shape.parameters(shape.forward(s)), [theta, phi], atol=1e-12)
    torus = sc.Torus(2.0, 0.5)
    rho = 2.0 + 0.5 * np.cos(theta)
    point = np.array([rho * np.cos(phi), rho * np.sin(phi), 0.5 * np.sin(theta)])
    np.testing.assert_allclose(torus.parameters(point), [theta, phi], atol=1e-12)


@pytest.mark.parametrize(
    "make, name",
    [
        (lambda: sc.Sphere(0), "radius"),
        (lambda: sc.Sphere(-1.0), "radius"),
        (lambda: sc.Sphere(float("nan")), "radius"),
        (lambda: sc.Sphere("1"), "radius"),
        (lambda: sc.Ellipsoid(1, 0, 1), "b = 0"),
        (lambda: sc.Ellipsoid(1, 1, float("inf")), "c = inf"),
        (lambda: sc.Torus(1.0, 1.0), "meets itself"),
        (lambda: sc.TwistedEllipsoid(d=float("nan")), "d = nan"),
    ],
)
def test_bad_parameters_are_named(make, name):
    with pytest.raises(ValueError, match=name):
        make()


def test_fingerprint_tells_bodies_apart():
    prints = {b.fingerprint for b in (sc.Sphere(), sc.Sphere(2.0), sc.Ellipsoid(1, 1, 1), sc.Sphere(speed="1 + x"))}
    assert len(prints) == 4
    assert sc.Sphere(1).fingerprint == sc.Sphere(1.0).fingerprint
