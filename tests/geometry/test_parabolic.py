"""Parabolic points: none on convex bodies, circles on the torus, K = 0 on others."""

import numpy as np
import shared_bodies as sc

from creeping.geometry.curvature import gaussian_curvature, normal_curvature, parabolic_points
from creeping.geometry.surface import normal


def test_a_convex_body_has_none():
    assert len(parabolic_points(sc.Ellipsoid(1.0, 0.7, 0.4)).points) == 0


def test_torus():
    # on top and below: u is radial, outward where normals are those of the outer half; kappa_1 = cos(v)/(R + r cos v)
    R, r = 2.0, 0.5
    found = parabolic_points(sc.Torus(R=R, r=r))
    assert len(found.points) > 20
    np.testing.assert_allclose(np.hypot(found.points[:, 0], found.points[:, 1]), R, atol=1e-6)
    np.testing.assert_allclose(np.abs(found.normals[:, 2]), 1, atol=1e-9)
    np.testing.assert_allclose(found.across, 1 / r, rtol=1e-6)


def test_twisted(rng):
    body = sc.TwistedEllipsoid()
    found = parabolic_points(body)
    at = found.points
    assert len(at) > 100
    assert np.max(np.abs(gaussian_curvature(body, at))) < 1e-6
    assert np.max(np.abs(normal_curvature(body, at, found.axes))) < 1e-6
    # a step along u to either side turns the normal towards u, by g s^2/2
    s = 1e-3
    for sign in (1, -1):
        x = at + sign * s * found.axes
        x -= (body.level(x) / np.sum(body.gradient(x) ** 2, axis=1))[:, None] * body.gradient(x)
        turned = np.sum((normal(body, x) - found.normals) * found.axes, axis=1)
        typical = found.bend > 0.5
        np.testing.assert_allclose(turned[typical], 0.5 * s * s * found.bend[typical], rtol=0.05)
