"""Kernels of the marched boundary layer in plain numpy: dense matrices, power series as polynomials."""

import numpy as np
from numpy.polynomial import polynomial


def dense(bands):
    """Symmetric matrix of columns (n, 8): entries (j - 3 + i, j), real and imaginary parts by turns."""
    n = len(bands)
    out = np.zeros((n, n), complex)
    for j in range(n):
        for i in range(max(0, 3 - j), 4):
            out[j - 3 + i, j] = out[j, j - 3 + i] = bands[j, 2 * i] + 1j * bands[j, 2 * i + 1]
    return out


def step(grid, k, soft, data, poles, weights, g, beta, y):
    """One step of one ray with data c, e, c0 and a: unknowns y (n,) of the next step."""
    c, e, least, twist = data
    m0, d0, first, second, square, linear, mixed, bent = (dense(part) for part in grid.matrices)
    operator = least * m0 + d0 + c * first + c * c * second + twist * square + e * (linear + c * mixed + e * bent)
    operator[0, 0] += 0 if soft else beta / k**2
    m, slope, t, rate = grid.levels
    h = 1 + c * m + e * t
    lean = 0.5 * (c * slope + e * rate) / h * grid.scale
    w = np.empty_like(y)
    w[0::2] = y[0::2] / np.sqrt(h)
    w[1::2] = (y[1::2] - lean * y[0::2]) / np.sqrt(h)
    if not soft:
        w[1] = (g[-1] - beta * w[0]) * grid.scale
    total = np.zeros_like(w)
    for b, weight, value in zip(poles, weights, g[:-1], strict=True):
        matrix, right = m0 + b * operator, m0 @ w
        if soft:
            matrix[0] = 0
            matrix[0, 0], right[0] = 1, value
        else:
            right[0] += b * value / k**2
        total += weight * np.linalg.solve(matrix, right)
    out = np.empty_like(total)
    out[0::2] = total[0::2] * np.sqrt(h)
    out[1::2] = total[1::2] * np.sqrt(h) + lean * out[0::2]
    return out


def pole_trace(k, q, kappa, first, linear, square, kappa_a, pole, terms, rounds):
    """Value and slope at n = 0 of the plane wave's part at a pole, after so many rounds of its series."""
    h = np.array([1.0, kappa])
    h2 = polynomial.polymul(h, h)
    sigma = polynomial.polyadd(-q * q * h2, 1j * kappa * q / k * h)
    sigma = polynomial.polyadd(sigma, [first - kappa**2 / (4 * k * k), linear, square])
    den = np.zeros(terms, complex)
    den[: len(sigma)] = pole * sigma
    den[0] += 1
    inverse = np.zeros(terms, complex)
    inverse[0] = 1 / den[0]
    for i in range(1, terms):
        inverse[i] = -(den[1 : i + 1] @ inverse[i - 1 :: -1][:i]) / den[0]
    start = np.cumprod([1.0, *(kappa_a * (1.5 - i) / i for i in range(1, terms))])
    r = polynomial.polymul(start, inverse)[:terms]
    total = r.copy()
    for _ in range(rounds):
        slope = polynomial.polyder(r)
        bend = polynomial.polyder(slope)
        moved = polynomial.polyadd(
            polynomial.polymul(h2, polynomial.polyadd(2j * k * q * slope, bend)),
            kappa * polynomial.polymul(h, slope),
        )
        r = polynomial.polymul(-pole / k**2 * moved, inverse)[:terms]
        r = np.pad(r, (0, terms - len(r)))
        total += r
    return total[0], total[1]
