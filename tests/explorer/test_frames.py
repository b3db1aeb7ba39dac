"""What is drawn of a frame: numbers of the fan, no NaN, statuses in their places."""

import re

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.explorer.frames import (
    cut_directions,
    made_matrix,
    matrix_cut,
    outline,
    preview_of,
    refined_view,
    step_of,
)
from creeping.explorer.panel import _broken, cut_svg, legend, plane_svg, preview_plane_svg, preview_text, refined_text
from creeping.explorer.request import ViewRequest, far_levels, wave_scale, wave_text
from creeping.explorer.scene import ENDED, FIELD_COLOURS, field_colours, fitted_span
from creeping.geometry.surface import normal
from creeping.geometry.triangulation import triangulate

REQUEST = ViewRequest(theta=50.0, phi=40.0, rays=64, length=2.0, spacing=0.25, wavenumber=30.0, boundary="hard")


RANGE = (-50.0, 5.0)


def cut_of(found):
    return cut_svg(found.request, found.cut_angles, found.far)


def found_of(body, request=REQUEST):
    flow = cr.DirectFlow(body, rtol=1e-8)
    frame = preview_of(flow, request, step_of(body))
    mesh = triangulate(body, cells=10)
    return frame, mesh, refined_view(flow, frame, mesh.vertices)


@pytest.fixture(scope="module")
def ellipsoid():
    return found_of(sc.Ellipsoid(1.2, 0.8, 0.6), REQUEST.changed(wavenumber=12.0))


def test_a_frame_has_no_nan():
    """Of rays that detach, too."""
    frame = preview_of(cr.DirectFlow(sc.TwistedEllipsoid(), rtol=1e-8), REQUEST, step_of(sc.TwistedEllipsoid()))
    assert np.any(np.isfinite(frame.fan.detachment))
    curves, levels = frame.level_segments
    for values in (frame.ray_segments, frame.launch_segments, curves):
        assert values.dtype == np.float32 and values.shape[1:] == (2, 3) and np.all(np.isfinite(values))
    assert len(frame.ray_segments) == 64 * (frame.fan.points.shape[1] - 1)
    assert set(np.round(levels, 9)) <= set(np.round(REQUEST.levels, 9)) and len(levels)
    assert frame.fan.length == pytest.approx(2.0, abs=step_of(frame.fan.body) / 2)


def test_levels_are_those_of_the_field(ellipsoid):
    frame, mesh, found = ellipsoid
    # the outline is as long as the shadow line
    drawn = outline(mesh, normal(frame.fan.body, mesh.vertices), REQUEST.direction)
    length = float(np.sum(np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1)))
    assert np.all(np.isfinite(drawn)) and length == pytest.approx(found.line.length, rel=0.02)
    assert frame.levels.shape == frame.fan.spreading.shape
    # |u| = 1.4 at the shadow line of a hard body: g(0) = 1.399
    np.testing.assert_allclose(frame.levels[:, 0], 20 * np.log10(1.399), atol=0.01)
    assert found.body_levels[np.isfinite(found.body_levels)].max() < 20 * np.log10(2) + 3
    assert frame.fan.error.samples == 0 and found.drawn.error.samples == 16
    told = refined_text(found)
    assert "rays drawn: 64 rays" in told and f"rms {found.drawn.error.rms:.1e}" in told


def test_a_newer_wish_ends_the_work():
    body = sc.Sphere()
    frame = preview_of(cr.DirectFlow(body), REQUEST, step_of(body))
    asked = []

    def stale():
        asked.append(0)
        return len(asked) == 2

    assert refined_view(cr.DirectFlow(body), frame, np.zeros((0, 3)), stale) is None
    assert len(asked) == 2


@pytest.mark.slow
def test_the_cut_of_a_sphere_is_near_the_partial_waves():
    from tests.reference import sphere

    # along z: theta of the cut is the angle from the forward direction
    _, _, found = found_of(sc.Sphere(), REQUEST.changed(theta=0.0, length=6.5, wavenumber=20.0))
    exact = sphere.far_field(20.0, 1.0, np.cos(np.radians(found.cut_angles)), "hard")
    assert np.max(np.abs(found.far.total - exact)) < 0.02 * np.max(np.abs(exact))
    np.testing.assert_allclose(cut_directions(np.array([90.0, -90.0]), 90.0), [[0, 1, 0], [0, -1, 0]], atol=1e-12)


def test_pictures_are_svg_of_finite_numbers(ellipsoid):
    frame, _, found = ellipsoid
    for text in (plane_svg(found), preview_plane_svg(frame), cut_of(found), legend(frame, RANGE)):
        assert text.startswith("<svg") and text.endswith("</svg>") and "nan" not in text and "inf" not in text
        assert not re.search(r"(src|href)=", text)


def test_a_weighted_body_has_rays_and_no_field():
    frame, _, found = found_of(sc.Sphere(speed="1 + 0.3*x"))
    assert frame.levels is None and found.body_levels is None and found.far is None and cut_of(found) == ""
    assert "no field" in refined_text(found) and "dB" not in preview_text(frame, 0.01, RANGE)
    assert plane_svg(found).count("<path") > 3


def test_the_range_of_colours_fits_and_stays():
    levels = np.linspace(-33.0, 2.0, 500)
    span = fitted_span(np.concatenate([levels, [-np.inf, np.nan, np.inf]]))
    assert span == (-35.0, 5.0)
    # a little more changes nothing, much more does; at most 60 dB
    assert fitted_span(levels + 4, span) == span
    assert fitted_span(levels - 20, span) == (-55.0, -15.0)
    assert fitted_span(np.linspace(-200, 3, 500)) == (-55.0, 5.0)
    assert fitted_span(np.full(4, -np.inf), span) == fitted_span(None, span) == span


@pytest.mark.parametrize(
    "boundary, name",
    [("pec", "|n × H|"), ("soft", "|du/dn|/k"), pytest.param("impedance:0.5+0.2j", "|u|", marks=pytest.mark.slow)],
)
def test_every_boundary_has_its_field(boundary, name):
    frame, mesh, found = found_of(sc.Sphere(), REQUEST.changed(boundary=boundary, wavenumber=12.0))
    assert frame.levels.shape == frame.fan.spreading.shape and name in legend(frame, RANGE)
    assert found.body_levels.shape == (len(mesh.vertices),) and np.isfinite(found.body_levels).mean() > 0.5
    assert ("φφ" in cut_of(found)) == (boundary == "pec") and found.far.boundary == boundary
    if boundary == "pec":
        # physical optics where the wave meets the body: |n x H| = 2
        front = mesh.vertices @ REQUEST.direction < -0.98
        np.testing.assert_allclose(found.body_levels[front], 20 * np.log10(2), atol=0.5)


def test_metres_have_frequencies():
    request = REQUEST.changed(metres=True, wavenumber=209.585)
    name, per_unit = wave_scale(request)
    assert name == "frequency (GHz)" and 209.585 / per_unit == pytest.approx(10.0, abs=1e-4)
    assert "10 GHz, wavelength 0.03 m" in wave_text(request)
    sound = REQUEST.changed(metres=True, sound_speed=1477.0, wavenumber=161.653)
    assert wave_scale(sound).name == "frequency (kHz)" and "38 kHz" in wave_text(sound)
    # a cross section of 4 pi square metres, and |f| = 1 m
    assert far_levels(request, np.ones(1))[0] == pytest.approx(10.99, abs=0.01)
    assert far_levels(sound, np.ones(1))[0] == pytest.approx(0.0)
    assert wave_scale(REQUEST) == ("wavenumber (1/L)", 1.0)


@pytest.mark.parametrize("k, flagged", [(3.0, True), (30.0, False)])
def test_waves_that_are_too_long_are_flagged(k, flagged):
    body = sc.Sphere()
    frame = preview_of(cr.DirectFlow(body), REQUEST.changed(wavenumber=k, rays=16), step_of(body))
    text = preview_text(frame, 0.01, RANGE)
    assert f"k rho >= {k:g}" in text and ("**k rho" in text) == flagged


def test_colours_are_of_the_range_and_lines_break_where_an_angle_jumps():
    low, high = RANGE
    colours = field_colours(np.array([np.nan, low - 20, low, high, np.inf]), RANGE)
    ends = [FIELD_COLOURS[n].tolist() for n in (0, 0, 255, 255)]
    assert colours.tolist() == [list(ENDED), *ends]
    phi = np.radians([150.0, 170.0, 179.0, -170.0, -150.0, np.nan])
    pieces = _broken(np.stack([np.full(6, 1.0), phi], axis=1)[None])
    assert [len(piece) for piece in pieces] == [3, 2] and all(np.isfinite(piece).all() for piece in pieces)


def test_the_cut_is_that_of_the_t_matrix_where_one_was_made():
    body, request = sc.Ellipsoid(0.6, 0.5, 0.4), REQUEST.changed(wavenumber=2.0)
    angles = np.array([-120.0, 0.0, 35.0])
    assert matrix_cut(body, request, angles) is None
    assert made_matrix(body, request) and not made_matrix(body, request)
    found = matrix_cut(body, request, angles)
    solution = cr.solve(body, request.direction, wavenumber=2.0, boundary="hard")
    want = solution.far_field(cut_directions(angles, request.cut)).total
    assert np.abs(found.total - want).max() < 1e-3 * np.abs(want).max()
    assert "by the T-matrix" in cut_svg(request, angles, found)
    assert not made_matrix(sc.Ellipsoid(60.0, 40.0, 30.0), request)


@pytest.mark.slow
def test_a_refined_cut_keeps_the_parts_of_rays():
    body, request = sc.Ellipsoid(1.2, 0.8, 0.6), REQUEST.changed(wavenumber=12.0)
    assert made_matrix(body, request)
    refined = found_of(body, request)[2].far
    assert set(refined.method) == {"t-matrix"} and refined.parts
