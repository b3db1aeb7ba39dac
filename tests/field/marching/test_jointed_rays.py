"""Rays across joints at nodes of their own, against great circles and helices."""

import numpy as np
import pytest
import shared_bodies as sc

from creeping.field.marching.fan_rays import jointed_rays, piece_nodes
from creeping.geodesics.states import M11, P, X, pack

PILL = sc.Capsule(radius=1.0, length=4.0)
TURN = np.radians(25.0)


def launched(heights):
    """Rays from the upper hemisphere down, all along one great circle's family, at angles to the axis."""
    theta = np.radians(70.0) * np.ones(len(heights))
    x = np.stack([np.sin(theta), 0 * theta, 1 + np.cos(theta)], axis=-1)
    down, across = np.array([np.cos(theta[0]), 0, -np.sin(theta[0])]), np.array([0.0, 1.0, 0.0])
    p = np.cos(heights)[:, None] * down + np.sin(heights)[:, None] * across
    return pack(x, p, jacobi=True)


def test_across_a_joint():
    """Down the meridian J is the cosine on the hemisphere, a straight line on the cylinder, and a cosine again."""
    found = jointed_rays(PILL, launched(np.array([0.0])), np.linspace(0, 3.0, 60), rtol=1e-10)
    s, J, z = found.times[0], found.states[0, :, M11], found.states[0, :, 2]
    first = np.radians(20.0)
    joints = s[1:][np.diff(s) == 0]
    np.testing.assert_allclose(joints, [first, first + 2.0], atol=1e-9)
    on_ball = s <= first
    np.testing.assert_allclose(J[on_ball], np.cos(s[on_ball]), atol=1e-7)
    flat = (s >= first) & (s <= first + 2)
    np.testing.assert_allclose(J[flat], np.cos(first) - np.sin(first) * (s[flat] - first), atol=1e-7)
    np.testing.assert_allclose(z[flat], 1 - (s[flat] - first), atol=1e-8)
    # two nodes stand at a joint, one on either piece
    at = np.flatnonzero(np.diff(s) == 0)
    assert np.all(found.pieces[0, at] != found.pieces[0, at + 1])
    nodes = piece_nodes(PILL, found.states[0, :, X], found.pieces[0])
    kappa = nodes.curvature(found.states[0, :, P])
    np.testing.assert_allclose(kappa[at[0] : at[0] + 2], [1.0, 0.0], atol=1e-9)


def test_on_a_helix():
    found = jointed_rays(PILL, launched(np.array([0.3, TURN, 1.2])), np.linspace(0, 2.5, 50), rtol=1e-10)
    assert found.times.shape == found.pieces.shape == found.states.shape[:2]
    for ray in range(3):
        nodes = piece_nodes(PILL, found.states[ray, :, X], found.pieces[ray])
        kappa, p = nodes.curvature(found.states[ray, :, P]), found.states[ray, :, P]
        middle = np.abs(nodes.points[:, 2]) < 1 - 1e-9
        assert middle.any()
        # sin^2 of the angle to the axis on the cylinder, 1 on the hemispheres
        np.testing.assert_allclose(kappa[middle], 1 - p[middle, 2] ** 2, atol=1e-6)
        np.testing.assert_allclose(kappa[np.abs(nodes.points[:, 2]) > 1 + 1e-6], 1.0, atol=1e-6)
        # Clairaut's constant
        moment = nodes.points[:, 0] * p[:, 1] - nodes.points[:, 1] * p[:, 0]
        np.testing.assert_allclose(moment, moment[0], atol=1e-6)


def test_a_ray_stays_at_its_tip():
    cone = sc.ConeSphere(radius=1.0, length=4.0)
    x = np.array([[np.cos(cone.half_angle), 0, np.sin(cone.half_angle)]]) * 1.0
    p = np.array([[-np.sin(cone.half_angle), 0, np.cos(cone.half_angle)]])
    found = jointed_rays(cone, pack(x, p, jacobi=True), np.linspace(0, 5.0, 80), rtol=1e-10)
    side = 1 / np.tan(cone.half_angle)
    assert found.ends[0] == pytest.approx(side, abs=0.02)
    late = found.times[0] > found.ends[0]
    assert np.linalg.norm(found.states[0, late, X] - [0, 0, 3.0], axis=1).max() < 0.02
