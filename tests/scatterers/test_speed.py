"""Speeds: expressions are differentiated and execute nothing; objects are accepted as they are."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc

# what else is refused is tested for bodies: the parser is the same
HOSTILE = [
    "__import__('os').system('true')",
    "x.__class__",
    "eval(x)",
    "a + 1",
    "",
    "sqrt(-1)",
    "9**9**9",
    "x**y",
    "1e400",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_expression_is_refused(text):
    with pytest.raises(ValueError):
        sc.Sphere(speed=text)


def test_expression_equals_its_formula(rng):
    speed = sc.ExpressionSpeed("2 + sin(x*y)/3 + exp(-z**2) + sqrt(1 + x**2)")
    points = rng.normal(size=(20, 3))
    x, y, z = points.T
    np.testing.assert_allclose(speed.value(points), 2 + np.sin(x * y) / 3 + np.exp(-(z**2)) + np.sqrt(1 + x**2))
    h = 1e-5
    for k, e in enumerate(h * np.eye(3)):
        slope = (speed.value(points + e) - speed.value(points - e)) / (2 * h)
        np.testing.assert_allclose(speed.gradient(points)[:, k], slope, atol=1e-8)
        bend = (speed.gradient(points + e) - speed.gradient(points - e)) / (2 * h)
        np.testing.assert_allclose(speed.hessian(points)[:, :, k], bend, atol=1e-8)


class OnePlusX:
    """A user's speed: value and gradient only, nothing compiled."""

    def value(self, points):
        return 1 + points[..., 0]

    def gradient(self, points):
        return np.broadcast_to([1.0, 0.0, 0.0], points.shape)


def test_object_speed_flows_like_the_expression(rng):
    by_object, by_text = sc.Sphere(speed=OnePlusX()), sc.Sphere(speed="1 + x")
    points = rng.normal(size=(5, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    directions = np.cross(points, [0.3, 0.5, 0.8])
    for a, b in zip(
        cr.trace(by_object, points, directions, 1.0), cr.trace(by_text, points, directions, 1.0), strict=True
    ):
        np.testing.assert_allclose(a, b, atol=1e-9)


def test_speed_of_another_kind_is_refused():
    with pytest.raises(TypeError, match="neither an expression"):
        sc.Sphere(speed=3)


def test_negative_speed_is_found():
    with pytest.raises(cr.CreepingError, match="negative speed"):
        cr.build_phase_map(sc.Sphere(speed="x"), horizon=0.5, grid=(12, 16), cache=False)
