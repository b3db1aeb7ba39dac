"""What is said of the fold caustic of the reflected field, against fundamental solutions and quadrature."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.waves.far_geometry import fold_error
from creeping.geometry.quadrature import body_nodes
from creeping.shadow.meshes import prepared

D = np.array([0.85, 0.35, -0.39]) / np.linalg.norm([0.85, 0.35, -0.39])
R = np.array([-0.8996, -0.2953, -0.3217]) / np.linalg.norm([0.8996, 0.2953, 0.3217])


def test_a_dark_direction_is_flagged():
    # no specular point there: isolated rays give .435 for .936, and said nothing
    body = sc.TwistedEllipsoid()
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=D), length=3.0, n_rays=96)
    rays = cr.far_field(fan, R[None], wavenumber=24.0, boundary="soft", method="rays")
    assert rays.error[0] > abs(abs(rays.total[0]) - 0.936)


@pytest.mark.parametrize("k", [20.0, 60.0, 200.0])
def test_size_of_the_field_at_the_fold(k):
    # physical optics of one lit bay, integrated: a torus from above, whose top is one parabolic circle, is not generic;
    # the twisted ellipsoid's normal line at a parabolic point is
    body = sc.TwistedEllipsoid()
    from creeping.geometry.curvature import parabolic_points

    found = parabolic_points(body)
    best = int(np.argmax(np.where((found.bend > 1) & (found.bend < 2.5), found.across, -1)))
    n = found.normals[best]
    d, r = -n[None], n[None]
    stated = fold_error(body, prepared(body).coarsest, d, r, k)[0]
    nodes = body_nodes(body, 2 * k)
    # only the surroundings, smoothly cut: other specular points have no part in it
    distance = np.linalg.norm(nodes.points - found.points[best], axis=1)
    window = np.exp(-((distance / 0.35) ** 8))
    lit = np.maximum(-(nodes.normals @ d[0]), 0.0)
    f = k / (2 * np.pi) * np.sum(nodes.weights * window * lit * np.exp(1j * k * (nodes.points @ (d - r)[0])))
    assert 0.6 < stated / abs(f) / (0.5357 / 0.3550) < 1.6
