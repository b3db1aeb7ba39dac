"""The command line as a user meets it: outputs, exit codes, messages."""

import json
import os
import subprocess
import sys

import pytest
import shared_bodies as sc
from command_line import creeping, table

import creeping as cr
from tests.reference import sphere


def test_run_writes_everything_it_names(tmp_path, capsys):
    folder = tmp_path / "out"
    options = ["--direction", 1, -1, 0.5, "--length", 1, "--rays", 32, "--tolerance", 1e-4, "--backend", "matplotlib"]
    body = "ellipsoid:a=1.2,b=0.8,c=0.8"
    code, out, err = creeping("run", body, *options, "--flow", "map", "-o", folder, capsys=capsys)
    assert code == 0
    assert "shadow line 1: length" in out
    assert "shadow line ..." in err
    summary = json.loads((folder / "summary.json").read_text())
    assert sorted(summary["files"]) == sorted(f.name for f in folder.iterdir())
    assert summary["flow"] == "map"
    assert summary["phase_map"]["rms"] <= 1e-4
    assert summary["error_of_rays"]["rms"] <= 1e-4
    assert summary["rays"] >= 32
    assert (folder / "rays.png").stat().st_size > 20_000


def test_few_rays_are_integrated_directly_and_json_is_all_that_is_printed(tmp_path, capsys):
    options = ["--direction", 0, 0, 1, "--length", 0.5, "--rays", 16, "--of", "eikonal", "--json", "--no-pictures"]
    code, out, err = creeping("run", "torus", *options, "-o", tmp_path, capsys=capsys)
    assert code == 0 and err == ""
    summary = json.loads(out)
    assert [round(c["length"], 8) for c in summary["shadow_line"]] == [9.42477796, 3.14159265]
    assert "phase_map" not in summary and summary["flow"] == "direct" and summary["error_of_rays"]["rms"] <= 1e-6


def test_run_with_a_wavenumber_writes_the_field(tmp_path, capsys):
    options = ["--direction", 0.06, 0.03, 1, "--flow", "direct", "--rays", 32, "--length", 3.6]
    options += ["--backend", "matplotlib"]
    field = ["--wavenumber", 20, "--boundary", "hard", "--observe", "cut:30:4", "--observe", "grid:90"]
    code, out, _ = creeping("run", "sphere", *options, *field, "--observe", "150,20", "-o", tmp_path, capsys=capsys)
    assert code == 0
    assert "field: k = 20, hard" in out and "direct integration of order 8" in out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert {"far.csv", "far.png", "far.ffe", "field.png"} <= set(summary["files"])
    assert sorted(summary["files"]) == sorted(f.name for f in tmp_path.iterdir())
    entry = summary["field"]
    assert (entry["wavenumber"], entry["boundary"], entry["order"]) == (20.0, "hard", 2)
    assert entry["observe"] == ["cut:30:4", "grid:90", "150,20"]
    assert entry["directions"] == sum(entry["methods"].values()) == 91 + 3 * 5 + 1
    assert entry["unresolved"] == entry["not_finite"] == 0
    # known exactly, as are its rays
    assert "uncertain_by" not in entry and not {"fit", "verdict", "error_of_body"} & set(summary)
    # the forward lobe of the hard sphere from its series; the cut passes a quarter of a degree from its top
    forward = abs(sphere.far_field(20.0, 1.0, [1.0], "hard")[0])
    assert entry["largest"] == pytest.approx(forward, rel=0.02)
    rows = table(tmp_path / "far.csv")
    assert len(rows) == entry["directions"]
    around = {round(float(row["phi"])) for row in rows if row["observe"] == "grid:90"}
    assert around == {0, 90, 180, 270}
    assert (round(float(rows[-1]["theta"])), round(float(rows[-1]["phi"]))) == (150, 20)


_SPHERE = ["run", "sphere", "--direction", 1, 0, 0, "-o", "x"]
_FIELD = [*_SPHERE, "--wavenumber", 20]


@pytest.mark.parametrize(
    "arguments, match",
    [
        (["run", "cube", "--direction", 1, 0, 0, "-o", "x"], "unknown body 'cube'"),
        (["run", "sphere", "--direction", 0, 0, 0, "-o", "x"], "zero vector"),
        (["run", "sphere", "--direction", 1, 0, 0, "--length", -1, "-o", "x"], "--length"),
        ([*_SPHERE, "--spacing", 1e-9, "--flow", "direct"], "iso-phase levels"),
        (["run", "torus", "--direction", 1, 0, 0, "-o", "x"], "crosses itself"),
        ([*_SPHERE, "--boundary", "hard"], "--boundary needs --wavenumber"),
        ([*_SPHERE, "--wavenumber", -3], "--wavenumber = -3.0 is not a positive"),
        ([*_FIELD, "--boundary", "firm"], "'firm' is not soft, hard, pec or impedance:ETA"),
        (["check", "ellipsoid:q=1"], "ellipsoid has no parameter 'q'; it has a, b, c"),
        ([*_FIELD, "--observe", "sphere:3"], "'sphere:3' is unknown; give cut:PHI"),
        ([*_FIELD, "--observe", "grid:7"], "must divide 180"),
        ([*_FIELD, "--observe", "grid:0.1"], "more than 200000 directions"),
        ([*_FIELD, "--observe", "grid:5", "--observe", "grid:9"], "several grids"),
        ([*_FIELD, "--speed", "1 + 0.1*x"], "leave out --speed"),
        (["figure", "nonsense"], "unknown figure"),
    ],
)
def test_bad_input_is_exit_code_3_and_one_line(arguments, match, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = creeping(*arguments, capsys=capsys)
    assert code == 3 and match in err and "Traceback" not in err
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("arguments", [["run", "sphere"], ["run", "sphere", "--direction", "1", "-o", "x"], ["fly"]])
def test_usage_is_exit_code_2(arguments, capsys):
    assert creeping(*arguments, capsys=capsys)[0] == 2


def test_interrupt_is_exit_code_130(capsys, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("creeping.shadow_line", interrupted, raising=False)
    code, _, err = creeping("run", "sphere", "--direction", 1, 0, 0, "-o", "x", capsys=capsys)
    assert code == 130
    assert "interrupted" in err


def test_cache_clear_leaves_what_is_not_ours(tmp_path, capsys, monkeypatch):
    """Neither folders with a file manifest.json, nor what a link leads to."""
    monkeypatch.setenv("CREEPING_CACHE", str(tmp_path / "maps"))
    cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(16, 16), degree=3, cache=True)
    cr.build_phase_map(sc.Sphere(radius=2.0), horizon=0.5, grid=(16, 16), degree=3, cache=True)
    first, second = sorted(folder for folder in (tmp_path / "maps").iterdir() if folder.is_dir())
    (second / "notes.txt").write_text("mine")
    foreign = tmp_path / "maps" / "project"
    foreign.mkdir()
    (foreign / "manifest.json").write_text('{"name": "an app"}')
    (tmp_path / "maps" / "link").symlink_to(foreign)
    (tmp_path / "maps" / "fits").mkdir()
    (tmp_path / "maps" / "fits" / "data.npz").write_bytes(b"measured")
    code, out, _ = creeping("cache", "clear", capsys=capsys)
    assert code == 3 and "removed 1 maps, 0 fitted bodies" in out
    for name in ("project", "link", "notes.txt", "data.npz"):
        assert name in out
    assert (foreign / "manifest.json").exists() and (tmp_path / "maps" / "fits" / "data.npz").exists()
    assert not first.exists() and [path.name for path in second.iterdir()] == ["notes.txt"]


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no such permissions here")
def test_a_cache_that_others_can_write_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setenv("CREEPING_CACHE", str(tmp_path / "new" / "maps"))
    asked = {"horizon": 0.5, "grid": (16, 16), "degree": 3, "cache": True}
    cr.build_phase_map(sc.Sphere(), **asked)
    assert (tmp_path / "new" / "maps").stat().st_mode & 0o777 == 0o700
    (tmp_path / "new" / "maps").chmod(0o777)
    said = []
    cr.build_phase_map(sc.Sphere(), **asked, progress=said.append)
    assert any("can be written by other users" in text for text in said)


@pytest.mark.parametrize(
    "error, words",
    [
        (MemoryError(), "not enough memory (an array is too large)"),
        (PermissionError(13, "Permission denied", "/nowhere"), "Permission denied: '/nowhere'"),
    ],
)
def test_what_the_machine_refuses_is_one_line(error, words, capsys, monkeypatch):
    def fails():
        raise error

    monkeypatch.setattr("creeping.commands.upkeep._stored", fails)
    code, _, err = creeping("cache", "ls", capsys=capsys)
    assert code == 3 and words in err and err.count("\n") == 1


def test_doctor(capsys):
    code, out, _ = creeping("doctor", capsys=capsys)
    assert code == 0
    assert "numba" in out
    assert "3-D graphics" in out


def test_help_does_not_import_the_heavy_libraries():
    code = (
        "import sys; sys.argv = ['creeping', '--help']\n"
        "from creeping.commands.main import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'pyvista', 'trimesh', 'sympy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ}, check=False)
    assert done.returncode == 0, done.stderr
    assert "run" in done.stdout
