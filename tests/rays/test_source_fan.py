"""Fans of point sources: closed forms on the sphere, spreading against neighbouring rays, phase, files."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.files import write_mat
from creeping.geometry.surface import normal
from creeping.plotting._drawing import compose
from creeping.rays.strips import ray_points
from creeping.shadow.attachment import line_tangents

SOURCE = np.array([-0.9, 0.7, 0.4])
WEIGHTED = sc.Ellipsoid(1.0, 0.8, 0.6, speed="1 + 0.2*x + 0.1*z")


def fan_of(body, source, **options):
    line = cr.shadow_line(body, source=cr.PointSource(source))
    return cr.launch(cr.DirectFlow(body, rtol=1e-11), line, **{"length": 3.0, "n_rays": 24, **options})


@pytest.mark.parametrize("distance", [1.05, 30.0])
def test_meridians_of_a_sphere(distance):
    fan = fan_of(sc.Sphere(), (0, 0, -distance))
    first, s = np.arccos(1 / distance), fan.travel_time
    np.testing.assert_allclose(-fan.points[..., 2], np.broadcast_to(np.cos(first + s), fan.spreading.shape), atol=1e-8)
    spreading = np.sin(first + s) / np.sin(first)
    np.testing.assert_allclose(fan.spreading, np.tile(spreading, (len(fan.points), 1)), atol=1e-7)
    rate = np.cos(first + s) / np.sin(first)
    np.testing.assert_allclose(fan.spreading_rate, np.tile(rate, (len(fan.points), 1)), atol=1e-7)
    np.testing.assert_allclose(fan.eikonal, np.tile(np.sqrt(distance**2 - 1) + s, (len(fan.points), 1)), rtol=1e-12)
    # the focus behind is passed where rays meet
    np.testing.assert_array_equal(fan.caustic_index[0], (s > np.pi - first).astype(int))


@pytest.mark.parametrize(
    "body", [sc.Ellipsoid(1.0, 0.8, 0.6), sc.Torus(), WEIGHTED], ids=["plain", "torus", "weighted"]
)
def test_spreading_is_that_of_neighbouring_rays(body):
    source = SOURCE if body is not sc.Torus() else np.array([1.9, 0.3, 0.2])
    line = cr.shadow_line(body, source=cr.PointSource(source))
    flow = cr.DirectFlow(body, rtol=1e-12)
    fan = cr.launch(flow, line, length=1.2, n_rays=12, n_steps=24, max_gap=np.inf)
    curve, h = line.curves[int(fan.curve_index[5])], 1e-5
    for ray in (0, 5, 9):
        if int(fan.curve_index[ray]) != int(fan.curve_index[5]):
            continue
        x0 = curve.at(fan.arclength[ray] + h * np.array([-1.0, 1.0]))
        p0 = x0 - source
        p0 /= np.linalg.norm(p0, axis=1, keepdims=True)
        ends, _ = flow.flow(x0, p0, fan.travel_time)
        b = np.cross(normal(body, fan.points[ray]), fan.directions[ray])
        across = np.cross(normal(body, fan.points[ray, :1]), fan.directions[ray, :1])
        width = abs(np.sum(across * line_tangents(body, fan.points[ray, :1], fan.directions[ray, :1])))
        found = np.abs(np.sum(b * (ends[1] - ends[0]), axis=1)) / (2 * h * width)
        np.testing.assert_allclose(found, np.abs(fan.spreading[ray]), atol=2e-5)


def test_points_of_a_fan_know_the_source():
    fan = fan_of(sc.Ellipsoid(1.0, 0.8, 0.6), SOURCE, n_steps=32)
    _, rays = ray_points(fan, fan.travel_time)
    np.testing.assert_allclose(rays.spreading, fan.spreading, atol=1e-7)
    np.testing.assert_allclose(rays.eikonal, fan.eikonal, atol=1e-10)
    np.testing.assert_array_equal(rays.caustics, fan.caustic_index)
    distance = np.linalg.norm(fan.points[:, 0] - SOURCE, axis=1)
    np.testing.assert_allclose(rays.opening[:, 3], 1 / distance, rtol=1e-12)


def test_iso_phase_curves_count_from_the_source():
    fan = fan_of(sc.Sphere(), (0, 0, -2.0))
    (curve,) = cr.iso_phase_curves(fan, np.sqrt(3) + 0.5, of="eikonal")
    assert curve.closed
    np.testing.assert_allclose(-curve.points[:, 2], np.cos(np.pi / 3 + 0.5), atol=1e-8)
    fan = fan_of(sc.Ellipsoid(1.0, 0.8, 0.6), SOURCE)
    nearest = float(fan.eikonal[:, 0].min())
    assert cr.iso_phase_curves(fan, nearest - 1e-6, of="eikonal") == []
    assert len(cr.iso_phase_curves(fan, float(fan.eikonal[:, 0].max()) + 0.1, of="eikonal")) == 1


def test_a_far_source_sends_the_fan_of_a_plane_wave():
    body, d, far = sc.Ellipsoid(1.0, 0.8, 0.6), np.array([0.48, 0.6, 0.64]), 1e5
    plane = cr.launch(cr.DirectFlow(body, rtol=1e-11), cr.shadow_line(body, direction=d), length=2.0, n_rays=16)
    fan = fan_of(body, -far * d, length=2.0, n_rays=16)
    assert len(fan.points) == len(plane.points)
    np.testing.assert_allclose(fan.points, plane.points, atol=1e-4)
    np.testing.assert_allclose(fan.spreading, plane.spreading, atol=1e-4)
    np.testing.assert_allclose(fan.eikonal - far, plane.eikonal, atol=1e-4)


def test_shown_and_written(tmp_path):
    import scipy.io

    fan = fan_of(sc.Ellipsoid(1.0, 0.8, 0.6), SOURCE)
    assert "source" in fan.line._repr_html_() and "PointSource" in fan.line._repr_html_()
    assert np.array_equal(fan.to_polydata().point_data["eikonal"].reshape(fan.eikonal.shape), fan.eikonal)
    for result in (fan, fan.line):
        write_mat(tmp_path / "one.mat", result)
        back = scipy.io.loadmat(tmp_path / "one.mat", squeeze_me=True)
        np.testing.assert_array_equal(back["source"], SOURCE)
        assert "direction" not in back and str(back["units"]["source"]) == "L"


def test_pictures_show_the_source():
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    near, far = (compose(cr.shadow_line(body, source=cr.PointSource(x))) for x in (SOURCE, 1e3 * SOURCE))
    np.testing.assert_array_equal(near.incidence.foot, SOURCE)
    assert near.incidence.name == far.incidence.name == "S" and np.linalg.norm(far.incidence.foot) < 10
    # in the hole of a torus it is looked at from above
    held = compose(cr.shadow_line(sc.Torus(), source=cr.PointSource((0.0, 0.0, 0.3))))
    assert held.view.visible(sc.Torus(), np.array([[0.0, 0.0, 0.3]]))[0]


def test_maps_carry_them_too():
    body = sc.Sphere()
    flow = cr.build_phase_map(body, horizon=0.5, grid=(16, 24), degree=5, cache=False, carry_jacobi=True)
    line = cr.shadow_line(body, source=cr.PointSource((0, 0, -1.5)))
    fan = cr.launch(flow, line, length=1.0, n_rays=8)
    first = np.arccos(1 / 1.5)
    exact = np.sin(first + fan.travel_time) / np.sin(first)
    np.testing.assert_allclose(fan.spreading, np.tile(exact, (len(fan.points), 1)), atol=1e-3)
