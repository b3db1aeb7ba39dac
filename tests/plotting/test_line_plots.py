"""Pictures of lines, fans and curves of themselves: their vertices against the object's points, converted here."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.plotting.pages import new_figure


def drawn(ax, label):
    """Vertices (n, 2 or 3) of the lines with a label."""
    (lines,) = [one for one in ax.collections if one.get_label() == label]
    return np.concatenate([np.asarray(piece) for piece in lines.get_segments()])


def in_degrees(points):
    """(phi, theta) of points, by arc cosine and arc tangent."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.degrees(np.stack([np.arctan2(y, x), np.arccos(z / np.sqrt(x**2 + y**2 + z**2))], axis=-1))


def farthest(some, of):
    """Greatest distance of some points to their nearest of others."""
    return np.linalg.norm(some[:, None] - of, axis=-1).min(axis=1).max()


def test_line_in_the_plane_of_parameters(ball_fan):
    body = sc.Sphere()
    line = cr.shadow_line(body, (0.3, 0.5, 0.81), n_points=64)
    ax = line.plot()
    assert "phi" in ax.get_xlabel() and "degrees" in ax.get_xlabel()
    assert "theta" in ax.get_ylabel() and "degrees" in ax.get_ylabel()
    # the upper pole is above
    assert ax.get_xlim() == (-180, 180) and ax.get_ylim() == (180, 0)
    found = drawn(ax, "shadow line, attached")
    expected = in_degrees(line.curves[0].points)
    assert farthest(expected, found) < 1e-9
    # what is added lies on the seam
    inner = found[np.abs(np.abs(found[:, 0]) - 180) > 1e-9]
    assert farthest(inner, expected) < 1e-9
    one = line.curves[0].plot()
    np.testing.assert_array_equal(drawn(one, "shadow line, attached"), found)


def test_rays_in_the_plane_of_parameters(ball_fan):
    body = sc.Sphere()
    line = cr.shadow_line(body, (0.3, 0.5, 0.81), n_points=64)
    fan = cr.launch(cr.DirectFlow(body), line, length=1.0, n_rays=6, n_steps=8, max_gap=np.inf)
    found = drawn(fan.plot(until=np.inf), "creeping ray")
    expected = in_degrees(fan.points.reshape(-1, 3))
    assert farthest(expected, found) < 1e-6
    few = drawn(fan.plot(rays=2, until=0.5), "creeping ray")
    assert farthest(few, found) < 1e-9
    assert len(few) < 0.25 * len(found)


def test_curves_over_a_fan_share_its_axes(twisted_fan, twisted_curves):
    ax = twisted_fan.plot(curves=twisted_curves)
    assert ax.figure.legends
    before = len(ax.collections), ax.get_xlabel()
    assert twisted_curves[0].plot(ax) is ax
    assert (len(ax.collections), ax.get_xlabel()) == (before[0] + 1, before[1])
    pieces = ax.collections[-1].get_segments()
    np.testing.assert_allclose(
        np.concatenate(pieces), np.degrees(np.concatenate(twisted_curves[0].parameter_pieces))[:, ::-1]
    )


def test_axes_that_are_given_get_no_legend_unasked(twisted_fan, ball_cut, small_map, twisted_curves):
    for result in (twisted_fan, twisted_fan.line, twisted_curves[0], ball_cut, small_map):
        ax = result.plot(new_figure((4, 3)).add_subplot())
        assert ax.get_legend() is None
        assert not ax.figure.legends
    assert len(ball_cut.plot(new_figure((4, 3)).add_subplot(), legend=True).get_legend().get_texts()) >= 1
    assert not ball_cut.plot(legend=False).figure.legends


def test_a_curve_alone_tells_the_torus_by_its_angles(twisted_curves, torus_fan):
    alone = twisted_curves[0].plot()
    assert "phi" in alone.get_xlabel()
    assert alone.get_ylim() == (180, 0)
    (curve, *_) = cr.iso_phase_curves(torus_fan, 0.5)
    assert np.any(curve.parameters[:, 0] < 0)
    assert "psi" in curve.plot().get_xlabel()
    # axes with a picture know better
    assert "psi" in twisted_curves[0].plot(torus_fan.plot()).get_xlabel()


@pytest.mark.parametrize("name", ["fan", "line", "curve"])
def test_axes_in_space_choose_the_picture(twisted_fan, twisted_curves, name):
    ax = new_figure((4, 4)).add_subplot(projection="3d")
    shown = {"fan": twisted_fan, "line": twisted_fan.line, "curve": twisted_curves[0]}[name]
    assert shown.plot(ax) is ax
    assert len(ax.collections) + len(ax.lines) >= 1
    with pytest.raises(cr.InvalidInputError, match="does not fit the axes, which are made for '3d'"):
        shown.plot(ax, kind="parameters")
    with pytest.raises(cr.InvalidInputError, match="made for 'parameters'"):
        shown.plot(new_figure((4, 4)).add_subplot(), kind="3d")
    with pytest.raises(cr.InvalidInputError, match="kind '4d' is unknown"):
        shown.plot(kind="4d")
