"""Compiled composition of maps stored in space, for any atlas.

A body enters as the addresses of its block evaluator and of its locator (see `creeping.geometry.surface.Compiled`), so
the kernel compiles once for all bodies.
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.kernels.flow_derivative import project_block
from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.kernels.contraction import contraction
from creeping.kernels.splines import cells_and_fractions, weights
from creeping.kernels.vectors import pointer

_state_3, _state_5 = contraction(3, 8), contraction(5, 8)
_jacobi_3, _jacobi_5 = contraction(3, 4), contraction(5, 4)


@njit(**options)
def _stencil(table, jacobi, carry_jacobi, degree, first, wu, wv, wa, ray, out):
    """Interpolate the state lanes of a ray into out[:8] and, if it is carried, the Jacobi lanes into out[8:12]."""
    row = table.shape[3]
    plane = row * table.shape[2]
    if degree == 3:
        _state_3(table, 8 * first, 8 * plane, 8 * row, wu, wv, wa, ray, BLOCK, out, 0)
    else:
        _state_5(table, 8 * first, 8 * plane, 8 * row, wu, wv, wa, ray, BLOCK, out, 0)
    if carry_jacobi:
        if degree == 3:
            _jacobi_3(jacobi, 4 * first, 4 * plane, 4 * row, wu, wv, wa, ray, BLOCK, out, 8)
        else:
            _jacobi_5(jacobi, 4 * first, 4 * plane, 4 * row, wu, wv, wa, ray, BLOCK, out, 8)


@njit(**entry_options)
def leap(locate, locate_par, level, level_par, table, jacobi, degree, origin, cells, horizon, leaps, tolerance, states):
    """Compose the map ``leaps`` times on states (n, 6 or 10), in place.

    table (charts, nu, nv, na, 8) holds x' - x - T0 p and p' - p, jacobi (charts, nu, nv, na, 4) M - [[1, T0], [0, 1]];
    grid coordinates are origin + cells * (u, v, angle/2 pi). Afterwards x is brought back to |F| <= tolerance |grad F|,
    which leaves grad F for the locator of the next leap.
    """
    n, lanes = states.shape
    y, geometry = aligned(6, BLOCK), aligned(10, BLOCK)
    chart, uv, frame = np.empty(BLOCK, np.int64), np.empty((2, BLOCK)), np.empty((6, BLOCK))
    w, places, cell = aligned(3, 6 * BLOCK), aligned(3, BLOCK), np.empty((3, BLOCK), np.int64)
    d = np.empty(12)
    last = table.shape[1] - degree - 1, table.shape[2] - degree - 1, int(cells[2]) - 1
    row = table.shape[3]
    plane = row * table.shape[2]
    turns = cells[2] / (2 * math.pi)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for lane in range(6):
                y[lane, i] = states[start + min(i, count - 1), lane]
        off = math.inf
        # y and geometry are in use until the end, as their addresses must be
        here, normals = pointer(y.reshape(-1), 0), pointer(geometry.reshape(-1), 0)
        for _ in range(leaps):
            # else the last evaluation was within the tolerance of where the rays are
            if not off <= tolerance:
                level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
            locate(y[:3], geometry[1:4], chart, uv, frame, locate_par)
            for i in range(BLOCK):
                px, py, pz = y[3, i], y[4, i], y[5, i]
                across = px * frame[3, i] + py * frame[4, i] + pz * frame[5, i]
                along = px * frame[0, i] + py * frame[1, i] + pz * frame[2, i]
                angle = math.atan2(across, along) * turns
                places[0, i], places[1, i] = origin[0] + cells[0] * uv[0, i], origin[1] + cells[1] * uv[1, i]
                places[2, i] = angle + cells[2] if angle < 0.0 else angle
            for axis in range(3):
                cells_and_fractions(places[axis], last[axis], cell[axis])
                weights(places[axis], degree, w[axis])
            for i in range(count):
                px, py, pz = y[3, i], y[4, i], y[5, i]
                first = (chart[i] * table.shape[1] + cell[0, i]) * plane + cell[1, i] * row + cell[2, i]
                _stencil(table, jacobi, lanes > 6, degree, first, w[0], w[1], w[2], i, d)
                y[0, i] += horizon * px + d[0]
                y[1, i] += horizon * py + d[1]
                y[2, i] += horizon * pz + d[2]
                y[3, i] += d[3]
                y[4, i] += d[4]
                y[5, i] += d[5]
                if lanes > 6:
                    state = states[start + i]
                    m11, m21, m12, m22 = 1.0 + d[8], d[9], horizon + d[10], 1.0 + d[11]
                    i1, j1, i2, j2 = state[6], state[7], state[8], state[9]
                    state[6], state[7] = m11 * i1 + m12 * j1, m21 * i1 + m22 * j1
                    state[8], state[9] = m11 * i2 + m12 * j2, m21 * i2 + m22 * j2
            for i in range(count, BLOCK):
                for lane in range(6):
                    y[lane, i] = y[lane, count - 1]
            for _newton in range(4):
                level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
                off = 0.0
                for i in range(BLOCK):
                    slope = math.sqrt(geometry[1, i] ** 2 + geometry[2, i] ** 2 + geometry[3, i] ** 2)
                    off = max(off, abs(geometry[0, i]) / slope)
                project_block(here, 6, normals, here)
                if off <= tolerance:
                    break
        for i in range(count):
            for lane in range(6):
                states[start + i, lane] = y[lane, i]
