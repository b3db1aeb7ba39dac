"""Bodies given by an expression: F and its derivatives, the box found, rays."""

from functools import cache

import numpy as np
import pytest
from numba import njit
from tolerances import MAP, TRACE

import creeping as cr
import scatterers as sc
from creeping.geodesics.bundle import random_bundle_points
from creeping.geometry.surface import project
from scatterers.implicit import Implicit
from scatterers.spline.cloud import body_cloud

COLUMNS = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
LENGTH = 1e-7
"""Length of a shadow line against the ten digits of a second method, on another representation of the same body."""
STEP = 1e-5
"""Of central differences: rounding and curvature are then both about 1e-10 of the second derivatives."""


def ring(x):
    return f"(sqrt((sqrt((x - {x})**2 + y**2) - 0.7)**2 + z**2) - 0.3)"


TEXTS = {
    "ellipsoid": "x**2/1.44 + y**2/0.64 + z**2/0.64 - 1",
    "torus": "((sqrt(x**2 + y**2) - 1)**2 + z**2)/0.25 - 1",
    "peanut": "(x**2+y**2+z**2+.64)**2-4*.64*x**2-.9**4",
    "genus 2": f"-log(exp(-12*{ring(-0.85)}) + exp(-12*{ring(0.85)}))/12",
    "twisted": "4*x**2 + 4*(y - cos(pi*z)/5)**2 + z**2 - 1",
    # sympy.cse may take the sums in the exponents for products
    "two balls": "-log(exp(-30*(x**2+y**2+(z-.9)**2-1)) + exp(-30*(x**2+y**2+(z+.9)**2-1)))/30",
    # no point sees it whole before it is sheared upright
    "bent": "((x - 1.2*z**2)**2 + (y - 0.3*sin(2*z))**2)/0.09 + z**2 - 1",
}
GENUS = {"torus": 1, "genus 2": 2}
EXACT = {"ellipsoid": sc.Ellipsoid(1.2, 0.8, 0.8), "torus": sc.Torus(), "twisted": sc.TwistedEllipsoid()}
STARS = [name for name in TEXTS if name not in GENUS]
LARGE = ("genus 2", "two balls")


def slow_if_large(names):
    return [pytest.param(name, marks=pytest.mark.slow if name in LARGE else ()) for name in names]


every = pytest.mark.parametrize("name", slow_if_large(TEXTS))


@cache
def body_of(name):
    return Implicit(TEXTS[name])


@cache
def points_of(name):
    body = body_of(name)
    return body_cloud(body.level, body.gradient, body.bounds, 2000)


@pytest.mark.slow
@every
def test_check_passes_and_counts_handles(name):
    report = cr.check_surface(body_of(name))
    assert report.ok, report
    assert report.genus == GENUS.get(name, 0)


@every
def test_only_bodies_with_a_sphere_map_are_star_shaped(name):
    body = body_of(name)
    assert type(body) is Implicit and body.star_shaped == (name in STARS)
    assert hasattr(body.atlas, "sphere_map") == body.star_shaped
    if body.star_shaped:
        assert body.atlas.sphere_map.spine.upright == (name not in ("bent", "twisted"))


@pytest.mark.parametrize("name", EXACT)
def test_derivatives_of_the_exact_bodies(name, rng):
    body, exact = body_of(name), EXACT[name]
    points = points_of(name) + 0.1 * rng.normal(size=points_of(name).shape)
    np.testing.assert_allclose(body.level(points), exact.level(points), atol=1e-13)
    np.testing.assert_allclose(body.gradient(points), exact.gradient(points), atol=1e-12)
    np.testing.assert_allclose(body.hessian(points), exact.hessian(points), atol=1e-11)


@every
def test_level_and_derivatives_are_those_of_the_text(name, rng):
    body, functions = body_of(name), body_of(name)._space.functions
    points = points_of(name) + 0.05 * rng.normal(size=points_of(name).shape)
    names = {name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "pi")}
    expected = eval(TEXTS[name], names | dict(zip("xyz", points.T, strict=True)))
    value, gradient, hessian = body.level(points), body.gradient(points), body.hessian(points)
    np.testing.assert_allclose(value, expected, atol=1e-13 * np.max(np.abs(gradient)))
    scale = np.max(np.abs(hessian))
    # the compiled ones against those of numpy
    plain = [
        np.stack([np.broadcast_to(part, len(points)) for part in f(*points.T)], axis=-1)
        for f in (functions.value, functions.gradient, functions.hessian)
    ]
    np.testing.assert_allclose(value, plain[0][:, 0], atol=1e-13 * scale)
    np.testing.assert_allclose(gradient, plain[1], atol=1e-13 * scale)
    np.testing.assert_allclose(np.stack([hessian[:, i, j] for i, j in COLUMNS], axis=-1), plain[2], atol=1e-12 * scale)
    # and both against differences
    points, steps = points[::7], STEP * np.eye(3)
    slopes = [(body.level(points + h) - body.level(points - h)) / (2 * STEP) for h in steps]
    np.testing.assert_allclose(gradient[::7], np.stack(slopes, axis=-1), atol=1e-8 * scale)
    bends = [(body.gradient(points + h) - body.gradient(points - h)) / (2 * STEP) for h in steps]
    np.testing.assert_allclose(hessian[::7], np.stack(bends, axis=-1), atol=1e-7 * scale)


@pytest.mark.parametrize("shape", [(4, 25), (0,), ()])
def test_any_shape_of_points(shape, rng):
    body, exact = body_of("ellipsoid"), EXACT["ellipsoid"]
    points = rng.normal(size=(*shape, 3))
    np.testing.assert_allclose(body.level(points), exact.level(points), atol=1e-12)
    np.testing.assert_allclose(body.gradient(points), exact.gradient(points), atol=1e-12)
    np.testing.assert_allclose(body.hessian(points), exact.hessian(points), atol=1e-12)


@njit
def call(function, *arguments):
    function(*arguments)


@pytest.mark.parametrize("name", ["peanut", "bent"])
def test_compiled_sphere_map_equals_numpy(name, rng):
    sphere_map, s = body_of(name).atlas.sphere_map, rng.normal(size=(200, 3))
    s /= np.linalg.norm(s, axis=-1, keepdims=True)
    x, d, forward = np.empty((3, 200)), np.empty((9, 200)), sphere_map.compiled_forward
    call(forward.function, np.ascontiguousarray(s.T), x, d, forward.parameters)
    np.testing.assert_allclose(x.T, sphere_map.forward(s), atol=1e-14)
    np.testing.assert_allclose(d.T.reshape(-1, 3, 3), sphere_map.derivative(s), atol=1e-12)
    np.testing.assert_allclose(body_of(name).level(x.T), 0, atol=1e-13)


@every
def test_bounds_contain_the_body_closely(name):
    low, high = points_of(name).min(0), points_of(name).max(0)
    below, above = low - body_of(name).bounds[0], body_of(name).bounds[1] - high
    assert np.all(below > 0) and np.all(above > 0)
    assert np.all(np.maximum(below, above) < 0.1 * (high - low))


@pytest.mark.parametrize("name", slow_if_large(GENUS))
def test_parameters_of_other_bodies_are_angles_too(name):
    theta, phi = np.moveaxis(body_of(name).parameters(points_of(name)), -1, 0)
    assert np.all((theta >= 0) & (theta <= np.pi) & (phi > -np.pi) & (phi <= np.pi))


@pytest.mark.parametrize(
    "name, scale",
    [
        ("ellipsoid", 1e-2),
        pytest.param("ellipsoid", 1e2, marks=pytest.mark.slow),
        pytest.param("torus", 1e-2, marks=pytest.mark.slow),
    ],
)
def test_scale_changes_nothing_but_lengths(name, scale):
    text = TEXTS[name].replace("x", f"(x/{scale!r})").replace("y", f"(y/{scale!r})").replace("z", f"(z/{scale!r})")
    body, unit = Implicit(text), body_of(name)
    np.testing.assert_allclose(body.bounds, scale * unit.bounds, rtol=0.1)
    report = cr.check_surface(body)
    assert report.ok, report
    # of the ellipsoid and of the torus, and published lengths
    bend = np.sqrt(1 - (2 / 3) ** 2)
    area = 2 * np.pi * 0.64 * (1 + 1.5 / bend * np.arcsin(bend)) if name == "ellipsoid" else 2 * np.pi**2
    assert report.area == pytest.approx(scale**2 * area, rel=1e-2)
    lengths = [6.1340508514] if name == "ellipsoid" else [8.9274357171, 4.6171835804]
    found = [curve.length for curve in cr.shadow_line(body, (1, 1, 1)).curves]
    np.testing.assert_allclose(found, np.multiply(scale, lengths), rtol=1e-8)


@pytest.mark.parametrize(
    "name, given",
    [("ellipsoid", False), *(pytest.param(name, True, marks=pytest.mark.slow) for name in ("ellipsoid", "torus"))],
)
def test_off_the_origin(name, given):
    centre = np.array([3.0, -2.0, 1.5])
    shifted = "".join(dict(zip("xyz", ("(x-3)", "(y+2)", "(z-1.5)"), strict=True)).get(c, c) for c in TEXTS[name])
    # of different reach on every side
    box = centre + np.array([[-2.1, -1.7, -0.9], [1.6, 2.2, 1.3]])
    body = Implicit(shifted, box) if given else Implicit(shifted)
    assert cr.check_surface(body).ok
    assert body.star_shaped == (name == "ellipsoid")
    if given:
        assert np.all(body.bounds[0] >= box[0]) and np.all(body.bounds[1] <= box[1])
    np.testing.assert_allclose(body.bounds, centre + body_of(name).bounds, atol=0.1)
    line, exact = (cr.shadow_line(one, (1, 1, 1)) for one in (body, EXACT[name]))
    np.testing.assert_allclose([c.length for c in line.curves], [c.length for c in exact.curves], atol=LENGTH)


def test_body_far_from_the_origin_needs_bounds():
    centre = np.array([1e4, 0.0, -300.0])
    body = Implicit("(x-1e4)**2 + y**2 + (z+300)**2/4 - 1", centre + np.array([[-1.5, -1.5, -2.5], [1.5, 1.5, 2.5]]))
    assert body.star_shaped and cr.check_surface(body).ok
    np.testing.assert_allclose(body.atlas.sphere_map.centre, centre, atol=1e-3)


@pytest.mark.parametrize("name", ["ellipsoid", "torus"])
def test_wide_bounds_are_tightened(name):
    body = Implicit(TEXTS[name], [[-40, -50, -60], [70, 60, 50]])
    np.testing.assert_allclose(body.bounds, body_of(name).bounds, atol=0.1)
    assert body.star_shaped == (name == "ellipsoid")


def test_bounds_leave_another_body_out():
    text = "((x-1.5)**2 + y**2 + z**2 - 1)*((x+1.5)**2 + 2*y**2 + z**2 - 1)"
    body = Implicit(text, [[0.1, -1.3, -1.3], [2.9, 1.3, 1.3]])
    assert cr.check_surface(body).area == pytest.approx(4 * np.pi, rel=1e-2)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("x**2 + y**2 + 1e6*z**2 - 1", marks=pytest.mark.slow),
        "x**16 + y**16 + z**16 - 1",
        "(sqrt(x**2 + y**2) - 1)**2 + z**2 - 0.999**2",
        pytest.param("sqrt(x**2 + 4*y**2 + 9*z**2) - 1", marks=pytest.mark.slow),
        pytest.param("(x**2 + y**2)**1.5 + z**2 - 1", marks=pytest.mark.slow),
        "sqrt(x**2 + y**2 + 1e-6) - (1 - z**2)/2",
    ],
)
def test_sharply_curved_bodies_are_no_kinks(text):
    assert Implicit(text).expression == text


def test_centre_is_taken():
    body = Implicit(TEXTS["ellipsoid"], centre=(0.3, 0.1, -0.2))
    np.testing.assert_array_equal(body.atlas.sphere_map.centre, (0.3, 0.1, -0.2))
    assert cr.check_surface(body).ok
    # without the spine that its own box suggests, no centre sees it
    assert Implicit(TEXTS["bent"], centre=body_of("bent").atlas.sphere_map.centre).star_shaped


def test_fingerprints_tell_bodies_apart_and_nothing_else():
    text, box = TEXTS["ellipsoid"], [[-2, -1, -1], [2, 1, 1]]
    make = {
        "plain": lambda: Implicit(text),
        "another F": lambda: Implicit(text.replace("1.44", "1.45")),
        "bounds": lambda: Implicit(text, box),
        "centre": lambda: Implicit(text, centre=(0.1, 0, 0)),
        "speed": lambda: Implicit(text, speed="2 + x"),
        "another speed": lambda: Implicit(text, speed="2 - x"),
    }
    prints = {name: one().fingerprint for name, one in make.items()}
    assert len({*prints.values(), body_of("torus").fingerprint}) == len(make) + 1 and None not in prints.values()
    assert all(make[name]().fingerprint == prints[name] for name in ("bounds", "speed"))

    class Unnamed:
        def value(self, points):
            return np.ones(points.shape[:-1])

        def gradient(self, points):
            return np.zeros(points.shape)

    assert Implicit(text, speed=Unnamed()).fingerprint is None
    assert repr(body_of("ellipsoid")) == f"Implicit({text!r}, speed=None)"


@pytest.mark.parametrize("name", ["ellipsoid", "torus"])
def test_rays_are_those_of_the_exact_body(name, rng):
    x, p = random_bundle_points(EXACT[name], 40, rng=rng)
    for found, exact in zip(
        *(cr.trace(b, x, p, [0.5, 2.0], rtol=1e-12) for b in (body_of(name), EXACT[name])), strict=True
    ):
        np.testing.assert_allclose(found, exact, atol=TRACE)


def test_speed_bends_rays(rng):
    body, exact = (
        make(speed="1 + x/4 + y*z/2")
        for make in (lambda **k: Implicit(TEXTS["ellipsoid"], **k), lambda **k: sc.Ellipsoid(1.2, 0.8, 0.8, **k))
    )
    x, p = random_bundle_points(exact, 20, rng=rng)
    found, expected = (cr.trace(b, x, p, 1.5, rtol=1e-12)[0] for b in (body, exact))
    np.testing.assert_allclose(found, expected, atol=TRACE)
    assert np.max(np.abs(expected - cr.trace(body_of("ellipsoid"), x, p, 1.5)[0])) > 0.1


@pytest.mark.slow
def test_map_of_an_ellipsoid(rng):
    body, exact = body_of("ellipsoid"), EXACT["ellipsoid"]
    built = cr.build_phase_map(body, tolerance=1e-6, cache=False)
    assert built.error.rms <= MAP
    x, p = random_bundle_points(exact, 500, rng=rng)
    found, expected = built.flow(x, p, built.horizon), cr.trace(exact, x, p, built.horizon, rtol=1e-12)
    error = np.linalg.norm(np.concatenate(found, axis=-1) - np.concatenate(expected, axis=-1), axis=-1)
    assert np.sqrt(np.mean(error**2)) < 1.5 * MAP
    np.testing.assert_allclose(project(exact, found[0]), found[0], atol=1e-12)


@pytest.mark.parametrize(
    "name, direction, lengths",
    [
        ("torus", (1, 1, 1), [8.9274357171, 4.6171835804]),
        ("peanut", (1, 0.5, 0.2), [6.3744816923]),
        pytest.param("twisted", (1, 1, 1), [5.1675274372], marks=pytest.mark.slow),
        pytest.param("ellipsoid", (1, 1, 1), [6.1340508514], marks=pytest.mark.slow),
    ],
)
def test_shadow_lines_of_published_length(name, direction, lengths):
    line = cr.shadow_line(body_of(name), direction)
    np.testing.assert_allclose([curve.length for curve in line.curves], lengths, atol=LENGTH)


def test_charts_that_cannot_be_are_sought_once(monkeypatch):
    """To find that out takes as long as charts do."""
    from scatterers.atlas.monge.atlas import MongeAtlas

    asked = []

    def covering(*_, **__):
        asked.append(1)
        raise ValueError("too thin")

    monkeypatch.setattr(MongeAtlas, "covering", covering)
    body = sc.Implicit("(x**2 + y**2 + z**2 + 0.84)**2 - 4*(x**2 + y**2)")
    asked.clear()
    for _ in range(2):
        with pytest.raises(ValueError, match="too sharply curved"):
            _ = body.atlas
    assert len(asked) <= 2
