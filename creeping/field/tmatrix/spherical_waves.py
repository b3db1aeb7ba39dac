"""Spherical waves at points and in directions, and what derivatives and turns are among them.

    psi_lm = z_l(kr) Y_lm(theta, phi),   z = j regular, z = h^(1) outgoing,   number l^2 + l + m
    e^{ikd.x} = 4 pi sum i^l psi_lm(x) conj Y_lm(d),   h_l(kr) -> (-i)^(l+1) e^{ikr}/(kr)

Y is that of `scipy.special.sph_harm_y`: normalised, with the phase (-1)^m. A derivative of a wave is a sum of waves of
the degrees next to it. As regular waves are sums of plane ones, d/dx multiplies these by i d_x, and with what d_x makes
of Y_lm,

    d_z Y_lm = a Y_l+1,m + b Y_l-1,m   ->   (1/k) d/dz psi_lm = -a psi_l+1,m + b psi_l-1,m

and so for d_x +- i d_y. Angular momentum L = -i x cross grad does not change the degree. Vector waves are

    M_lm = L psi_lm/[l(l + 1)]^(1/2),   N_lm = curl M_lm/k,   far away  X_lm and i r cross X_lm

the magnetic and the electric multipoles, numbered 2 (l^2 + l + m - 1) for N and one more for M. Waves, numbers and
phases are those of treams and acoustotreams. In the coordinate planes

    psi_lm(P x):   x -> -x   psi_l-m,    y -> -y   (-1)^m psi_l-m,    z -> -z   (-1)^(l+m) psi_lm

so that (psi_lm +- psi_l-m)/2^(1/2) are even or odd; N of psi is as psi, and M, an axial vector, the other way.

Sources: [J98, sec. 9.6 and 9.7]; [BFR24].
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.kernels.threads import in_threads

BLOCK = 256
"""Points whose waves are made at a time: tables that a cache holds."""


def count(order: int) -> int:
    """Number of scalar waves of degrees up to ``order``."""
    return (order + 1) ** 2


def vector_count(order: int) -> int:
    """Number of vector waves of degrees 1 to ``order``."""
    return 2 * order * (order + 2)


def degrees(order: int) -> tuple[IntArray, IntArray]:
    """Degrees l and orders m of the scalar waves, ((order + 1)^2,) each.

    Examples
    --------
    >>> degrees(1)[0].tolist(), degrees(1)[1].tolist()
    ([0, 1, 1, 1], [0, -1, 0, 1])
    """
    number = np.arange(count(order))
    deg = np.sqrt(number + 0.5).astype(np.int64)
    return deg, number - deg * (deg + 1)


def vector_degrees(order: int) -> tuple[IntArray, IntArray, IntArray]:
    """Degrees, orders and kinds, 1 electric and 0 magnetic, of the vector waves."""
    deg, m = (np.repeat(part[1:], 2) for part in degrees(order))
    return deg, m, np.tile([1, 0], len(deg) // 2)


def legendre(theta: FloatArray, order: int) -> FloatArray:
    """Y_lm(theta, 0) at polar angles (n,), radians, on the sphere or beyond its poles: (n, (order + 1)^2)."""
    from scipy.special import sph_legendre_p_all

    deg, m = degrees(order)
    table = sph_legendre_p_all(order, order, theta)[0]
    # of negative m by parity, which scipy keeps at the end of the axis
    return np.ascontiguousarray(table[deg, m].T)


def harmonics(directions: FloatArray, order: int) -> ComplexArray:
    """Y_lm in unit directions (n, 3): (n, (order + 1)^2).

    Examples
    --------
    >>> bool(np.allclose(harmonics(np.array([[0.0, 0.0, 1.0]]), 1) ** 2 * 4 * np.pi, [[1, 0, 3, 0]]))
    True
    """
    return regular(directions, 1.0, order, radial=False)


def regular(points: FloatArray, wavenumber: float, order: int, *, radial: bool = True) -> ComplexArray:
    """Regular waves at points (n, 3), L, from their centre, or Y_lm alone: (n, (order + 1)^2)."""
    from scipy.special import spherical_jn

    out = np.empty((len(points), count(order)), dtype=complex)
    deg, m = degrees(order)

    def work(part: slice) -> None:
        for first in range(part.start, part.stop, BLOCK):
            at = slice(first, min(first + BLOCK, part.stop))
            x = points[at]
            r = np.linalg.norm(x, axis=1)
            theta = np.arctan2(np.hypot(x[:, 0], x[:, 1]), x[:, 2])
            turn = np.exp(1j * np.arctan2(x[:, 1], x[:, 0])[:, None] * np.arange(-order, order + 1))
            values = legendre(theta, order)
            if radial:
                values *= spherical_jn(np.arange(order + 1), wavenumber * r[:, None])[:, deg]
            np.multiply(values, turn[:, m + order], out=out[at])

    in_threads(work, len(points), least=BLOCK, multiple=1)
    return out


def _ladder(order: int, coefficients: FloatArray, low: FloatArray, m_step: int) -> Any:
    """Sparse matrix of psi_lm -> ``low`` psi_(l-1, m+step) - ``coefficients`` psi_(l+1, m+step)."""
    from scipy.sparse import csr_array

    deg, m = degrees(order)
    number = np.arange(len(deg))
    rows = [(deg + 1) * (deg + 2) + m + m_step]
    columns, entries = [number], [-coefficients]
    there = (deg >= 1) & (np.abs(m + m_step) <= deg - 1)
    rows.append(((deg - 1) * deg + m + m_step)[there])
    columns.append(number[there])
    entries.append(low[there])
    shape = (count(order + 1), count(order))
    return csr_array((np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape, dtype=complex)


@cache
def gradients(order: int) -> tuple[Any, Any, Any]:
    """(1/k) d/dx, d/dy and d/dz of scalar waves: sparse ((order + 2)^2, (order + 1)^2) each.

    Examples
    --------
    >>> [part.shape for part in gradients(2)]
    [(16, 9), (16, 9), (16, 9)]
    """
    deg, m = (part.astype(float) for part in degrees(order))
    above, below = (2 * deg + 1) * (2 * deg + 3), np.maximum((2 * deg - 1) * (2 * deg + 1), 1.0)
    # signs and squares of what goes up a degree and down one, and the step of m
    z, plus, minus = (
        _ladder(order, up * np.sqrt(above_one / above), down * np.sqrt(np.maximum(below_one, 0.0) / below), step)
        for up, above_one, down, below_one, step in (
            (1, (deg + 1) ** 2 - m**2, 1, deg**2 - m**2, 0),
            (-1, (deg + m + 1) * (deg + m + 2), 1, (deg - m) * (deg - m - 1), 1),
            (1, (deg - m + 1) * (deg - m + 2), -1, (deg + m) * (deg + m - 1), -1),
        )
    )
    return 0.5 * (plus + minus), -0.5j * (plus - minus), z


@cache
def momenta(order: int) -> tuple[Any, Any, Any]:
    """L_x, L_y and L_z of scalar waves: sparse ((order + 1)^2,) * 2 each."""
    from scipy.sparse import csr_array, diags_array

    deg, m = degrees(order)
    n, number = len(deg), np.arange(len(deg))
    up = m < deg
    raised = np.sqrt((deg - m) * (deg + m + 1.0))[up]
    plus = csr_array((raised.astype(complex), (number[up] + 1, number[up])), (n, n))
    minus = plus.T.tocsr()
    return 0.5 * (plus + minus), -0.5j * (plus - minus), diags_array(m.astype(complex)).tocsr()


@cache
def vector_parts(order: int) -> tuple[Any, Any, Any]:
    """x, y and z components of vector waves as scalar ones: sparse ((order + 2)^2, 2 order (order + 2)) each."""
    from scipy.sparse import csr_array, eye_array, hstack

    deg, _ = degrees(order)
    share = 1 / np.sqrt(np.maximum(deg * (deg + 1.0), 1.0))
    M = [csr_array(part * share[None])[:, 1:] for part in momenta(order)]
    D = gradients(order)
    lift = eye_array(count(order + 1), count(order), dtype=complex, format="csr")
    parts = []
    n = count(order) - 1
    mixed = np.stack([np.arange(n), n + np.arange(n)], axis=1).ravel()
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        N = D[one] @ M[two] - D[two] @ M[one]
        parts.append(csr_array(hstack([N, lift @ M[axis]], format="csc")[:, mixed]))
    return parts[0], parts[1], parts[2]


def combined(table: ComplexArray, parts: Sequence[Any], vectors: FloatArray) -> ComplexArray:
    """sum_c v_c (table @ part_c) of waves (n, s), sparse parts (s, t) and vectors (n, 3): (n, t)."""
    # sparse products copy what does not lie in rows, each time
    rows = np.ascontiguousarray(table.T)
    out = np.zeros((parts[0].shape[1], len(table)), dtype=complex)
    for part, v in zip(parts, vectors.T, strict=True):
        out += (part.T @ rows) * v
    return out.T


def far_vectors(directions: FloatArray, order: int) -> ComplexArray:
    """What vector waves are far away along theta and phi in unit directions (n, 3): (n, 2, 2 order (order + 2)).

    X_lm of M and i r cross X_lm of N, whose degrees' factors (-i)^(l+1) are left out.
    """
    from creeping.field.results.far_result import spherical_frame

    frame = spherical_frame(directions)
    deg, _ = degrees(order)
    share = 1 / np.sqrt(np.maximum(deg * (deg + 1.0), 1.0))
    Y = harmonics(directions, order)
    X = np.stack([combined(Y, momenta(order), frame[:, c]) for c in (0, 1)], axis=1) * share
    out = np.empty((len(X), 2, 2 * X.shape[2] - 2), dtype=complex)
    # i r cross X
    out[:, 0, 0::2], out[:, 1, 0::2] = -1j * X[:, 1, 1:], 1j * X[:, 0, 1:]
    out[:, :, 1::2] = X[:, :, 1:]
    return out


def far_profiles(theta: FloatArray, order: int, *, vector: bool) -> ComplexArray:
    """What waves are far away at phi = 0 and polar angles (n,): (n, c, waves), c = 1 or theta and phi."""
    x = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    return far_vectors(x, order) if vector else harmonics(x, order)[:, None].copy()


def parities(order: int, flips: tuple[tuple[int, ...], ...], *, vector: bool) -> tuple[Any, IntArray]:
    """Waves even or odd in each flip as sums of spherical ones, sparse (waves, waves), and the number of their chi.

    A flip turns the signs of coordinates, of those axes.
    """
    from scipy.sparse import csr_array, eye_array

    deg, m, kind = vector_degrees(order) if vector else (*degrees(order), None)
    n = len(deg)
    paired = any({0, 1} & set(axes) for axes in flips)
    sums = eye_array(n, format="csr")
    if paired:
        number, other = np.arange(n), np.arange(n) - 2 * m * (2 if vector else 1)
        half = np.sqrt(0.5)
        # even ones stand at m > 0, odd ones at m < 0
        own = np.where(m > 0, half, np.where(m < 0, -half, 1.0))
        cross = np.where(m == 0, 0.0, half)
        sums = csr_array((np.concatenate([own, cross]), (np.tile(number, 2), np.concatenate([number, other]))), (n, n))
    t = np.where(m < 0, -1, 1)
    even = {0: t, 1: t * (-1) ** (m % 2), 2: (-1) ** ((deg + m) % 2)}
    sign = 1 if kind is None else np.where(kind == 1, 1, -1)
    which = np.zeros(n, dtype=np.int64)
    for axes in flips:
        which = 2 * which + (np.prod([even[axis] * sign for axis in axes], axis=0) < 0)
    return sums, which
