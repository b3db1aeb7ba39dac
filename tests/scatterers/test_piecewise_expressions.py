"""Expressions with max, min, where and tips: pieces, creases and tiles against closed forms."""

from functools import cache

import numpy as np
import pytest
from tolerances import ORDER

import creeping as cr
import scatterers as sc
from creeping.geometry.surface import PiecewiseSurface
from scatterers.exact.switches import Switches
from scatterers.expression import differentiate
from scatterers.kernels.compiled import Compiled, evaluated

EDGE_AT = 1e-12
"""Points of an edge off both of its pieces."""
JOINT_AT = 1e-7
"""Points of a joint off the plane of a switch: found by halving."""
TEXTS = {
    "cube": "max(x-1,-1-x,y-1,-1-y,z-1,-1-z)",
    "can": "max(x**2 + y**2 - 1, z - 1, -1 - z)",
    "capsule": "x**2 + y**2 - 1 + where(z > 1, (z-1)**2, where(z < -1, (z+1)**2, 0))",
    "cone": "max(sqrt(x**2 + y**2) - (1 - z), -z)",
    "two balls": "min((x-.5)**2 + y**2 + z**2 - 1, (x+.5)**2 + y**2 + z**2 - 1)",
    "ogive": "sqrt(x**2 + y**2) - (1 - z**2)/2",
    "seam": "max(x**2 + y**2 + z**2 - 1 + where(x < 0, 0, x**4), z - 0.5)",
    "crossed": "max(min(x**2 + y**2 - .25, x**2 + z**2 - .25), x**2 + y**2 + z**2 - 1)",
}
PIECES = {
    "cube": (6, {"edge": 12}),
    "can": (3, {"edge": 2}),
    "capsule": (3, {"joint": 2}),
    "cone": (2, {"edge": 1, "tip": 1}),
    "two balls": (2, {"edge": 1}),
    "ogive": (1, {"tip": 2}),
    "seam": (3, {"edge": 2, "seam": 1}),
    "crossed": (3, {"edge": 6}),
}
"""How many, and how many creases of which kind."""
# a ball of radius 1 beyond a plane at -1/2 from its middle
CAP = np.pi * 1.5**2 * (3 - 1.5) / 3
EXACT = {
    "cube": (24, 8),
    "can": (6 * np.pi, 2 * np.pi),
    "capsule": (8 * np.pi, 2 * np.pi + 4 / 3 * np.pi),
    "cone": (np.pi * (1 + np.sqrt(2)), np.pi / 3),
    "two balls": (2 * 2 * np.pi * 1.5, 2 * CAP),
}
QUICK = ("capsule", "cone")
every = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in TEXTS]
)


@cache
def body_of(name):
    return sc.Implicit(TEXTS[name])


@every
def test_pieces_and_creases(name):
    body = body_of(name)
    assert isinstance(body, PiecewiseSurface) and isinstance(body, sc.Implicit)
    number, wanted = PIECES[name]
    assert len(body.pieces) == number
    kinds = [crease.kind for crease in body.creases]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == wanted
    for crease in body.creases:
        for number in crease.pieces:
            near = JOINT_AT if crease.kind == "joint" else EDGE_AT
            np.testing.assert_allclose(body.pieces[number].level(crease.points), 0, atol=near)


@pytest.mark.slow
def test_edges_of_a_cube_are_where_they_are():
    for crease in body_of("cube").creases:
        assert crease.angle == pytest.approx(np.pi / 2, abs=1e-12)
        assert crease.length == pytest.approx(2, abs=1e-9)
        # two coordinates are +-1, the third goes from -1 to 1
        np.testing.assert_allclose(np.sort(np.abs(crease.points), axis=1)[:, 1:], 1, atol=EDGE_AT)


def test_creases_are_where_they_are():
    (edge,) = (crease for crease in body_of("cone").creases if crease.kind == "edge")
    np.testing.assert_allclose(edge.angle, 0.75 * np.pi, atol=1e-9)
    for crease in body_of("capsule").creases:
        np.testing.assert_allclose(np.abs(crease.points[:, 2]), 1, atol=JOINT_AT)
    for crease in (edge, *body_of("capsule").creases):
        # of a polygon with some hundred corners
        assert crease.closed and crease.length == pytest.approx(2 * np.pi, rel=1e-3)
    (tip,) = (crease.points[0] for crease in body_of("cone").creases if crease.kind == "tip")
    np.testing.assert_allclose(tip, (0, 0, 1), atol=1e-9)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "cone" else pytest.mark.slow) for name in EXACT]
)
def test_area_and_volume_of_tiles(name):
    edges, errors = np.array([0.3, 0.15, 0.075]), []
    for edge in edges:
        corners, _, _ = body_of(name).tiles(edge)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        found = np.linalg.norm(normal, axis=1).sum() / 2, np.sum(corners[:, 0] * normal) / 6
        errors.append(np.abs(np.divide(found, EXACT[name]) - 1))
    assert np.max(errors[-1]) < 5e-3
    for error in np.transpose(errors):
        # bodies with plane faces are exact but for their corners
        if name != "cube":
            assert np.polyfit(np.log(edges), np.log(error), 1)[0] > 2 - ORDER


@every
def test_tiles_lie_on_their_pieces(name):
    body = body_of(name)
    corners, normals, pieces = body.tiles(0.15)
    assert np.max(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)) < 1.3 * 0.15
    for number, piece in enumerate(body.pieces):
        x = corners[pieces == number]
        assert len(x)
        gradient = piece.gradient(x)
        slope = np.linalg.norm(gradient, axis=-1)
        assert np.max(np.abs(piece.level(x)) / slope) < JOINT_AT
        np.testing.assert_allclose(normals[pieces == number], gradient / slope[..., None], atol=1e-12)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(outward[:, None] * normals, axis=-1) > 0)
    middle = corners.mean(axis=1)
    large = np.linalg.norm(outward, axis=-1) > 1e-4
    assert np.mean(body.piece(middle[large]) == pieces[large]) > 0.999
    middle += 0.01 * np.random.default_rng(1).normal(size=(len(corners), 1)) * normals.mean(axis=1)
    number = body.piece(middle)
    for k, piece in enumerate(body.pieces):
        mine = middle[number == k]
        np.testing.assert_allclose(body.level(mine), piece.level(mine), atol=1e-14)
        np.testing.assert_allclose(body.gradient(mine), piece.gradient(mine), atol=1e-12)
        np.testing.assert_allclose(body.hessian(mine), piece.hessian(mine), rtol=1e-12, atol=1e-12)


def test_max_and_min_are_those_of_numpy(rng):
    x, y, z = rng.normal(size=(3, 500))
    functions = differentiate("max(x*y, sin(z), min(x + y, y**2)) - 2*min(x, y)*z + max(1, 2) - min(3, 2)")
    expected = np.maximum(np.maximum(x * y, np.sin(z)), np.minimum(x + y, y**2)) - 2 * np.minimum(x, y) * z
    np.testing.assert_allclose(functions.value(x, y, z)[0], expected, atol=1e-14)
    block = [np.empty(500), np.empty((3, 500)), np.empty((6, 500))]
    functions.block(np.stack([x, y, z]), *block, np.zeros(1))
    np.testing.assert_allclose(block[0], expected, atol=1e-14)
    step = 1e-6
    for k, shift in enumerate(step * np.eye(3)):
        ahead, back = (functions.value(*(p + s * d for p, d in zip((x, y, z), shift, strict=True)))[0] for s in (1, -1))
        difference = (ahead - back) / (2 * step)
        # a switch may lie between
        assert np.mean(np.abs(difference - block[1][k]) < 1e-8) > 0.99


def test_many_planes_are_one_cheap_choice(rng):
    normals = rng.normal(size=(30, 3)).round(3)
    text = f"max({','.join('+'.join(f'({c})*{v}' for c, v in zip(n, 'xyz', strict=True)) + '-1' for n in normals)})"
    functions = differentiate(text)
    # the sums that are compared, and little else
    assert functions.block.operations < 10 * len(normals)
    points = rng.normal(size=(200, 3))
    largest = np.argmax(points @ normals.T, axis=1)
    found = [np.empty(len(points)), np.empty((3, len(points))), np.empty((6, len(points)))]
    functions.block(points.T, *found, np.zeros(1))
    np.testing.assert_allclose(found[1].T, normals[largest])
    cut = Switches(text)
    cut.met(points)
    one = cut.compiled(0)
    assert len(cut.pieces) == len(np.unique(largest)) and len(one.parameters) == 4
    # nested, they are no larger
    assert differentiate("max(x," * 60 + "y" + ")" * 60).block.operations < 10


def test_whole_numbers_beyond_the_compiler_are_taken():
    compiled = Compiled(differentiate("(10000*x)**6").block, "level", np.zeros(1))
    value, gradient, hessian = evaluated(compiled, np.ones(3))
    np.testing.assert_allclose([value, gradient[0], hessian[0]], [1e24, 6e24, 30e24])


def test_choices_that_make_no_difference_make_no_pieces():
    switches = Switches("max(x, min(y, z)) + where(x < 0, z, z)")
    points = np.array([[9, 0, 1], [9, 1, 0], [-9, 0, 1], [-9, 1, 0.0]])
    switches.met(points)
    assert len(switches.pieces) == 3
    found = switches.numbers(points)
    assert found[0] == found[1] and len(set(found)) == 3


def test_only_joints_leave_charts():
    report = cr.check_surface(body_of("capsule"))
    assert report.ok, report
    with pytest.raises(ValueError, match="edges and tips, first Crease"):
        _ = body_of("cone").atlas.charts


@pytest.mark.slow
def test_pieces_that_join_smoothly_are_one_smooth_body():
    body = sc.Implicit("x**2 + y**2 + z**2 - 1 + where(z < 0, 0, z**4)")
    assert type(body) is sc.Implicit and not isinstance(body, PiecewiseSurface)


def test_strict_takes_joints():
    """That it refuses edges: tests/dumb_inputs/test_bad_expressions.py."""
    assert [crease.kind for crease in sc.Implicit(TEXTS["capsule"], strict=True).creases] == ["joint", "joint"]


def test_a_tip_belongs_to_the_piece_it_ends():
    # the cone is the second choice here
    body = sc.Implicit("max(-z, sqrt(x**2 + y**2) - (1 - z))")
    (tip,) = (crease for crease in body.creases if crease.kind == "tip")
    ring = np.array([[0.1, 0, 0.9], [0, -0.1, 0.9]])
    assert tip.pieces == (body.piece(ring)[0],) * 2
    np.testing.assert_allclose(body.pieces[tip.pieces[0]].level(ring), 0, atol=1e-15)
