"""Iso-phase curves: exact on the sphere, on the rays elsewhere, correctly split at the seam."""

from itertools import pairwise

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr


@pytest.fixture(scope="module")
def twisted_fan(phase_map):
    body = sc.TwistedEllipsoid()
    return cr.launch(phase_map(body), cr.shadow_line(body, (1, 1, 1)), length=2.0, n_rays=100)


def test_circles_of_the_sphere(phase_map):
    d = np.array([0.6, 0.0, 0.8])
    fan = cr.launch(phase_map("sphere"), cr.shadow_line(sc.Sphere(), d), length=3.0, n_rays=64)
    for curve in cr.iso_phase_curves(fan, [0.0, 0.5, 1.234, 2.9]):
        np.testing.assert_allclose(curve.points @ d, np.sin(curve.level), atol=1e-6)
        assert curve.closed
        assert len(curve.points) == len(fan.points)


@pytest.mark.parametrize("of", ["travel_time", "eikonal"])
def test_points_are_the_rays_at_that_phase(twisted_fan, of):
    fan = twisted_fan
    for curve in cr.iso_phase_curves(fan, [0.31, 0.87, 1.4], of=of):
        offset = fan.eikonal[curve.rays, 0] if of == "eikonal" else np.zeros(len(curve.rays))
        for k in range(0, len(curve.rays), 9):
            ray = curve.rays[k]
            x, _ = cr.trace(fan.body, fan.points[ray, 0], fan.directions[ray, 0], curve.level - offset[k], rtol=1e-12)
            np.testing.assert_allclose(curve.points[k], x, atol=5e-5)
        assert np.abs(fan.body.level(curve.points)).max() < 1e-12
        np.testing.assert_allclose(curve.parameters, fan.body.parameters(curve.points))


def test_neighbouring_points_stay_neighbours(twisted_fan):
    for curve in cr.iso_phase_curves(twisted_fan, np.arange(0, 2, 0.25)):
        step = np.diff(np.concatenate([curve.points, curve.points[:1]]) if curve.closed else curve.points, axis=0)
        assert np.linalg.norm(step, axis=1).max() < 0.13


def test_eikonal_levels_split_where_rays_have_not_started(twisted_fan):
    lowest = twisted_fan.eikonal[:, 0].min()
    curves = cr.iso_phase_curves(twisted_fan, lowest + 0.05, of="eikonal")
    assert curves
    assert not any(curve.closed for curve in curves)
    assert sum(len(curve.points) for curve in curves) < len(twisted_fan.points)
    assert cr.iso_phase_curves(twisted_fan, lowest - 1.0, of="eikonal") == []
    # and may end at detachment
    whole, ended = (cr.iso_phase_curves(twisted_fan, 1.9, beyond_detachment=beyond) for beyond in (True, False))
    assert sum(len(c.points) for c in ended) < sum(len(c.points) for c in whole)


def test_two_components_give_two_curves(phase_map):
    body = sc.Torus()
    every = cr.launch(phase_map(body), cr.shadow_line(body, (1, 1, 1)), length=0.5, n_rays=200, launch_from="all")
    # the inner component has six arcs of three states, and one iso-phase curve
    assert [curve.closed for curve in cr.iso_phase_curves(every, 0.3)] == [True, True]
    fan = cr.launch(phase_map(body), cr.shadow_line(body, (0, 0, 1)), length=0.5, n_rays=100)
    curves = cr.iso_phase_curves(fan, 0.3)
    assert [curve.closed for curve in curves] == [True, True]
    radii = [np.hypot(*curve.points[:, :2].T) for curve in curves]
    # at angle 0.3/r from the equators, on the upper half
    np.testing.assert_allclose(
        np.sort([np.mean(r) for r in radii]), [1 - 0.5 * np.cos(0.6), 1 + 0.5 * np.cos(0.6)], atol=1e-6
    )


def test_pieces_end_on_the_seam(twisted_fan):
    crossed = 0
    for curve in cr.iso_phase_curves(twisted_fan, np.arange(0.25, 2, 0.25)):
        pieces = curve.parameter_pieces
        crossed += len(pieces) - 1
        for before, after in pairwise(pieces):
            assert abs(before[-1, 1]) == pytest.approx(np.pi)
            assert after[0, 1] == pytest.approx(-before[-1, 1])
            assert after[0, 0] == pytest.approx(before[-1, 0])
        for piece in pieces:
            assert np.abs(np.diff(piece, axis=0)).max() <= np.pi
    assert crossed > 0


@pytest.mark.parametrize("levels, of", [([np.nan], "travel_time"), ([0.1], "phase"), ([[0.1]], "eikonal")])
def test_bad_input_is_named(twisted_fan, levels, of):
    with pytest.raises(cr.CreepingError):
        cr.iso_phase_curves(twisted_fan, levels, of=of)
