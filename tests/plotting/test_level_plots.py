"""Cuts of far fields and errors of maps as pictures of themselves: decibels, angles, marks."""

from dataclasses import replace

import numpy as np
import pytest
from fake_fields import far_of

import creeping as cr
from creeping.plotting.pages import new_figure
from tests.reference import sphere


def test_cross_section_of_a_sphere_in_dbsm(ball_cut):
    ax = ball_cut.plot()
    assert "dB re 1 L" in ax.get_ylabel()
    assert ax.get_xlabel() == "θ at φ = 0° (degrees)"
    line = next(one for one in ax.lines if one.get_label() == "total")
    np.testing.assert_allclose(line.get_xdata(), np.arange(-40.0, 181.0, 5.0), atol=1e-9)
    at = np.array([60.0, 90.0, 120.0])
    found = np.interp(at, line.get_xdata(), line.get_ydata())
    # 10 log10(4 pi |f|^2) of Mie's series; the far field is good to 2 % here
    exact = sphere.far_field(30.0, 1.0, np.cos(np.radians(at)), "hard")
    np.testing.assert_allclose(found, 10 * np.log10(4 * np.pi * np.abs(exact) ** 2), atol=0.4)
    polar = ball_cut.plot(new_figure((4, 4)).add_subplot(projection="polar"))
    np.testing.assert_allclose(polar.lines[0].get_xdata(), np.radians(line.get_xdata()), atol=1e-9)


def test_parts_are_drawn_on_request(ball_cut):
    ax = ball_cut.plot(parts=True)
    lines = {line.get_label(): line for line in ax.lines}
    assert {"total", "creeping", "reflected", "forward"} <= set(lines)
    with np.errstate(divide="ignore"):
        expected = 10 * np.log10(4 * np.pi * np.abs(ball_cut.reflected) ** 2)
    shown = np.isfinite(expected) & (expected > ax.get_ylim()[0])
    np.testing.assert_allclose(lines["reflected"].get_ydata()[shown], expected[shown])


def test_what_is_not_to_be_trusted_is_marked(ball_cut):
    lost = np.zeros(len(ball_cut.total), dtype=bool)
    lost[[3, 30]] = True
    total = ball_cut.total.copy()
    total[10] = np.nan
    ax = replace(ball_cut, unresolved=lost, total=total).plot()
    marks = {line.get_label(): line for line in ax.lines}
    # hatched half a step to both sides
    spans = [patch.get_extents().transformed(ax.transData.inverted()) for patch in ax.patches if patch.get_hatch()]
    np.testing.assert_allclose([span.width for span in spans], 5.0)
    np.testing.assert_allclose([span.x0 + span.width / 2 for span in spans], [-25.0, 110.0])
    assert "unresolved" in ax.get_legend_handles_labels()[1]
    np.testing.assert_allclose(marks["not finite"].get_xdata(), [10.0])
    ax.figure.draw_without_rendering()


def degrees_of(directions, **options):
    far = far_of(directions, np.ones(len(directions)))
    ax = far.plot(**options)
    return ax.lines[0].get_xdata(), ax.get_xlabel()


def test_angle_of_a_cut_is_found():
    t = np.radians(np.arange(-180.0, 181.0, 20.0))
    for azimuth in (0.0, 30.0, 135.0, 180.0, -100.0):
        e = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
        found, name = degrees_of(np.sin(t)[:, None] * e + np.cos(t)[:, None] * [0, 0, 1])
        np.testing.assert_allclose(found, np.degrees(t), atol=1e-9)
        assert name == f"θ at φ = {azimuth:g}° (degrees)"
    # the first direction may be a pole, where +180 degrees is as good as -180
    around = np.stack([np.sin(t), 0 * t, np.cos(t)], axis=-1)
    around[0] = [0, 0, -1]
    np.testing.assert_allclose(degrees_of(around)[0], np.degrees(t), atol=1e-9)
    # from pole to pole the polar angle itself, whichever way the directions run
    half = np.stack([0 * t[9:], -np.sin(t[9:]), np.cos(t[9:])], axis=-1)
    found, name = degrees_of(half[::-1])
    np.testing.assert_allclose(found, np.degrees(t[9:]), atol=1e-9)
    assert name == "θ at φ = -90° (degrees)"
    # a tilted great circle
    e1, e2 = np.array([1.0, 1, 0]) / np.sqrt(2), np.array([-1.0, 1, 1]) / np.sqrt(3)
    found, name = degrees_of(np.cos(t)[:, None] * e1 + np.sin(t)[:, None] * e2)
    np.testing.assert_allclose(found - found[0], np.degrees(t) + 180, atol=1e-6)
    assert name.startswith("angle from the first direction")


def test_directions_on_no_cut_are_refused():
    directions = np.random.default_rng(1).normal(size=(9, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with pytest.raises(cr.InvalidInputError, match="9 directions are on no cut"):
        far_of(directions, np.ones(9)).plot()
    found, name = degrees_of(directions, angles=np.linspace(0, 1, 9), angle_name="tilt")
    np.testing.assert_allclose(found, np.degrees(np.linspace(0, 1, 9)))
    assert name == "tilt (degrees)"
    with pytest.raises(cr.InvalidInputError, match="give two at least"):
        far_of(directions[:1], [1.0]).plot()
    with pytest.raises(cr.InvalidInputError, match=r"shape \(9,\); 8 angles"):
        far_of(directions, np.ones(9)).plot(angles=np.linspace(0, 1, 8))


def test_growth_of_a_map(small_map):
    ax = small_map.plot(tolerance=1e-5)
    lines = {line.get_label(): line for line in ax.lines}
    expected = np.stack([small_map.growth.lengths, small_map.growth.rms], axis=-1)
    np.testing.assert_array_equal(lines["rms"].get_xydata(), expected)
    np.testing.assert_array_equal(lines["max"].get_ydata(), small_map.growth.max)
    np.testing.assert_array_equal(lines["tolerance 1e-05"].get_ydata(), 1e-5)
    assert ax.get_yscale() == "log"
    assert "(L)" in ax.get_xlabel()
    tuned = replace(small_map, parameters={"tolerance": 1e-4}).plot()
    assert "tolerance 0.0001" in [line.get_label() for line in tuned.lines]
    alone = replace(small_map, growth=None).plot().lines
    np.testing.assert_array_equal(alone[-1].get_xydata(), [[0.5, small_map.error.rms]])
