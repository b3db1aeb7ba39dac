"""Observed orders of convergence: h^4 cubic, h^6 quintic, tau^4 burn-in, t^8 tracer."""

import numpy as np
import pytest
import shared_bodies as sc
from tolerances import ORDER

import creeping as cr
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.phaseflow.building import measure


def slope(sizes, errors):
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


def error_of(body, **options):
    """Rms error over enough points that its scatter does not show in a slope."""
    flow = cr.build_phase_map(body, cache=False, **options)
    return measure(flow, samples=5000, rng=np.random.default_rng(1)).rms


@pytest.mark.parametrize("order, nodes", [pytest.param(3, (48, 64, 96), marks=pytest.mark.slow), (5, (56, 72, 92))])
def test_spline_order(order, nodes):
    # the doubly periodic torus: h is 1/nodes without margins
    body = sc.Torus()
    errors = [error_of(body, horizon=1 / 8, grid=(n, n, n), degree=order) for n in nodes]
    assert errors[-1] < 1e-6
    assert slope(1 / np.array(nodes), errors) == pytest.approx(order + 1, abs=ORDER)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [3, 5])
def test_spline_order_on_six_charts(degree):
    # no body of revolution: its map has two axes; nor the sphere, whose displacement is one rotation everywhere
    body = sc.Ellipsoid(1.2, 0.8, 0.85)
    nodes = np.array([21, 29, 41])
    cells = nodes - 5
    errors = [
        error_of(body, horizon=1 / 2, grid=(int(n), int(4 * c)), degree=degree)
        for n, c in zip(nodes, cells, strict=True)
    ]
    # between these grids and rounding a quintic still gains more than its order: 6.5 was measured
    assert slope(1 / cells, errors) == pytest.approx(degree + 1, abs=ORDER if degree == 3 else 2 * ORDER)


@pytest.mark.slow
def test_burn_in_order():
    body = sc.Torus()
    steps = np.array([2.0**-3, 2.0**-4, 2.0**-5])
    errors = [
        error_of(body, horizon=1 / 4, grid=(48, 48, 48), degree=5, method="tower", time_step=float(tau), stages=k)
        for k, tau in enumerate(steps, start=1)
    ]
    assert slope(steps, errors) == pytest.approx(4, abs=ORDER)


def test_tracer_order():
    body = sc.Ellipsoid(1.2, 0.8, 0.8)
    states = pack(*random_bundle_points(body, 50, rng=np.random.default_rng(3)))
    exact = trace_states(body, states, np.array([2.0]), rtol=1e-13)
    # below 1/8 the error meets rounding
    steps = np.array([1 / 5, 1 / 6, 1 / 7, 1 / 8])
    errors = [
        np.sqrt(np.mean((trace_states(body, states, np.array([2.0]), rtol=0.0, step=h) - exact) ** 2)) for h in steps
    ]
    assert slope(steps, errors) == pytest.approx(8, abs=0.6)
