"""A step of the integral equation: exact currents stay as they are, wrong ones get better."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.currents import node_sums
from creeping.field.currents.second_kind import stepped
from creeping.geometry.quadrature import body_nodes
from studies.reference import sphere

K = 12.0


@pytest.fixture(scope="module")
def fan():
    ball = sc.Ellipsoid(1.0, 1.0, 1.0)
    return cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1)), length=3.5, n_rays=64)


def exact(points, boundary):
    """U, or du/dn if soft, of the wave along z on the unit sphere (n,)."""
    if boundary == "soft":
        return sphere.surface_derivative(K, 1.0, np.clip(points[:, 2], -1, 1), boundary)
    return sphere.total_field(K, 1.0, points, np.array([0.0, 0.0, 1.0]), boundary)


def known(fan, boundary, change):
    """Currents of the ball at nodes all over it: the exact ones, times what ``change`` makes of the points."""
    kind = cr.ImpedanceBoundary(boundary) if not isinstance(boundary, str) else boundary
    nodes = body_nodes(fan.body, 2 * K)
    values = exact(nodes.points, boundary) * change(nodes.points)
    return replace(
        cr.surface_currents(fan, wavenumber=K, boundary=kind, solve=False),
        points=nodes.points,
        normals=nodes.normals,
        weights=nodes.weights,
        values=values,
        change=0 * values,
        travel=nodes.normals,
        lit=np.ones(len(values), dtype=bool),
    )


@pytest.mark.parametrize("boundary", ["soft", "hard", 0.6 - 0.2j])
def test_exact_currents_are_its_fixed_point(fan, boundary, rng):
    x = rng.normal(size=(80, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    u = exact(x, boundary)
    found = stepped(known(fan, boundary, lambda x: 1.0), x, x, u)
    # in the dark an impedance is parted by a c that is none
    at = x[:, 2] < (0 if not isinstance(boundary, str) else 1)
    assert np.max(np.abs(found - u)[at]) < 0.01 * np.abs(u).max()


@pytest.mark.parametrize("boundary", ["soft", "hard", 0.6 - 0.2j])
def test_what_is_wrong_gets_better_in_the_light(fan, boundary, rng):
    """Currents that jump by a fifth along a meridian, as the expansions of lit ground do at a joint."""

    def jump(x):
        return 1 + 0.1 * np.sign(x[:, 0])

    x = rng.normal(size=(200, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    x = x[(x[:, 2] < -0.4) & (np.abs(x[:, 0]) > 0.02)]
    u = exact(x, boundary)
    wrong = u * jump(x)
    off = np.abs(stepped(known(fan, boundary, jump), x, x, wrong) - u)
    assert np.median(off / np.abs(wrong - u)) < 0.35
    assert np.max(off) < np.max(np.abs(wrong - u))


def test_what_stands_far_off_is_summed_as_what_is_beside(fan, monkeypatch):
    """Where the sums are parted is no matter but for the window, which is 1e-9 there."""
    currents = known(fan, "hard", lambda x: 1.0)
    x = currents.points[::97]
    u = exact(x, "hard")
    found = stepped(currents, x, currents.normals[::97], u)
    monkeypatch.setattr(node_sums, "NEIGHBOURS", 6.0)
    np.testing.assert_allclose(stepped(currents, x, currents.normals[::97], u), found, atol=1e-7)
