"""What is kept with a fan: not the fan, and nothing a caller can change."""

import gc
import weakref

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.waves.far_geometry import TAPERED, far_geometry
from creeping.geometry.surface import normal


def small_fan():
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0, 0, 1)), length=3.0, n_rays=32)


def test_a_fan_is_let_go():
    fan = small_fan()
    cr.far_field(fan, [[1.0, 0, 0]], wavenumber=20.0)
    watch = weakref.ref(fan)
    del fan
    gc.collect()
    assert watch() is None


def test_changing_a_result_changes_nothing_kept():
    fan = small_fan()
    r = [[1.0, 0, 0.3], [0, -0.4, -1]]
    first = cr.far_field(fan, r, wavenumber=20.0)
    total = first.total.copy()
    first.directions[:] *= -1
    assert cr.far_field(fan, r, wavenumber=20.0).total == pytest.approx(total, rel=1e-12)


def test_a_coarse_fan_still_finds_its_points():
    body = sc.Ellipsoid(1, 0.8, 0.6)
    line = cr.shadow_line(body, (1, 0.2, 0.3))
    fine, coarse = (cr.launch(cr.DirectFlow(body), line, length=3.0, n_rays=n, max_gap=np.inf) for n in (64, 16))
    points = fine.points[::2, 12]
    found = cr.surface_field(coarse, points, wavenumber=20.0, boundary="hard")
    assert np.all(found != 0)


D = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])
E = np.cross(D, [1.0, 0, 0]) / np.linalg.norm(np.cross(D, [1.0, 0, 0]))


def test_nodes_of_the_fan_integral_on_the_sphere_in_closed_form():
    radius, theta = 2.0, np.array([2.0, 2.5, 3.0])
    body = sc.Sphere(radius)
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-11), cr.shadow_line(body, D), length=8.0, n_rays=80, max_gap=np.inf)
    r = np.cos(theta)[:, None] * D + np.sin(theta)[:, None] * E
    nodes = far_geometry(fan, r).fan_nodes(5.0, np.ones(3, dtype=bool))
    for k in range(3):
        mine = nodes.observer == k
        # x = a (cos(s/a) u + sin(s/a) d), n.r = 0 at tan(s/a) = -u.r/d.r: each ray has one with p.r > 0 in 2 pi a
        u = nodes.rays.first_normal[mine]
        t = nodes.rays.time[mine] / radius
        np.testing.assert_allclose(np.cos(t) * (u @ r[k]) + np.sin(t) * (D @ r[k]), 0, atol=1e-8)
        first = fan.points[:, 0] / radius
        root = np.mod(-np.arctan2(first @ r[k], D @ r[k]), 2 * np.pi)
        ahead = np.cos(root) * (D @ r[k]) - np.sin(root) * (first @ r[k])
        # nodes that the taper leaves out are none
        assert np.sum(mine) == np.sum((root < 8.0 / radius) & (ahead > TAPERED))
        np.testing.assert_allclose(nodes.weight[mine], 2 * np.pi * radius / 80, rtol=1e-9)


def test_finer_nodes_share_the_line_among_them():
    body = sc.Ellipsoid(1, 0.8, 0.6)
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-10), cr.shadow_line(body, D), length=3.0, n_rays=40, max_gap=np.inf)
    geometry = far_geometry(fan, [-D, [0.3, -0.4, -0.8], D])
    wanted = np.array([True, True, False])
    coarse, fine = geometry.fan_nodes(5.0, wanted), geometry.fan_nodes(90.0, wanted)
    assert set(coarse.observer) == set(fine.observer) == {0, 1}
    assert len(fine.observer) > 3.5 * len(coarse.observer)
    n = normal(body, fine.rays.points)
    np.testing.assert_allclose(np.sum(n * geometry.directions[fine.observer], axis=1), 0, atol=1e-7)
    for k in (0, 1):
        one, other = (np.sum(nodes.weight[nodes.observer == k]) for nodes in (coarse, fine))
        assert one == pytest.approx(other, rel=0.05)


def test_no_wanted_observer_no_node():
    geometry = far_geometry(small_fan(), [[0.3, 0, -1.0]])
    assert len(geometry.fan_nodes(20.0, np.zeros(1, dtype=bool)).observer) == 0
