"""Elements across the layer: what their matrices integrate, and the shape of a grid."""

import numpy as np
import pytest
from oracles.boundary_layer import dense

from creeping.field.marching.profile import DEPTH, GridSpec, layer_grid

K = 20.0


@pytest.fixture(scope="module")
def grid():
    return layer_grid(GridSpec(height=1.0, element=0.06, first=0.02, cap=np.inf, twist=0.5, wavenumber=K))


def nodal(grid, f, slope):
    """Unknowns of a function and its slope."""
    out = np.empty(2 * len(grid.nodes), complex)
    out[0::2], out[1::2] = f(grid.nodes), slope(grid.nodes) * grid.scale
    return out


def test_matrices_integrate_cubics(grid):
    """v = n^2 - n and w = n^3 on 0..T, faded out by not reaching the absorber's elements."""
    inside = grid.nodes <= 1.0 + 1e-9
    v = nodal(grid, lambda n: n**2 - n, lambda n: 2 * n - 1)
    w = nodal(grid, lambda n: n**3, lambda n: 3 * n**2)
    some = np.repeat(inside, 2)
    m0, d0, first, second, *twist = (dense(part)[np.ix_(some, some)] for part in grid.matrices)
    # the last kept node has an element of the absorber above it: take its share off by a function that vanishes there
    bell, rate = lambda n: (1 - n) ** 2 * n, lambda n: (1 - n) ** 2 - 2 * n * (1 - n)
    u = nodal(grid, bell, rate)[some]
    n = np.polynomial.Polynomial([0, 1])
    p, q = (1 - n) ** 2 * n, n**2 - n

    def integral(f):
        return f.integ()(1) - f.integ()(0)

    v = v[some]
    expected = integral(p * q), -integral(p.deriv() * q.deriv()) / K**2
    assert u @ m0 @ v == pytest.approx(expected[0], rel=1e-10)
    assert u @ d0 @ v == pytest.approx(expected[1], rel=1e-10)
    assert u @ first @ v == pytest.approx(2 * integral(n * p * q) - 2 * integral(n * p.deriv() * q.deriv()) / K**2)
    assert u @ second @ v == pytest.approx(integral(n**2 * p * q) - integral(n**2 * p.deriv() * q.deriv()) / K**2)
    # t = 0.5 tanh(n/0.5) is no polynomial: by Gauss' rule on many points
    x, weight = np.polynomial.legendre.leggauss(200)
    x, weight = (x + 1) / 2, weight / 2
    t, bend = 0.5 * np.tanh(2 * x), p.deriv()(x) * q.deriv()(x)
    slopes = (-2 * t, -2 * x * t, -(t**2))
    expected = [weight @ (t**2 * p(x) * q(x)), *(weight @ (f * bend) / K**2 for f in slopes)]
    np.testing.assert_allclose([u @ part @ v for part in twist], expected, rtol=1e-6)
    assert w.shape == (2 * len(grid.nodes),)


def test_top_is_held_and_absorbs(grid):
    m0, d0, *_ = (dense(part) for part in grid.matrices)
    top = len(m0) - 2
    assert m0[top, top] == 1 and np.count_nonzero(m0[top]) == 1 and np.count_nonzero(d0[top]) == 0
    assert np.all(m0[: top // 2].imag == 0) and np.any(m0.imag > 0)
    assert grid.nodes[-1] == pytest.approx(1 + DEPTH)
    assert grid.cut[0, 0] == 1 and grid.cut[-1, 0] == 0


def test_heights_level_off_over_concave_ground():
    grid = layer_grid(GridSpec(height=1.0, element=0.06, first=0.02, cap=0.4, twist=0.5, wavenumber=K))
    kept = grid.nodes < 0.6 * 0.4
    heights, rates, *_ = grid.levels
    np.testing.assert_array_equal(heights[kept], grid.nodes[kept])
    assert np.max(heights) <= 0.4
    between = np.diff(heights) / np.diff(grid.nodes)
    assert np.all((between >= np.minimum(rates[1:], rates[:-1]) - 1e-12) & (between <= 1 + 1e-12))
