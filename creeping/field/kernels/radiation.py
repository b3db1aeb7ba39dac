"""Compiled sums over currents at nodes x_n of a body: phases of distant observers, and point sources.

    distant   S_c(r) = sum_n w_cn e^{-ik r.x_n}
    near      u(y) = sum_n [a_n + b_n n_n.(y - x_n) (1/R - ik)/R] e^{ikR}/R,   R = |y - x_n|
    curl      H(y) = sum_n (ik - 1/R) e^{ikR}/R^2 (y - x_n) x J_n
    electric  E(y) = sum_n (ik - 1/R + w) e^{ikR}/R J_n - (ik - 3/R + 3w) e^{ikR}/R^3 (y - x_n) (y - x_n).J_n
              w = 1/(ik R^2) = -i/(k R^2)

Phases are taken in turns, for polynomials vectorise (`creeping.kernels.turns`).

Sources: [CK13, sec. 2.2 and 6.2]; Derivations, F16.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import entry_options
from creeping.kernels.turns import cosine_sine

PART = 1024
"""Nodes whose phases are held at a time."""


@njit(**entry_options)
def distant(turns, real, imaginary, r, out):
    """Fill out (m, 2 C), real parts of the C sums before their imaginary parts.

    turns (3, n) are k x/2 pi, real and imaginary (C, n) the weights, r (m, 3) unit directions.
    """
    n, columns = turns.shape[1], real.shape[0]
    cosines, sines = np.empty(PART), np.empty(PART)
    out[:] = 0.0
    for first in range(0, n, PART):
        count = min(PART, n - first)
        x, y, z = turns[0, first : first + count], turns[1, first : first + count], turns[2, first : first + count]
        for j in range(r.shape[0]):
            rx, ry, rz = -r[j, 0], -r[j, 1], -r[j, 2]
            for i in range(count):
                cosines[i], sines[i] = cosine_sine(rx * x[i] + ry * y[i] + rz * z[i])
            for column in range(columns):
                a, b = real[column, first : first + count], imaginary[column, first : first + count]
                p, q = 0.0, 0.0
                for i in range(count):
                    p += a[i] * cosines[i] - b[i] * sines[i]
                    q += a[i] * sines[i] + b[i] * cosines[i]
                out[j, column] += p
                out[j, columns + column] += q


@njit(**entry_options)
def near(x, normals, single, double, k, y, out):
    """Fill out (m, 2 C), real parts of u at points y (m, 3) for each of C columns before their imaginary parts.

    x and normals (3, n), single and double (2, C, n) the weights a and b, real before imaginary parts.
    """
    n, columns = x.shape[1], single.shape[1]
    per = k / (2 * math.pi)
    cosines, sines, close, far = np.empty(PART), np.empty(PART), np.empty(PART), np.empty(PART)
    out[:] = 0.0
    for first in range(0, n, PART):
        count = min(PART, n - first)
        last = first + count
        x0, x1, x2 = x[0, first:last], x[1, first:last], x[2, first:last]
        n0, n1, n2 = normals[0, first:last], normals[1, first:last], normals[2, first:last]
        for j in range(y.shape[0]):
            y0, y1, y2 = y[j, 0], y[j, 1], y[j, 2]
            for i in range(count):
                dx, dy, dz = y0 - x0[i], y1 - x1[i], y2 - x2[i]
                inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
                c, s = cosine_sine(per / inverse)
                lean = (n0[i] * dx + n1[i] * dy + n2[i] * dz) * inverse
                # b n.R (1/R - ik), over R
                cosines[i], sines[i], close[i], far[i] = c * inverse, s * inverse, lean * inverse, lean * k
            for column in range(columns):
                a, b = single[0, column, first:last], single[1, column, first:last]
                d, e = double[0, column, first:last], double[1, column, first:last]
                p, q = 0.0, 0.0
                for i in range(count):
                    u = a[i] + d[i] * close[i] + e[i] * far[i]
                    v = b[i] + e[i] * close[i] - d[i] * far[i]
                    p += u * cosines[i] - v * sines[i]
                    q += u * sines[i] + v * cosines[i]
                out[j, column] += p
                out[j, columns + column] += q


@njit(**entry_options)
def curl(x, real, imaginary, k, y, out):
    """Fill out (m, 6), real and imaginary parts of H at points y (m, 3); real and imaginary (3, n) are those of J."""
    n = x.shape[1]
    per = k / (2 * math.pi)
    for j in range(y.shape[0]):
        hx, hy, hz, gx, gy, gz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            dx, dy, dz = y[j, 0] - x[0, i], y[j, 1] - x[1, i], y[j, 2] - x[2, i]
            inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
            c, s = cosine_sine(per / inverse)
            # (ik - 1/R) e^{ikR}/R^2
            square = inverse * inverse
            u, v = -(k * s + inverse * c) * square, (k * c - inverse * s) * square
            ax, ay, az = real[0, i], real[1, i], real[2, i]
            bx, by, bz = imaginary[0, i], imaginary[1, i], imaginary[2, i]
            px, py, pz = u * ax - v * bx, u * ay - v * by, u * az - v * bz
            qx, qy, qz = u * bx + v * ax, u * by + v * ay, u * bz + v * az
            hx, hy, hz = hx + dy * pz - dz * py, hy + dz * px - dx * pz, hz + dx * py - dy * px
            gx, gy, gz = gx + dy * qz - dz * qy, gy + dz * qx - dx * qz, gz + dx * qy - dy * qx
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4], out[j, 5] = hx, hy, hz, gx, gy, gz


@njit(**entry_options)
def electric(x, real, imaginary, k, y, out):
    """Fill out (m, 6), real and imaginary parts of E at points y (m, 3); real and imaginary (3, n) are those of J."""
    n = x.shape[1]
    per = k / (2 * math.pi)
    for j in range(y.shape[0]):
        ex, ey, ez, fx, fy, fz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            dx, dy, dz = y[j, 0] - x[0, i], y[j, 1] - x[1, i], y[j, 2] - x[2, i]
            inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
            c, s = cosine_sine(per / inverse)
            c, s = c * inverse, s * inverse
            turn = k - inverse * inverse / k
            lean = (k - 3.0 * inverse * inverse / k) * inverse * inverse
            square = inverse * inverse * inverse
            # (ik - 1/R + w) e^{ikR}/R and -(ik - 3/R + 3w) e^{ikR}/R^3
            u, v = -turn * s - inverse * c, turn * c - inverse * s
            p, q = lean * s + 3.0 * square * c, 3.0 * square * s - lean * c
            ax, ay, az = real[0, i], real[1, i], real[2, i]
            bx, by, bz = imaginary[0, i], imaginary[1, i], imaginary[2, i]
            a, b = dx * ax + dy * ay + dz * az, dx * bx + dy * by + dz * bz
            g, h = p * a - q * b, p * b + q * a
            ex, ey, ez = ex + u * ax - v * bx + g * dx, ey + u * ay - v * by + g * dy, ez + u * az - v * bz + g * dz
            fx, fy, fz = fx + u * bx + v * ax + h * dx, fy + u * by + v * ay + h * dy, fz + u * bz + v * az + h * dz
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4], out[j, 5] = ex, ey, ez, fx, fy, fz
