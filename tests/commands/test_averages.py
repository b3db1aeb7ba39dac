"""``creeping rcs --average`` and ``creeping ts --average``."""

import json

import numpy as np
import pytest
from command_line import ran, table
from ended import ending_at
from scipy.special import spherical_jn, spherical_yn

from creeping.storage import folder as folders

WORDS = ["sphere:radius=0.1", "--sound-speed", 1500, "--average", "--no-cache"]


def backscatter_of(ka):
    """|f| of the soft sphere over its radius, back towards the source: the same in all orientations."""
    deg = np.arange(20)
    j = spherical_jn(deg, ka)
    return abs(np.sum((-1.0) ** deg * (2 * deg + 1) * j / (j + 1j * spherical_yn(deg, ka)))) / ka


def test_the_mean_of_a_sphere_is_that_of_its_series(tmp_path, capsys):
    assert ran("ts", *WORDS, "--frequency", "3:5:2kHz", "-o", tmp_path) == 0
    said, told = capsys.readouterr()
    assert "mean over orientation, of sphere:radius=0.1, soft" in said and "by the T-matrix" in told
    rows = table(tmp_path / "ts_average.csv")
    for row, hertz in zip(rows, (3000.0, 5000.0), strict=True):
        want = 20 * np.log10(0.1 * backscatter_of(2 * np.pi * hertz / 1500 * 0.1))
        assert float(row["frequency_hz"]) == hertz
        assert abs(float(row["level_db"]) - want) < float(row["error_db"]) < 0.02
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["complete"] and sorted(p.name for p in tmp_path.iterdir()) == sorted(summary["files"])


@pytest.mark.slow
def test_interrupted_it_says_what_is_missing_and_goes_on_to_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr("creeping.commands.resuming.EVERY", 0.0)
    words = ["ts", *WORDS, "--frequency", "1:3:1kHz", "--no-pictures"]
    with ending_at(folders, "_digest", 0) as calls:
        assert ran(*words, "-o", tmp_path / "whole") == 0
    with ending_at(folders, "_digest", calls[0] - 1):
        ran(*words, "-o", tmp_path / "parts")
    partly = (tmp_path / "parts" / "ts_average.csv").read_text()
    assert partly.startswith("# incomplete: 2 of 3 frequencies; to go on: creeping")
    assert ran(*words, "-o", tmp_path / "parts") != 0
    assert ran(*words, "-o", tmp_path / "parts", "--resume") == 0
    for name in ("ts_average.csv", "summary.json"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize(
    "stray", [["--monostatic", "az"], ["--incidence", "10,0"], ["--method", "rays"], ["--polarisation", "VV"]]
)
def test_angles_and_polarisations_do_not_go_with_it(tmp_path, stray, capsys):
    assert ran("rcs", "sphere", "--frequency", "1GHz", "--average", *stray, "-o", tmp_path) == 3
    assert f"leave out {stray[0]}" in capsys.readouterr().err
