"""What of a mesh is the body: parts by size, number and name, holes closed, parts united, subdivision; bad options."""

import numpy as np
import pytest
import trimesh
from body_checks import normal_curvature, rms, unit, volume

import scatterers as sc
from creeping.geometry.surface import project
from scatterers.triangles.quality import Choice


def ball(radius=1.0, at=0.0, times=2):
    mesh = trimesh.creation.icosphere(times, radius=radius)
    mesh.apply_translation([at, 0, 0])
    return mesh


def taken(source, **options):
    return sc.examined_mesh(source, "m", **options)[0]


SMALL, LARGE = ball(0.5, 3.0), ball()
TWO = trimesh.util.concatenate([SMALL, LARGE])


@pytest.mark.parametrize("part, expected", [("largest", LARGE), (1, LARGE), (2, SMALL)])
def test_a_part_is_taken_by_its_area(part, expected):
    mesh = taken(TWO, part=part)
    # area 4 pi and pi
    number, share = (1, 20) if expected is LARGE else (2, 80)
    assert mesh.repairs == (f"part {number} of 2 of the mesh taken; {share} % of its area left out",)
    assert volume(mesh) == pytest.approx(expected.volume)
    np.testing.assert_allclose(mesh.vertices.mean(axis=0), expected.vertices.mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("suffix", ["glb", "obj"])
def test_a_part_is_taken_by_its_name(tmp_path, suffix):
    place = tmp_path / f"two.{suffix}"
    if suffix == "glb":
        trimesh.Scene({"hull": LARGE, "wheel": SMALL}).export(place)
    else:
        lines, begin = [], 1
        for name, mesh in (("hull", LARGE), ("wheel", SMALL)):
            lines += [f"o {name}", *(f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist())]
            lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + begin).tolist()]
            begin += len(mesh.vertices)
        place.write_text("\n".join(lines))
    mesh = taken(place, part="wheel")
    assert volume(mesh) == pytest.approx(SMALL.volume, rel=1e-5)
    with pytest.raises(ValueError, match=r"has no part 'keel'; it has (hull, wheel|wheel, hull)$"):
        taken(place, part="keel")


def test_several_parts_are_refused_with_what_to_do():
    with pytest.raises(ValueError, match=r"2 separate surfaces, of 320, 320 triangles; .*part='largest', .*union=True"):
        taken(TWO)
    with pytest.raises(ValueError, match=r"part = 3 is none of the mesh; .*1: 320 triangles, 2 x 2 x 2 m; 2: 320 tri"):
        taken(TWO, part=3)
    with pytest.raises(ValueError, match="has no part 'hull'"):
        taken(TWO, part="hull")


def test_cavities_are_parts_that_are_left_out():
    hollow = ball(0.4)
    hollow.invert()
    whole = trimesh.util.concatenate([LARGE, hollow])
    with pytest.raises(ValueError, match="within the box of the largest: cavities or inner parts"):
        taken(whole)
    assert volume(taken(whole, part="largest")) == pytest.approx(LARGE.volume)
    assert volume(taken(whole, union=True)) == pytest.approx(LARGE.volume)


def holed(*tops):
    """A box of fine triangles with the faces about these middles of its sides taken out, where they are so near."""
    box = trimesh.creation.box().subdivide().subdivide().subdivide()
    middle = box.triangles_center
    out = np.zeros(len(middle), dtype=bool)
    for centre, near in tops:
        out |= np.linalg.norm(middle - centre, axis=1) < near
    return trimesh.Trimesh(box.vertices, box.faces[~out], process=False)


def test_holes_up_to_a_size_are_closed():
    small, large = ([0, 0, 0.5], 0.1), ([0, 0, -0.5], 0.3)
    with pytest.raises(ValueError, match=r"are open, .* cap= with the size of the largest hole"):
        taken(holed(small))
    for cap in (0.5, np.inf):
        mesh = taken(holed(small), cap=cap)
        assert volume(mesh) == pytest.approx(1) and len(mesh.repairs) == 1
        assert mesh.repairs[0].startswith("a hole of the mesh with") and "closed about (" in mesh.repairs[0]
    # the larger one is left open
    with pytest.raises(ValueError, match=r"are open, .*near .*-0\.5\].* cap= with the size of the largest hole"):
        taken(holed(small, large), cap=0.5)
    assert volume(taken(holed(small, large), cap=1.2)) == pytest.approx(1)


def test_crossing_parts_are_united():
    pytest.importorskip("manifold3d")
    first, second = trimesh.creation.box(), trimesh.creation.box()
    second.apply_translation([0.5, 0.25, 0.3])
    both = trimesh.util.concatenate([first, second])
    mesh, quality = sc.examined_mesh(both, union=True)
    # less what both have
    assert volume(mesh) == pytest.approx(2 - 0.5 * 0.75 * 0.7)
    assert quality.verdict == "sharp" and mesh.repairs[0].startswith("2 parts of the mesh united: 24 triangles became")


def test_the_library_for_unions_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda *_: None)
    with pytest.raises(ModuleNotFoundError, match=r"uniting parts needs manifold3d: pip install 'creeping\[mesh\]'"):
        taken(TWO, union=True)


def test_subdivision_of_a_coarse_mesh_is_told():
    coarse = ball(times=1)
    mesh, quality = sc.examined_mesh(coarse, subdivide=2)
    assert len(mesh.triangles) == 16 * 80 and quality.verdict == "smooth"
    assert mesh.repairs[0].startswith(
        f"subdivided 2 times after Loop: 42 vertices became {len(mesh.vertices)}, moved by"
    )
    # Loop's limit surface lies within the ball
    radius = np.linalg.norm(mesh.vertices, axis=1)
    assert radius.max() < 1 and np.ptp(radius) < 0.05 * radius.mean()
    assert "subdivided" in sc.examined_mesh(coarse, subdivide="auto")[0].repairs[0]
    # a mesh that is fine enough is left
    assert sc.examined_mesh(ball(times=3), subdivide="auto")[0].repairs == ()


@pytest.mark.slow
def test_a_subdivided_mesh_passes_by_its_vertices_and_errs_about_as_stated():
    axes, mesh = (1, 0.8, 0.6), ball()
    mesh.apply_scale(axes)
    body, exact = sc.Mesh(mesh, subdivide=1, cache=False), sc.Ellipsoid(*axes)
    off = rms(body.level(mesh.vertices) / np.linalg.norm(body.gradient(mesh.vertices), axis=1))
    assert off < 2e-3 * max(axes) and off < 1.3 * body.fit.misfit
    x = project(exact, mesh.triangles_center)
    t = np.cross(unit(exact.gradient(x)), [0.36, 0.48, 0.8])
    error = rms(normal_curvature(body, x, t) - normal_curvature(exact, x, t))
    assert error < 1.4 * body.fit.normal_curvature_error


@pytest.mark.slow
def test_a_noisy_mesh_is_no_better_for_a_narrower_grid(rng):
    """On the narrowest both fits would follow the noise, and agree."""
    mesh = ball(times=3)
    mesh.vertices = mesh.vertices * (1 + 0.012 * rng.normal(size=len(mesh.vertices)))[:, None]
    assert sc.examined_mesh(mesh)[1].verdict == "noisy"
    with pytest.raises(ValueError, match="curvatures are uncertain by"):
        sc.Mesh(mesh, subdivide=1, cache=False)


@pytest.mark.slow
def test_a_mesh_whose_curvature_is_within_its_edges_is_refused():
    """At the rim of a flat ellipsoid, not at the ends of a long one, whose long edges lie along it."""
    flat, long = ball(times=1), ball(times=1)
    flat.apply_scale((1, 1, 0.3))
    with pytest.raises(ValueError, match=r"at \d+ of 42 vertices it does not show how its body curves"):
        sc.Mesh(flat, subdivide=1, cache=False)
    long.apply_scale((4, 1, 1))
    body = sc.Mesh(long, subdivide=1, cache=False)
    assert np.mean(body.non_smooth(long.vertices)) < 0.2


@pytest.mark.parametrize("mesh", [trimesh.creation.box(), trimesh.creation.capsule(radius=0.5, height=1.0)])
def test_bodies_of_pieces_are_not_subdivided(mesh):
    with pytest.raises(ValueError, match=r"edges or joints .*, which subdivide = 1 would round off; leave it"):
        sc.examined_mesh(mesh, subdivide=1)
    assert sc.examined_mesh(mesh, subdivide="auto")[0].repairs == ()


@pytest.mark.slow
def test_what_a_subdivision_makes_is_bounded():
    with pytest.raises(ValueError, match="subdivide = 3 makes 655488 vertices of 10242, more than 300000; subdivide"):
        sc.examined_mesh(ball(times=5), subdivide=3)


@pytest.mark.parametrize(
    "options, match",
    [
        ({"part": ""}, "part = ''; give \"largest\", a number from 1"),
        ({"part": 0}, "part = 0; give"),
        ({"part": 1.5}, "part = 1.5; give"),
        ({"cap": 0}, "cap = 0 is no size in m"),
        ({"cap": np.nan}, "cap = nan is no size"),
        ({"subdivide": 0}, "subdivide = 0; give 1, 2 or 3"),
        ({"subdivide": "often"}, "subdivide = 'often'; give"),
    ],
)
def test_bad_options_are_named(options, match):
    with pytest.raises(ValueError, match=match):
        Choice(**options)
    with pytest.raises(ValueError, match=match):
        sc.Mesh(LARGE, cache=False, **options)
