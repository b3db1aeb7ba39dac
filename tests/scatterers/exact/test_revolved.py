"""Bodies of revolution, named or from tables and segments, and the almond, against closed forms; what is refused."""

import numpy as np
import pytest
from body_checks import assert_compiled_is_its_source, assert_derivatives, shape_operator, unit
from matplotlib.path import Path
from tolerances import ORDER

import creeping as cr
import scatterers as sc
from creeping.geometry.covering import patches_of
from creeping.geometry.surface import PiecewiseSurface, project
from scatterers.exact.profile import Arc, Line, SplineSegment, upward

ALPHA = np.radians(25.0)
BULLET = [(0, 1), (2, 1), (2, 1), (3, 0.75), (3.6, 0.4), (4, 0.0)]
DUMBBELL = [
    Line((-2, 0), (-2, 1)),
    Line((-2, 1), (-1, 1)),
    Line((-1, 1), (-0.5, 0.4)),
    Arc((-0.5, 0.4), (0.5, 0.4), (0, 0.4), (0.5, 0.2), convex=False),
    Line((0.5, 0.4), (1, 1)),
    Arc((1, 1), (2, 0), (1, 0)),
]
T = np.linspace(-np.pi / 2, np.pi / 2, 31)
NAMED = {
    "cylinder": sc.Cylinder(0.8, 3.0),
    "capsule": sc.Capsule(0.8, 5.0),
    "cone": sc.Cone(1.0, 2.0),
    "frustum": sc.Cone(1.0, 2.0, top=0.4),
    "cone-sphere": sc.ConeSphere(1.0, 1 + 1 / np.sin(ALPHA)),
    "ogive": sc.Ogive(1.0, 5.0),
    "double ogive": sc.DoubleOgive(1.0, 2.5, 5.0, lower_angle=np.radians(46.4)),
    "almond": sc.Almond(1.0),
}
BODIES = NAMED | {
    "bullet": sc.Revolution(BULLET),
    "dumbbell": sc.Revolution(DUMBBELL),
    "egg": sc.Revolution(np.stack([np.sin(T) + 0.2 * np.cos(T), np.cos(T)], axis=-1)),
    "two lines in one": sc.Revolution([(0, 1), (1, 1), (1, 1), (2, 1)]),
    "blunt": sc.Revolution(np.stack([np.sin(T), np.cos(T)], axis=-1), corners=[0, 30]),
}
KINDS = {
    "cylinder": ["edge", "edge"],
    "capsule": ["joint", "joint"],
    "cone": ["tip", "edge"],
    "frustum": ["edge", "edge"],
    "cone-sphere": ["tip", "joint"],
    "ogive": ["tip", "tip"],
    "double ogive": ["tip", "tip", "joint"],
    "almond": ["tip", "joint"],
    "bullet": ["tip", "edge", "edge"],
    "dumbbell": ["edge"] * 5,
    "egg": ["tip", "tip"],
    "two lines in one": ["edge", "seam", "edge"],
    "blunt": ["tip", "tip"],
}
every = pytest.mark.parametrize("name", BODIES)


def published_ogive(z, radius, length, alpha):
    return radius * (np.sqrt(1 - (z / length * np.sin(alpha)) ** 2) - np.cos(alpha)) / (1 - np.cos(alpha))


def exact(name):
    """Area and volume."""
    sine, cosine = np.sin(ALPHA), np.cos(ALPHA)
    return {
        "capsule": (2 * np.pi * 0.8 * 5.0, np.pi * 0.8**2 * (5.0 - 1.6) + 4 / 3 * np.pi * 0.8**3),
        "frustum": (np.pi * (1 + 0.16 + 1.4 * np.hypot(2.0, 0.6)), 2 * np.pi / 3 * (1 + 0.4 + 0.16)),
        # a cap of the sphere up to z = sin alpha, and a cone with the slant cos alpha/sin alpha
        "cone-sphere": (
            2 * np.pi * (1 + sine) + np.pi * cosine**2 / sine,
            np.pi * (1 + sine) ** 2 * (2 - sine) / 3 + np.pi * cosine**2 * (1 / sine - sine) / 3,
        ),
    }[name]


def area_and_volume(corners):
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.linalg.norm(normal, axis=1).sum() / 2, np.sum(corners[:, 0] * normal) / 6


@every
def test_is_a_body_of_pieces(name):
    body = BODIES[name]
    assert isinstance(body, PiecewiseSurface)
    assert [crease.kind for crease in body.creases] == KINDS[name]
    for crease in body.creases:
        for number in crease.pieces:
            np.testing.assert_allclose(body.pieces[number].level(crease.points), 0, atol=1e-14)
        if crease.kind != "tip":
            assert crease.closed
            a, b = (unit(body.pieces[k].gradient(crease.points)) for k in crease.pieces)
            np.testing.assert_allclose(np.linalg.norm(a - b, axis=-1), 2 * np.sin(crease.angle / 2), atol=1e-12)


@pytest.mark.parametrize("name", ["capsule", "frustum", "cone-sphere"])
def test_area_and_volume_of_tiles_converge_to_closed_forms(name):
    edges = 0.4 / 2.0 ** np.arange(4)
    errors = [np.abs(np.divide(area_and_volume(BODIES[name].tiles(edge)[0]), exact(name)) - 1) for edge in edges]
    np.testing.assert_allclose(np.polyfit(np.log(edges), np.log(errors), 1)[0], 2, atol=ORDER)
    assert np.max(errors[-1]) < 2e-3


QUICK = ("cylinder", "cone", "almond", "dumbbell", "two lines in one")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in BODIES]
)
def test_tiles_lie_on_their_pieces_and_close(name):
    body, edge = BODIES[name], 0.07
    corners, normals, pieces = body.tiles(edge)
    assert np.max(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)) < 1.25 * edge
    tips = [crease.points[0] for crease in body.creases if crease.kind == "tip"]
    for number, piece in enumerate(body.pieces):
        x, n = corners[pieces == number].reshape(-1, 3), normals[pieces == number].reshape(-1, 3)
        np.testing.assert_allclose(piece.level(x), 0, atol=1e-13)
        apart = np.all([np.linalg.norm(x - tip, axis=-1) > 0 for tip in [*tips, [9, 9, 9]]], axis=0)
        np.testing.assert_allclose(n[apart], unit(piece.gradient(x[apart])), atol=1e-12)
        assert np.all((x >= piece.bounds[0] - 1e-14) & (x <= piece.bounds[1] + 1e-14))
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(outward[:, None] * normals, axis=-1) > 0)
    # every side is that of one other triangle, the other way round
    _, number = np.unique(corners.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    ways = {(a, b) for row in number.reshape(-1, 3) for a, b in zip(row, np.roll(row, -1), strict=True)}
    assert len(ways) == 3 * len(corners) and all((b, a) in ways for a, b in ways)
    np.testing.assert_array_equal(body.piece(corners.mean(axis=1)), pieces)


@every
def test_sign_tells_inside_from_outside_everywhere(name, rng):
    body = BODIES[name]
    points = rng.uniform(1.4 * body.bounds[0] - 0.2, 1.4 * body.bounds[1], (4000, 3))
    # one quarter of them close to the body
    points[:1000] = project(body, points[:1000]) + rng.uniform(-0.03, 0.03, (1000, 3))
    outline = np.concatenate([segment.point(np.linspace(0, 1, 2001)) for segment in body._profile])
    across, aside, along = np.moveaxis(points[:, body._axes], -1, 0)
    meridian = np.stack([along, np.hypot(across, body._stretch * aside)], axis=-1)
    inside = Path(np.concatenate([outline, outline[::-1] * [1, -1]])).contains_points(meridian)
    level = body.level(points)
    clear = np.abs(level) > 1e-5
    np.testing.assert_array_equal(level[clear] < 0, inside[clear])
    near = points[:1000]
    values = np.array([piece.level(near) for piece in body.pieces])
    np.testing.assert_array_equal(level[:1000], values[body.piece(near), np.arange(1000)])


@every
def test_derivatives_are_those_of_differences_and_compiled_functions_their_source(name, rng):
    body, step = BODIES[name], 1e-5
    size = np.max(body.bounds)
    corners, _, pieces = body.tiles(0.3 * size)
    for number, piece in enumerate(body.pieces):
        points = corners[pieces == number].reshape(-1, 3)
        points = points + 0.01 * size * rng.normal(size=points.shape)
        # about the axis the curvature of a cone has no bound
        points = points[np.linalg.norm(np.delete(points, list(body._axes)[2], axis=1), axis=1) > 0.04 * size]
        scale = np.max(np.abs(piece.gradient(points)))
        bend = 2e-5 * scale / size if name in NAMED else 1e-6
        assert_derivatives(piece, points, step * size, 1e-8 * scale, bend)
    points = rng.uniform(*body.bounds, (200, 3))
    for compiled in (body.compiled, *(piece.compiled for piece in body.pieces)):
        assert_compiled_is_its_source(compiled, points, 1e-12 if name in NAMED else 1e-9)


def test_derivatives_on_the_axis_are_exact():
    body = BODIES["capsule"]
    top = np.array([[0.0, 0.0, 2.5], [1e-200, 0, 2.5], [0, 0, -2.5]])
    np.testing.assert_allclose(body.level(top), 0, atol=1e-16)
    np.testing.assert_allclose(body.gradient(top), [[0, 0, 1], [0, 0, 1], [0, 0, -1]], atol=1e-199)
    np.testing.assert_allclose(body.hessian(top), np.broadcast_to(np.eye(3) / 0.8, (3, 3, 3)), atol=1e-15)


def test_ogives_are_those_published():
    inch, z, alpha = 0.0254, np.linspace(-5, 5, 31)[1:-1], np.radians(22.62)
    ogive = sc.Ogive(inch, 10 * inch)
    r = published_ogive(z, 1.0, 5.0, alpha)
    # the angle is printed with two digits
    np.testing.assert_allclose(ogive.level(inch * np.stack([r, 0 * r, z], axis=-1)) / inch, 0, atol=1e-6)
    assert np.degrees(ogive.half_angle) == pytest.approx(22.62, abs=5e-3)
    double = sc.DoubleOgive(inch, 2.5 * inch, 5 * inch, lower_angle=np.radians(46.4), upper_angle=alpha)
    z = np.linspace(-2.5, 5, 31)[1:-1]
    halves = (published_ogive(z[z < 0], 1, 2.5, np.radians(46.4)), published_ogive(z[z >= 0], 1, 5.0, alpha))
    r = np.concatenate(halves)
    np.testing.assert_allclose(double.level(inch * np.stack([0 * r, r, z], axis=-1)), 0, atol=1e-16)


def test_cone_sphere_is_that_published():
    # inches, z from the joint, the tip below: a cone of 7 degrees over 23.821, a ball of radius 2.947 about 0.359
    alpha = np.radians(7.0)
    body = sc.ConeSphere(2.947, 2.947 * (1 + 1 / np.sin(alpha)))
    z = np.concatenate([np.linspace(-23.8, 0, 30), np.linspace(0.01, 3.3, 30)])
    with np.errstate(invalid="ignore"):
        r = np.where(z < 0, np.tan(alpha) * (z + 23.821), 2.947 * np.sqrt(1 - ((z - 0.359) / 2.947) ** 2))
    points = np.stack([r, 0 * r, 0.359 - z], axis=-1)
    np.testing.assert_allclose(body.level(points), 0, atol=1e-3)
    np.testing.assert_array_equal(body.piece(points[1:-1]), z[1:-1] < 0)


def test_almond_is_that_published():
    body = sc.Almond(9.936)
    t, psi = np.linspace(-0.416, 0.583, 60), np.linspace(-3, 3, 60)
    with np.errstate(invalid="ignore"):
        back, front = np.sqrt(1 - (t / 0.416667) ** 2), np.sqrt(1 - (t / 2.08335) ** 2) - 0.96
    y = np.where(t < 0, 0.193333 * back, 4.83345 * front) * np.cos(psi)
    z = np.where(t < 0, 0.064444 * back, 1.61115 * front) * np.sin(psi)
    points = 9.936 * np.stack([t, y, z], axis=-1)
    assert np.max(np.linalg.norm(project(body, points) - points, axis=-1)) < 7e-6 * 9.936
    np.testing.assert_array_equal(body.piece(points), t >= 0)
    np.testing.assert_allclose(body.bounds[:, 0], 9.936 * np.array([-0.416667, 0.583333]), atol=1e-5)
    # the curvature goes on across its rim
    rim = next(crease for crease in body.creases if crease.kind == "joint").points
    np.testing.assert_allclose(*(shape_operator(piece, rim) for piece in body.pieces), atol=1e-12)


def test_only_bodies_without_edges_and_tips_have_charts():
    report = cr.check_surface(BODIES["capsule"])
    assert report.ok, report
    for name in ("cylinder", "almond", "bullet"):
        with pytest.raises(ValueError, match="edges and tips, first Crease"):
            _ = BODIES[name].atlas.charts


@pytest.mark.slow
def test_a_splined_spheroid_converges_to_the_exact_one(rng):
    spheroid = sc.Ellipsoid(1.0, 1.0, 2.0)
    # the poles too, and a place next to one
    points = unit(rng.normal(size=(500, 3))) * (1, 1, 2)
    points = np.concatenate([points, [[0, 0, 2.0], [0, 0, -2.0], [1e-9, 0, 2.0]]])
    wanted, counts, errors = shape_operator(spheroid, points), np.array([21, 41, 81]), []
    for n in counts:
        t = np.linspace(-np.pi / 2, np.pi / 2, n)
        body = sc.Revolution(np.stack([2 * np.sin(t), np.cos(t)], axis=-1))
        assert body.creases == [] and isinstance(body, PiecewiseSurface)
        errors.append([np.max(np.abs(v)) for v in (body.level(points), shape_operator(body, points) - wanted)])
    slopes = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # position as h^6, curvature as h^4, or better
    assert slopes[0] > 6 - ORDER and slopes[1] > 4 - ORDER
    assert errors[-1][0] < 1e-8 and errors[-1][1] < 2e-4
    np.testing.assert_allclose(np.linalg.norm(body.gradient(1.03 * points), axis=-1), 1, atol=1e-13)
    # it has charts and rays
    report = cr.check_surface(body)
    assert report.ok, report
    x, p = np.array([[1.0, 0, 0]]), np.array([[0, 0.6, 0.8]])
    found, expected = (cr.trace(b, x, p, 5.0, rtol=1e-12)[0] for b in (body, spheroid))
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_direction_of_the_profile_does_not_matter_and_bounds_hold_bulges_between_points(rng):
    points = rng.uniform(-1, 4, (200, 3))
    turned = sc.Revolution(BULLET[::-1])
    assert [crease.kind for crease in turned.creases] == KINDS["bullet"]
    np.testing.assert_allclose(turned.level(points), BODIES["bullet"].level(points), atol=1e-12)
    z = np.linspace(-1, 1, 40)
    # the widest place lies between two points
    bulge = sc.Revolution(np.stack([z, 2 - z**2], axis=-1))
    np.testing.assert_allclose(bulge.bounds, [[-2, -2, -1], [2, 2, 1]], atol=1e-6)


def test_three_points_make_a_smooth_piece():
    """A straight line between them would be a kink that is no crease: there the equation had no mesh."""
    segment = SplineSegment(np.array([(0.0, 1.0), (1.0, 0.75), (2.0, 0.0)]), (False, False))
    u = np.linspace(0, 1, 201)
    heading = np.arctan2(*segment.tangent(u).T[::-1])
    assert np.max(np.abs(np.diff(heading))) < 0.01
    np.testing.assert_allclose(segment.point(segment.turns), [(0, 1), (2, 0)], atol=1e-14)
    body = sc.Revolution([(0, 1), (2, 1), (2, 1), (3, 0.75), (4, 0.0)])
    assert patches_of(body).off.max() < 1e-4


def test_fingerprints_tell_bodies_apart():
    bodies = [*BODIES.values(), sc.Cylinder(0.8, 3.1), sc.Ogive(1.0, 5.0, speed="2 + x"), sc.DoubleOgive(1.0, 2.5, 5.0)]
    bodies += [sc.Revolution(BULLET[1:]), sc.Revolution(BULLET, speed="2 + x")]
    assert len({body.fingerprint for body in bodies}) == len(bodies)
    assert sc.Cone(1, 2).fingerprint == sc.Cone(1.0, 2.0, top=0.0).fingerprint
    assert sc.Revolution(BULLET).fingerprint == BODIES["bullet"].fingerprint


@pytest.mark.parametrize(
    "make, what",
    [
        (lambda: sc.Cylinder(0.0, 1.0), "radius = 0.0 is not positive"),
        (lambda: sc.Cylinder(1.0, np.inf), "length = inf"),
        (lambda: sc.Capsule(1.0, 2.0), "not more than twice the radius 1.0; it is that of the whole"),
        (lambda: sc.Cone(1.0, 2.0, top=-1.0), "top = -1.0 is negative"),
        (lambda: sc.DoubleOgive(1.0, 0.5, 5.0), "lower = 0.5 is not more than the radius"),
        (lambda: sc.DoubleOgive(1.0, 2.5, 5.0, upper_angle=46.4), "upper_angle = 46.4 .* angles are radians"),
        (lambda: sc.Almond(-1.0), "length = -1.0 is not positive"),
        (lambda: sc.Cylinder(1.0, 1.0).tiles(1e-9), "more than 1e.07; give more"),
        (lambda: upward([Line((0, 0), (0, 1))]), "begin and end at radius 0"),
        (lambda: upward([Line((0, 0), (0, 1)), Line((1, 1), (1, 0))]), "the next begins at"),
        (lambda: upward([Line((0, 0), (1, 1)), Line((1, 1), (1, 0)), Line((1, 0), (2, 0))]), "touches the axis"),
        (lambda: Line((0, 0), (0, -1)), "radius = -1 of a profile is negative"),
        (lambda: Arc((0, 1), (1, 0.1), (0, 0)), "end .* is not on the arc"),
        (lambda: sc.Revolution("text"), "neither a table of points"),
        (lambda: sc.Revolution([(0, 0), (1, 1), (2, 0)], corners=1), "corners 1 are no numbers of points"),
        (lambda: sc.Revolution([(0, 0), (1, 1), (2, 0)], corners=[0.5]), "give whole numbers"),
        (lambda: sc.Revolution([(0, 1)]), "two at least"),
        (lambda: sc.Revolution([(0, 0), (np.nan, 1), (2, 0)]), "1 of 3 points of the profile are not finite"),
        (lambda: sc.Revolution([(0, 0), (1, -1), (2, 0)]), "the radius of 1 of 3 points of the profile is negative"),
        (lambda: sc.Revolution([(0, 0), (1, 1), (2, 0)], corners=[3]), r"corners \[3\] are no points"),
        (lambda: sc.Revolution(DUMBBELL, corners=[1]), "segments meet in corners of themselves"),
        (
            lambda: sc.Revolution([(0, 1), (1, 1), (1, 1), (1, 0.5), (1, 0.5), (0.2, 1.5), (0.2, 1.5), (2, 0)]),
            "crosses itself near",
        ),
        (lambda: sc.Revolution([(0, 1), (1, 0), (1, 0), (2, 1)]), "touches the axis between"),
        (lambda: sc.Revolution([(0, 0), (2, 1), (0.5, 1.2), (2.5, 1.3), (3, 0)]), "turns by .* degrees between two of"),
    ],
)
def test_bad_parameters_are_named(make, what):
    with pytest.raises(ValueError, match=what):
        make()
