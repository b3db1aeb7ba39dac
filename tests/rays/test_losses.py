"""Shares that edges take, against closed forms."""

import numpy as np
import pytest
import shared_bodies as sc
from piecewise_bodies import cut_sphere

import creeping as cr
from creeping.rays.reach import HARD_DECAY


@pytest.mark.parametrize("angle", [np.pi / 2, 0.9])
def test_cut_sphere(angle):
    body, d = cut_sphere(0.5), (np.sin(angle), 0.0, np.cos(angle))
    fan = cr.launch(
        cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, d), length=4.0, n_rays=256, n_steps=64, max_gap=np.inf
    )
    rim, cut = np.sqrt(0.75), 2 * np.arccos(0.5 / np.sin(angle))
    # the ball is lit on the rim where cos(phi) < c, and the cap is dark
    c = np.clip(-0.5 * np.cos(angle) / (rim * np.sin(angle)), -1, 1)
    phi = np.linspace(np.arccos(c), 2 * np.pi - np.arccos(c), 20001)
    edge = rim * (phi[-1] - phi[0])
    seen = rim * np.trapezoid(np.sqrt(1 - (np.sin(phi) * np.sin(angle)) ** 2), phi)
    ball = 2 * np.pi - cut
    found = fan.losses(wavenumber=20.0)
    assert found.line == pytest.approx(edge / (edge + ball), rel=1e-5)
    assert found.outline == pytest.approx(seen / (seen + ball), rel=1e-3)
    # launch points of the great circle below the cut, and where z cos t + d_z sin t = 1/2 first
    s = (np.arange(200_000) + 0.5) / 200_000 * ball + cut / 2
    z, up = np.sin(angle) * np.cos(s), np.cos(angle)
    far = np.hypot(z, up)
    end = np.mod(np.arctan2(up, z) - np.arccos(np.minimum(0.5 / far, 1)), 2 * np.pi)
    left = np.where((far > 0.5) & (end < 4.0), np.exp(-(10 ** (1 / 3)) * end * HARD_DECAY), 0.0)
    assert found.rays == pytest.approx(left.mean(), rel=0.01)


@pytest.mark.parametrize(
    "body, direction, lost",
    [(sc.Capsule(0.5, 3.0), (1, 0, 0.5), (0, 0, 0)), (sc.Cylinder(0.5, 2.0), (0, 0, 1), (1, 0, 1))],
)
def test_nothing_is_lost_without_edges_and_all_of_a_cylinder_end_on(body, direction, lost):
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-6), cr.shadow_line(body, direction), length=1.0, n_rays=16)
    assert fan.losses() == lost
