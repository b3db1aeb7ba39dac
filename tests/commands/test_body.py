"""Bodies from files and expressions on the command line: outputs, exit codes, messages."""

import json

import numpy as np
import pytest
import shared_bodies as sc
import trimesh
from command_line import creeping

import creeping as cr


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A mesh of the unit sphere, in millimetres, that does not say so."""
    path = tmp_path_factory.mktemp("meshes") / "ball.stl"
    mesh = trimesh.creation.icosphere(3)
    mesh.apply_scale(1000)
    mesh.export(path)
    return path


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    path = tmp_path_factory.mktemp("meshes") / "cube.off"
    trimesh.creation.box().subdivide().subdivide().subdivide().export(path)
    return path


SHORT = ["--direction", 0.1, 0.2, 1, "--flow", "direct", "--rays", 16, "--backend", "matplotlib"]


@pytest.mark.slow
def test_run_with_an_expression(tmp_path, capsys):
    body = "x**2 + y**2 + 4*z**2 - 1"
    code, out, err = creeping("run", body, *SHORT, "--length", 0.5, "--no-pictures", "-o", tmp_path, capsys=capsys)
    assert code == 0
    assert "examining the expression" in err
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["body"] == body and out.startswith(body)
    # the same oblate spheroid by name
    line = cr.shadow_line(sc.Ellipsoid(1.0, 1.0, 0.5), (0.1, 0.2, 1.0))
    assert summary["shadow_line"][0]["length"] == pytest.approx(line.curves[0].length, rel=1e-8)
    assert not {"fit", "verdict", "error_of_body"} & set(summary)


def test_run_with_a_mesh(ball, tmp_path, capsys):
    options = [*SHORT, "--length", 1, "--units", "mm", "--no-pictures", "-o", tmp_path]
    code, out, err = creeping("run", ball, *options, capsys=capsys)
    assert code == 0
    assert "reading the mesh" in err and "fitting" in err
    assert "body: a fit to 1922 points" in out and "because of it: points" in out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["verdict"] == "smooth" and summary["ray_status"]["NON_SMOOTH"] == 0
    assert summary["fit"]["points"] == 642 + 1280
    assert summary["fit"]["normal_curvature"] == pytest.approx(1, rel=1e-3)
    # that corners of an STL file's triangles are joined is no repair
    assert summary["repairs"] == []
    # a sphere of one metre: its shadow line is a great circle
    assert summary["shadow_line"][0]["length"] == pytest.approx(2 * np.pi, abs=1e-5)
    off = summary["error_of_body"]
    assert 0 < off["points"] < 1e-4 and 0 < off["spreading"] < 1e-3 and 0 < off["attenuation"] < 1e-3
    assert 1 <= off["rays"] <= summary["rays"]
    # once more, the fit from the cache, with a field
    options = ["--length", 3.2, "--units", "mm", "--wavenumber", 10, "--observe", "grid:90", "-o", tmp_path]
    code, out, err = creeping("run", ball, *SHORT, *options, "--no-pictures", capsys=capsys)
    assert code == 0 and "fitting" not in err
    assert "error of the field because of the body: rms" in out
    entry = json.loads((tmp_path / "summary.json").read_text())["field"]
    assert 0 < entry["uncertain_by"]["rms"] <= entry["uncertain_by"]["max"] < 1e-2 * entry["largest"]


def test_maps_and_fitted_bodies_in_the_cache(ball, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("CREEPING_CACHE", str(tmp_path))
    assert "0 maps, 0 fitted bodies" in creeping("cache", "ls", capsys=capsys)[1]
    body = sc.Mesh(ball, "mm")
    cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(12, 16), degree=3, cache=True)
    assert "1 maps, 1 fitted bodies" in creeping("cache", "ls", capsys=capsys)[1]
    rows = json.loads(creeping("cache", "ls", "--json", capsys=capsys)[1])
    (row,) = (one for one in rows if "fit" in one)
    assert len(rows) == 2 and f"({row['fit']})" in body.fingerprint and row["MB"] > 0
    code, out, _ = creeping("cache", "verify", capsys=capsys)
    assert code == 0 and f"ok       {row['fit']}\n" in out
    (state,) = tmp_path.glob("*/state-0.npy")
    for file in (tmp_path / "fits" / f"{row['fit']}.npz", state):
        whole = file.read_bytes()
        file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 0x55]))
        code, out, _ = creeping("cache", "verify", capsys=capsys)
        assert code == 3 and "DAMAGED" in out
        file.write_bytes(whole)
    assert "removed 1 maps, 1 fitted bodies" in creeping("cache", "clear", capsys=capsys)[1]
    assert not any((tmp_path / "fits").glob("*.npz")) and not state.exists()


@pytest.mark.slow
def test_check_of_a_mesh(ball, tmp_path, capsys):
    options = ["--units", "mm", "--wavenumber", 4 * np.pi]
    code, out, _ = creeping("check", ball, *options, "-o", tmp_path / "new", capsys=capsys)
    assert code == 0
    assert "size                       2 x 2 x 2 m" in out
    assert "4 x 4 x 4 wavelengths" in out
    assert "fit: 1922 points" in out and "genus 0" in out
    assert (tmp_path / "new" / "quality.png").read_bytes().startswith(b"\x89PNG")
    code, out, _ = creeping("check", ball, *options, "--json", capsys=capsys)
    answer = json.loads(out)
    assert code == 0 and answer["ok"] is True
    assert answer["quality"]["verdict"] == "smooth" and answer["fit"]["points"] == 1922 and answer["genus"] == 0
    assert "picture" not in answer


def test_check_of_a_cube_gives_its_quality(cube, tmp_path, capsys):
    strict = ["--units", "m", "--strict"]
    code, out, err = creeping("check", cube, *strict, "-o", tmp_path, capsys=capsys)
    assert code == 3
    assert "verdict                    sharp" in out and "dihedral 50 %, 99 %, max" in out
    assert "refused: " in out and "round the edges off" in out
    assert "Traceback" not in err
    assert (tmp_path / "quality.png").stat().st_size > 5000
    code, out, _ = creeping("check", cube, *strict, "--json", capsys=capsys)
    answer = json.loads(out)
    assert code == 3 and answer["ok"] is False
    assert answer["quality"]["verdict"] == "sharp" and "not smooth enough" in answer["refused"]


@pytest.mark.slow
def test_a_cube_is_taken_in_pieces(cube, tmp_path, capsys):
    code, out, err = creeping("check", cube, "--units", "m", "--json", capsys=capsys)
    answer = json.loads(out)
    # its faces are planes, whose Hessians are nought
    assert code == 0 and answer["ok"] is True, err
    assert answer["area"] == pytest.approx(6) and answer["quality"]["verdict"] == "sharp" and "refused" not in answer
    # rays along flat faces do not creep: all of the line lies on edges, and that is said
    code, out, _ = creeping(
        "run", cube, *SHORT, "--length", 0.5, "--units", "m", "-o", tmp_path, "--no-pictures", capsys=capsys
    )
    assert code == 0 and "on edges and tips: 100 % of the line" in out
    assert json.loads((tmp_path / "summary.json").read_text())["losses"]["line"] == 1


@pytest.fixture(scope="module")
def balls(tmp_path_factory):
    """Two balls, of radius 1 and 0.5 m."""
    folder, small = tmp_path_factory.mktemp("meshes"), trimesh.creation.icosphere(3, radius=0.5)
    small.apply_translation([3, 0, 0])
    trimesh.util.concatenate([trimesh.creation.icosphere(3), small]).export(folder / "balls.off")
    return folder / "balls.off"


@pytest.mark.slow
def test_options_of_files_reach_the_body(balls, capsys):
    code, _, err = creeping("check", balls, "--units", "m", "--surface", "smooth", capsys=capsys)
    assert code == 3 and "holds 2 separate surfaces" in err and "union" in err
    for part, size in (("largest", 2.0), (2, 1.0)):
        code, out, _ = creeping("check", balls, "--units", "m", "--part", part, "--json", capsys=capsys)
        assert code == 0
        np.testing.assert_allclose(json.loads(out)["quality"]["size"], size, atol=0.02)


@pytest.mark.parametrize(
    "options, match",
    [
        (["--part", 3], "--part 3 is none of balls.off"),
        (["--part", "wing"], "no part 'wing'"),
        (["--cap", -1], "--cap -1.0 is no size in m"),
        (["--subdivide", 4], "--subdivide 4; give 1, 2 or 3 times"),
        (["--sew", 0.1], "--sew does not belong to this body"),
    ],
)
def test_bad_options_of_files_are_exit_code_3(balls, options, match, capsys):
    code, _, err = creeping("check", balls, "--units", "m", *options, capsys=capsys)
    assert code == 3 and match in err and "Traceback" not in err


@pytest.mark.parametrize(
    "name, match",
    [
        ("hull.vtk", "hull.vtk is a VTK file; save its surface as STL"),
        ("hull.step", "hull.step does not begin as STEP files do: it is a VTK file"),
        ("hull", "hull is a VTK file"),
    ],
)
def test_what_is_there_is_a_file_whatever_its_name(name, match, tmp_path, capsys):
    (tmp_path / name).write_text("# vtk DataFile Version 3.0\n")
    code, _, err = creeping("check", tmp_path / name, "--units", "m", capsys=capsys)
    assert code == 3 and match in err and "--units" not in err


@pytest.mark.parametrize(
    "body, more, match",
    [
        ("ball", [], "does not state its unit"),
        ("ball", ["--units", "yard"], "--units yard is none of m, mm"),
        ("cube", ["--units", "m", "--strict"], "not smooth enough (sharp)"),
        ("none.stl", ["--units", "m"], "none.stl is no file on this machine"),
        ("none.xyz", [], "unknown body 'none.xyz'"),
        ("torus", ["--units", "mm"], "--units does not belong to this body: torus takes none"),
        ("x/none.xyz", ["--units", "mm"], "--units does not belong to this body: 'x/none.xyz' is no file"),
        ("x**2 + y**2 - 1", [], "x**2 + y**2 - 1: "),
        ("__import__('os').system('touch hey') + x", [], ""),
    ],
)
def test_bad_bodies_are_exit_code_3(body, more, match, capsys, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    source = request.getfixturevalue(body) if body in ("ball", "cube") else body
    code, _, err = creeping("run", source, *more, "--direction", 1, 0, 0, "-o", "x", capsys=capsys)
    assert code == 3 and match in err and "Traceback" not in err
    assert list(tmp_path.iterdir()) == []
