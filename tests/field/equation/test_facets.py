"""The equation on flat facets and on several bodies: against series, boxes and itself on other triangles."""

import numpy as np
import pytest
import trimesh

import creeping as cr
import scatterers as sc
from creeping.field.boundary import HARD
from creeping.field.equation.body_tiles import COARSE_RULES, RULES, facet_tiles
from creeping.geometry.patches import facet_patches, halved, sides_of
from tests.reference import sphere, stored

CUBE = stored.read("edged_cube")
D, R = CUBE["incident"].real, CUBE["directions"].real


def cube(times, lean=0.22, seed=3):
    """A cube of side 2 of irregular triangles."""
    mesh, rng = trimesh.creation.box((2, 2, 2)), np.random.default_rng(seed)
    for _ in range(times):
        mesh = mesh.subdivide()
    v = np.array(mesh.vertices)
    # within faces and along edges
    v += rng.uniform(-lean, lean, v.shape) * 2 / 2**times * (np.abs(np.abs(v) - 1) > 1e-9)
    return trimesh.Trimesh(v, mesh.faces, process=False)


def rms(found, exact):
    return np.sqrt(np.mean(np.abs(found - exact) ** 2)) / np.abs(exact).max()


@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_a_ball_of_flat_triangles_is_the_sphere_of_its_volume(kind):
    k, ball = 6.0, trimesh.creation.icosphere(subdivisions=3)
    ball.apply_scale((4 * np.pi / 3 / ball.volume) ** (1 / 3))
    d = np.array([0.6, 0.0, 0.8])
    far = cr.solve(sc.Facets(ball), d, wavenumber=k, boundary=kind).far_field(R)
    assert rms(far.total, sphere.far_field(k, 1.0, R @ d, kind)) < 2e-3 and not far.unresolved.any()


@pytest.mark.parametrize("times", [0, 2, 3])
@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_a_cube_of_irregular_triangles_is_a_cube(times, kind):
    exact = CUBE[kind][:, 0]
    far = cr.solve(sc.Facets(cube(times)), D, wavenumber=5.0, boundary=kind).far_field(R)
    assert rms(far.total, exact) < (2e-4 if times == 0 else 1.5e-3)
    true = np.abs(far.total - exact)
    assert np.mean(true < far.error) > 0.8 and np.median(far.error / true) < 12


@pytest.mark.slow
@pytest.mark.parametrize(
    "rule",
    [*RULES, *COARSE_RULES],
    ids=lambda rule: f"{'squares' if rule.squares else 'triangles'} {rule.p}, {rule.side:g}",
)
def test_every_rule_knows_its_error_at_edges(rule, monkeypatch):
    monkeypatch.setattr("creeping.field.equation.body_tiles._chosen", lambda *problem: (1.0, rule))
    # of the triangles as they are: whole faces would be squares
    monkeypatch.setattr("creeping.field.equation.body_tiles.with_whole_faces", lambda body: None)
    # another cube than the one that set what they lack, and turned
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.5, 0.9]))[:3, :3]
    mesh = cube(1, seed=8)
    mesh.vertices = mesh.vertices @ turn.T
    solution = cr.solve(sc.Facets(mesh), D @ turn.T, wavenumber=5.0, boundary="hard")
    far, exact = solution.far_field(R @ turn.T), CUBE["hard"][:, 0]
    true = np.abs(far.total - exact)
    assert np.mean(true < far.error) > 0.8 and 1 < np.median(far.error / true) < 8
    least = {(False, 1): 1e-2, (True, 5): 2e-4}.get((rule.squares, rule.p), 4e-3)
    assert rms(far.total, exact) < (2 if rule in COARSE_RULES else 1) * least


def test_tiles_close_have_the_area_and_meet_at_edges():
    for mesh in (cube(1), trimesh.creation.cylinder(1.0, 2.0, sections=7), trimesh.creation.icosphere(subdivisions=1)):
        body = sc.Facets(mesh)
        for finest in (False, True):
            tiles = facet_tiles(body, 40.0, HARD, finest=finest)
            assert abs(tiles.weights.sum() / mesh.area - 1) < 1e-12
            assert np.linalg.norm(tiles.normals.T @ tiles.weights) < 1e-12 * mesh.area
            volume = np.sum(tiles.weights * np.einsum("nx,nx->n", tiles.points, tiles.normals)) / 3
            assert abs(volume / mesh.volume - 1) < 1e-12
            # each stretch of an edge is that of two tiles, one on either face; squares in corners have two edges
            key, _, start, end = tiles.edges[tiles.edges[:, 0] >= 0].T
            stretches = np.stack([key, np.minimum(start, end).round(9), np.maximum(start, end).round(9)], axis=1)
            each, count = np.unique(stretches, axis=0, return_counts=True)
            assert np.all((count == 2) | (each[:, 1] == 0) | (each[:, 2] == 1))


def test_halved_triangles_share_their_sides():
    mesh = trimesh.creation.cylinder(0.3, 5.0, sections=9)
    found = halved(np.array(mesh.vertices), np.array(mesh.faces), 0.4)
    assert np.all(np.bincount(sides_of(found.triangles)[1].ravel()) == 2)
    corners = found.vertices[found.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= 0.4
    same = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert same.is_watertight and abs(same.volume / mesh.volume - 1) < 1e-12


def test_rectangles_come_back():
    patches = facet_patches(sc.Facets(trimesh.creation.box((1, 2, 30))))
    assert len(patches.places) == 6 and patches.edges.all()


@pytest.mark.slow
def test_size_and_unit_change_nothing():
    mesh, d = trimesh.creation.cone(0.5, 1.2, sections=9), (0.2, -0.7, 0.5)
    large = mesh.copy()
    large.apply_scale(1e3)
    one = cr.solve(sc.Facets(mesh), d, wavenumber=6.0, boundary="hard").far_field(R)
    for body, k, scale in ((sc.Facets(large), 6e-3, 1e3), (sc.Facets(large, units="mm"), 6.0, 1.0)):
        other = cr.solve(body, d, wavenumber=k, boundary="hard").far_field(R)
        # the same pairs of triangles, though lengths of sides are equal but for rounding
        np.testing.assert_allclose(other.total / scale, one.total, atol=1e-6 * np.abs(one.total).max())
        np.testing.assert_allclose(other.error / scale, one.error, rtol=0.05)


@pytest.mark.parametrize("kind", ["hard", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("soft", "pec"))])
def test_two_spheres_a_wavelength_apart(kind):
    case, axis, k = stored.read("two_spheres"), np.array([0.48, 0.6, 0.64]), 6.0
    two = sc.Bodies([sc.Sphere(1.0), sc.Sphere(0.7)], at=[-(1 + np.pi / k) * axis, (0.7 + np.pi / k) * axis])
    far = cr.solve(two, case["incident"].real, wavenumber=k, boundary=kind).far_field(case["directions"].real)
    exact = case[kind][:, 0]
    assert rms(far.total, exact) < 1e-4 and np.mean(np.abs(far.total - exact) <= far.error) > 0.9


@pytest.mark.slow
def test_bodies_of_several_kinds_where_they_are_put():
    # a turned box of facets beside a cylinder with edges, and the same two as they stand
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.2, 0.7]))[:3, :3]
    box, rod, k = trimesh.creation.box((0.6, 0.8, 1.0)), sc.Cylinder(0.3, 0.8), 2.0
    moved = box.copy()
    moved.vertices = box.vertices @ turn.T + [1.2, 0.1, 0.0]
    d = np.array([0.48, 0.6, -0.64])
    put = sc.Bodies([sc.Facets(box), rod], at=[(1.2, 0.1, 0), (0, 0, 0)], turned=[turn, np.eye(3)])
    first = cr.solve(put, d, wavenumber=k, boundary="hard")
    other = cr.solve(sc.Bodies([sc.Facets(moved), rod]), [d, -R[7]], wavenumber=k, boundary="hard")
    np.testing.assert_allclose(first.far_field(R).total, other.far_field(R).total, atol=1e-5)
    # reciprocity: the same from the other side
    assert abs(other.far_field(-d, 1).total[0] - first.far_field(R[7]).total[0]) < 2e-4
    points = np.array([[0.6, 0.0, 0.0], [1.2, 0.1, 2.0]])
    assert np.all(other.near_field(points).ok)
    with pytest.raises(cr.InvalidInputError, match="inside the body"):
        other.near_field([(0.0, 0.0, 0.1)])


def test_echoes_and_sweeps_of_facets_are_the_solution(tmp_path):
    body, k = sc.Facets(trimesh.creation.box((1.0, 0.8, 0.6)), units="m"), 2.0
    ds = cr.backscatter(body, wavenumbers=k, azimuth=[0.0, 40.0], boundary="hard")
    assert ds.by_currents.values.all() and ds.attrs["flow"] == "none" and ds.field.unit == "m"
    d = -np.array([[1.0, 0, 0], [np.cos(np.radians(40)), np.sin(np.radians(40)), 0]])
    asked = {"wavenumbers": k, "boundary": "hard", "quantity": "bistatic", "observation": -d, "store": tmp_path / "s"}
    kept = cr.sweep_directions(body, d[:1], **asked)
    assert np.all(np.isfinite(kept.total)) and np.all(np.isnan(kept.creeping))
    # two angles may be those of a T-matrix, which holds 1e-4
    np.testing.assert_allclose(kept.total.values.ravel()[0], ds.total.values.ravel()[0], atol=1e-4)
    again = cr.sweep_directions(body, d[:1], **asked, resume=True)
    np.testing.assert_array_equal(kept.total, again.total)


@pytest.mark.slow
def test_a_body_of_many_pieces_is_solved_on_its_own_triangles():
    # an open seam of one piece with itself has no mesh of squares
    body = sc.Mesh(cube(2), cache=False)
    own = body.corners
    assert own is not None and len(own) == 192
    assert sc.Mesh(trimesh.creation.icosphere(subdivisions=3), cache=False).corners is None
