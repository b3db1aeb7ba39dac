"""Points moved onto shadow lines by the kernel against the plain Newton steps, on bodies of every kind."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import unit

import creeping as cr
from creeping.geometry.incident import rows_of
from creeping.geometry.surface import size
from creeping.shadow.curves import moved_onto_lines
from creeping.shadow.line import shadow_lines


def plain_step(body, waves, x):
    """Step of least norm for {F = 0, grad F.q = 0} and the tangent, by the pseudo-inverse of its Jacobian."""
    q = waves[..., :3] + waves[..., 3:] * x
    F, g, H = body.level(x), body.gradient(x), body.hessian(x)
    rows = np.stack([g, np.einsum("nij,nj->ni", H, q)], axis=1)
    off = np.stack([F, np.sum(g * q, axis=1) - waves[..., 3] * F], axis=1)
    return -np.einsum("nij,nj->ni", np.linalg.pinv(rows), off), unit(np.cross(rows[:, 0], rows[:, 1]))


def plain_steps(body, waves, x, reach, steps):
    for _ in range(steps):
        step, _ = plain_step(body, waves, x)
        x = x + step * np.minimum(1.0, reach / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-300))
    return x


class Plain:
    """An ellipsoid with numpy methods only."""

    def __init__(self):
        own = sc.Ellipsoid(1.3, 0.7, 0.9)
        self.bounds, self.level, self.gradient, self.hessian = own.bounds, own.level, own.gradient, own.hessian


BODIES = {
    "ellipsoid": lambda: sc.Ellipsoid(1.3, 0.7, 0.9),
    "twisted": sc.TwistedEllipsoid,
    "torus": sc.Torus,
    "expression": lambda: sc.Implicit("x**4 + y**4 + z**4 - 1", bounds=((-1.1,) * 3, (1.1,) * 3)),
    "plain": Plain,
}


def begun(body, n=150):
    """Waves (n, 3) and points next to their lines."""
    rng = np.random.default_rng(2)
    d = cr.fibonacci_directions(24)[5:20]
    lines = shadow_lines(body, d, n // 15)
    there = lines.launch.there
    waves = np.repeat(d, n // 15, axis=0)[there.reshape(-1)] + 0.02 * rng.normal(size=(there.sum(), 3))
    return waves / np.linalg.norm(waves, axis=1, keepdims=True), lines.launch.points[there]


@pytest.mark.parametrize("name", BODIES)
def test_points_are_those_of_the_plain_steps(name):
    body = BODIES[name]()
    waves, points = begun(body)
    found = moved_onto_lines(body, waves, points, reach=0.2 * size(body), steps=8)
    plain = plain_steps(body, rows_of(waves), points, 0.2 * size(body), 8)
    good = found.left < 1e-12
    assert good.mean() > 0.9
    np.testing.assert_allclose(found.points[good], plain[good], atol=1e-12)
    np.testing.assert_allclose(found.tangents[good], plain_step(body, rows_of(waves), plain)[1][good], atol=1e-9)


def test_point_sources_have_lines_too():
    body = sc.Ellipsoid(1.3, 0.7, 0.9)
    source = cr.PointSource((0.4, -0.5, 3.0))
    wave = source.row(body)
    points = cr.shadow_line(body, source=source).launch_points(30).points[0]
    found = moved_onto_lines(body, np.tile(wave, (30, 1)), points + 0.01, reach=0.1, steps=6).points
    plain = plain_steps(body, rows_of(wave)[None], points + 0.01, 0.1, 6)
    np.testing.assert_allclose(found, plain, atol=1e-13)
    away = found - np.array(source.position)
    assert np.abs(np.sum(body.gradient(found) * away, axis=1)).max() < 1e-12


def test_points_do_not_depend_on_their_company():
    body = sc.TwistedEllipsoid()
    waves, points = begun(body)
    whole = moved_onto_lines(body, waves, points, reach=0.1, steps=5)
    for some in (slice(0, 1), slice(70, 71), slice(3, 140)):
        alone = moved_onto_lines(body, waves[some], points[some], reach=0.1, steps=5)
        for one, other in zip(alone, whole, strict=True):
            assert np.array_equal(one, other[some])


def test_steps_are_no_longer_than_asked_for_and_what_is_left_is_told():
    body = sc.Ellipsoid(1.3, 0.7, 0.9)
    waves, points = begun(body)
    far = points + 0.3
    one = moved_onto_lines(body, waves, far, reach=0.01, steps=1)
    np.testing.assert_array_less(np.linalg.norm(one.points - far, axis=1), 0.01 + 1e-12)
    step, _ = plain_step(body, rows_of(waves), one.points)
    np.testing.assert_allclose(one.left, np.linalg.norm(step, axis=1), rtol=1e-9)
    # the middle of an ellipsoid has no gradient, and no step leads out of it
    assert not np.isfinite(moved_onto_lines(body, waves[:1], np.zeros((1, 3)), reach=0.1, steps=2).left[0])
