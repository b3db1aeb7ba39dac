"""scipy solves the problem that the engine solves: its times would mean nothing otherwise."""

import numpy as np
import pytest
import shared_bodies as sc

from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from studies.cost.flow_speed import scipy_flow

BODIES = {"triaxial": sc.Ellipsoid(1.0, 0.8, 0.6), "torus": sc.Torus(), "twisted": sc.TwistedEllipsoid()}
TIMES = np.array([0.0, 0.7, 2.0])
RAYS = 9


@pytest.mark.parametrize("name", BODIES)
def test_scipy_agrees(name):
    body = BODIES[name]
    states = pack(*random_bundle_points(body, RAYS, rng=np.random.default_rng(0)))
    exact = trace_states(body, states, TIMES, rtol=1e-12)
    found = scipy_flow(body, states, TIMES, rtol=1e-9)
    assert found.shape == (RAYS, 3, 6)
    np.testing.assert_allclose(found, exact, atol=2e-7)
    last = scipy_flow(body, states, TIMES[-1:], rtol=1e-9)
    np.testing.assert_allclose(last[:, 0], exact[:, -1], atol=2e-7)
