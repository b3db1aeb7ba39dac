"""Scattering by a box |x_i| < h_i: its integral equation in the eight parity classes of its three mirrors.

With the mirrors g, g x = (+-x_1, +-x_2, +-x_3), and their characters chi_c(g) = +-1, class c of a wave is solved on an
eighth of the box alone,

    u_c = 2^{-3} sum_g chi_c(g) u(g x),   u(g x) = sum_c chi_c(g) u_c,   M_c = sum_g chi_c(g) M(g x, y)
    hard, impedance   u/2 - M u = u_inc,               M(x, y) = w (dG/dn_y + ik eta G)
    soft              v/2 + W^{-1} M^T W v = du_inc/dn,  v = du/dn, W = diag(w), M of the hard box
    f(r) = (1/4 pi) int [-ik (r.n - eta) u - v] e^{-ik r.y} dS

Soft boxes take the transpose of the hard one in the weights: next to edges it is more accurate by far than dG/dn_x at
the nodes. Faces are panels of p x p Gauss nodes, smaller towards edges. What a panel sends to points near it is
integrated on parts of it, halved until they are as small as their distance, with the polynomial through its nodes; a
face's dG/dn_y vanishes on itself.

The equation has no solution at resonances of the inside; near one it multiplies errors. The field inside, which is 0,
shows both.

Sources: [CK13, sec. 3.2], [BT04] for the polynomials.
"""

from dataclasses import dataclass
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from tests.reference.conditions import Boundary, ComplexArray, FloatArray, IntArray, condition, positive
from tests.reference.generatrix import GAUSS, lagrange

IMAGES = np.array(list(product((1.0, -1.0), repeat=3)))
"""Mirrors g (8, 3)."""
CHARACTERS = np.array([np.prod(np.where(np.array(odd), IMAGES, 1.0), axis=1) for odd in product((0, 1), repeat=3)])
"""chi_c(g) (8 classes, 8 mirrors)."""
RATIO, LONGEST = 0.3, 0.8
"""Of successive cuts of the last panel before an edge; length of a panel at most, in wavelengths."""
NEAR, REACH, LEAST = 1.5, 0.7, 1e-6
"""Distance up to which a panel is near, over its longer side; of a part at least, over its side; least part of all."""
BLOCK = 4_000
"""Parts that are integrated at once."""


class Eighth(NamedTuple):
    """Nodes (n, 3), normals, weights (n,) of the faces x_i = h_i > 0, and panels: axis (t,), and sides (t, 2, 2).

    Sides are from and to along the two axes that follow cyclically.
    """

    x: FloatArray
    n: FloatArray
    w: FloatArray
    axis: IntArray
    sides: FloatArray
    half: FloatArray
    order: int


@dataclass(frozen=True)
class BoxSolution:
    """Scattered fields of a box for several plane waves.

    Attributes
    ----------
    wavenumber : float, 1/L
    directions : (d, 3)
        Unit vectors, where the waves go.
    boundary : "soft", "hard" or complex
    points, normals, weights : (n, 3), (n, 3) and (n,), L, 1 and L^2
        Nodes of the whole box.
    values : (n, d)
        u, or v, 1/L, if soft.
    inside : (d,)
        Root mean square of the total field at points inside.
    """

    wavenumber: float
    directions: FloatArray
    boundary: Boundary
    points: FloatArray
    normals: FloatArray
    weights: FloatArray
    values: ComplexArray
    inside: FloatArray

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field f, L, u_s ~ f e^{ikR}/R, in unit directions: (m, 3) to (m, d)."""
        r, k = np.asarray(r, dtype=float), self.wavenumber
        alpha, beta = condition(self.boundary)
        source = -1.0 if beta == 0 else -1j * k * (r @ self.normals.T) + k * alpha
        return np.asarray((np.exp(-1j * k * (r @ self.points.T)) * self.weights * source) @ self.values / (4 * np.pi))


def scatter_box(
    half_sides: ArrayLike,
    wavenumber: float,
    directions: ArrayLike,
    boundary: Boundary,
    *,
    order: int = 6,
    cuts: int = 3,
) -> BoxSolution:
    """Solve for a box about the origin.

    Parameters
    ----------
    half_sides : (3,), L
    wavenumber : float, 1/L
        Off the resonances of the inside.
    directions : (d, 3)
        Unit vectors, where the waves go.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.
    order : int
        Nodes of a panel along either side.
    cuts : int
        Of the last panel at edges.
    """
    positive(wavenumber=wavenumber)
    k, d = wavenumber, np.atleast_2d(np.asarray(directions, dtype=float))
    alpha, beta = condition(boundary)
    part = _eighth(np.asarray(half_sides, dtype=float), k, order, cuts)
    inner = np.random.default_rng(0).uniform(0.03, 0.8, (60, 3)) * part.half
    received = np.stack([_received(part.x * g, part, k, 1.0, k * alpha if beta else 0.0) for g in IMAGES])
    double, single = (1.0, k * alpha) if beta else (0.0, -1.0)
    within = np.stack([_received(inner * g, part, k, double, single) for g in IMAGES])
    wave, under = (np.exp(1j * k * np.einsum("gc,nc,dc->gnd", IMAGES, x, d)) for x in (part.x, inner))
    if beta == 0:
        wave *= 1j * k * np.einsum("gc,nc,dc->gnd", IMAGES, part.n, d)
    one, root = 0.5 * np.eye(len(part.x)), np.sqrt(part.w)[:, None]
    values = np.zeros((8, len(part.x), len(d)), dtype=complex)
    left = np.zeros((8, len(inner), len(d)), dtype=complex)
    for chi in CHARACTERS:
        M = root * np.tensordot(chi, received, 1) / root.T
        found = np.linalg.solve(one - M if beta else one + M.T, root * np.tensordot(chi, wave, 1) / 8) / root
        off = np.tensordot(chi, under, 1) / 8 + np.tensordot(chi, within, 1) @ found
        values += chi[:, None, None] * found
        left += chi[:, None, None] * off
    return BoxSolution(
        wavenumber=k,
        directions=d,
        boundary=boundary,
        points=(IMAGES[:, None] * part.x).reshape(-1, 3),
        normals=(IMAGES[:, None] * part.n).reshape(-1, 3),
        weights=np.tile(part.w, 8),
        values=values.reshape(-1, len(d)),
        inside=np.sqrt(np.mean(np.abs(left.reshape(-1, len(d))) ** 2, axis=0)),
    )


def _eighth(half: FloatArray, k: float, order: int, cuts: int) -> Eighth:
    """Nodes and panels."""
    gauss, weights = np.polynomial.legendre.leggauss(order)
    edges = []
    for h in half:
        count = max(1, int(np.ceil(h * k / (2 * np.pi * LONGEST))))
        even = np.linspace(0, h, count + 1)
        edges.append([*even[:-1], *(h - even[1] * RATIO ** np.arange(1.0, cuts + 1)), h])
    x, n, w, axes, sides = [], [], [], [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for a, b in product(pairwise(edges[u]), pairwise(edges[v])):
            (a_mid, a_half), (b_mid, b_half) = ((0.5 * (e[0] + e[1]), 0.5 * (e[1] - e[0])) for e in (a, b))
            nodes = np.empty((order, order, 3))
            nodes[..., axis], nodes[..., u] = half[axis], (a_mid + a_half * gauss)[:, None]
            nodes[..., v] = b_mid + b_half * gauss
            x.append(nodes.reshape(-1, 3))
            n.append(np.tile(np.eye(3)[axis], (order**2, 1)))
            w.append(a_half * b_half * np.outer(weights, weights).ravel())
            axes.append(axis)
            sides.append((a, b))
    nodes, normals, own = (np.concatenate(each) for each in (x, n, w))
    return Eighth(nodes, normals, own, np.array(axes), np.array(sides), half, order)


def _received(x: FloatArray, part: Eighth, k: float, double: complex, single: complex) -> ComplexArray:
    """What points (m, 3) receive of values at the nodes of the eighth, by double dG/dn_y + single G: (m, n)."""
    height = part.half[part.axis][None] - x[:, part.axis]
    height = np.repeat(height, part.order**2, axis=1)
    R = np.sqrt(sum(np.subtract.outer(x[:, c], part.x[:, c]) ** 2 for c in range(3)))
    # a point on its own node: without dG/dn_y, and its G is integrated below
    out = _kernel(np.where(R > 0, R, 1.0), height, k, double, single) * part.w
    columns = np.arange(part.order**2)
    targets, panels, local = [], [], []
    for number, (axis, sides) in enumerate(zip(part.axis, part.sides, strict=True)):
        own = np.stack([x[:, (axis + 1) % 3], x[:, (axis + 2) % 3], part.half[axis] - x[:, axis]], axis=-1)
        near = _distance(own, np.broadcast_to(sides, (len(x), 2, 2))) < NEAR * np.max(sides[:, 1] - sides[:, 0])
        if single == 0:
            near &= own[:, 2] != 0
        at = np.flatnonzero(near)
        targets.append(at)
        panels.append(np.full(len(at), number))
        local.append(own[at])
    target, panel, own = (np.concatenate(each) for each in (targets, panels, local))
    near_rows = _near(own, part.sides[panel], part.order, k, double, single)
    out[target[:, None], part.order**2 * panel[:, None] + columns] = near_rows
    return out


def _kernel(R: FloatArray, height: FloatArray, k: float, double: complex, single: complex) -> ComplexArray:
    """double dG/dn_y + single G at distances, with n.(y - x)."""
    G = np.exp(1j * k * R) / (4 * np.pi * R)
    return np.asarray(G * (single + double * (1j * k - 1 / R) / R * height))


def _distance(own: FloatArray, sides: FloatArray) -> FloatArray:
    """From points (m, 3) in the frame of a face to rectangles (m, 2, 2) of it."""
    off = own[:, :2] - np.clip(own[:, :2], sides[:, :, 0], sides[:, :, 1])
    return np.asarray(np.sqrt(np.sum(off**2, axis=1) + own[:, 2] ** 2))


def _near(own: FloatArray, sides: FloatArray, order: int, k: float, double: complex, single: complex) -> ComplexArray:
    """Integrals over panels (m, 2, 2) near points (m, 3), for each node's polynomial: (m, order^2)."""
    out = np.zeros((len(own), order**2), dtype=complex)
    pair, parts = np.arange(len(own)), sides
    least = LEAST * np.max(sides[:, :, 1] - sides[:, :, 0], axis=1)
    while len(pair):
        size = parts[:, :, 1] - parts[:, :, 0]
        longest = np.max(size, axis=1)
        ready = (_distance(own[pair], parts) >= REACH * longest) | (longest < least[pair])
        for first in range(0, int(np.sum(ready)), BLOCK):
            some = np.flatnonzero(ready)[first : first + BLOCK]
            found = _integrals(own[pair[some]], parts[some], sides[pair[some]], order, k, double, single)
            one = csr_array((np.ones(len(some)), (pair[some], np.arange(len(some)))), shape=(len(own), len(some)))
            out += one @ found
        pair, parts, size = pair[~ready], parts[~ready], size[~ready]
        # the longer side alone where it is longer by half
        for axis in (0, 1):
            halved = size[:, axis] > size[:, 1 - axis] / 1.5
            middle = np.mean(parts[:, axis], axis=1)
            low, high = parts.copy(), parts[halved].copy()
            low[halved, axis, 1] = middle[halved]
            high[:, axis, 0] = middle[halved]
            pair, size = np.concatenate([pair, pair[halved]]), np.concatenate([size, size[halved]])
            parts = np.concatenate([low, high])
    return out


def _integrals(
    own: FloatArray, parts: FloatArray, sides: FloatArray, order: int, k: float, double: complex, single: complex
) -> ComplexArray:
    """Gauss's rule on parts (b, 2, 2) of panels (b, 2, 2): (b, order^2)."""
    nodes = np.polynomial.legendre.leggauss(order)[0]
    mid, half = np.mean(parts, axis=2)[..., None], 0.5 * (parts[:, :, 1:] - parts[:, :, :1])
    places = mid + half * GAUSS[0]
    shapes = lagrange((2 * places - np.sum(sides, axis=2)[..., None]) / (sides[:, :, 1:] - sides[:, :, :1]), nodes)
    shapes = shapes * (half * GAUSS[1])[..., None]
    a, b = (places[:, axis] - own[:, axis, None] for axis in (0, 1))
    height = own[:, 2, None, None]
    R = np.sqrt(a[:, :, None] ** 2 + b[:, None, :] ** 2 + height**2)
    values = _kernel(R, height, k, double, single)
    return np.asarray((np.swapaxes(shapes[:, 0], 1, 2) @ values @ shapes[:, 1]).reshape(len(own), -1))
