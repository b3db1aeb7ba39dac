"""Bodies of revolution from tables and from segments: splines against exact bodies, corners, poles, what is refused."""

import numpy as np
import pytest
from numba import njit
from tolerances import ORDER

import creeping as cr
import scatterers as sc
from creeping.geometry.surface import CreasedSurface
from scatterers.exact.profile import Arc, Line

EXACT = sc.Ellipsoid(1.0, 1.0, 2.0)


@njit
def call(function, *arguments):
    function(*arguments)


def spheroid(n):
    t = np.linspace(-np.pi / 2, np.pi / 2, n)
    return sc.Revolution(np.stack([2 * np.sin(t), np.cos(t)], axis=-1))


def on_spheroid(rng, n):
    s = rng.normal(size=(n, 3))
    points = s / np.linalg.norm(s, axis=-1, keepdims=True) * (1, 1, 2)
    # the poles too, and a place next to one
    return np.concatenate([points, [[0, 0, 2.0], [0, 0, -2.0], [1e-9, 0, 2.0]]])


def shape_operator(body, points):
    gradient, hessian = body.gradient(points), body.hessian(points)
    slope = np.linalg.norm(gradient, axis=-1)[:, None, None]
    n = gradient[:, :, None] / slope
    flat = np.eye(3) - n * n.swapaxes(1, 2)
    return flat @ hessian @ flat / slope


def test_a_splined_spheroid_converges_to_the_exact_one(rng):
    points, counts, errors = on_spheroid(rng, 500), np.array([21, 41, 81]), []
    for n in counts:
        body = spheroid(n)
        assert body.creases == [] and isinstance(body, CreasedSurface)
        errors.append(
            (
                np.max(np.abs(body.level(points))),
                np.max(np.abs(shape_operator(body, points) - shape_operator(EXACT, points))),
            )
        )
    slopes = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # position as h^6, curvature as h^4, or better
    assert slopes[0] > 6 - ORDER and slopes[1] > 4 - ORDER
    assert errors[-1][0] < 1e-8 and errors[-1][1] < 2e-4


def test_splined_derivatives_are_those_of_differences_off_the_body_too(rng):
    body, step = spheroid(41), 1e-5
    points = on_spheroid(rng, 300) + 0.05 * rng.normal(size=(303, 3))
    slopes = [(body.level(points + h) - body.level(points - h)) / (2 * step) for h in step * np.eye(3)]
    bends = [(body.gradient(points + h) - body.gradient(points - h)) / (2 * step) for h in step * np.eye(3)]
    np.testing.assert_allclose(body.gradient(points), np.stack(slopes, axis=-1), atol=1e-9)
    np.testing.assert_allclose(body.hessian(points), np.stack(bends, axis=-1), atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(body.gradient(points), axis=-1), 1, atol=1e-13)


def test_a_splined_body_has_charts_and_rays():
    body = spheroid(81)
    report = cr.check_surface(body)
    assert report.ok, report
    x, p = np.array([[1.0, 0, 0]]), np.array([[0, 0.6, 0.8]])
    found, expected = (cr.trace(b, x, p, 5.0, rtol=1e-12)[0] for b in (body, EXACT))
    np.testing.assert_allclose(found, expected, atol=1e-8)


BULLET = [(0, 1), (2, 1), (2, 1), (3, 0.75), (3.6, 0.4), (4, 0.0)]
DUMBBELL = [
    Line((-2, 0), (-2, 1)),
    Line((-2, 1), (-1, 1)),
    Line((-1, 1), (-0.5, 0.4)),
    Arc((-0.5, 0.4), (0.5, 0.4), (0, 0.4), (0.5, 0.2), convex=False),
    Line((0.5, 0.4), (1, 1)),
    Arc((1, 1), (2, 0), (1, 0)),
]
BODIES = {
    "bullet": (lambda: sc.Revolution(BULLET), ["tip", "edge", "edge"]),
    "turned round": (lambda: sc.Revolution(BULLET[::-1]), ["tip", "edge", "edge"]),
    "dumbbell": (lambda: sc.Revolution(DUMBBELL), ["edge"] * 5),
    "egg": (lambda: sc.Revolution(np.stack([np.sin(T) + 0.2 * np.cos(T), np.cos(T)], axis=-1)), ["tip", "tip"]),
    "two lines in one": (lambda: sc.Revolution([(0, 1), (1, 1), (1, 1), (2, 1)]), ["edge", "seam", "edge"]),
    "blunt": (lambda: sc.Revolution(np.stack([np.sin(T), np.cos(T)], axis=-1), corners=[0, 30]), ["tip", "tip"]),
}
T = np.linspace(-np.pi / 2, np.pi / 2, 31)
every = pytest.mark.parametrize("name", BODIES)


@every
def test_creases(name):
    body = BODIES[name][0]()
    assert [crease.kind for crease in body.creases] == BODIES[name][1]
    for crease in body.creases:
        for number in crease.pieces:
            np.testing.assert_allclose(body.pieces[number].level(crease.points), 0, atol=1e-14)


@every
def test_tiles_close_and_lie_on_their_pieces(name):
    body = BODIES[name][0]()
    corners, normals, pieces = body.tiles(0.1)
    for number, piece in enumerate(body.pieces):
        np.testing.assert_allclose(piece.level(corners[pieces == number].reshape(-1, 3)), 0, atol=1e-13)
    np.testing.assert_array_equal(body.piece(corners.mean(axis=1)), pieces)
    _, number = np.unique(corners.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    ways = {(a, b) for row in number.reshape(-1, 3) for a, b in zip(row, np.roll(row, -1), strict=True)}
    assert len(ways) == 3 * len(corners) and all((b, a) in ways for a, b in ways)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(outward[:, None] * normals, axis=-1) > 0)


@every
def test_sign_tells_inside_from_outside(name, rng):
    from matplotlib.path import Path

    body = BODIES[name][0]()
    points = rng.uniform(1.4 * body.bounds[0] - 0.2, 1.4 * body.bounds[1], (4000, 3))
    outline = np.concatenate([segment.point(np.linspace(0, 1, 2001)) for segment in body._profile])
    meridian = np.stack([points[:, 2], np.hypot(points[:, 0], points[:, 1])], axis=-1)
    inside = Path(np.concatenate([outline, outline[::-1] * [1, -1]])).contains_points(meridian)
    clear = np.abs(body.level(points)) > 1e-5
    np.testing.assert_array_equal(body.level(points)[clear] < 0, inside[clear])


@every
def test_compiled_functions_equal_their_source(name, rng):
    body = BODIES[name][0]()
    points = np.ascontiguousarray(rng.uniform(body.bounds[0], body.bounds[1], (100, 3)).T)
    for compiled in (body.compiled, body._compiled_numbers, *(piece.compiled for piece in body.pieces)):
        fast, plain = ([np.zeros(100), np.zeros((3, 100)), np.zeros((6, 100))] for _ in range(2))
        call(compiled.function, points, *fast, compiled.parameters)
        compiled.source(points, *plain, compiled.parameters)
        for a, b in zip(fast, plain, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


@every
def test_pieces_go_on_smoothly_beyond_their_creases(name, rng):
    body, step = BODIES[name][0](), 1e-6
    for crease in body.creases:
        # about the axis the curvature of a tip has no bound
        points = crease.points[::9] + 0.02 * rng.normal(size=(len(crease.points[::9]), 3))
        for number in set(crease.pieces) if crease.kind != "tip" else ():
            piece = body.pieces[number]
            slopes = [(piece.level(points + h) - piece.level(points - h)) / (2 * step) for h in step * np.eye(3)]
            bends = [(piece.gradient(points + h) - piece.gradient(points - h)) / (2 * step) for h in step * np.eye(3)]
            np.testing.assert_allclose(piece.gradient(points), np.stack(slopes, axis=-1), atol=1e-8)
            np.testing.assert_allclose(piece.hessian(points), np.stack(bends, axis=-1), atol=1e-6)


def test_direction_of_the_profile_does_not_matter(rng):
    points = rng.uniform(-1, 4, (200, 3))
    one, other = (BODIES[name][0]() for name in ("bullet", "turned round"))
    np.testing.assert_allclose(one.level(points), other.level(points), atol=1e-12)


def test_bounds_hold_bulges_between_points():
    z = np.linspace(-1, 1, 40)
    body = sc.Revolution(np.stack([z, 2 - z**2], axis=-1))
    # the widest place lies between two points
    np.testing.assert_allclose(body.bounds, [[-2, -2, -1], [2, 2, 1]], atol=1e-6)


def test_fingerprints():
    prints = [
        sc.Revolution(BULLET).fingerprint,
        sc.Revolution(BULLET[1:]).fingerprint,
        sc.Revolution(BULLET, speed="2 + x").fingerprint,
    ]
    assert len(set(prints)) == 3 and sc.Revolution(BULLET).fingerprint == prints[0]


@pytest.mark.parametrize(
    "profile, corners, what",
    [
        ("text", (), "neither a table of points"),
        (3, (), "3 is neither|shape"),
        (None, (), "shape|neither"),
        ([(0, 0), (1, 1), (2, 0)], 1, "corners 1 are no numbers of points"),
        ([(0, 0), (1, 1), (2, 0)], [0.5], "give whole numbers"),
        ([(0, 1, 2)], (), r"shape \(1, 3\); give points \(n, 2\)"),
        ([(0, 1)], (), "two at least"),
        ([(0, 0), (np.nan, 1), (2, 0)], (), "1 of 3 points of the profile are not finite"),
        ([(0, 0), (1, -1), (2, 0)], (), "the radius of 1 of 3 points of the profile is negative"),
        ([(0, 0), (1, 1), (2, 0)], [3], r"corners \[3\] are no points"),
        (DUMBBELL, [1], "segments meet in corners of themselves"),
        ([(0, 1), (1, 1), (1, 1), (1, 0.5), (1, 0.5), (0.2, 1.5), (0.2, 1.5), (2, 0)], (), "crosses itself near"),
        ([(0, 1), (1, 0), (1, 0), (2, 1)], (), "touches the axis between"),
        ([(0, 0), (2, 1), (0.5, 1.2), (2.5, 1.3), (3, 0)], (), "turns by .* degrees between two of its 5 points"),
        ([], (), "a profile without|shape"),
    ],
)
def test_what_is_no_profile(profile, corners, what):
    with pytest.raises(ValueError, match=what):
        sc.Revolution(profile, corners=corners)
