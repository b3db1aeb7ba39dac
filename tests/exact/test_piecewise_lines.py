"""Shadow lines of bodies with edges, joints and tips against closed forms."""

import numpy as np
import pytest
import shared_bodies as sc
from piecewise_bodies import TwoBalls, cut_sphere

import creeping as cr

LENGTH = 1e-10
"""Relative error of lengths: panels are exact to rounding, ends to 1e-12 of the size."""
EDGE = 1e-6
"""Of parts of edges: n.d counts as 0 up to 1e-7."""


CUT, CAPSULE, CYLINDER = cut_sphere(0.5), sc.Capsule(0.5, 3.0), sc.Cylinder(0.5, 2.0)
"""What all lines of a body need of it is made once."""


def tilted(angle):
    return (np.sin(angle), 0.0, np.cos(angle))


@pytest.mark.parametrize("angle", [0.9, 2.0])
def test_cut_sphere(angle):
    # the great circle across d goes above the cut z = 1/2 over the arc in which sin(angle) cos(t) > 1/2
    line = cr.shadow_line(CUT, tilted(angle))
    lost = 2 * np.arccos(0.5 / np.sin(angle))
    assert line.length == pytest.approx(2 * np.pi - lost, rel=LENGTH)
    # of the rim, that part is on the line where the ball is lit and the cap dark or the other way round
    rim = np.sqrt(0.75)
    limit = np.arccos(np.clip(-0.5 * np.cos(angle) / (rim * np.sin(angle)), -1, 1))
    ball_dark, cap_dark = 2 * limit, np.cos(angle) > -1e-12
    on_edge = rim * (2 * np.pi - ball_dark if cap_dark else ball_dark)
    assert sum(part.length for part in line.on_edges) == pytest.approx(on_edge, rel=EDGE)
    assert line.edge_share == pytest.approx(on_edge / (on_edge + 2 * np.pi - lost), rel=EDGE)
    (curve,) = line.curves
    assert not curve.closed and line.fractions["attached"] == 1.0
    np.testing.assert_allclose(curve.points[[0, -1], 2], 0.5, atol=1e-11)
    whole = cr.shadow_line(CUT, (0, 0, 1))
    assert whole.curves[0].closed and whole.on_edges == () and whole.edge_share == 0
    assert whole.length == pytest.approx(2 * np.pi, rel=LENGTH)


@pytest.mark.parametrize("direction", [(1, 0, 0), (0.3, -1, -2)])
def test_capsule(direction):
    # half a great circle on either cap and two generators, whatever the incidence
    line = cr.shadow_line(CAPSULE, direction)
    assert line.length == pytest.approx(4 + np.pi, rel=LENGTH)
    assert line.fractions["attached"] == 1.0 and line.edge_share == 0.0
    assert [curve.piece for curve in line.curves[:2]] == [1, 1]
    # across each joint another curve goes on
    ends = np.array([curve.points[-1] for curve in line.curves])
    for curve in line.curves:
        assert np.linalg.norm(ends - curve.points[0], axis=1).min() < 1e-11


def test_capsule_along_its_axis():
    # the side lies edge-on; the line is the rear joint, whose rays start on the rear cap
    line = cr.shadow_line(CAPSULE, (0, 0, 1))
    (curve,) = line.curves
    assert line.edge_on == (1,) and curve.piece == 2 and curve.closed
    assert line.length == pytest.approx(np.pi, rel=LENGTH) and line.fractions["attached"] == 1.0


def test_cylinder():
    line = cr.shadow_line(CYLINDER, (1, 0.2, 1))
    assert line.length == pytest.approx(4.0, rel=LENGTH)
    # half of either rim: where the lit end meets the dark side, and the dark end the lit side
    assert [part.length for part in line.on_edges] == pytest.approx([np.pi / 2] * 2, rel=EDGE)
    ahead = cr.shadow_line(CYLINDER, (0, 0, 1))
    assert ahead.curves == () and ahead.edge_on == (1,) and ahead.edge_share == 1.0
    assert [part.crease for part in ahead.on_edges] == [0]


def test_cone_ends_at_its_tip():
    line = cr.shadow_line(sc.Cone(0.5, 1.0), (1, 0, 0))
    # two generators, less what is next to the tip
    assert line.length + line.at_tips == pytest.approx(2 * np.hypot(0.5, 1.0), rel=1e-9)
    assert 0 < line.at_tips < 3e-3
    assert len(line.curves) == 2


def test_two_balls_in_line_hide_each_other():
    """The edge between them is concave: no part of the line, though the line of one is in the shadow of the other."""
    line = cr.shadow_line(TwoBalls(0.7), (1, 0, 1))
    assert line.on_edges == ()
    shares = {curve.piece: curve.fractions for curve in line.curves}
    assert shares[0]["attached"] == 1.0
    # the first ball's shadow is a circle of radius 1 about its centre, seen along d sqrt(2) 0.7 aside
    hidden = 2 * np.arccos(0.7 * np.sqrt(0.5)) - (2 * np.pi - line.curves[0].length)
    assert shares[1]["occluded"] * line.curves[0].length == pytest.approx(hidden, abs=1e-4)


def test_points_and_rays_of_open_curves():
    line = cr.shadow_line(CUT, (1, 0, 0), n_points=65)
    curve = line.curves[0]
    np.testing.assert_allclose(curve.at(curve.arclength), curve.points, atol=1e-13)
    np.testing.assert_allclose(curve.at([-1.0, 9.0]), curve.points[[0, -1]], rtol=0, atol=1e-15)
    launch = line.launch_points(10)
    np.testing.assert_allclose(launch.arclength[0], (np.arange(10) + 0.5) * curve.length / 10)
    assert not launch.closed.any() and launch.there.all()
