"""``creeping run --source``: files, the summary, iso-phase curves from the source, and what is refused."""

import json

import numpy as np
import pytest
from command_line import ran, table


def test_source_of_a_run(tmp_path, capsys):
    options = ["--flow", "direct", "--rays", 16, "--length", 1, "--format", "csv,mat", "--backend", "matplotlib"]
    assert ran("run", "sphere", "--source", 0, 0, -2, *options, "-o", tmp_path) == 0
    assert "source at (0.0000, 0.0000, -2.0000)" in capsys.readouterr().out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["source"] == [0, 0, -2] and "direction" not in summary
    assert summary["shadow_line"][0]["length"] == pytest.approx(2 * np.pi * np.sqrt(0.75))
    assert {"rays.png", "parameters.png", "rays.vtp", "curves.vtp", "rays.csv", "rays.mat"} <= set(summary["files"])
    rows = table(tmp_path / "curves.csv")
    level, z = (np.array([float(row[name]) for row in rows]) for name in ("level", "z"))
    # counted from the source: the line is sqrt(3) away from it
    assert level.min() >= np.sqrt(3) - 1e-9 and level.max() <= np.sqrt(3) + 1 + 1e-9
    np.testing.assert_allclose(-z, np.cos(np.pi / 3 + level - np.sqrt(3)), atol=1e-6)


@pytest.mark.parametrize(
    ("words", "code", "match"),
    [
        (["--source", 0, 0, 0.5], 3, "inside the body"),
        (["--source", 0, 0, "nan"], 3, "three finite numbers"),
        ([], 3, "--direction X Y Z"),
        (["--source", 0, 0, 2, "--direction", 0, 0, 1], 2, ""),
        (["--source", 0, 0, 2, "--wavenumber", 20], 3, "source_pattern"),
        (["--source", 0, 0, 2, "--plane", "xz"], 3, "--wavenumber"),
    ],
)
def test_refused(words, code, match, tmp_path, capsys):
    assert ran("run", "sphere", *words, "-o", tmp_path / "x") == code
    assert match in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
