"""``creeping cache``, versions, and texts that help: what a user reads of what is kept and of what was mistyped."""

import inspect
import json
import sys

import numpy as np
import pytest
import shared_bodies as sc
import trimesh
from command_line import creeping

import creeping as cr
from tests.exact_meshes import geodesic_sphere


def said(capsys, *words):
    return creeping(*words, capsys=capsys)[:2]


def test_version_as_json(capsys):
    code, text = said(capsys, "--version", "--json")
    found = json.loads(text)
    assert code == 0 and found["creeping"] == cr.__version__ and found["numpy"] == np.__version__
    assert found["python"] == sys.version.split()[0]
    assert said(capsys, "--version")[1].strip() == cr.__version__


@pytest.mark.slow
def test_cache_shows_files_and_decimal_numbers(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("CREEPING_CACHE", str(tmp_path / "kept"))
    points, triangles = geodesic_sphere(1000)
    trimesh.Trimesh(points, triangles).export(tmp_path / "ball of mine.ply")
    body = sc.Mesh(tmp_path / "ball of mine.ply", units="m")
    for one in (body, sc.Ellipsoid(1.2, 0.8, 0.7)):
        cr.build_phase_map(one, horizon=0.5, grid=(12, 16), degree=3, cache=True)
    text = said(capsys, "cache", "ls")[1]
    assert text.count("ball of mine.ply") == 2 and str(tmp_path / "ball") not in text
    assert "a=1.2, b=0.8, c=0.7" in text and "0x" not in text
    rows = json.loads(said(capsys, "cache", "ls", "--json")[1])
    assert [row["source"] for row in rows if "fit" in row] == ["ball of mine.ply"]


@pytest.fixture(scope="module")
def fan():
    ball = sc.Sphere()
    return cr.launch(cr.DirectFlow(ball, rtol=1e-6), cr.shadow_line(ball, (0, 0, 1)), length=0.5, n_rays=8)


def test_what_was_mistyped_is_told_where_to_go(fan):
    for name, meant in {"PEC": "pec", " Soft": "soft", "Neumann": "hard"}.items():
        with pytest.raises(cr.InvalidInputError, match=f"did you mean '{meant}'"):
            cr.far_field(fan, [(0, 0, -1)], wavenumber=20.0, boundary=name)
    for several in ([30, 40], np.array([30.0, 40.0]), (30,)):
        with pytest.raises(cr.InvalidInputError, match="sweep_directions"):
            cr.far_field(fan, [(0, 0, -1)], wavenumber=several)
    with pytest.raises(ValueError, match=r"write x\*\*2"):
        sc.Implicit("x^2 + y^2 + z^2 - 1")


def test_help_is_readable():
    for name in dir(cr):
        value = getattr(cr, name)
        if inspect.isfunction(value):
            text = str(inspect.signature(value))
            assert "numpy._typing" not in text and len(text) < 900, name
    assert not {"Any", "TYPE_CHECKING", "import_module", "present_with", "ArrayLike"} & set(dir(cr))
