"""The wave that runs on the page: its phase is that of the field, only colours move, and what has none is told."""

from types import SimpleNamespace

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.explorer.frames import preview_of, refined_view, step_of
from creeping.explorer.panel import legend, wave_note
from creeping.explorer.request import ViewRequest
from creeping.explorer.scene import ENDED, WAVE_COLOURS, coloured, strengths, wave_colours
from creeping.geometry.triangulation import triangulate
from creeping.plotting.coloured_body import at_phase
from tests.patience import until
from tests.reference import sphere

REQUEST = ViewRequest(theta=50.0, phi=40.0, rays=64, length=2.0, spacing=0.25, wavenumber=30.0, boundary="hard")
SPAN = (-50.0, 5.0)


def frame_of(body, request=REQUEST):
    return preview_of(cr.DirectFlow(body, rtol=1e-9), request, step_of(body))


@pytest.mark.parametrize("boundary", ["soft", pytest.param("impedance:0.5+0.2j", marks=pytest.mark.slow)])
def test_the_phase_along_rays_is_that_of_the_field(boundary):
    """At points between the steps, too: of a fan that has so many of its own, by the field on the surface."""
    request = REQUEST.changed(boundary=boundary, length=1.5)
    frame = frame_of(sc.TwistedEllipsoid(), request)
    parts = (frame.wave.values.shape[1] - 1) // (frame.levels.shape[1] - 1)
    assert parts > 1
    line, n_steps = frame.fan.line, frame.wave.values.shape[1] - 1
    fine = cr.launch(
        cr.DirectFlow(line.body, rtol=1e-9), line, length=frame.fan.length, n_rays=64, n_steps=n_steps, max_gap=np.inf
    )
    np.testing.assert_allclose(fine.points[:, 0], frame.fan.points[:, 0], atol=1e-9)
    u = cr.surface_field(fine, wavenumber=30.0, boundary=request.kind, order=1).values
    # in the step that passes a caustic the quarter of a turn is spread over it
    passing = np.repeat(np.diff(frame.fan.caustic_index, axis=1) != 0, parts, axis=1)
    # what colours show: below, in the last step before a ray detaches, the phase turns by a tenth
    held = (frame.wave.levels > -60) & (np.abs(fine.spreading) > 0.01)
    held[:, :-1] &= ~passing
    assert np.mean(held) > 0.3 and np.any(fine.caustic_index[held])
    turn = np.abs(np.angle(u[held] / frame.wave.values[held]))
    # the slow part of the phase between steps is a chord
    assert np.max(turn) < 0.05
    np.testing.assert_allclose(np.abs(frame.wave.values), 1.0, rtol=1e-12)


def test_colours_are_crests_and_troughs_of_the_range():
    values = np.array([2.0, -2.0, 2j, 1e-9, 0.0, np.nan])
    levels = np.array([5.0, 5.0, 5.0, -180.0, np.nan, np.inf])
    found = strengths(values, levels, SPAN)
    np.testing.assert_allclose(found[:4], [1, -1, 1j, 0])
    assert np.isnan(found[4]) and found[5] == 1
    crest, trough = WAVE_COLOURS[255].tolist(), WAVE_COLOURS[0].tolist()
    middle = coloured(WAVE_COLOURS, np.array(0.5)).tolist()
    assert wave_colours(found, 0.0).tolist() == [crest, trough, middle, middle, list(ENDED), crest]
    # a quarter of a period later u = i is up: e^{-i omega t}
    assert wave_colours(found, np.pi / 2)[2].tolist() == crest
    assert wave_colours(found, np.pi)[:2].tolist() == [trough, crest]
    # halfway up the range of dB
    half = strengths(np.array([3j]), np.array([-22.5]), SPAN)
    np.testing.assert_allclose(at_phase(half, np.pi / 2), 0.5)


@pytest.mark.slow
def test_the_wave_on_the_body_is_that_of_the_series():
    body, request = sc.Sphere(), REQUEST.changed(theta=0.0, phi=0.0, length=6.0, rays=64)
    mesh = triangulate(body, cells=10)
    frame = frame_of(body, request)
    found = refined_view(frame.fan.flow, frame, mesh.vertices)
    exact = sphere.total_field(30.0, 1.0, mesh.vertices * (1 + 1e-12), np.array([0.0, 0.0, 1.0]), "hard")
    known = np.isfinite(found.body_levels)
    assert np.mean(known) > 0.95
    assert np.median(np.abs(found.body_wave - exact)[known]) < 0.01
    shown = strengths(found.body_wave, found.body_levels, SPAN)
    bright = np.abs(exact) > 0.3
    for phase in (0.0, 2.0):
        expected = at_phase(exact / np.abs(exact), phase)
        level = np.clip((20 * np.log10(np.abs(exact)) + 50) / 55, 0, 1)
        assert np.max(np.abs(at_phase(shown, phase) - level * expected)[bright & known]) < 0.15


def test_what_has_no_wave_is_told():
    ball = frame_of(sc.Sphere())
    assert "crest" in legend(ball, SPAN, wave=True)
    assert wave_note(ball, True) == "" and "mesh" in wave_note(ball, False)
    for body, change, word in (
        (sc.Sphere(), {"boundary": "pec"}, "vector"),
        (sc.Sphere(speed="1 + 0.3*x"), {}, "weighted"),
        (sc.Sphere(), {"wavenumber": 3e4}, "too short"),
    ):
        frame = frame_of(body, REQUEST.changed(**change, rays=16))
        assert frame.wave is None and word in wave_note(frame, True)


@pytest.fixture
def page():
    pytest.importorskip("viser")
    from creeping.explorer.page import Explorer

    made = Explorer(cr.DirectFlow(sc.Sphere(), rtol=1e-9), REQUEST, port=8180)
    yield made
    made.close()


@pytest.mark.slow
def test_playing_computes_no_field(page, monkeypatch):
    from creeping.explorer import frames as module

    until(lambda: page.found.content, lambda: page.status.content)

    def fail(*_, **__):
        raise AssertionError("a field was computed for a picture of the same wave")

    for name in ("preview_of", "refined_view", "far_cut"):
        monkeypatch.setattr(module, name, fail)
    level, body = page.scene._lines["rays"].colors.copy(), page.scene.painted.glb_data
    page.player.show.value = "wave"
    until(lambda: "crest" in page.bar.content, lambda: page.status.content)
    rays = page.scene._lines["rays"]
    assert len(rays.points) == len(page._drawn[0].wave.segments)
    points, first, still = rays.points, rays.colors.copy(), page.scene.painted.glb_data
    assert still != body and page.player.slider.value == 0
    page.player.play.value = True
    until(lambda: page.player.slider.value >= 90 and page.scene.painted.glb_data != still, lambda: page.status.content)
    assert rays.points is points and np.any(rays.colors != first)
    page.player.play.value = False
    # a hand on the phase turns the wave
    turned = rays.colors.copy()
    page.player.slider.value = 180
    page.player._slid(SimpleNamespace(client=object(), target=page.player.slider))
    assert np.any(rays.colors != turned)
    # back to what was: the same colours
    page.player.show.value = "level"
    until(lambda: "rays and body" in page.bar.content, lambda: page.status.content)
    assert np.array_equal(page.scene._lines["rays"].colors, level) and page.scene.painted.glb_data == body
    assert "failed" not in page.status.content
    # what has no wave is shown without
    monkeypatch.undo()
    page.player.show.value = "wave"
    page.ask(boundary="pec")
    until(lambda: "vector" in page.status.content, lambda: page.status.content)
    assert "crest" not in page.bar.content and page.cut.content.startswith("<svg")
