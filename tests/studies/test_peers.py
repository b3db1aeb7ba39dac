"""The peers solve the problem that the engine solves: their times would mean nothing otherwise."""

from functools import cache

import numpy as np
import pytest
import shared_bodies as sc

from creeping.geodesics.bundle import random_bundle_points
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack
from creeping.geometry.curvature import normal_curvature
from studies._peers import scipy_flow

BODIES = {"triaxial": sc.Ellipsoid(1.0, 0.8, 0.6), "torus": sc.Torus(), "twisted": sc.TwistedEllipsoid()}
TIMES = np.array([0.0, 0.7, 2.0])
RAYS = 9
"""One more than a batch, so that the last batch is filled up."""


@cache
def traced(name):
    """States at 0, the flow with J and J' in lanes 6 and 7, and A at the last time."""
    body = BODIES[name]
    states = pack(*random_bundle_points(body, RAYS, rng=np.random.default_rng(0)), jacobi=True)
    fine = np.linspace(0, TIMES[-1], 8001)
    rays = trace_states(body, states, fine, rtol=1e-12)
    decay = np.maximum(normal_curvature(body, rays[..., :3], rays[..., 3:6]), 0) ** (2 / 3)
    return states, trace_states(body, states, TIMES, rtol=1e-12), np.trapezoid(decay, fine, axis=1)


@pytest.mark.parametrize("carry_jacobi", [False, True])
@pytest.mark.parametrize("name", BODIES)
def test_scipy_agrees(name, carry_jacobi):
    states, exact, decay = traced(name)
    found = scipy_flow(BODIES[name], states, TIMES, rtol=1e-9, carry_jacobi=carry_jacobi)
    assert found.shape == (RAYS, 3, 9 if carry_jacobi else 6)
    lanes = 8 if carry_jacobi else 6
    np.testing.assert_allclose(found[..., :lanes], exact[..., :lanes], atol=2e-7)
    if carry_jacobi:
        # error estimates of order 8 see the kink of max(kappa_n, 0)^(2/3) poorly
        np.testing.assert_allclose(found[:, -1, 8], decay, atol=1e-7 if name == "triaxial" else 1e-4)
    last = scipy_flow(BODIES[name], states, TIMES[-1:], rtol=1e-9, carry_jacobi=carry_jacobi)
    np.testing.assert_allclose(last[:, 0, :lanes], exact[:, -1, :lanes], atol=2e-7)
