"""Pictures are drawn, by both libraries alike; their geometry is checked where it can be computed by hand."""

from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping import CreepingError, InvalidInputError
from creeping.plotting import parameter_picture, picture, pictures
from creeping.plotting._drawing import View, shadow_view
from creeping.plotting._strokes import chosen_rays, drawn_ends, line_pieces, refined, runs, status_pieces, strokes
from creeping.plotting.scene import GLProbe


def pixels(path):
    from matplotlib.image import imread

    return np.asarray(imread(path))[..., :3]


@pytest.mark.slow
def test_both_backends_draw_the_same(tmp_path, opengl, sphere_line, sphere_fan, sphere_curves):
    images = []
    for backend in ("matplotlib", "pyvista"):
        path = tmp_path / f"{backend}.png"
        assert picture(path, sphere_line, sphere_fan, sphere_curves, backend=backend, dpi=60) == backend
        images.append(pixels(path))
    assert images[0].shape == images[1].shape
    # dark and light in the same places: both agree on where the body and its lines are
    blurred = [np.mean(image, axis=-1)[:240, :320].reshape(30, 8, 40, 8).mean(axis=(1, 3)) for image in images]
    assert np.corrcoef(blurred[0].ravel(), blurred[1].ravel())[0, 1] > 0.97


def test_auto_falls_back_to_matplotlib(tmp_path, monkeypatch, sphere_line, sphere_fan):
    monkeypatch.setattr(pictures, "gl_available", lambda: GLProbe(False, "no libEGL"))
    assert picture(tmp_path / "a.png", sphere_line, sphere_fan, dpi=40) == "matplotlib"
    assert pixels(tmp_path / "a.png").std() > 0.05


def test_wrong_arguments(tmp_path, sphere_line, sphere_fan, sphere_curves):
    with pytest.raises(InvalidInputError, match="backend 'povray' is unknown"):
        picture(tmp_path / "a.png", sphere_line, backend="povray")
    with pytest.raises(InvalidInputError, match="at least one ray"):
        picture(tmp_path / "a.png", sphere_line, sphere_fan, backend="matplotlib", rays=0)
    mixed = [*sphere_curves, replace(sphere_curves[0], of="eikonal")]
    with pytest.raises(InvalidInputError, match="eikonal and travel_time"):
        parameter_picture(tmp_path / "a.png", sphere_line, curves=mixed)
    with pytest.raises(CreepingError, match="create the folder"):
        parameter_picture(tmp_path / "missing" / "a.png", sphere_line, dpi=40)


def test_status_pieces_join_and_close(sphere_line):
    curve = sphere_line.curves[0]
    lengths = [
        [len(piece) for piece in status_pieces(curve.points, curve.status, name)]
        for name in ("attached", "occluded", "concave")
    ]
    assert lengths == [[61], [21], [17]]
    (whole,) = status_pieces(curve.points, np.full(96, "attached"), "attached")
    np.testing.assert_array_equal(whole[0], whole[-1])
    assert not list(status_pieces(curve.points, np.full(96, "attached"), "concave"))
    points = np.arange(18.0).reshape(6, 3)
    (found,) = runs(points, np.array([True, False, True, True, False, True]))
    np.testing.assert_array_equal(found, points[2:4])


def test_open_curves_of_a_line_are_not_closed():
    """On a body of pieces a shadow line is of arcs: no chord joins the ends of one."""
    pill = sc.Capsule(1.0, 4.0)
    pieces = line_pieces(cr.shadow_line(pill, (0.6, 0, 0.8)), "attached")
    assert len(pieces) == 4
    for piece in pieces:
        assert np.max(np.linalg.norm(np.diff(piece, axis=0), axis=1)) < 0.1


def test_refined_ray_stays_on_the_great_circle(sphere_fan):
    fine, times = refined(sphere_fan.points[0], sphere_fan.directions[0], sphere_fan.travel_time, 0.02)
    assert len(fine) == len(times) > 80
    # cubic Hermite on steps of 0.1; the chord in place of the arc costs 0.1^4/96 of it
    assert np.abs(np.linalg.norm(fine, axis=-1) - 1).max() < 2e-5


def test_rays_stop_at_nan_and_fade_at_detachment(sphere_line, sphere_fan):
    drawn = strokes(sphere_line, sphere_fan, (), rays=1000, ends=drawn_ends(sphere_fan, np.inf))
    by_label = {stroke.label: stroke.lines for stroke in drawn}
    assert len(by_label["creeping ray"]) == 30
    assert all(np.isfinite(points).all() for lines in by_label.values() for points in lines)
    (after,) = by_label["ray after detachment"]
    joined = np.concatenate([points[-1:] for points in by_label["creeping ray"]])
    assert np.min(np.linalg.norm(joined - after[0], axis=-1)) < 0.02


def test_rays_are_chosen_by_distance_not_by_number(sphere_fan):
    # 30 rays of one arc, the first of them repeated 50 times as refinement would crowd them
    crowd = np.concatenate([np.full(50, 0), np.arange(30)])
    fan = type(sphere_fan)(points=sphere_fan.points[crowd], curve_index=sphere_fan.curve_index[crowd])
    chosen = crowd[chosen_rays(fan, 10)]
    assert len(chosen) == 10
    assert set(np.diff(chosen)) <= {2, 3, 4}
    assert chosen_rays(fan, 1000) == list(range(80))


def test_torus_hides_what_its_near_tube_covers():
    body = sc.Torus()
    points = np.array([[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    level, steep = View(0.0, 0.0), View(0.0, np.radians(80))
    # inner equator: the point at x = -0.5 faces +x, but the tube at x = 1 stands before it, unless seen from above
    assert level.visible(body, points).tolist() == [False, False, True, False]
    assert steep.visible(body, points).tolist() == [False, True, True, False]


@pytest.mark.parametrize("direction", [(1, 1, 1), (0, 0, 1), (0, 0, -1), (1, 0, 0), (-3, 2, -5)])
def test_camera_stands_on_the_shadow_side(direction):
    view = shadow_view(direction)
    d = np.array(direction) / np.linalg.norm(direction)
    assert np.degrees(np.arccos(view.toward @ d)) == pytest.approx(36, abs=15)
    frame = np.stack([view.right, view.up, view.toward])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert view.up[2] > 0.3
