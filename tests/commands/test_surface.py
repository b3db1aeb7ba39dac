"""Files on their facets from the command line: which surface is taken, what is said of it, and its fields."""

import json

import numpy as np
import pytest
import trimesh
import xarray
from command_line import creeping, ran, table

from creeping.commands.options import FileOptions, parse_body
from creeping.errors import InvalidInputError


@pytest.fixture
def two_balls(tmp_path):
    """File of two coarse balls apart, which no single smooth surface is."""
    parts = [trimesh.creation.icosphere(subdivisions=1, radius=0.5) for _ in range(2)]
    parts[1].apply_translation([2.0, 0.0, 0.0])
    path = tmp_path / "balls.stl"
    trimesh.util.concatenate(parts).export(path)
    return path


def test_auto_takes_facets_where_nothing_smooth_fits_and_says_why(two_balls):
    said = []
    body = parse_body(str(two_balls), options=FileOptions(units="m"), progress=said.append)
    assert len(body.triangles) == 160 and "2 separate surfaces" in body.without_rays
    assert any("taken on its facets (160 triangles), without creeping rays" in text for text in said)
    with pytest.raises(InvalidInputError, match="2 separate surfaces"):
        parse_body(str(two_balls), options=FileOptions(units="m", surface="smooth"))
    # what asks for a smooth surface does not get facets
    with pytest.raises(InvalidInputError, match="2 separate surfaces"):
        parse_body(str(two_balls), options=FileOptions(units="m", strict=True))
    with pytest.raises(InvalidInputError, match="strict is of a smooth surface"):
        parse_body(str(two_balls), options=FileOptions(units="m", surface="facets", strict=True))
    with pytest.raises(InvalidInputError, match="none of smooth, facets, auto"):
        parse_body(str(two_balls), options=FileOptions(units="m", surface="round"))
    with pytest.raises(InvalidInputError, match="does not belong to this body"):
        parse_body("sphere", options=FileOptions(surface="facets"))


def test_what_is_wrong_with_a_file_is_told_once(tmp_path):
    mesh = trimesh.creation.box()
    mesh.update_faces([True] * 11 + [False])
    mesh.export(tmp_path / "open.stl")
    with pytest.raises(InvalidInputError, match=r"edges of open\.stl are open") as caught:
        parse_body(str(tmp_path / "open.stl"), options=FileOptions(units="m"))
    assert str(caught.value).count("are open") == 1


def test_check_says_first_what_a_field_is_made_by(two_balls, capsys):
    code, out, _ = creeping("check", two_balls, "--units", "m", "--wavenumber", 6, capsys=capsys)
    first, second = out.splitlines()[:2]
    assert code == 0 and "on its facets" in first and "2 separate surfaces" in first
    assert "3 wavelengths across" not in second and "integral equation between" in second
    code, out, _ = creeping("check", "cylinder:radius=1,length=2", "--json", capsys=capsys)
    field = json.loads(out)["field"]
    assert "smooth pieces" in field["body"] and field["nodes"] > 1000


def test_a_run_of_facets(two_balls, tmp_path, capsys):
    words = [two_balls, "--units", "m", "--no-pictures"]
    out = tmp_path / "run"
    code, said, _ = creeping(
        "run", *words, "--direction", 1, 0.2, 0.1, "--wavenumber", 4, "--boundary", "hard", "--observe", "backscatter",
        "--plane", "xy:0.25", "-o", out, capsys=capsys,
    )  # fmt: skip
    assert code == 0 and "no creeping rays: no smooth surface fits it" in said and "field on the plane xy:0.25" in said
    summary = json.loads((out / "summary.json").read_text())
    assert summary["files"] == ["far.csv", "plane.csv", "summary.json"] and summary["field"]["unresolved"] == 0
    (plane,) = summary["planes"]
    assert plane["methods"] == {"equation": len(table(out / "plane.csv"))}
    assert len(table(out / "plane.csv")) + plane["inside"] == np.prod(plane["points"])
    row = table(out / "far.csv")[0]
    assert row["method"] == "equation" and "lit_re" in row and "creeping_re" not in row
    code, _, said = creeping("run", *words, "--direction", 1, 0, 0, "-o", out, capsys=capsys)
    assert code == 3 and "no creeping rays" in said and "--wavenumber" in said


def test_echoes_of_facets(two_balls, tmp_path):
    words = [two_balls, "--units", "m", "--no-pictures", "--sound-speed", 1500, "--frequency", "700Hz"]
    assert ran("ts", *words, "--incidence", "40,0", "--boundary", "hard", "-o", tmp_path / "ts") == 0
    assert [row["unresolved"] for row in table(tmp_path / "ts" / "ts.csv")] == ["0"]


def test_a_study_of_facets(two_balls, tmp_path, capsys):
    study = tmp_path / "a.toml"
    study.write_text(
        f'[study]\nbody = "{two_balls.name}"\nunits = "m"\nsurface = "facets"\n'
        'wavenumbers_per_length = [3.0]\nboundary = ["hard"]\n'
        '[incidences]\nkind = "lebedev"\norder = 3\n[run]\noutput = "out.zarr"\n'
    )
    code, out, _ = creeping("sweep", study, capsys=capsys)
    assert code == 0 and "6 incidences" in out
    with xarray.open_zarr(tmp_path / "out.zarr", consolidated=False) as ds:
        assert np.all(np.isfinite(ds.total.values)) and ds.by_currents.values.all() and ds.attrs["flow"] == "none"
    assert creeping("sweep", study, "--resume", capsys=capsys)[0] == 0
