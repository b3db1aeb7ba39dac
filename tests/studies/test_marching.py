"""The tables of the study of marched layers: a row of each kind in the quick suite, all of them in the slow one."""

import pytest

from studies._section_waves import REGIONS
from studies.marching import FACTOR, FAR, SURFACE, VARYING, Solvers, far_row, surface_row, varying_row

UNCOVERED = {"peanut .3 at 60"}
"""Whose rays say that lit concave ground is behind them."""
OUTSIDE = {
    ("ellipse 1.2 x 0.8", 20, "soft"): (1.7, 1.5),
    ("peanut .3 along", 40, "soft"): (1.5, 2.7),
    ("peanut .3 along", 40, "hard"): (1.8, 1.7),
    ("peanut .22 along", 40, "hard"): (1.8, 1.5),
}
"""Far fields beyond the factor, for the optics of second order in front: their own factors."""
QUICK = {("peanut .3 along", 20, "hard"), ("capsule along", 20, "soft"), ("ellipse 3:1 across", 20, "hard")}
ROUNDED = 0.005
"""Per cent: figures are rounded to hundredths."""


def quick_first(rows):
    """Rows as parameters; those not quick are slow."""
    return [row if row[:3] in QUICK else pytest.param(*row, marks=pytest.mark.slow) for row in rows]


@pytest.fixture(scope="module")
def solvers():
    return Solvers()


@pytest.mark.parametrize(("name", "k", "boundary", "limits"), quick_first(SURFACE))
def test_surface(name, k, boundary, limits, solvers):
    found = surface_row(name, k, boundary, solvers)
    for region, limit in zip(REGIONS, limits, strict=True):
        if limit is not None:
            assert found[region][0] < FACTOR * limit + ROUNDED, region
    assert name in UNCOVERED or found["covered"][0] >= (95 if k <= 100 else 90)


@pytest.mark.parametrize(
    ("name", "k", "limits"), [row if row[1] < 60 else pytest.param(*row, marks=pytest.mark.slow) for row in VARYING]
)
def test_admittance(name, k, limits, solvers):
    found = varying_row(name, k, solvers)
    assert all(found[region][0] < FACTOR * limit for region, limit in zip(REGIONS[1:3], limits, strict=True))
    assert found["covered"][0] >= 95


@pytest.mark.parametrize(("name", "k", "boundary", "limits"), quick_first(FAR))
def test_far(name, k, boundary, limits, solvers):
    factors = OUTSIDE.get((name, k, boundary), (FACTOR, FACTOR))
    found = far_row(name, k, boundary, solvers)
    assert all(one < factor * limit + ROUNDED for one, factor, limit in zip(found, factors, limits, strict=True))
