"""Kernels of the layer against their twins in numpy, closed forms and slow searches."""

import numpy as np
import pytest
from oracles.boundary_layer import pole_trace, step
from scipy.optimize import brentq

from creeping.field.kernels.layer_march import ROW, march_block
from creeping.field.kernels.ray_load import ROUNDS, TERMS, pole_traces, reflected
from creeping.field.kernels.ray_profile import cubics, plane_curve
from creeping.field.marching.layer import ORDER, rational_step
from creeping.field.marching.profile import GridSpec, layer_grid
from creeping.kernels.vectors import LANES

K = 20.0


@pytest.mark.parametrize("soft", [True, False])
def test_march_equals_numpy_twin(soft):
    rng = np.random.default_rng(5)
    grid = layer_grid(GridSpec(height=0.5, element=0.06, first=0.03, cap=0.8, twist=0.3, wavenumber=K))
    n, steps = 2 * len(grid.nodes), 3

    def noise(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    data = np.stack(
        [rng.uniform(*ends, (steps, LANES)) for ends in ((-0.4, 1), (-0.2, 0.2), (0, 1e-3), (-1, 1))], axis=1
    )
    b, weight = rational_step(rng.uniform(0.5, 3, steps * LANES))
    b, weight = b.reshape(steps, LANES, ORDER), weight.reshape(steps, LANES, ORDER)
    g, beta = noise(steps, LANES, ORDER + 1), noise(steps, LANES)
    y, incident = noise(LANES, n), noise(LANES, n)
    y[:, -2] = incident[:, -2] = 0
    switch = rng.integers(0, steps + 1, LANES)

    def flat(values):
        """Lanes last, real parts before imaginary ones: (..., ROW)."""
        moved = np.moveaxis(values, 1 if values.ndim > 2 or values.shape[0] == steps else 0, -1)
        return np.ascontiguousarray(np.concatenate([moved.real, moved.imag], axis=-1))

    w, out = flat(y).ravel(), np.empty((steps + 1, 2, ROW))
    march_block(
        *(grid.matrices, grid.levels, grid.cut, grid.scale, K, soft, data),
        *(flat(b), flat(weight), flat(g), flat(beta), switch.astype(np.int64), flat(incident).ravel(), w, out),
    )
    for lane in range(LANES):
        here = y[lane].copy()
        for i in range(steps):
            if switch[lane] == i:
                total = here + incident[lane]
                here = np.empty_like(total)
                here[0::2] = total[0::2] * grid.cut[:, 0]
                here[1::2] = total[1::2] * grid.cut[:, 0] + total[0::2] * grid.cut[:, 1]
            rest = (b[i, lane], weight[i, lane], g[i, lane], beta[i, lane])
            here = step(grid, K, soft, data[i, :, lane], *rest, here)
            found = out[i + 1, :, lane] + 1j * out[i + 1, :, LANES + lane]
            np.testing.assert_allclose(found, [here[0], here[1] / grid.scale], rtol=1e-8)


def test_traces_equal_numpy_twin():
    poles, weights = (part[0] for part in rational_step(np.array([1.2])))
    q, layer = -0.6, (0.9, 0.002, 1.5, 0.7, 0.4)
    traces = np.empty((ORDER, 2), complex)
    flat = np.empty((5, TERMS), complex)
    work = (*flat, np.empty((ORDER, ROUNDS, 2), complex))
    # the wave at the step's end that the last partial sum gives makes it the best one
    expected = [pole_trace(K, q, *layer, pole, TERMS, ROUNDS - 1) for pole in poles]
    ratio = sum(w * value for w, (value, _) in zip(weights, expected, strict=True))
    misfit = pole_traces(K, q, *layer, poles, weights, ratio, traces, work)
    np.testing.assert_allclose(traces, expected, rtol=1e-12)
    assert misfit < 1e-12


def test_plane_curve_of_a_circle_and_of_a_jump():
    s = np.concatenate([np.linspace(-1, 0.5, 16), np.linspace(0.5, 2, 16)])
    kappa = np.where(np.arange(32) < 16, 2.0, -1.0)
    c, curve = np.empty((31, 4)), np.empty((32, 3))
    cubics(s, kappa, c)
    plane_curve(s, c, 10, curve)
    assert s[10] == 0
    psi = np.where(s <= 0.5, 2 * s, 1 - (s - 0.5))
    np.testing.assert_allclose(curve[:, 0], psi, atol=1e-13)
    first = np.arange(32) < 16
    np.testing.assert_allclose(curve[first, 1], np.sin(2 * s[first]) / 2, atol=1e-9)
    np.testing.assert_allclose(curve[first, 2], (1 - np.cos(2 * s[first])) / 2, atol=1e-9)


def test_cubics_reproduce_a_cubic():
    s = np.sort(np.random.default_rng(2).uniform(-1, 2, 9))
    p = np.polynomial.Polynomial([0.3, -1, 0.5, 2])
    c = np.empty((8, 4))
    cubics(s, p(s), c)
    middle = 0.5 * (s[1:] + s[:-1])
    found = [np.polynomial.Polynomial(row)(x - a) for row, x, a in zip(c, middle, s[:-1], strict=True)]
    np.testing.assert_allclose(found, p(middle), rtol=1e-11)


def test_reflected_wave_of_a_circle():
    """The ray that meets a height by a search; its tube by differences of neighbouring rays."""
    s = np.linspace(-1.5, 0.5, 41)
    s[np.argmin(np.abs(s))] = 0
    c, curve = np.empty((40, 4)), np.empty((41, 3))
    cubics(s, np.ones(41), c)
    plane_curve(s, c, int(np.argmax(s == 0)), curve)
    start, nodes = -1.0, np.linspace(0, 1.0, 60)
    nothing, out = np.zeros((40, 4)), np.empty((60, 2), complex)
    reflected(K, False, s, c, curve, nothing, nothing.astype(complex), start, -1.5, nodes, out)

    def point(a):
        return np.array([np.sin(a), 1 - np.cos(a)])

    def ray(a):
        """Direction of the reflected ray from angle a, its length to the line and its height there."""
        n = np.array([np.sin(a), -np.cos(a)])
        r = np.array([1.0, 0.0]) - 2 * n[0] * n
        tangent, normal = np.array([np.cos(start), np.sin(start)]), np.array([np.sin(start), -np.cos(start)])
        length = ((point(start) - point(a)) @ tangent) / (r @ tangent)
        return r, length, (point(a) + length * r - point(start)) @ normal

    for n, (u, slope) in zip(nodes[1:16:3], out[1:16:3], strict=True):
        a = brentq(lambda a, n=n: ray(a)[2] - n, -1.27, start)
        r, length, _ = ray(a)
        narrow = 1 / (1 + 2 * length / -np.sin(a))
        expected = np.sqrt(narrow) * np.exp(1j * K * (point(a)[0] + length))
        assert abs(u - expected) < 2e-3
        normal = np.array([np.sin(start), -np.cos(start)])
        assert abs(slope - 1j * K * (r @ normal) * u) < 2e-3 * K
