"""Grids and the margins of charts: nodes beyond the unit square must lie within the chart."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.phaseflow.building import Plan
from creeping.phaseflow.search import _scaled
from creeping.phaseflow.splines import MARGIN, Grid, least_cells

SPHERE = sc.Sphere()


class Reaching:
    """The unit sphere; its charts say that they reach so many half widths beyond their unit squares."""

    class Atlas:
        charts = SPHERE.atlas.charts
        locate = staticmethod(SPHERE.atlas.locate)

        def __init__(self, margin):
            self.margin = margin

    def __init__(self, margin):
        for name in ("level", "gradient", "hessian", "bounds", "parameters"):
            setattr(self, name, getattr(SPHERE, name))
        self.atlas = self.Atlas(margin)


def grid_of(nodes, degree=5):
    return Grid((nodes, nodes, 16), degree, (False, False))


@pytest.mark.parametrize("margin", [0.2, 0.7, 3.9, 4.0, 10.0])
def test_least_cells_keep_the_nodes_within_the_charts(margin):
    cells = least_cells(Reaching(margin))

    def reach(n):
        # in half widths: u runs over two of them
        u, v, _ = grid_of(n + 1 + 2 * MARGIN).axes()
        assert u[0] == v[0] == pytest.approx(1 - u[-1])
        return -2 * u[0]

    assert reach(cells) <= margin * (1 + 1e-9)
    assert cells == 1 or reach(cells - 1) > margin


@pytest.mark.parametrize("degree", [pytest.param(3, marks=pytest.mark.slow), 5])
def test_grid_too_small_for_the_margin_is_refused(degree):
    body = Reaching(0.6)
    least = least_cells(body) + 1 + 2 * MARGIN
    assert least == 12 > degree + 5
    for grid in ((least - 1, 8), (least - 1, least, 8), (least, least - 1, 8)):
        with pytest.raises(cr.CreepingError, match=rf"at least \[12, 12, {degree + 1}\] for degree {degree}"):
            cr.build_phase_map(body, horizon=0.1, grid=grid, degree=degree, cache=False)
        # the same grid does where charts reach everywhere
        built = cr.build_phase_map(SPHERE, horizon=0.1, grid=grid, degree=degree, cache=False)
        assert built.error.rms < 1e-2
    assert cr.build_phase_map(body, horizon=0.1, grid=(least, 8), degree=degree, cache=False).error.rms < 1e-2


def test_monge_charts_say_how_far_they_reach():
    # a rough fit, for its charts alone; what is too small for a margin is refused above
    body = sc.Gridded.sampled(sc.Torus(), 12)
    assert least_cells(body) == least_cells(Reaching(0.4)) == 10
    # those without a margin take any grid
    assert least_cells(SPHERE) == least_cells(sc.Torus()) == 1


@pytest.mark.parametrize("factor", [0.01, 0.5, 0.9, 1.0, 1.7])
def test_thinned_and_refined_grids_keep_the_margin(factor):
    plan = Plan(0.5, grid_of(20), least_cells=12)
    grid = _scaled(plan, factor).grid
    assert np.all(grid.cells[:2] >= 12)
    assert _scaled(Plan(0.5, grid_of(20)), 0.5).grid.cells[0] < 12
