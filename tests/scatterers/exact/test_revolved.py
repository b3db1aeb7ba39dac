"""Named bodies of revolution and the almond: areas, volumes, curvatures and geodesics against closed forms."""

import numpy as np
import pytest
from numba import njit
from scipy.integrate import quad
from scipy.spatial import cKDTree
from tolerances import ORDER

import creeping as cr
import scatterers as sc
from creeping.geometry.surface import CreasedSurface, project
from scatterers.exact.profile import Arc, Line, upward

ALPHA = np.radians(25.0)
BODIES = {
    "cylinder": sc.Cylinder(0.8, 3.0),
    "capsule": sc.Capsule(0.8, 5.0),
    "cone": sc.Cone(1.0, 2.0),
    "frustum": sc.Cone(1.0, 2.0, top=0.4),
    "cone-sphere": sc.ConeSphere(1.0, 1 + 1 / np.sin(ALPHA)),
    "ogive": sc.Ogive(1.0, 5.0),
    "double ogive": sc.DoubleOgive(1.0, 2.5, 5.0, lower_angle=np.radians(46.4)),
    "almond": sc.Almond(1.0),
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
}
every = pytest.mark.parametrize("name", BODIES)
GEODESIC = 1e-9
"""Points traced at rtol 1e-12 over a few units of length, against closed forms."""


@njit
def call(function, *arguments):
    function(*arguments)


def published_ogive(z, radius, length, alpha):
    return radius * (np.sqrt(1 - (z / length * np.sin(alpha)) ** 2) - np.cos(alpha)) / (1 - np.cos(alpha))


def revolved(profile, low, high):
    """Area and volume of r = profile(z), by quadrature in t of z = low + (high - low) sin^2 t."""

    def z_of(t):
        return low + (high - low) * np.sin(t) ** 2

    def slope(t):
        step = 1e-6
        return (profile(z_of(t + step)) - profile(z_of(t - step))) / (2 * step)

    def dz(t):
        return (high - low) * np.sin(2 * t)

    inner = (1e-5, np.pi / 2 - 1e-5)
    area = quad(lambda t: 2 * np.pi * profile(z_of(t)) * np.hypot(dz(t), slope(t)), *inner, limit=200)[0]
    return area, quad(lambda t: np.pi * profile(z_of(t)) ** 2 * dz(t), *inner, limit=200)[0]


def exact(name):
    """Area and volume."""
    sine, cosine = np.sin(ALPHA), np.cos(ALPHA)
    if name in ("ogive", "double ogive"):
        # of circles tan(alpha/2) is radius over length
        alpha = 2 * np.arctan(1 / 2.5)
        if name == "ogive":
            parts = [(2.5, alpha), (2.5, alpha)]
        else:
            parts = [(2.5, np.radians(46.4)), (5.0, 2 * np.arctan(1 / 5))]
        return np.sum([revolved(lambda z, p=p: published_ogive(z, 1.0, *p), 0.0, p[0]) for p in parts], axis=0)
    return {
        "cylinder": (2 * np.pi * 0.8 * (3.0 + 0.8), np.pi * 0.8**2 * 3.0),
        "capsule": (2 * np.pi * 0.8 * 5.0, np.pi * 0.8**2 * (5.0 - 1.6) + 4 / 3 * np.pi * 0.8**3),
        "cone": (np.pi * (1 + np.sqrt(5.0)), 2 * np.pi / 3),
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
    assert isinstance(body, CreasedSurface)
    assert [crease.kind for crease in body.creases] == KINDS[name]
    for crease in body.creases:
        for number in crease.pieces:
            np.testing.assert_allclose(body.pieces[number].level(crease.points), 0, atol=1e-14)
        if crease.kind != "tip":
            assert crease.closed
            a, b = (body.pieces[k].gradient(crease.points) for k in crease.pieces)
            a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (a, b))
            np.testing.assert_allclose(np.linalg.norm(a - b, axis=-1), 2 * np.sin(crease.angle / 2), atol=1e-12)


@pytest.mark.parametrize("name", [name for name in BODIES if name != "almond"])
def test_area_and_volume_of_tiles_converge_to_closed_forms(name):
    body, errors = BODIES[name], []
    edges = 0.4 / 2.0 ** np.arange(4)
    for edge in edges:
        corners, _, _ = body.tiles(edge)
        errors.append(np.abs(np.divide(area_and_volume(corners), exact(name)) - 1))
    slopes = np.polyfit(np.log(edges), np.log(errors), 1)[0]
    np.testing.assert_allclose(slopes, 2, atol=ORDER)
    assert np.max(errors[-1]) < 2e-3


def test_volume_of_the_almond():
    # cross-sections are ellipses with semi-axes y and y/3
    a, b = 29 / 150, 5 / 12
    back = np.pi / 3 * a**2 * (2 / 3 * b)
    front = quad(lambda t: np.pi / 3 * (25 * a * (np.sqrt(1 - (t / (5 * b)) ** 2) - 0.96)) ** 2, 0, 7 / 12)[0]
    errors = [area_and_volume(BODIES["almond"].tiles(edge)[0])[1] / (back + front) - 1 for edge in (0.04, 0.02, 0.01)]
    assert abs(errors[-1]) < 2e-3
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.15)


@every
def test_tiles_lie_on_their_pieces_and_close(name):
    body, edge = BODIES[name], 0.07
    corners, normals, pieces = body.tiles(edge)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    assert np.max(sides) < 1.25 * edge
    tips = [crease.points[0] for crease in body.creases if crease.kind == "tip"]
    for number, piece in enumerate(body.pieces):
        x, n = corners[pieces == number].reshape(-1, 3), normals[pieces == number].reshape(-1, 3)
        np.testing.assert_allclose(piece.level(x), 0, atol=1e-14)
        apart = (
            np.all([np.linalg.norm(x - tip, axis=-1) > 0 for tip in tips], axis=0) if tips else np.full(len(x), True)
        )
        gradient = piece.gradient(x[apart])
        np.testing.assert_allclose(n[apart], gradient / np.linalg.norm(gradient, axis=-1, keepdims=True), atol=1e-12)
        assert np.all((x >= piece.bounds[0] - 1e-14) & (x <= piece.bounds[1] + 1e-14))
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(outward[:, None] * normals, axis=-1) > 0)
    # every side is that of one other triangle, the other way round
    _, number = np.unique(corners.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    ways = {(a, b) for row in number for a, b in zip(row, np.roll(row, -1), strict=True)}
    assert len(ways) == 3 * len(number) and all((b, a) in ways for a, b in ways)
    np.testing.assert_array_equal(body.piece(corners.mean(axis=1)), pieces)


@every
def test_piece_is_the_nearest_one(name, rng):
    body = BODIES[name]
    thin = np.min(body.bounds[1] - body.bounds[0])
    corners, normals, pieces = body.tiles(0.02 * np.max(body.bounds))
    at = rng.choice(len(corners), 2000)
    points = corners[at].mean(axis=1) + rng.uniform(-0.03, 0.03, (2000, 1)) * thin * normals[at].mean(axis=1)
    found = body.piece(points)
    apart = np.array([cKDTree(corners[pieces == k].reshape(-1, 3)).query(points)[0] for k in range(len(body.pieces))])
    assert np.all(apart[found, np.arange(2000)] <= apart.min(axis=0) + 0.02 * np.max(body.bounds))
    values = np.array([piece.level(points) for piece in body.pieces])
    np.testing.assert_array_equal(body.level(points), values[found, np.arange(2000)])


@every
def test_sign_tells_inside_from_outside_everywhere(name, rng):
    body = BODIES[name]
    points = rng.uniform(1.3 * body.bounds[0], 1.3 * body.bounds[1], (300, 3))
    # solid angle of the closed tiles
    corners = body.tiles(0.1 * np.max(body.bounds))[0]
    a, b, c = np.moveaxis(corners[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    below = la * lb * lc + np.sum(a * b, -1) * lc + np.sum(b * c, -1) * la + np.sum(c * a, -1) * lb
    turns = 2 * np.arctan2(np.sum(a * np.cross(b, c), axis=-1), below)
    inside = turns.sum(axis=1) > 2 * np.pi
    level = body.level(points)
    clear = np.abs(level) > 0.02 * np.max(body.bounds)
    np.testing.assert_array_equal(level[clear] < 0, inside[clear])


@every
def test_derivatives_are_those_of_differences(name, rng):
    body, step = BODIES[name], 1e-5
    size = np.max(body.bounds)
    for number, piece in enumerate(body.pieces):
        corners, _, pieces = body.tiles(0.3 * size)
        points = corners[pieces == number].reshape(-1, 3) + 0.01 * size * rng.normal(
            size=(3 * np.sum(pieces == number), 3)
        )
        # about the axis the curvature of a cone has no bound
        points = points[np.linalg.norm(np.delete(points, list(body._axes)[2], axis=1), axis=1) > 0.04 * size]
        shifts = step * size * np.eye(3)
        slopes = [(piece.level(points + h) - piece.level(points - h)) / (2 * step * size) for h in shifts]
        bends = [(piece.gradient(points + h) - piece.gradient(points - h)) / (2 * step * size) for h in shifts]
        scale = np.max(np.abs(piece.gradient(points)))
        np.testing.assert_allclose(piece.gradient(points), np.stack(slopes, axis=-1), atol=1e-8 * scale)
        np.testing.assert_allclose(piece.hessian(points), np.stack(bends, axis=-1), atol=2e-5 * scale / size)


@every
def test_compiled_functions_equal_their_source(name, rng):
    body = BODIES[name]
    points = np.ascontiguousarray((body.bounds[1] * rng.uniform(-1, 1, (200, 3))).T)
    for compiled in (body.compiled, body._compiled_numbers, *(piece.compiled for piece in body.pieces)):
        fast, plain = ([np.zeros(200), np.zeros((3, 200)), np.zeros((6, 200))] for _ in range(2))
        call(compiled.function, points, *fast, compiled.parameters)
        compiled.source(points, *plain, compiled.parameters)
        for a, b in zip(fast, plain, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


def test_derivatives_on_the_axis_are_exact():
    body = BODIES["capsule"]
    top = np.array([[0.0, 0.0, 2.5], [1e-200, 0, 2.5], [0, 0, -2.5]])
    np.testing.assert_allclose(body.level(top), 0, atol=1e-16)
    np.testing.assert_allclose(body.gradient(top), [[0, 0, 1], [0, 0, 1], [0, 0, -1]], atol=1e-199)
    np.testing.assert_allclose(body.hessian(top), np.broadcast_to(np.eye(3) / 0.8, (3, 3, 3)), atol=1e-15)


def curvatures(body, points):
    """Principal curvatures, in order."""
    gradient, hessian = body.gradient(points), body.hessian(points)
    slope = np.linalg.norm(gradient, axis=-1)
    n = gradient / slope[:, None]
    flat = np.eye(3) - n[:, :, None] * n[:, None, :]
    values = np.linalg.eigvalsh(flat @ hessian @ flat / slope[:, None, None])
    # one of the three is that of the normal, 0
    worst = np.argmin(np.abs(values), axis=1)
    return np.sort(np.delete(values.ravel(), np.arange(len(values)) * 3 + worst).reshape(-1, 2), axis=1)


def test_curvatures_of_the_arcs():
    z = np.linspace(-2.2, 2.2, 40)
    # of the circle through (0, 1) and (+-2.5, 0); across it 1/r times the cosine of the slope
    circle = (2.5**2 + 1) / 2
    r = np.sqrt(circle**2 - z**2) - (circle - 1)
    points = np.stack([r * np.cos(z), r * np.sin(z), z], axis=-1)
    found = curvatures(BODIES["ogive"], points)
    across = np.sqrt(1 - (z / circle) ** 2) / r
    np.testing.assert_allclose(found, np.sort(np.stack([np.full(40, 1 / circle), across], axis=-1), axis=1), rtol=1e-12)

    # cone: 0 along, and cos(alpha)/r across
    cone = BODIES["cone"]
    r = 1 - np.linspace(0.1, 1.9, 20) / 2
    points = np.stack([r, 0 * r, 2 * (1 - r)], axis=-1)
    found = curvatures(cone, points)
    np.testing.assert_allclose(found, np.stack([0 * r, 2 / np.sqrt(5) / r], axis=-1), atol=1e-12)


def test_geodesics_on_a_cylinder_are_helices(rng):
    body = sc.Cylinder(0.8, 30.0)
    phi, slope = rng.uniform(-3, 3, 20), rng.uniform(-1.5, 1.5, 20)
    x = np.stack([0.8 * np.cos(phi), 0.8 * np.sin(phi), 0 * phi], axis=-1)
    p = np.stack([-np.sin(phi) * np.cos(slope), np.cos(phi) * np.cos(slope), np.sin(slope)], axis=-1)
    found, _ = cr.DirectFlow(body, rtol=1e-12).flow(x, p, 6.0)
    turned = phi + 6.0 * np.cos(slope) / 0.8
    expected = np.stack([0.8 * np.cos(turned), 0.8 * np.sin(turned), 6.0 * np.sin(slope)], axis=-1)
    np.testing.assert_allclose(found, expected, atol=GEODESIC)


def test_geodesics_on_a_cone_are_lines_of_its_plane(rng):
    body = sc.Cone(8.0, 16.0)
    # unrolled about its tip the cone is a sector: polar angle theta = phi sin(alpha), radius rho = r/sin(alpha)
    sine = 1 / np.sqrt(5.0)
    rho, heading = rng.uniform(4, 6, 20) / sine, rng.uniform(-0.8, 0.8, 20)
    r = rho * sine
    x = np.stack([r, 0 * r, 16 - rho * 2 * sine], axis=-1)
    # heading from the direction around
    across, down = np.cos(heading), np.sin(heading)
    p = np.stack([down * sine, across, -down * 2 * sine], axis=-1)
    found, _ = cr.DirectFlow(body, rtol=1e-12).flow(x, p, 3.0)
    flat = np.stack([rho + 3 * down, 3 * across], axis=-1)
    rho, theta = np.linalg.norm(flat, axis=-1), np.arctan2(flat[:, 1], flat[:, 0])
    r, phi = rho * sine, theta / sine
    np.testing.assert_allclose(
        found, np.stack([r * np.cos(phi), r * np.sin(phi), 16 - rho * 2 * sine], axis=-1), atol=GEODESIC
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ogive", "double ogive", "cone-sphere"])
def test_rays_keep_clairauts_constant(name, rng):
    body, phi = BODIES[name], rng.uniform(-3, 3, 10)
    # around where the body is widest, and across the joint
    z, heading = np.full(10, 0.2), rng.uniform(-0.4, 0.4, 10)
    x = project(body, np.stack([np.cos(phi), np.sin(phi), z], axis=-1))
    p = np.stack([-np.sin(phi) * np.cos(heading), np.cos(phi) * np.cos(heading), np.sin(heading)], axis=-1)
    flow = cr.DirectFlow(body, rtol=1e-12)
    _, p0 = flow.flow(x, p, 0.0)
    found, ahead = flow.flow(x, p, np.linspace(0.5, 5.0, 10))
    start = x[:, 0] * p0[:, 1] - x[:, 1] * p0[:, 0]
    moment = found[..., 0] * ahead[..., 1] - found[..., 1] * ahead[..., 0]
    np.testing.assert_allclose(moment, np.broadcast_to(start[:, None], moment.shape), atol=GEODESIC)


def test_ogives_are_those_published():
    inch = 0.0254
    ogive = sc.Ogive(inch, 10 * inch)
    z = np.linspace(-5, 5, 31)[1:-1]
    alpha = np.radians(22.62)
    r = published_ogive(z, 1.0, 5.0, alpha)
    points = inch * np.stack([r, 0 * r, z], axis=-1)
    # the angle is printed with two digits
    np.testing.assert_allclose(ogive.level(points) / inch, 0, atol=1e-6)
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
    t = np.linspace(-0.416, 0.583, 60)
    psi = np.linspace(-3, 3, 60)
    with np.errstate(invalid="ignore"):
        back, front = np.sqrt(1 - (t / 0.416667) ** 2), np.sqrt(1 - (t / 2.08335) ** 2) - 0.96
    y = np.where(t < 0, 0.193333 * back, 4.83345 * front) * np.cos(psi)
    z = np.where(t < 0, 0.064444 * back, 1.61115 * front) * np.sin(psi)
    points = 9.936 * np.stack([t, y, z], axis=-1)
    assert np.max(np.linalg.norm(project(body, points) - points, axis=-1)) < 7e-6 * 9.936
    np.testing.assert_array_equal(body.piece(points), t >= 0)
    np.testing.assert_allclose(body.bounds[:, 0], 9.936 * np.array([-0.416667, 0.583333]), atol=1e-5)


def test_curvature_of_the_almond_is_continuous_its_second_derivative_not():
    body = sc.Almond(1.0)
    rim = next(crease for crease in body.creases if crease.kind == "joint").points
    a, b = (curvatures(piece, rim) for piece in body.pieces)
    np.testing.assert_allclose(a, b, rtol=1e-12)
    profiles = (lambda t: np.sqrt(1 - (t / (5 / 12)) ** 2), lambda t: 25 * (np.sqrt(1 - (t / (25 / 12)) ** 2) - 0.96))
    fourth = [np.polyfit(np.linspace(-0.1, 0.1, 41), f(np.linspace(-0.1, 0.1, 41)), 8)[-5] for f in profiles]
    assert abs(fourth[0]) > 20 * abs(fourth[1])


def test_only_bodies_without_edges_and_tips_have_charts():
    report = cr.check_surface(BODIES["capsule"])
    assert report.ok, report
    for name, body in BODIES.items():
        if name != "capsule":
            with pytest.raises(ValueError, match="edges and tips, first Crease"):
                _ = body.atlas.charts


def test_fingerprints_tell_bodies_apart():
    bodies = [*BODIES.values(), sc.Cylinder(0.8, 3.1), sc.Ogive(1.0, 5.0, speed="2 + x"), sc.DoubleOgive(1.0, 2.5, 5.0)]
    assert len({body.fingerprint for body in bodies}) == len(bodies)
    assert sc.Cone(1, 2).fingerprint == sc.Cone(1.0, 2.0, top=0.0).fingerprint


@pytest.mark.parametrize(
    "make, what",
    [
        (lambda: sc.Cylinder(0.0, 1.0), "radius = 0.0 is not positive"),
        (lambda: sc.Cylinder(1.0, np.inf), "length = inf"),
        (lambda: sc.Capsule(1.0, 2.0), "not more than twice the radius 1.0; it is that of the whole"),
        (lambda: sc.Cone(1.0, 2.0, top=-1.0), "top = -1.0 is negative"),
        (lambda: sc.ConeSphere(1.0, 2.0), "not more than twice the radius"),
        (lambda: sc.Ogive(5.0, 1.0), "length = 1.0 is not more than twice the radius 5.0"),
        (lambda: sc.DoubleOgive(1.0, 0.5, 5.0), "lower = 0.5 is not more than the radius"),
        (lambda: sc.DoubleOgive(1.0, 2.5, 5.0, upper_angle=46.4), "upper_angle = 46.4 .* angles are radians"),
        (lambda: sc.Almond(-1.0), "length = -1.0 is not positive"),
        (lambda: sc.Cylinder(1.0, 1.0).tiles(0.0), "edge = 0.0 is not positive"),
        (lambda: sc.Cylinder(1.0, 1.0).tiles(1e-9), "more than 1e.07; give more"),
        (lambda: upward([Line((0, 0), (0, 1))]), "begin and end at radius 0"),
        (lambda: upward([Line((0, 0), (0, 1)), Line((1, 1), (1, 0))]), "the next begins at"),
        (lambda: upward([Line((0, 0), (1, 1)), Line((1, 1), (1, 0)), Line((1, 0), (2, 0))]), "touches the axis"),
        (lambda: Line((0, 0), (0, -1)), "radius = -1 of a profile is negative"),
        (lambda: Arc((0, 1), (1, 0.1), (0, 0)), "end .* is not on the arc"),
    ],
)
def test_bad_parameters_are_named(make, what):
    with pytest.raises(ValueError, match=what):
        make()
