"""Sums over nodes split into near pairs and a series: against all pairs, which they replace where those take longer."""

import numpy as np
import pytest
from creeping.field.currents.node_sums import sums_at
from creeping.field.currents.smooth_kernel import SmoothKernel
from creeping.field.currents.split_sums import CURL, ONE_LAYER, SPLITS, SplitSums, best_split, cells_of
from creeping.field.currents.whole_solution import second_surface, windows_of

import creeping as cr
import scatterers as sc
from creeping.field.currents import node_sums
from creeping.field.kernels import near_pairs
from creeping.geometry.quadrature import body_nodes
from tests.tolerances import TWIN

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
    sums = SplitSums(kernel, x, normals, y, sides, w, np.ones(n, dtype=bool), np.zeros(m))
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
    sums = SplitSums(kernel, x, one[:2], y, one, np.ones(50), np.ones(50, dtype=bool), np.zeros(2))
    exact = green(6.0, x, y)[0] @ np.ones(50)
    np.testing.assert_allclose(sums.values(np.ones(50, dtype=complex)), exact, rtol=5e-5)


def test_sums_do_not_depend_on_where_the_body_is(rng):
    y, x, far = rng.random((300, 3)), rng.random((40, 3)), np.array([1e4, -3e3, 0.0])
    one, kernel = np.ones((300, 3)) / np.sqrt(3), SmoothKernel(8.0, np.ones(3), 0.75)
    exact = green(8.0, x, y)[0] @ np.ones(300)
    sums = SplitSums(kernel, x + far, one[:40], y + far, one, np.ones(300), np.ones(300, dtype=bool), np.zeros(40))
    assert rms(sums.values(np.ones(300, dtype=complex)) - exact) < SPLIT * rms(exact)


@pytest.mark.parametrize("kind", ["soft", "hard", "pec"])
def test_nothing_is_summed_of_no_nodes_and_at_no_points(kind):
    body = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0, 0, 1)), wavenumber=5.0, n_rays=16)
    currents = cr.surface_currents(fan, wavenumber=5.0, boundary=kind, solve=False)
    x, nobody = body_nodes(body, 5.0).points[:9], currents.part(np.zeros(len(currents.points), dtype=bool))
    zero = np.zeros((9, *currents.values.shape[1:]), dtype=complex)
    np.testing.assert_array_equal(sums_at(nobody, x, x, 0.1).total(nobody.values, zero), 0)
    assert len(sums_at(currents, x[:0], x[:0], 0.1).total(currents.values, zero[:0])) == 0


def test_both_ways_agree_at_a_point_that_is_a_node(monkeypatch):
    k, body = 6.0, sc.Sphere()
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0, 0, 1)), wavenumber=k, n_rays=16)
    currents = cr.surface_currents(fan, wavenumber=k, boundary=cr.ImpedanceBoundary(0.3), solve=False)
    x, found = currents.points[::50], []
    for take in (lambda *_: None, lambda make, *_: make(0.75)):
        monkeypatch.setattr(node_sums, "best_split", take)
        found.append(sums_at(currents, x, x, 0.0).total(currents.values, np.zeros(len(x), dtype=complex)))
    assert rms(found[1] - found[0]) < SPLIT * rms(found[0])


@pytest.mark.parametrize("kind", ["soft", "hard", "pec"])
def test_what_nodes_of_a_body_send_it_is_what_all_pairs_do(kind, monkeypatch):
    """Of the expansions' currents, whose nodes on rays are not alike, on the body and beneath it."""
    k, body = 10.0, sc.Ellipsoid(1.0, 0.6, 0.4)
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0.36, 0.48, 0.8)), wavenumber=k, n_rays=12)
    currents = cr.surface_currents(fan, wavenumber=k, boundary=kind, solve=False)
    assert not currents.even.all()
    nodes = body_nodes(body, 1.5 * k)
    at, inner = second_surface(body, nodes, k)
    x, n = np.concatenate([nodes.points, inner]), np.concatenate([nodes.normals, nodes.normals[at]])
    window = np.concatenate([windows_of(nodes, k, nodes.points), np.zeros(len(at))])
    x, n, window = x[::8], n[::8], window[::8]
    mine = np.zeros((len(x), *currents.values.shape[1:]), dtype=complex)
    found = []
    for take in (lambda *_: None, lambda make, *_: make(0.75)):
        monkeypatch.setattr(node_sums, "best_split", take)
        found.append(sums_at(currents, x, n, window).total(currents.values, mine))
    assert rms(found[1] - found[0]) < SPLIT * rms(found[0])
    assert np.abs(found[1] - found[0]).max() < 10 * SPLIT * np.abs(found[0]).max()


def test_kernels_are_their_sums_in_numpy(rng):
    m, n, k = 7, 200, 5.0
    x, y, sides = rng.random((m, 3)), rng.random((n, 3)), rng.normal(size=(n, 3))
    normals, weights, bends, alike = rng.normal(size=(m, 3)), rng.random(n), rng.normal(size=n), rng.random(n) < 0.6
    x[:2] = y[:2]
    reach, near = np.linspace(0.1, 0.2, m), np.linspace(0.3, 0.6, m)
    near[3] = 0.0
    cells = cells_of(y, 0.2)
    by_cells = [np.ascontiguousarray(y[cells.order].T), np.ascontiguousarray(sides[cells.order].T)]
    of_nodes = *by_cells, weights[cells.order], bends[cells.order], alike[cells.order]
    out, count = np.empty((m, 4)), np.empty(m, dtype=np.int64)
    points = np.ascontiguousarray(x.T), np.ascontiguousarray(normals.T)
    near_pairs.window_sums(*points, *of_nodes, *cells.grid, reach, near, k, False, 0, m, out)
    near_pairs.count_near(points[0], by_cells[0], *cells.grid, 0.35, 0, m, count)
    away = x[:, None] - y
    R = np.linalg.norm(away, axis=2)
    np.testing.assert_array_equal(count, np.sum(R < 0.35, axis=1))
    chi = np.where((near[:, None] >= R) & alike, np.exp(-((R / reach[:, None]) ** 2)) * weights, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        still = np.where(R > 0, chi / R, 0.0)
        tilted = np.where(R > 0, chi * np.einsum("mnc,nc->mn", away, sides) / R**3, 0.0)
    want = np.stack([chi.sum(axis=1), chi @ bends, still.sum(axis=1), tilted.sum(axis=1)], axis=1)
    np.testing.assert_allclose(out, want, atol=TWIN * np.abs(want).max())


def test_splitting_is_left_where_all_pairs_are_sooner_or_memory_is_short(rng, monkeypatch):
    y = rng.random((400, 3))

    def make(split):
        return SmoothKernel(30.0, np.ones(3), split)

    assert best_split(make, y, y, ONE_LAYER, 1e-3) is None
    plain = best_split(make, y, y, ONE_LAYER, 100.0)
    assert best_split(make, y, y, ONE_LAYER, 100.0, plain.reach).reach >= plain.reach
    assert best_split(make, y, y, ONE_LAYER, 100.0, 2 * make(SPLITS[-1]).reach) is None
    # pairs of conductors are not kept
    monkeypatch.setenv("CREEPING_MEMORY", "80M")
    assert best_split(make, y, y, CURL, 100.0) is not None
    monkeypatch.setenv("CREEPING_MEMORY", "1M")
    assert best_split(make, y, y, ONE_LAYER, 100.0) is None
