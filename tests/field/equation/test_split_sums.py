"""Sums over nodes split into near pairs and a series: against all pairs, which they replace where those take longer."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.boundary import CONDUCTOR, scalar_boundaries
from creeping.field.equation.columns import SplitProduct
from creeping.field.equation.matrix import Matrix
from creeping.field.equation.mirrors import blocks_of, no_mirrors
from creeping.field.equation.parting import tiles_for
from creeping.field.equation.split_sums import CURL, ONE_LAYER, SPLITS, SmoothKernel, SplitSums, best_split
from creeping.geometry.covering import patches_of

SPLIT = 3e-5
"""What split sums leave of those over all pairs, rms."""


def green(k, x, y):
    """G, and its gradient along x, for points (m, 3) and nodes (n, 3) that are nowhere one."""
    away = x[:, None] - y
    R = np.linalg.norm(away, axis=2)
    G = np.exp(1j * k * R) / R
    return G, (G * (1j * k - 1 / R) / R)[..., None] * away


def rms(values):
    return np.sqrt(np.mean(np.abs(values) ** 2))


@pytest.mark.parametrize("split", SPLITS)
def test_the_series_and_what_is_near_are_the_wave(split):
    k, widths = 7.0, np.array([3.0, 1.1, 0.4])
    kernel = SmoothKernel(k, widths, split)
    away = np.array([[2.9, -1.0, 0.3], [-0.3, 0.2, 0.1], [0.01, 0.0, -0.02], [3.0, 1.1, 0.4], [0.0, 0.0, 0.0]])
    phases = [np.exp(1j * np.multiply.outer(x, s)) for x, s in zip(away.T, kernel.waves, strict=True)]
    smooth = np.einsum("abc,ma,mb,mc->m", kernel.series, *phases)
    R = np.linalg.norm(away, axis=1)[:-1]
    near = np.where(R < kernel.reach, kernel.near(R)[0], 0.0)
    np.testing.assert_allclose(R * smooth[:-1] + near, np.exp(1j * k * R), atol=5e-5)
    np.testing.assert_allclose(smooth[-1], kernel.at_zero + 1j * k, rtol=5e-5)
    assert np.all(kernel.modes % 2 == 0) and abs(kernel.near(np.array([kernel.reach]))[0, 0]) < 2e-5


def test_what_is_near_has_the_derivatives_that_are_said():
    kernel, h = SmoothKernel(5.0, np.ones(3), 0.6), 1e-5
    R = np.linspace(0.05, 0.9, 7)
    plus, here, minus = (kernel.near(R + step) for step in (h, 0.0, -h))
    np.testing.assert_allclose(here[1], (plus[0] - minus[0]) / (2 * h), atol=1e-7)
    np.testing.assert_allclose(here[2], (plus[1] - minus[1]) / (2 * h), atol=1e-6)
    # of its table cubics are taken
    at = np.array([0.31, 0.77]) * kernel.reach
    step = kernel.reach / (len(kernel.table) - 1)
    for place in at:
        row = int(place / step)
        middle = kernel.near(np.array([(row + 0.5) * step]))[0, 0]
        E, dE = kernel.table[row : row + 2, 0], kernel.table[row : row + 2, 1]
        assert abs(E.mean() + step * (dE[0] - dE[1]) / 8 - middle) < 1e-10


@pytest.mark.parametrize("split", [0.4, 0.9, 2.2])
def test_sums_are_those_over_all_pairs(rng, split):
    k, n, m = 9.0, 700, 60
    y, x = rng.random((n, 3)) * (1.0, 0.5, 0.3), rng.random((m, 3)) * (0.9, 0.5, 0.2)
    sides, normals = (
        v / np.linalg.norm(v, axis=1)[:, None] for v in (rng.normal(size=(n, 3)), rng.normal(size=(m, 3)))
    )
    w, a = rng.random(n), rng.normal(size=n) + 1j * rng.normal(size=n)
    J = rng.normal(size=(n, 3, 2)) + 1j * rng.normal(size=(n, 3, 2))
    kernel = SmoothKernel(k, np.ptp(np.concatenate([x, y]), axis=0), split)
    sums = SplitSums(kernel, x, normals, y, sides, w)
    G, gradient = green(k, x, y)
    want = {
        "values": G @ (w * a),
        "at nodes": -np.einsum("mnc,nc->mn", gradient, sides) @ (w * a),
        "at points": -np.einsum("mnc,mc->mn", gradient, normals) @ (w * a),
        "curl": np.einsum("mncp,n->mcp", np.cross(gradient[..., None], J[None], axis=2), w),
    }
    have = {
        "values": sums.values(a),
        "at nodes": sums.tilted_at_nodes(a),
        "at points": sums.tilted_at_points(a),
        "curl": sums.curl(J),
    }
    for name, exact in want.items():
        assert rms(have[name] - exact) < SPLIT * rms(exact), name


def test_points_may_be_anywhere_in_the_box(rng):
    """Far from all cells of the nodes, too."""
    y, x = rng.random((50, 3)) * 0.1, np.array([[0.9, 0.9, 0.9], [-0.2, 0.5, 0.0]])
    kernel, one = SmoothKernel(6.0, np.full(3, 1.3), 0.9), np.ones((50, 3)) / np.sqrt(3)
    sums = SplitSums(kernel, x, one[:2], y, one, np.ones(50))
    exact = green(6.0, x, y)[0] @ np.ones(50)
    np.testing.assert_allclose(sums.values(np.ones(50, dtype=complex)), exact, rtol=5e-5)


def test_sums_do_not_depend_on_where_the_body_is(rng):
    y, x, far = rng.random((300, 3)), rng.random((40, 3)), np.array([1e4, -3e3, 0.0])
    one, kernel = np.ones((300, 3)) / np.sqrt(3), SmoothKernel(8.0, np.ones(3), 0.75)
    exact = green(8.0, x, y)[0] @ np.ones(300)
    sums = SplitSums(kernel, x + far, one[:40], y + far, one, np.ones(300))
    assert rms(sums.values(np.ones(300, dtype=complex)) - exact) < SPLIT * rms(exact)


@pytest.mark.parametrize(
    "boundary",
    [cr.ImpedanceBoundary(0.5 + 0.2j), *(pytest.param(k, marks=pytest.mark.slow) for k in ("soft", "hard", "pec"))],
)
def test_products_are_those_of_the_matrix(boundary, rng):
    """On the body and beneath it, of scalar fields next to edges too."""
    k, kinds = 3.0, scalar_boundaries(boundary)
    tiles = tiles_for(patches_of(sc.Sphere() if boundary == "pec" else sc.Cylinder(0.5, 1.0)), k)
    matrix = Matrix(tiles, k, CONDUCTOR if len(kinds) == 2 else kinds[0])
    v = rng.normal(size=(len(matrix.root) * matrix.columns, 2)) + 1j * rng.normal(size=(1, 2))
    (block,) = blocks_of(matrix, no_mirrors(len(matrix.root), matrix.columns))
    whole = block @ v
    assert rms(SplitProduct(matrix)(v) - whole) < SPLIT * rms(whole - v)


def test_splitting_is_left_where_all_pairs_are_sooner_or_memory_is_short(rng, monkeypatch):
    y = rng.random((400, 3))

    def make(split):
        return SmoothKernel(30.0, np.ones(3), split)

    assert best_split(make, y, y, ONE_LAYER, 1e-3) is None
    assert best_split(make, y, y, ONE_LAYER, 100.0) is not None
    # pairs of conductors are not kept
    monkeypatch.setenv("CREEPING_MEMORY", "80M")
    assert best_split(make, y, y, CURL, 100.0) is not None
    monkeypatch.setenv("CREEPING_MEMORY", "1M")
    assert best_split(make, y, y, ONE_LAYER, 100.0) is None


def test_a_thin_body_has_nothing_beneath_its_nodes(rng):
    matrix = Matrix(tiles_for(patches_of(sc.Sphere())[:1], 0.5), 0.5, CONDUCTOR)
    matrix.at, matrix.inner = matrix.at[:0], matrix.inner.part(slice(0, 0))
    values = rng.normal(size=(2 * len(matrix.root), 1)) + 0j
    assert np.all(np.isfinite(SplitProduct(matrix)(values)))
