"""Bodies given by an expression: F and its derivatives, the box found, rays."""

import sys
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import assert_derivatives, assert_sphere_map, directions
from tolerances import TRACE

import creeping as cr
from creeping.geodesics.states import random_bundle_points
from scatterers.charts.samples import body_cloud
from scatterers.implicit import Implicit

LENGTH = 1e-7
"""Length of a shadow line against the ten digits of a second method, on another representation of the same body."""


def ring(x):
    return f"(sqrt((sqrt((x - {x})**2 + y**2) - 0.7)**2 + z**2) - 0.3)"


TEXTS = {
    "ellipsoid": "x**2/1.44 + y**2/0.64 + z**2/0.64 - 1",
    "torus": "((sqrt(x**2 + y**2) - 1)**2 + z**2)/0.25 - 1",
    "peanut": "(x**2+y**2+z**2+.64)**2-4*.64*x**2-.9**4",
    "genus 2": f"-log(exp(-12*{ring(-0.85)}) + exp(-12*{ring(0.85)}))/12",
    # sympy.cse may take the sums in the exponents for products
    "two balls": "-log(exp(-30*(x**2+y**2+(z-.9)**2-1)) + exp(-30*(x**2+y**2+(z+.9)**2-1)))/30",
    # no point sees it whole before it is sheared upright
    "bent": "((x - 1.2*z**2)**2 + (y - 0.3*sin(2*z))**2)/0.09 + z**2 - 1",
}
GENUS = {"torus": 1, "genus 2": 2}
EXACT = {"ellipsoid": sc.Ellipsoid(1.2, 0.8, 0.8), "torus": sc.Torus()}
STARS = [name for name in TEXTS if name not in GENUS]
LARGE = ("genus 2", "two balls")


every = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LARGE else ()) for name in TEXTS]
)


@cache
def body_of(name):
    return Implicit(TEXTS[name])


@cache
def points_of(name):
    body = body_of(name)
    return body_cloud(body.level, body.gradient, body.bounds, 2000)


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGE)
def test_check_passes_and_counts_handles(name):
    report = cr.check_surface(body_of(name))
    assert report.ok and report.genus == GENUS.get(name, 0), report


@every
def test_only_bodies_with_a_sphere_map_are_star_shaped(name):
    body = body_of(name)
    assert type(body) is Implicit and body.star_shaped == (name in STARS)
    assert hasattr(body.atlas, "sphere_map") == body.star_shaped
    if body.star_shaped:
        assert body.atlas.sphere_map.spine.upright == (name != "bent")
        assert_sphere_map(body.atlas.sphere_map, directions(np.random.default_rng(1), 200))


@every
def test_level_and_derivatives_are_those_of_the_text(name, rng):
    body, functions = body_of(name), body_of(name)._space.functions
    points = points_of(name) + 0.05 * rng.normal(size=points_of(name).shape)
    names = {name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "pi")}
    expected = eval(TEXTS[name], names | dict(zip("xyz", points.T, strict=True)))
    value, gradient, hessian = body.level(points), body.gradient(points), body.hessian(points)
    np.testing.assert_allclose(value, expected, atol=1e-13 * np.max(np.abs(gradient)))
    scale = np.max(np.abs(hessian))
    # the compiled value against that of numpy, its derivatives against differences
    np.testing.assert_allclose(value, np.broadcast_to(functions.value(*points.T)[0], len(points)), atol=1e-13 * scale)
    assert_derivatives(body, points[::7], 1e-5, 1e-8 * scale, 1e-7 * scale)


@pytest.mark.parametrize("shape", [(4, 25), (0,), ()])
def test_any_shape_of_points(shape, rng):
    body, exact = body_of("ellipsoid"), EXACT["ellipsoid"]
    points = rng.normal(size=(*shape, 3))
    np.testing.assert_allclose(body.level(points), exact.level(points), atol=1e-12)
    np.testing.assert_allclose(body.gradient(points), exact.gradient(points), atol=1e-12)
    np.testing.assert_allclose(body.hessian(points), exact.hessian(points), atol=1e-12)


@every
def test_bounds_contain_the_body_closely_and_parameters_are_angles(name):
    points = points_of(name)
    low, high = points.min(0), points.max(0)
    below, above = low - body_of(name).bounds[0], body_of(name).bounds[1] - high
    assert np.all(below > 0) and np.all(above > 0)
    assert np.all(np.maximum(below, above) < 0.1 * (high - low))
    theta, phi = np.moveaxis(body_of(name).parameters(points), -1, 0)
    assert np.all((theta >= 0) & (theta <= np.pi) & (phi > -np.pi) & (phi <= np.pi))


@pytest.mark.parametrize("name, scale", [("ellipsoid", 1e-2), pytest.param("torus", 1e2, marks=pytest.mark.slow)])
def test_scale_changes_nothing_but_lengths(name, scale):
    text = TEXTS[name].replace("x", f"(x/{scale!r})").replace("y", f"(y/{scale!r})").replace("z", f"(z/{scale!r})")
    body = Implicit(text)
    np.testing.assert_allclose(body.bounds, scale * body_of(name).bounds, rtol=0.1)
    report = cr.check_surface(body)
    assert report.ok, report
    # in closed form, and published lengths
    bend = np.sqrt(1 - (2 / 3) ** 2)
    area = 2 * np.pi * 0.64 * (1 + 1.5 / bend * np.arcsin(bend)) if name == "ellipsoid" else 2 * np.pi**2
    assert report.area == pytest.approx(scale**2 * area, rel=1e-2)
    lengths = [6.1340508514] if name == "ellipsoid" else [8.9274357171, 4.6171835804]
    found = [curve.length for curve in cr.shadow_line(body, (1, 1, 1)).curves]
    np.testing.assert_allclose(found, np.multiply(scale, lengths), rtol=1e-8)


@pytest.mark.slow
def test_off_the_origin():
    body = Implicit("(x-3)**2/1.44 + (y+2)**2/0.64 + (z-1.5)**2/0.64 - 1")
    assert cr.check_surface(body).ok and body.star_shaped
    np.testing.assert_allclose(body.bounds, np.array([3, -2, 1.5]) + body_of("ellipsoid").bounds, atol=0.1)
    assert cr.shadow_line(body, (1, 1, 1)).length == pytest.approx(6.1340508514, abs=LENGTH)


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
        "x**16 + y**16 + z**16 - 1",
        "(sqrt(x**2 + y**2) - 1)**2 + z**2 - 0.999**2",
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

    unnamed = SimpleNamespace(value=lambda x: np.ones(x.shape[:-1]), gradient=np.zeros_like)
    assert Implicit(text, speed=unnamed).fingerprint is None
    assert repr(body_of("ellipsoid")) == f"Implicit({text!r}, speed=None)"


@pytest.mark.parametrize("name", ["ellipsoid", "torus"])
def test_rays_are_those_of_the_exact_body(name, rng):
    x, p = random_bundle_points(EXACT[name], 40, rng=rng)
    for found, exact in zip(
        *(cr.trace(b, x, p, [0.5, 2.0], rtol=1e-12) for b in (body_of(name), EXACT[name])), strict=True
    ):
        np.testing.assert_allclose(found, exact, atol=TRACE)


def test_charts_that_cannot_be_are_sought_once(monkeypatch):
    """To find that out takes as long as charts do."""
    from scatterers.charts.monge import MongeAtlas

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


def test_without_sympy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'creeping\[expr\]'") as caught:
        sc.Implicit("x**2 + y**2 + z**2 - 97")
    assert caught.value.name == "sympy"
