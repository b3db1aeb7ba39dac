"""Results as polylines for pyvista: points and arrays are theirs, and those of a file."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import creeping as cr
from creeping.files import polydata, write_vtp
from creeping.files.arrays import CELL_ARRAYS, POINT_ARRAYS


@pytest.fixture(scope="module")
def pyvista():
    return pytest.importorskip("pyvista", exc_type=ImportError)


def test_polydata_of_a_fan_is_the_fan(pyvista, twisted_fan):
    mesh = twisted_fan.to_polydata()
    assert isinstance(mesh, pyvista.PolyData)
    shape = twisted_fan.points.shape[:2]
    assert (mesh.n_lines, mesh.n_points) == (shape[0], shape[0] * shape[1])
    np.testing.assert_array_equal(mesh.points.reshape(twisted_fan.points.shape), twisted_fan.points)
    for name in ("eikonal", "spreading", "spreading_rate", "curvature", "attenuation", "caustic_index"):
        np.testing.assert_array_equal(mesh.point_data[name].reshape(shape), getattr(twisted_fan, name))
    np.testing.assert_array_equal(mesh.point_data["travel_time"].reshape(shape)[-1], twisted_fan.travel_time)
    np.testing.assert_array_equal(mesh.cell_data["ray"], np.arange(shape[0]))
    for name in ("status", "curve_index"):
        np.testing.assert_array_equal(mesh.cell_data[name], getattr(twisted_fan, name))
    # cells are the rays, in order
    np.testing.assert_array_equal(mesh.get_cell(3).point_ids, np.arange(3 * shape[1], 4 * shape[1]))


def test_detached_rays_keep_their_points(pyvista, twisted_fan):
    mesh = twisted_fan.to_polydata()
    ray = int(np.flatnonzero(twisted_fan.status == cr.RayStatus.DETACHED)[0])
    cell = mesh.get_cell(ray)
    np.testing.assert_array_equal(cell.points, twisted_fan.points[ray])
    assert np.all(np.isfinite(cell.points))
    status = mesh.point_data["ray_status"][cell.point_ids]
    gone = twisted_fan.travel_time > twisted_fan.detachment[ray]
    assert 0 < gone.sum() < len(gone)
    np.testing.assert_array_equal(status, np.where(gone, cr.RayStatus.DETACHED, cr.RayStatus.OK))


def test_polydata_is_a_copy(pyvista, twisted_fan):
    mesh = twisted_fan.to_polydata()
    assert not np.shares_memory(mesh.points, twisted_fan.points)
    assert not np.shares_memory(mesh.point_data["spreading"], twisted_fan.spreading)


def test_polydata_of_line_and_curves(pyvista, twisted_fan, twisted_curves):
    line = twisted_fan.line
    mesh = line.to_polydata()
    np.testing.assert_array_equal(mesh.points, np.concatenate([curve.points for curve in line.curves]))
    names = np.array(["attached", "occluded", "concave"])
    np.testing.assert_array_equal(
        names[mesh.point_data["line_status"]], np.concatenate([curve.status for curve in line.curves])
    )
    one = line.curves[0].to_polydata()
    np.testing.assert_array_equal(one.points, line.curves[0].points)
    curve = twisted_curves[0].to_polydata()
    np.testing.assert_array_equal(curve.points, twisted_curves[0].points)
    assert np.all(curve.point_data["travel_time"] == 0.5)
    np.testing.assert_array_equal(curve.cell_data["level"], [0.5])
    joined = polydata(line, twisted_fan, twisted_curves)
    assert joined.n_lines == len(line.curves) + len(twisted_fan.points) + len(twisted_curves)
    counts = [len(line.curves), len(twisted_fan.points), len(twisted_curves)]
    np.testing.assert_array_equal(joined.cell_data["kind"], np.repeat([0, 1, 2], counts))
    np.testing.assert_array_equal(joined.cell_data["level"][-len(twisted_curves) :], [c.level for c in twisted_curves])
    on_line = slice(0, len(mesh.points))
    assert np.all(np.isnan(joined.point_data["eikonal"][on_line]))
    assert np.all(joined.point_data["caustic_index"][on_line] == -1)
    # a closed curve comes back to its first point
    first = mesh.get_cell(0).point_ids
    assert line.curves[0].closed and len(first) == len(line.curves[0].points) + 1 and first[0] == first[-1]


def test_file_and_polydata_have_one_list_of_names(pyvista, tmp_path, twisted_fan, twisted_curves):
    path = tmp_path / "all.vtp"
    write_vtp(path, twisted_fan.line, twisted_fan, twisted_curves)
    piece = ET.parse(path).getroot().find("PolyData/Piece")
    names = [[array.get("Name") for array in piece.find(part)] for part in ("PointData", "CellData")]
    assert names == [list(POINT_ARRAYS), list(CELL_ARRAYS)]
    mesh, read = polydata(twisted_fan.line, twisted_fan, twisted_curves), pyvista.read(path)
    assert sorted(mesh.point_data.keys()) == sorted(names[0])
    assert sorted(mesh.cell_data.keys()) == sorted(names[1])
    for name in names[0]:
        assert mesh.point_data[name].dtype == read.point_data[name].dtype
        np.testing.assert_array_equal(mesh.point_data[name], read.point_data[name])
    for name in names[1]:
        np.testing.assert_array_equal(mesh.cell_data[name], read.cell_data[name])
    np.testing.assert_array_equal(mesh.points, read.points)
    np.testing.assert_array_equal(mesh.lines, read.lines)


def test_polydata_of_nothing(pyvista, dark_fan):
    assert dark_fan.line.to_polydata().n_lines == len(dark_fan.line.curves)
    mesh = dark_fan.to_polydata()
    assert (mesh.n_points, mesh.n_lines) == (0, 0)
    assert polydata().n_points == 0
