"""Bodies on their facets: what is inside and hidden, parts, and what they refuse."""

import numpy as np
import pytest
import trimesh

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError
from creeping.geometry.surface import fingerprint

RNG = np.random.default_rng(5)


def test_inside_and_hidden_are_those_of_the_polyhedron():
    ball = trimesh.creation.icosphere(subdivisions=2)
    body, x = sc.Facets(ball), RNG.uniform(-1.2, 1.2, (2000, 3))
    # below all planes of a convex body
    planes = np.einsum("tx,mx->mt", ball.face_normals, x) - np.sum(ball.face_normals * ball.triangles[:, 0], axis=1)
    np.testing.assert_array_equal(body.inside(x), np.all(planes < 0, axis=1))
    d = np.array([0.0, 0.0, 1.0])
    # at centroids of triangles, a little above them
    middle = ball.triangles_center + 1e-6 * ball.face_normals
    np.testing.assert_array_equal(body.hidden(middle, d), ball.face_normals @ d > 0)
    # along a direction in which rays go through sides and corners
    np.testing.assert_array_equal(body.hidden(2.0 * x[:50] / np.linalg.norm(x[:50], axis=1)[:, None], d)[:0], [])
    box = sc.Facets(trimesh.creation.box((2, 2, 2)))
    over = np.array([[0.0, 0.0, 3.0], [0.5, 0.5, 1.5], [1.0 + 1e-6, 0.0, 3.0]])
    assert box.hidden(over, d).tolist() == [True, True, False]


def test_parts_inside_others_are_left_out_and_the_rest_are_one_body():
    inner = trimesh.creation.icosphere(subdivisions=1, radius=0.4)
    outer, other = (trimesh.creation.icosphere(subdivisions=1) for _ in range(2))
    other.apply_translation([3, 0, 0])
    other.invert()
    body = sc.Facets(trimesh.util.concatenate([inner, outer, other]))
    assert len(body.triangles) == 160 and any("1 of them inside others" in text for text in body.repairs)
    assert body.inside(np.array([[0.0, 0, 0], [3, 0, 0], [1.5, 0, 0]])).tolist() == [True, True, False]
    one = sc.Facets(trimesh.util.concatenate([outer, other]), part=1)
    assert len(one.triangles) == 80
    assert sc.Facets(outer).fingerprint != sc.Facets(other).fingerprint == sc.Facets(other).fingerprint
    twice = outer.copy()
    twice.apply_scale(2.0)
    assert sc.Facets(twice).fingerprint != sc.Facets(outer).fingerprint


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda m: m.update_faces(np.arange(len(m.faces)) > 0), "open"),
        (lambda m: m.vertices.__setitem__(0, np.nan), "not finite"),
    ],
)
def test_what_is_no_body_is_refused(damage, told):
    ball = trimesh.creation.icosphere(subdivisions=1)
    damage(ball)
    with pytest.raises(ValueError, match=told):
        sc.Facets(ball)


def test_parts_that_cross_are_refused():
    two = [trimesh.creation.icosphere(subdivisions=1) for _ in range(2)]
    two[1].apply_translation([1.0, 0.1, 0.2])
    with pytest.raises(ValueError, match="crosses itself"):
        sc.Facets(trimesh.util.concatenate(two))
    assert len(sc.Facets(trimesh.util.concatenate(two), union=True).triangles) > 80


@pytest.mark.parametrize(
    "asked",
    [
        lambda body: cr.shadow_line(body, (0, 0, 1)),
        lambda body: cr.DirectFlow(body),
        lambda body: cr.choose_flow(body, n_rays=10, length=1.0),
        lambda body: cr.check_surface(body),
        lambda body: cr.backscatter(body, wavenumbers=3.0, method="rays"),
        lambda body: cr.sweep_directions(body, [(0, 0, 1)], quantity="rays"),
    ],
)
@pytest.mark.parametrize("body", [sc.Facets(trimesh.creation.box()), sc.Bodies([sc.Sphere()])])
def test_rays_are_refused_by_name(asked, body):
    with pytest.raises(InvalidInputError, match=r"no creeping rays on this body: .*creeping.solve"):
        asked(body)


def test_bodies_say_what_does_not_fit():
    ball = sc.Sphere()
    for given, told in (
        (([],), "no bodies"),
        (([ball], [(0, 0, 0), (1, 0, 0)]), "shape"),
        (([ball], None, [2 * np.eye(3)]), "no rotation"),
        (([ball], None, [-np.eye(3)]), "no rotation"),
    ):
        with pytest.raises(ValueError, match=told):
            sc.Bodies(given[0], **dict(zip(("at", "turned"), given[1:], strict=False)))
    two = sc.Bodies([ball, ball], at=[(0, 0, 0), (0, 0, 1.5)])
    with pytest.raises(cr.SurfaceError, match="reach into each other"):
        cr.solve(two, (1, 0, 0), wavenumber=2.0, boundary="hard")
    assert "Bodies(2: Sphere, Sphere)" in repr(two) and fingerprint(two) != fingerprint(sc.Bodies([ball, ball]))
