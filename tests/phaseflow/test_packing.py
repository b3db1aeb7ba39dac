"""Packed leaps: the bend of the curvature, what is trusted, and what comes of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import betainc

import creeping as cr
import scatterers as sc
from creeping.geodesics.states import pack, random_bundle_points
from creeping.phaseflow.rotation import bent_floor


def test_the_bend_is_what_its_slope_says():
    threshold = 0.3
    least = threshold - quad(lambda k: betainc(7, 4, (k + threshold) / (2 * threshold)), -threshold, threshold)[0]
    for curvature in (-2.0, -0.3, -0.1, 0.0, 0.2, 0.299, 0.3, 1.7):
        low = min(max(curvature, -threshold), threshold)
        risen = quad(lambda k: betainc(7, 4, (k + threshold) / (2 * threshold)), -threshold, low)[0]
        expected = curvature if curvature > threshold else least + risen
        assert bent_floor(np.array([curvature]), threshold)[0] == pytest.approx(expected, abs=1e-12)
    assert np.all(bent_floor(np.linspace(-3, 3, 500), threshold) > 0)


@pytest.fixture(
    scope="module",
    params=[sc.Ellipsoid(1.0, 0.8, 0.6), sc.TwistedEllipsoid(), sc.Torus()],
    ids=["octant", "rotation", "angles"],
)
def built(request):
    return cr.build_phase_map(request.param, tolerance=1e-4, length=3.0, cache=False)


def test_maps_that_carry_the_attenuation_are_packed(built):
    leap = built.leaps[-1]
    assert leap.is_packed and leap.flagged.shape == leap.jacobi.shape[:4]
    # a convex body has no cell that is not trusted, but those that no ray is in
    cells, first = built.grid.cells.astype(int), built.grid.origin.astype(int)
    inside = leap.flagged[:, first[0] :, first[1] :][:, : cells[0], : cells[1], : cells[2]]
    convex = isinstance(built.body, sc.Ellipsoid)
    assert (inside.mean() < 0.01) if convex else (0.05 < inside.mean() < 0.7)


def test_attenuation_and_detachment_are_those_of_the_traced_ray(built):
    states = pack(*random_bundle_points(built.body, 800, rng=np.random.default_rng(5)), lanes=12)
    times = built.horizon * np.array([2.0, 5.0])
    exact = cr.DirectFlow(built.body, rtol=1e-11).transport(states, times)
    found = built.transport(states, times)
    late = 2 * times[-1]
    alike = np.abs(np.minimum(found[..., 11], late) - np.minimum(exact[..., 11], late)) < 0.02
    assert alike.mean() > 0.99
    off = np.abs(found[..., 10] - exact[..., 10])[alike]
    assert np.sqrt(np.mean(off**2)) < 1e-4


def test_what_is_not_trusted_has_the_curvature(built):
    """With every cell flagged results are those of the curvature's table, and nearly those of the trusted cells."""
    leap = built.leaps[-1]
    careful = replace(built, leaps=(replace(leap, flagged=np.ones(leap.flagged.shape, dtype=np.uint8)),))
    states = pack(*random_bundle_points(built.body, 500, rng=np.random.default_rng(6)), lanes=12)
    one, other = (flow.leap(states, 3) for flow in (built, careful))
    assert np.array_equal(one[:, :10], other[:, :10])
    assert np.array_equal(np.isinf(one[:, 11]), np.isinf(other[:, 11]))
    assert np.abs(one[:, 10] - other[:, 10]).max() < 3e-3
    assert np.sqrt(np.mean((one[:, 10] - other[:, 10]) ** 2)) < 1e-4
