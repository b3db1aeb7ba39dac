"""``creeping run --plane``: what is asked for, and what the files hold."""

import csv
import json

import numpy as np
import pytest

from creeping.commands.main import main
from creeping.commands.run_plane import parse_plane
from creeping.errors import InvalidInputError
from studies.reference import sphere


def ran(*words):
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return end.value.code


def test_planes_are_written(tmp_path, capsys):
    options = ["--direction", 0, 0, 1, "--flow", "direct", "--rays", 32, "--wavenumber", 6, "--boundary", "hard"]
    planes = ["--plane", "incidence:0.2", "--plane", "xy:0.25", "--observe", "backscatter"]
    assert ran("run", "sphere", *options, *planes, "--no-pictures", "-o", tmp_path) == 0
    said = capsys.readouterr().out
    assert "field on the plane incidence:0.2: " in said and "field on the plane xy:0.25: " in said
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert {"plane.csv", "plane_2.csv"} <= set(summary["files"])
    assert sorted(summary["files"]) == sorted(file.name for file in tmp_path.iterdir())
    assert (
        sum(summary["planes"][0]["status"].values())
        == np.prod(summary["planes"][0]["points"]) - (summary["planes"][0]["inside"])
    )
    rows = list(csv.DictReader(line for line in (tmp_path / "plane.csv").read_text().splitlines() if line[0] != "#"))
    points = np.array([[float(row[name]) for name in "xyz"] for row in rows])
    values = np.array([complex(float(row["re_u"]), float(row["im_u"])) for row in rows])
    np.testing.assert_allclose([float(row["across"]) for row in rows], points[:, 2], atol=1e-12)
    away = np.linalg.norm(points, axis=1) > 1.4
    exact = sphere.total_field(6.0, 1.0, points[away], (0, 0, 1), "hard")
    assert np.median(np.abs(values[away] - exact)) < 0.03


def test_a_plane_needs_a_wave(tmp_path, capsys):
    assert ran("run", "sphere", "--direction", 0, 0, 1, "--plane", "xy", "-o", tmp_path) == 3
    assert "--plane needs --wavenumber" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "zx", "xy:", "xy:0", "xy:nan", "xy:-1", "incidence:a"])
def test_unknown_planes_are_refused(text):
    with pytest.raises(InvalidInputError, match="is unknown; give incidence, xy, xz or yz"):
        parse_plane(text)


def test_planes_are_spanned_by_axes():
    found = parse_plane("yz:0.5")
    assert found.axes.tolist() == [[0, 1, 0], [0, 0, 1]] and found.step == 0.5
    assert parse_plane("incidence").axes is None
