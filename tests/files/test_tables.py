"""Files are read back, by VTK's own reader where there is one."""

import csv
import errno
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from creeping import CreepingError, InvalidInputError
from creeping.files import write_csv, write_text, write_vtp


def table(path):
    with open(path, encoding="ascii") as stream:
        lines = list(stream)
    notes = [line for line in lines if line.startswith("#")]
    rows = list(csv.DictReader(lines[len(notes) :]))
    assert len(notes) == len(rows[0])
    return rows


def test_vtp_keeps_every_bit_without_a_library_that_draws(tmp_path):
    code = """
import pathlib, sys
from types import SimpleNamespace as S
import numpy as np
from creeping.files import polydata, write_vtp
curve = S(points=np.array([[0.1, np.nan, 1e-300], [1 / 3, 2, 3], [4, 5, -0.0]]), status=["concave"] * 3)
write_vtp(sys.argv[1], S(curves=[curve]))
assert polydata(S(body=None, direction=None, curves=[curve])).n_lines == 1
maps = pathlib.Path("/proc/self/maps")
loaded = maps.read_text() if maps.exists() else ""
assert not [name for name in ("libX11", "libEGL", "libGL.", "libOpenGL", "libGLX") if name in loaded]
drawing = [name for name in sys.modules if "vtkRendering" in name or name.startswith("pyvista.plotting")]
assert not drawing, drawing
import pyvista
mesh = pyvista.read(sys.argv[1])
assert mesh.points.tobytes() == curve.points.tobytes()
assert mesh.point_data["line_status"].tolist() == [2] * 3
assert np.isnan(mesh.point_data["eikonal"]).all()
"""
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "line.vtp")], check=True)


def test_csv_of_a_fan_keeps_every_bit(tmp_path, sphere_fan):
    path = tmp_path / "fan.csv"
    write_csv(path, fan=sphere_fan)
    rows = table(path)
    expected = "ray step t x y z px py pz eikonal J dJ kappa_n caustic_index status"
    assert list(rows[0]) == expected.split()
    rays, steps = sphere_fan.eikonal.shape
    assert len(rows) == rays * steps
    read = np.array([[float(row[name]) for name in "xyz"] for row in rows]).reshape(rays, steps, 3)
    np.testing.assert_array_equal(read, sphere_fan.points)
    spreading = np.array([float(row["J"]) for row in rows]).reshape(rays, steps)
    np.testing.assert_array_equal(spreading, sphere_fan.spreading)
    assert [int(row["status"]) for row in rows[::steps]] == sphere_fan.status.tolist()


def test_csv_of_line_and_curves(tmp_path, sphere_line, sphere_curves):
    write_csv(tmp_path / "line.csv", line=sphere_line)
    rows = table(tmp_path / "line.csv")
    assert [row["status"] for row in rows] == sphere_line.curves[0].status.tolist()
    assert [float(row["s"]) for row in rows] == sphere_line.curves[0].arclength.tolist()
    open_curve = replace(sphere_curves[0], closed=False)
    write_csv(tmp_path / "curves.csv", curves=[*sphere_curves, open_curve])
    rows = table(tmp_path / "curves.csv")
    assert len(rows) == 4 * 96
    assert {row["closed"] for row in rows} == {"0", "1"}


def test_csv_wants_exactly_one(tmp_path, sphere_line, sphere_fan):
    with pytest.raises(InvalidInputError, match="got nothing; give exactly one"):
        write_csv(tmp_path / "x.csv")
    with pytest.raises(InvalidInputError, match="got line and fan"):
        write_csv(tmp_path / "x.csv", line=sphere_line, fan=sphere_fan)
    with pytest.raises(InvalidInputError, match="got curves and far; give exactly one of line, fan, curves, far, cut"):
        write_csv(tmp_path / "x.csv", curves=[], far=sphere_line)
    assert not list(tmp_path.iterdir())


def test_text_is_replaced_whole(tmp_path):
    path = tmp_path / "summary.json"
    for text in ("long old text\n", "κ\n"):
        write_text(path, text)
        assert path.read_bytes() == text.encode()
    assert list(tmp_path.iterdir()) == [path]


def test_missing_folder_is_named(tmp_path, sphere_line):
    with pytest.raises(CreepingError, match=r"missing.*create the folder first"):
        write_vtp(tmp_path / "missing" / "line.vtp", sphere_line)


def test_full_disk_leaves_the_old_file(tmp_path, sphere_line, monkeypatch):
    path = tmp_path / "line.old"
    path.write_text("old")

    def full(*_args, **_options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for opened in ("open", "write_text"):
        monkeypatch.setattr(Path, opened, full)
    with pytest.raises(CreepingError, match="free some space") as caught:
        write_vtp(path, line=sphere_line)
    monkeypatch.undo()
    assert caught.value.path == path
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
