"""Squares and tiles of bodies: they close, they are the body, and what they send next to themselves is known."""

import numpy as np
import pytest
import shared_bodies as sc
from numpy.testing import assert_allclose

from creeping.field.boundary import CONDUCTOR, HARD, Boundary
from creeping.field.equation.matrix import TANGENT, Matrix, Places
from creeping.field.equation.parting import tiles_for
from creeping.geometry.covering import patches_of

HALF = 25 * 29 / 150 * (np.sqrt(1 - (np.linspace(0, 7 / 25, 2001)) ** 2) - 0.96)
ALMOND = np.pi / 3 * (2 / 3 * 5 / 12 * (29 / 150) ** 2 + np.trapezoid(HALF**2, dx=7 / 12 / 2000))
"""Volume of half an ellipsoid and of a half ogive whose cross-sections are ellipses."""
RING, AROUND = "(x**2+y**2+z**2+0.96)**2 - 4*(x**2+y**2+z**2 - (0.48*x+0.6*y+0.64*z)**2)", (1.0773, 1.0, 0.9684)
"""A slender torus, R = 1, r = 0.2, about (0.48, 0.6, 0.64), and its box: coarse grids have no point within it."""
BODIES = {
    "sphere": (lambda: sc.Sphere(1.5), 9 * np.pi, 4.5 * np.pi),
    "torus": (lambda: sc.Torus(R=1.0, r=0.4), 1.6 * np.pi**2, 0.32 * np.pi**2),
    "slender": (lambda: sc.Implicit(RING, bounds=(-np.array(AROUND), AROUND)), 0.8 * np.pi**2, 0.08 * np.pi**2),
    "cylinder": (lambda: sc.Cylinder(0.5, 2.0), 2.5 * np.pi, 0.5 * np.pi),
    "cone": (lambda: sc.Cone(1.0, 2.0), np.pi * (1 + 5**0.5), 2 / 3 * np.pi),
    "capsule": (lambda: sc.Capsule(0.5, 3.0), 3 * np.pi, 2 / 3 * np.pi),
    "almond": (lambda: sc.Almond(1.0), None, ALMOND),
    "box": (lambda: sc.Implicit("max(x-1,-x-1,y-1,-y-1,z-1,-z-1)", bounds=((-1.1,) * 3, (1.1,) * 3)), 24.0, 8.0),
}
"""Bodies, their areas and their volumes."""


@pytest.mark.parametrize("name", BODIES)
def test_squares_close_and_have_the_area_and_volume_of_the_body(name):
    body, area, volume = BODIES[name]
    patches = patches_of(body())
    tiles = tiles_for(patches, 4.0)
    assert patches.gap < 1e-8
    assert area is None or np.isclose(tiles.weights.sum(), area, rtol=2e-5)
    assert_allclose((tiles.weights @ np.sum(tiles.points * tiles.normals, axis=1)) / 3, volume, rtol=2e-5)


@pytest.mark.parametrize("name", ["sphere", "cone", "box"])
def test_a_static_double_layer_of_one_is_minus_one_half_on_the_body(name):
    body = BODIES[name][0]()
    tiles = tiles_for(patches_of(body), 2.0)
    matrix = Matrix(tiles, 1e-9, HARD)
    one = np.ones((len(tiles.points), 1), dtype=complex)
    off = np.abs(matrix.received(matrix.nodes, one)[:, 0] + 1)
    assert np.median(off) < 1e-5 and np.quantile(off, 0.99) < 1e-3 and np.max(off) < 5e-3
    # 0 outside and -1 inside, close to the surface, at its middle and at an edge alike
    some = np.arange(0, len(tiles.points), 37)
    for height, value in ((1e-4, 0.0), (-1e-4, -2.0)):
        x = tiles.points[some] + height * tiles.normals[some]
        near = matrix.received(Places.at(x, tiles.normals[some]), one[:, :1])[:, 0]
        assert np.median(np.abs(near - value)) < 1e-3 and np.max(np.abs(near - value)) < 0.03


def test_tiles_on_both_faces_of_an_edge_are_parted_at_the_same_places():
    tiles = tiles_for(patches_of(sc.Cone(1.0, 2.0)), 14.0)
    corners = tiles.shapes[:, ::6, ::6].reshape(-1, 4, 3)
    base = np.all(np.abs(corners[..., 2]) < 1e-9, axis=1)
    on_rim = np.hypot(np.hypot(corners[..., 0], corners[..., 1]) - 1, corners[..., 2]) < 1e-5
    angles = [
        np.unique(np.round(np.arctan2(corners[of, 1], corners[of, 0]), 4))
        for of in (on_rim & base[:, None], on_rim & ~base[:, None])
    ]
    assert len(angles[0]) == len(angles[1]) > 15
    assert_allclose(angles[0], angles[1], atol=1e-4)


@pytest.mark.slow
def test_single_and_double_layers_of_a_harmonic_function():
    # on the surface of a body u/2 = S du/dn - D u, u harmonic inside: 2 S du/dn - 2 D u = u
    tiles = tiles_for(patches_of(sc.Cone(1.0, 2.0)), 4.0)
    matrix = Matrix(tiles, 1e-9, Boundary("impedance", 0j))
    x, n = tiles.points, tiles.normals
    u, slope = x[:, 0] * x[:, 1], n[:, 0] * x[:, 1] + n[:, 1] * x[:, 0]
    layers = (
        matrix.received(matrix.nodes, part[:, None].astype(complex), kind)
        for part, kind in ((slope, "single"), (u, "double"))
    )
    single, double = layers
    assert_allclose((single - double)[:, 0], u, atol=5e-4)


def test_places_are_found_next_to_narrow_tiles_and_on_the_axis():
    """Nodes of the strip along an edge are nearer to some points of the tile beside it than its own."""
    body = sc.Cylinder(1.0, 2.0)
    tiles = tiles_for(patches_of(body), 4.0, side=0.5, turn=0.3)
    r, phi = np.meshgrid([0.0, 0.5, 0.9, 0.95, 0.97, 0.98, 0.99, 1.0], np.linspace(0.1, 6.2, 23))
    x = np.stack([r * np.cos(phi), r * np.sin(phi), 1 + 0 * r], axis=-1).reshape(-1, 3)
    tile, u, v, off = tiles.located(x)
    assert off.max() < 1e-5
    there, normals = tiles.on(tile, u, v)
    assert_allclose(there, x, atol=1e-5)
    assert np.all(np.isfinite(normals))


@pytest.mark.parametrize("body", [sc.Cone(1.0, 2.0), sc.Cylinder(1.0, 0.2)], ids=["cone", "disc"])
def test_tiles_know_what_is_inside(body):
    tiles = tiles_for(patches_of(body), 6.0)
    low, high = np.asarray(body.bounds)
    rng = np.random.default_rng(2)
    x = low + (high - low) * rng.uniform(-0.1, 1.1, (1500, 3))
    # next to edges and faces too, on either side of them
    near = tiles.points[::7] + rng.choice([-0.02, 0.01], (len(tiles.points[::7]), 1)) * rng.normal(
        size=(len(tiles.points[::7]), 3)
    )
    x = np.concatenate([x, near])
    clear = np.abs(body.level(x)) > 1e-4
    np.testing.assert_array_equal(tiles.inside(x)[clear], (body.level(x) < 0)[clear])


def test_currents_are_tangent_to_tiles_next_to_points(rng):
    """The compiled sums are those over finer nodes of J less its part along the normal there."""
    tiles = tiles_for(patches_of(sc.Torus(R=1.0, r=0.4))[:1], 4.0)
    matrix = Matrix(tiles, 4.0, CONDUCTOR)
    places = Places.at(tiles.points[:3] + 0.05 * tiles.normals[:3], tiles.normals[:3])
    targets, _, found = matrix.near(places, "double")
    finer = tiles.with_nodes(tiles.p + TANGENT)
    starts, _ = near = tiles.near(places.points)
    tile = np.repeat(np.arange(tiles.count), np.diff(starts))
    by_u, by_v = tiles.onto(finer.p)
    values = rng.normal(size=(tiles.count, tiles.p**2, 2))
    a, b = (part.reshape(tiles.count, -1, 3) for part in (matrix.nodes.a, matrix.nodes.b))
    J = a * values[..., :1] + b * values[..., 1:]
    J = np.einsum("fj,tjx->tfx", np.kron(by_u, by_v), J)
    n = finer.normals.reshape(tiles.count, -1, 3)
    J = (J - n * np.sum(n * J, axis=2, keepdims=True))[tile]
    slopes = finer.rows(places.points, near, 4.0, 2)
    plain = []
    for p in (places.a[targets], places.b[targets]):
        across = np.einsum("pcf,pc,pfx,px->p", slopes, p, J, places.normals[targets])
        plain.append(across - np.einsum("pcf,pc,pfx,px->p", slopes, places.normals[targets], J, p))
    assert_allclose(np.einsum("prjc,pjc->rp", found, values[tile]), plain, rtol=1e-10, atol=1e-12)
