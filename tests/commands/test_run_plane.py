"""``creeping run --plane``: what is asked for, and what the files hold."""

import json

import numpy as np
import pytest
import scipy.io
from command_line import ran, table

from creeping.commands.run_report import parse_plane
from creeping.errors import InvalidInputError
from tests.reference import sphere


@pytest.mark.slow
def test_planes_are_written(tmp_path, capsys):
    options = ["--direction", 0, 0, 1, "--flow", "direct", "--rays", 32, "--wavenumber", 12, "--boundary", "hard"]
    planes = ["--plane", "incidence:0.5", "--plane", "xy:1", "--observe", "backscatter"]
    assert ran("run", "sphere", *options, *planes, "--no-pictures", "-o", tmp_path) == 0
    said, told = capsys.readouterr()
    assert "field on the plane incidence:0.5: " in said and "field on the plane xy:1: " in said
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert {"plane.csv", "plane_2.csv"} <= set(summary["files"])
    assert sorted(summary["files"]) == sorted(file.name for file in tmp_path.iterdir())
    # its cost beforehand: points outside, no seconds of a few
    for plane in summary["planes"]:
        outside = np.prod(plane["points"]) - plane["inside"]
        assert sum(plane["status"].values()) == outside
        assert f"field on the plane {plane['plane']}: {outside} points ...\n" in told
    rows = table(tmp_path / "plane.csv")
    points = np.array([[float(row[name]) for name in "xyz"] for row in rows])
    values = np.array([complex(float(row["re_u"]), float(row["im_u"])) for row in rows])
    np.testing.assert_allclose([float(row["across"]) for row in rows], points[:, 2], atol=1e-12)
    away = np.linalg.norm(points, axis=1) > 1.4
    exact = sphere.total_field(12.0, 1.0, points[away], (0, 0, 1), "hard")
    assert np.median(np.abs(values[away] - exact)) < 0.03


@pytest.mark.slow
def test_tables_for_matlab_hold_what_the_others_hold(tmp_path, capsys):
    options = ["--direction", 0, 0, 1, "--flow", "direct", "--rays", 16, "--wavenumber", 12, "--no-pictures"]
    options += ["--observe", "cut:0:30", "--observe", "backscatter", "--plane", "xz:0.5", "-o", tmp_path]
    assert ran("run", "sphere", *options, "--format", "csv,mat") == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert sorted(summary["files"]) == sorted(file.name for file in tmp_path.iterdir())
    tables = {}
    for stem in ("line", "rays", "curves", "far", "plane"):
        rows = table(tmp_path / f"{stem}.csv")
        tables[stem] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    back = {stem: scipy.io.loadmat(tmp_path / f"{stem}.mat", simplify_cells=True) for stem in tables}
    rows = tables["far"]
    f = rows["re"].astype(float) + 1j * rows["im"].astype(float)
    np.testing.assert_array_equal(back["far"]["f"], f)
    np.testing.assert_array_equal(back["far"]["angle"], rows["angle"].astype(float))
    assert back["far"]["observe"].tolist() == rows["observe"].tolist() == 13 * ["cut:0:30"] + ["backscatter"]
    rows, outside = tables["plane"], back["plane"]["outside"] != 0
    np.testing.assert_array_equal(back["plane"]["u"][outside].real, rows["re_u"].astype(float))
    np.testing.assert_array_equal(back["plane"]["status"][outside], rows["status"].astype(int))
    np.testing.assert_array_equal(back["rays"]["points"][..., 0].ravel(), tables["rays"]["x"].astype(float))
    np.testing.assert_array_equal(back["rays"]["spreading"].ravel(), tables["rays"]["J"].astype(float))
    assert (back["line"]["units"]["length"], back["rays"]["units"]["curvature"]) == ("L", "1/L")
    assert back["rays"]["units"]["attenuation"] == "L^(1/3)" and set(back["line"]["status"]) == {"attached"}
    assert set(back["curves"]["of"]) == {"travel_time"}
    np.testing.assert_array_equal(back["line"]["points"][:, 1], tables["line"]["y"].astype(float))
    np.testing.assert_array_equal(back["curves"]["points"][:, 1], tables["curves"]["y"].astype(float))
    # alone, and what there is not
    bare = ["--direction", 0, 0, 1, "--flow", "direct", "--rays", 16, "--no-pictures", "-o", tmp_path]
    assert ran("run", "sphere", *bare, "--format", "mat") == 0
    files = json.loads((tmp_path / "summary.json").read_text())["files"]
    assert "rays.mat" in files and not [name for name in files if name.endswith(".csv")]
    assert ran("run", "sphere", *options, "--format", "hdf") == 3
    assert "give some of csv, mat" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "zx", "xy:0", "xy:nan", "incidence:a"])
def test_unknown_planes_are_refused(text):
    with pytest.raises(InvalidInputError, match="is unknown; give incidence, xy, xz or yz"):
        parse_plane(text)
    found = parse_plane("yz:0.5")
    assert found.axes.tolist() == [[0, 1, 0], [0, 0, 1]] and found.step == 0.5
    assert parse_plane("incidence").axes is None
