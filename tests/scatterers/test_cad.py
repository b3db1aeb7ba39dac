"""Bodies from STEP and BREP files made by gmsh: points and normals, units, edges, and files that are none."""

import importlib.util
import os
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from body_checks import directions, normal_curvature, rms
from cad_files import made

import creeping as cr
import scatterers as sc
from creeping.field.boundary import CONDUCTOR
from creeping.field.equation.mirrors import mirrors_of
from creeping.field.equation.parting import tiles_of
from creeping.geometry.covering import patches_of
from creeping.geometry.surface import normal, project
from scatterers.triangles import cad_file as _cad_files
from scatterers.triangles.cad_file import CadReading, read_cad
from scatterers.triangles.quality import Choice
from scatterers.triangles.topology import edges_of

pytest.importorskip("gmsh", exc_type=ImportError)

MAKER = """
ball = make.addSphere(0, 0, 0, 1)
make.dilate([(3, ball)], 0, 0, 0, 1.2, 0.8, 0.8)
write("ellipsoid.brep")
ball = make.addSphere(0, 0, 0, 1)
make.dilate([(3, ball)], 0, 0, 0, 1200, 800, 800)
write("ellipsoid.step")
make.addTorus(0, 0, 0, 1000, 500)
write("torus.step")
ball = make.addSphere(3, 2, 1, 1)
make.dilate([(3, ball)], 3, 2, 1, 126, 49, 20)
write("flat.step")
make.addBox(0, 0, 0, 1, 1, 1)
write("box.brep")
make.addCone(0, 0, 0, 0, 0, 2, 1, 0)
write("cone.brep")
rod = make.addCylinder(0, 0, -1, 0, 0, 2, 0.5)
ends = [(3, make.addSphere(0, 0, z, 0.5)) for z in (-1, 1)]
make.fuse([(3, rod)], ends)
write("capsule.brep")
make.addSphere(0, 0, 0, 1)
make.addSphere(3, 0, 0, 0.5)
write("two.brep")
make.addBox(0, 0, 0, 1, 1, 1)
make.addBox(0.5, 0.5, 0.5, 1, 1, 1)
write("crossing.brep")
make.fragment([(3, make.addBox(0, 0, 0, 1, 1, 1))], [(3, make.addBox(1, 0, 0, 1, 2, 1))])
write("joined.brep")
make.addBox(0, 0, 0, 1, 1, 1)
make.addBox(1, 0, 0, 1, 2, 1)
write("touching.brep")
make.fillet([make.addCylinder(0, 0, 0, 0, 0, 1, 0.5)], [1], [0.2])
write("filleted.brep")
# faces of one cylinder are not made one
gmsh.option.setNumber("Geometry.OCCUnionUnify", 0)
halves = [make.addCylinder(0, 0, 0, 0, 0, 1, 0.5, angle=3.141592653589793) for _ in range(2)]
make.rotate([(3, halves[1])], 0, 0, 0, 0, 0, 1, 3.141592653589793)
make.fuse([(3, halves[0])], [(3, halves[1])])
write("halves.brep")
"""
EXACT = {"ellipsoid": sc.Ellipsoid(1.2, 0.8, 0.8), "torus": sc.Torus()}
CLOSED = ("ellipsoid.step", "ellipsoid.brep", "torus.step")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return made(tmp_path_factory.mktemp("cad"), MAKER)


@pytest.fixture(scope="module", autouse=True)
def _shared_reads():
    """Each file is meshed once for as many points."""
    patch = pytest.MonkeyPatch()
    patch.setattr(_cad_files, "_meshed", cache(_cad_files._meshed))
    yield
    patch.undo()


def read(path, units, points):
    return read_cad(path, CadReading(units, points, Choice()), progress=lambda _: None)


@cache
def points_of(path):
    return read(path, "m" if path.suffix == ".brep" else None, 2000)


@pytest.mark.parametrize("name", CLOSED)
def test_points_lie_on_the_body_with_its_normals(files, name):
    found, body = points_of(files / name), EXACT[name.split(".")[0]]
    at = found.mesh.vertices
    assert 1500 < len(at) < 3000
    assert found.edges == () and not found.creases.any() and found.mesh.repairs == ()
    assert np.max(np.abs(body.level(at)) / np.linalg.norm(body.gradient(at), axis=1)) < 1e-12
    # at a pole of its parameters a face has none
    known = np.isfinite(found.normals).all(axis=1)
    assert np.sum(~known) <= 2
    np.testing.assert_allclose(found.normals[known], normal(body, at)[known], atol=1e-9)


def test_step_files_state_their_unit(files, tmp_path):
    stated = read(files / "torus.step", "mm", 500)
    np.testing.assert_allclose(np.ptp(stated.mesh.vertices[:, 2]), 1, atol=1e-3)
    for unit in ("m", "in"):
        with pytest.raises(ValueError, match=rf"torus.step is in mm, not in {unit}; leave units out"):
            read(files / "torus.step", unit, 500)
    # the same numbers, said to be metres
    text = (files / "torus.step").read_text()
    large = tmp_path / "large.STP"
    large.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    assert text.count("SI_UNIT(.MILLI.,.METRE.)") == 1
    metres = read(large, "m", 4000)
    # as many points as asked
    for found, points in ((stated, 500), (metres, 4000)):
        assert len(found.mesh.vertices) == pytest.approx(points, rel=0.15)
    np.testing.assert_allclose(np.ptp(metres.mesh.vertices[:, 2]), 1000, atol=1)


def test_brep_files_need_a_unit(files):
    with pytest.raises(ValueError, match=r'box.brep does not state its unit; give e\.g\. units="mm"'):
        sc.Cad(files / "box.brep", cache=False)
    with pytest.raises(ValueError, match="units = 'yard' is none of m, mm"):
        sc.Cad(files / "box.brep", "yard", cache=False)
    inches = read(files / "ellipsoid.brep", "in", 500)
    np.testing.assert_allclose(np.ptp(inches.mesh.vertices, axis=0), 0.0254 * np.array([2.4, 1.6, 1.6]), rtol=1e-2)


REFUSED = {
    "box.brep": r"box.brep is not smooth: edge between faces 1 and \d: 90 deg at \d+ points; .*; round its edges off",
    "cone.brep": r"cone.brep is not smooth: edge between faces 1 and 2: 117 deg at \d+ points",
    "capsule.brep": r"capsule.brep is not smooth enough \(curvature jumps\): the curvature jumps at \d+ of \d+",
    "two.brep": r"two.brep holds 2 separate surfaces, .*; take one, e.g. part='largest', or all with union=True",
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_smooth_body_is_refused_as_strict(files, tmp_path, name):
    with pytest.raises(ValueError, match=REFUSED[name]):
        sc.Cad(files / name, "m", points=2000, strict=True, cache=tmp_path)
    assert list(tmp_path.iterdir()) == []


@cache
def parted(path, **options):
    return sc.Cad(path, "m", **{"points": 500, "cache": False} | options)


def kinds(body):
    return sorted((crease.kind, round(crease.length, 2)) for crease in body.creases)


@pytest.mark.slow
def test_edges_and_joints_are_taken_in_pieces(files):
    box, capsule = parted(files / "box.brep"), parted(files / "capsule.brep")
    assert len(box.pieces) == 6 and kinds(box) == [("edge", 1.0)] * 12
    # a cylinder and two balls: the curvature jumps, the normal does not
    assert len(capsule.pieces) == 3 and [kind for kind, _ in kinds(capsule)] == ["joint"] * 2
    exact = sc.Capsule(0.5, 3.0)
    points = np.random.default_rng(5).uniform(-1.6, 1.6, size=(400, 3)) * [0.4, 0.4, 1]
    assert np.array_equal(capsule.level(points) > 0, exact.level(points) > 0)
    on = exact.level(project(capsule, points))
    # across a joint the next piece goes on a little
    np.testing.assert_allclose(on, 0, atol=1e-4)
    assert np.median(np.abs(on)) < 1e-12


@pytest.mark.slow
def test_fillets_are_joints(files):
    # the rims of the fillet: about the cylinder of radius 0.5, and about the lid of radius 0.3
    assert kinds(parted(files / "filleted.brep")) == [("edge", 3.14), ("joint", 1.88), ("joint", 3.14)]


@pytest.mark.slow
def test_halves_of_one_face_are_parted_by_seams(files):
    halves = parted(files / "halves.brep")
    # the halves of both lids and of the cylinder are parts of one surface, parted along lines of length 1
    assert {kind for kind, _ in kinds(halves)} == {"edge", "seam"}
    assert [pair for pair in kinds(halves) if pair[0] == "seam"] == [("seam", 1.0)] * 4
    angle = np.linspace(0, 2 * np.pi, 60)
    points = np.stack([0.49 * np.cos(angle), 0.49 * np.sin(angle), 0 * angle + 0.5], axis=-1)
    assert np.all(halves.level(points) < 0) and np.all(halves.level(points * [1.05, 1.05, 1]) > 0)


@pytest.mark.slow
def test_parts_of_a_cad_file_are_chosen(files):
    largest, second = (parted(files / "two.brep", points=800, part=part) for part in ("largest", 2))
    at = directions(np.random.default_rng(8), 50)
    np.testing.assert_allclose(largest.level(at), 0, atol=1e-4)
    np.testing.assert_allclose(second.level([3, 0, 0] + 0.5 * at), 0, atol=1e-4)
    # points are of the part alone, of a fifth of the area here
    assert min(body.fit.points for body in (largest, second)) > 600
    assert largest.repairs == ("part 1 of 2 of two.brep taken; 20 % of its area left out",)


@pytest.mark.slow
def test_parts_that_cross_are_united(files):
    whole = parted(files / "crossing.brep", union=True)
    # six faces each, and edges where they cross as well
    assert len(whole.pieces) == 12 and {crease.kind for crease in whole.creases} == {"edge"}
    crossing = [c for c in whole.creases if np.allclose(np.ptp(c.points, axis=0).max(), 0.5)]
    assert len(crossing) == 12
    points = np.random.default_rng(6).uniform(-0.2, 1.7, size=(2000, 3))
    inside = np.all(np.abs(points - 0.5) < 0.5, axis=1) | np.all(np.abs(points - 1) < 0.5, axis=1)
    assert np.array_equal(whole.level(points) < 0, inside)


@pytest.mark.parametrize(
    "name, options, pieces",
    [
        # what the wall leaves of the larger face, and the wall
        ("joined.brep", {"part": "largest"}, 7),
        ("touching.brep", {"part": 2}, 6),
        ("joined.brep", {"union": True}, None),
        ("touching.brep", {"union": True}, None),
    ],
)
@pytest.mark.slow
def test_solids_that_share_a_wall_have_an_outer_surface(files, name, options, pieces):
    """Boxes of volumes 1 and 2: as they touch, edges of the wall between them have more than two triangles."""
    with pytest.raises(ValueError, match=r"2 separate surfaces.*part='largest', or all with union=True"):
        parted(files / name)
    body = parted(files / name, **options)
    assert pieces in (None, len(body.pieces)) and {crease.kind for crease in body.creases} <= {"edge", "seam"}
    points = np.random.default_rng(7).uniform([-0.2] * 3, [2.2, 2.2, 1.2], size=(2000, 3))
    low = np.all((points > 0) & (points < 1), axis=1)
    high = np.all((points > [1, 0, 0]) & (points < [2, 2, 1]), axis=1)
    inside = low | high if "union" in options else low if options["part"] == 2 else high
    assert np.array_equal(body.level(points) < 0, inside)


def on_creases(found):
    return found.mesh.vertices[edges_of(found.mesh.triangles).ends[found.creases]].reshape(-1, 3)


def test_edges_are_where_they_are(files):
    found = points_of(files / "box.brep")
    assert len(found.edges) == 12 and all("90 deg" in line for line in found.edges)
    sharp = on_creases(found)
    off = np.sort(np.minimum(sharp, 1 - sharp), axis=1)
    np.testing.assert_allclose(off[:, :2], 0, atol=1e-12)
    rim = points_of(files / "cone.brep")
    np.testing.assert_allclose(on_creases(rim)[:, 2], 0, atol=1e-12)
    assert points_of(files / "capsule.brep").edges == ()


def cut(folder, files):
    data = (files / "torus.step").read_bytes()
    (folder / "cut.step").write_bytes(data[: len(data) // 2])


def written(name, data):
    return lambda folder, files: (folder / name).write_bytes(data)


BAD = {
    "missing.step": (lambda folder, files: None, "missing.step is no file"),
    "cut.step": (cut, "cut.step: gmsh cannot read or mesh it .*; repair the body or export it anew"),
    "empty.step": (written("empty.step", b""), "empty.step has 0 bytes"),
    "noise.step": (written("noise.step", bytes(range(256)) * 9), "noise.step does not begin as STEP files do"),
    "hollow.step": (written("hollow.step", b"ISO-10303-21;\nEND-ISO-10303-21;\n"), "gmsh cannot read or mesh it"),
    "hull.sldprt": (written("hull.sldprt", b"x"), r"hull.sldprt is none of \.step, .*; export the body as STEP"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_named(files, tmp_path, name):
    make, message = BAD[name]
    make(tmp_path, files)
    with pytest.raises(ValueError, match=message) as caught:
        sc.Cad(tmp_path / name, "m" if name.endswith(".brep") else None, cache=False)
    assert "Traceback" not in str(caught.value)


def test_options_are_checked(files, tmp_path):
    for source in (None, 7, tmp_path):
        with pytest.raises(ValueError, match=r"cannot be read|is none of"):
            sc.Cad(source, cache=False)
    for points in (100, 10**7, 2000.0, True):
        with pytest.raises(ValueError, match=r"points = .*; give a whole number from 500 to 200000"):
            sc.Cad(tmp_path / "a.step", points=points)
    for sew in (0, True, "wide", np.nan):
        with pytest.raises(ValueError, match=r"sew = .* is no distance in m"):
            sc.Cad(files / "box.brep", "m", sew=sew, cache=False)


def test_gmsh_that_is_not_installed_is_named_with_its_extra(files, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: None if name == "gmsh" else find(name, *a))
    with pytest.raises(ModuleNotFoundError, match=r"CAD files need gmsh: pip install 'creeping\[cad\]'") as caught:
        sc.Cad(files / "torus.step", cache=False)
    assert caught.value.name == "gmsh"


LIBRARY = "OSError: libGLU.so.1: cannot open shared object file: No such file or directory"
DEATHS = {
    "killed": ("kill -KILL $$", "gmsh cannot read or mesh it .it ended with code -9.; repair"),
    "says why": ("echo 'Error: no faces' >&2; exit 3", "cannot read or mesh it .Error: no faces."),
    "writes nothing": ("exit 0", "it ended with code 0"),
    "library": (f"echo '{LIBRARY}' >&2; exit 1", "gmsh does not start: OSError: libGLU.*; on Debian: apt install lib"),
    "hangs": ("exec sleep 60", r"torus.step: gmsh did not mesh it within 0.2 s; mend or simplify it"),
}


@pytest.mark.skipif(os.name != "posix", reason="the stand-in is a shell script")
@pytest.mark.parametrize("name", DEATHS)
def test_a_worker_that_dies_is_an_error_of_the_file(files, tmp_path, monkeypatch, name):
    text, message = DEATHS[name]
    path = tmp_path / "python"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(path))
    if name == "hangs":
        monkeypatch.setattr(_cad_files, "TIMEOUT", 0.2)
    with pytest.raises(ValueError, match=message):
        sc.Cad(files / "torus.step", cache=False)


def test_modules_of_the_working_folder_are_not_imported(files, tmp_path, monkeypatch):
    for module in ("numpy", "gmsh", "scatterers"):
        (tmp_path / f"{module}.py").write_text("raise SystemExit('imported by accident')")
    monkeypatch.chdir(tmp_path)
    # as many points as no other test asks for
    assert len(read(files / "torus.step", None, 510).mesh.vertices) > 400


def test_ellipsoid_against_the_exact_one(files):
    body, exact = sc.Cad(files / "ellipsoid.step", points=2000, cache=False), EXACT["ellipsoid"]
    assert body.quality.verdict == "smooth" and body.edges == () and body.repairs == ()
    assert not body.pieces and not body.creases
    rng = np.random.default_rng(4)
    points = exact.forward(directions(rng, 500))
    found, n = project(body, points), normal(exact, points)
    along = np.cross(n, rng.normal(size=n.shape))
    # twice what was measured
    assert rms(np.linalg.norm(found - points, axis=1)) < 1e-6
    assert rms(np.linalg.norm(normal(body, found) - n, axis=1)) < 2e-5
    off = rms(normal_curvature(body, found, along) - normal_curvature(exact, points, along))
    assert off < 4e-4
    assert off < body.fit.normal_curvature_error < 10 * off
    # that of the exact one is published
    assert cr.shadow_line(body, (1.0, 1.0, 1.0)).length == pytest.approx(6.1340508514, abs=1e-5)


@pytest.mark.slow
def test_ends_that_are_sharper_than_their_points_are_followed_by_normals(files):
    """Radius 3 mm, points 4 mm apart: jets make nothing of it, normals of the faces do."""
    body, exact = sc.Cad(files / "flat.step", points=3000, cache=False), sc.Ellipsoid(0.126, 0.049, 0.02)
    middle = np.array([0.003, 0.002, 0.001])
    assert body.quality.verdict == "too coarse" and not body.pieces
    points = exact.forward(directions(np.random.default_rng(4), 500))
    points = np.concatenate([points, [[0.126, 0, 0], [-0.126, 0, 0]]])
    assert not np.any(body.non_smooth(points + middle))
    found, n = project(body, points + middle) - middle, normal(exact, points)
    assert np.max(np.linalg.norm(found - points, axis=1)) < 1e-4
    assert np.max(np.linalg.norm(normal(body, found + middle) - n, axis=1)) < 0.1
    # it is its own mirror image to rounding, as the exact one is, and takes no more tiles
    tiles = [tiles_of(patches_of(one), 200.0, CONDUCTOR) for one in (body, exact)]
    assert mirrors_of(tiles[0], CONDUCTOR).flips == ((0,), (1,), (2,))
    assert len(tiles[0].points) < 1.2 * len(tiles[1].points)


@pytest.mark.slow
def test_second_opening_takes_the_fit_from_the_cache(files, tmp_path, monkeypatch):
    path, messages = files / "ellipsoid.step", []
    first = sc.Cad(path, points=2000, cache=tmp_path, progress=messages.append)
    assert messages[0] == "reading the CAD file" and any("fitting" in line for line in messages)
    monkeypatch.setattr(_cad_files, "_meshed", lambda *_, **__: pytest.fail("gmsh was asked"))
    second = sc.Cad(str(path), points=2000, cache=tmp_path)
    assert second.fingerprint == first.fingerprint and second.fit == first.fit
    # other points are another fit
    with pytest.raises(pytest.fail.Exception, match="gmsh was asked"):
        sc.Cad(path, points=2100, cache=tmp_path)
    assert Path(tmp_path / f"{first._identity()}.npz").is_file()
