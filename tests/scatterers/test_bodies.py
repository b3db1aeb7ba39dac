"""Bodies satisfy their protocol, and their compiled evaluators equal the numpy ones."""

from functools import partial

import numpy as np
import pytest
from body_checks import (
    assert_compiled_is_its_source,
    assert_locator,
    assert_sphere_map,
    call,
    directions,
    evaluated_by,
)

import creeping as cr
import scatterers as sc
from creeping.geometry.evaluators import polar_frame
from creeping.geometry.surface import Surface
from scatterers.kernels.charts import cos_pi, sin_pi
from scatterers.kernels.compiled import SYMMETRIC


def test_every_body_passes_its_check(body):
    report = cr.check_surface(body)
    assert report.ok, report
    assert report.genus == (1 if isinstance(body, sc.Torus) else 0)
    assert isinstance(body, Surface)


@pytest.mark.slow
def test_fine_ripples_are_no_wrong_derivatives():
    """Fits of noisy meshes have them: differences of second order err by 7e-6 of the Hessian here."""
    assert cr.check_surface(sc.Implicit("x**2 + y**2 + z**2 - 1 + 1e-5*sin(500*x)")).ok


def test_area_of_the_sphere_and_the_torus():
    assert cr.check_surface(sc.Sphere(2.0)).area == pytest.approx(16 * np.pi, rel=2e-3)
    assert cr.check_surface(sc.Torus(1.0, 0.25)).area == pytest.approx(np.pi**2, rel=4e-3)


def test_compiled_functions_equal_numpy(body, rng):
    # 37 leaves a remainder for every width of vector
    points = rng.uniform(0.3, 1.0, (37, 3)) * rng.choice([-1, 1], (37, 3))
    values, gradients, hessians = evaluated_by(partial(call, body.compiled.function), body.compiled, points)
    np.testing.assert_allclose(values, body.level(points), atol=1e-13)
    np.testing.assert_allclose(gradients, body.gradient(points), atol=1e-12)
    np.testing.assert_allclose(hessians[:, SYMMETRIC], body.hessian(points), atol=1e-12)
    assert_compiled_is_its_source(body.compiled, points, 2e-14)
    assert_locator(body, rng)
    if not isinstance(body, sc.Torus):
        assert_sphere_map(body.atlas.sphere_map, directions(rng, 37))


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


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (sc.Cylinder(1.0, 3.0), ["Cylinder", "2 x 2 x 3 L", "any unit", "2 edges, joints or tips"]),
        (sc.Bodies([sc.Sphere(), sc.Sphere()], at=[[0, 0, 0], [4, 0, 0]]), ["Bodies", "6 x 2 x 2 L", "none: "]),
        (sc.Implicit("x**2 + y**2 + z**2 = 1"), ["(x**2 + y**2 + z**2) - (1)", "Implicit"]),
    ],
)
def test_a_body_shows_itself_in_notebooks(body, words):
    table = body._repr_html_()
    assert all(word in table for word in words) and table.startswith("<table>")
