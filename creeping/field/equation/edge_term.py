"""What a current along an edge that the equation does not see may add to the far field: a part of its error.

Across an edge of exterior angle N pi, with nu = 1/N and rho the distance from it, on the faces + and -,

    hard, impedance   u = A + A' rho^(2 nu) + A'' rho^2 +- [B rho^nu + B' rho^(3 nu) + C rho^-nu]
    soft              rho du/dn = +-[A rho^(2 nu) + A' rho^(4 nu)] + B rho^nu + B' rho^(3 nu) + C rho^-nu
    conductor         J across the edge as u; J along it, times k, as du/dn

C is forbidden: its energy is infinite. It is a wave C' H_nu(k rho) from the edge that cancels inside the body, so that
extinction does not know it, with |C| = |C'| (Gamma(nu)/pi) (2/k)^nu, nu times that if soft; straight or curved, the
edge radiates

    f(r) = (1/pi) int C' e^{-ik r.x} dl   times a function of the angle about it, cos(nu phi), 1/sqrt(2) in the mean

C is read off the nodes of the tiles along the edge, where there are three or more away from it. Of flat triangles it
is known beforehand as well: of B rho^nu they lack about C = lacks B w^(2 nu), w their width (`Tiles.lacks`).

Source: [M72]; Derivations, F36.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import gamma

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.currents.radiation import phase_sums
from creeping.field.equation.tiles import Tiles, gauss
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.squares import differentiation, interpolation, lobatto

DIRECTIONS = 64
"""Directions by which the mean of what edges radiate is taken."""
SAME = 1e-7
"""Difference of places on an edge, 0 to 1, that are one."""
STRAIGHT = 0.02
"""Angle between two faces, radians, below which there is no edge to speak of."""


class Rings(NamedTuple):
    """Nodes of tiles on both faces of edges, at m places along them.

    Attributes
    ----------
    nodes : (m, 2, p)
        Their numbers on both faces, nearest to the edge first.
    points, tangents : (m, 3), L and 1
        Of the edge.
    lengths : (m,), L
        Weights of an integral along it.
    """

    nodes: IntArray
    points: FloatArray
    tangents: FloatArray
    lengths: FloatArray


def rings_of(tiles: Tiles) -> Rings:
    """Nodes along the edges of tiles."""
    key, side, start, end = tiles.edges.T
    rows = np.flatnonzero(key >= 0)
    order = rows[np.lexsort((np.minimum(start, end)[rows], key[rows]))]
    one, two = order[:-1], order[1:]
    low, high = np.minimum(start, end), np.maximum(start, end)
    pair = (key[one] == key[two]) & (abs(low[one] - low[two]) < SAME) & (abs(high[one] - high[two]) < SAME)
    faces = np.stack([one[pair], two[pair]], axis=1)
    p, m = tiles.p, len(faces)
    number = np.arange(p * p).reshape(p, p)
    # by side: along the edge, then away from it
    ways = np.stack([number.T, number[::-1].T, number, number[:, ::-1]])[side[faces].astype(int)]
    backward = (start > end)[faces]
    ways = np.where(backward[..., None, None], ways[:, :, ::-1], ways)
    nodes = np.moveaxis(faces[..., None, None] * p * p + ways, 2, 1).reshape(m * p, 2, p)
    shapes, which = tiles.shapes[faces[:, 0]], side[faces[:, 0]].astype(int)
    lines = np.stack([shapes[:, 0], shapes[:, -1], shapes[:, :, 0], shapes[:, :, -1]], axis=1)[np.arange(m), which]
    lines = np.where(backward[:, 0, None, None], lines[:, ::-1], lines)
    t, w = gauss(p)
    grid = lobatto(lines.shape[1] - 1)
    rows_at = interpolation(grid, t)
    slopes = rows_at @ differentiation(grid)
    x, slope = (np.einsum("aq,mqx->max", part, lines).reshape(-1, 3) for part in (rows_at, slopes))
    length = np.linalg.norm(slope, axis=1)
    return Rings(nodes, x, slope / length[:, None], length * np.tile(w, m))


class EdgeTerm:
    """What edges may radiate that currents of a wavenumber, 1/L, at the nodes of tiles do not know."""

    def __init__(self, tiles: Tiles, wavenumber: float) -> None:
        rings = rings_of(tiles)
        self._k, x, n = wavenumber, tiles.points[rings.nodes], tiles.normals[rings.nodes][:, :, 0]
        turned = np.arctan2(np.linalg.norm(np.cross(n[:, 0], n[:, 1]), axis=1), np.sum(n[:, 0] * n[:, 1], axis=1))
        convex = np.sum((x[:, 1, 0] - x[:, 0, 0]) * n[:, 0], axis=1) < 0
        there = turned > STRAIGHT
        self.rings = Rings(*(part[there] for part in rings))
        self._normals = n[there]
        self._distance = np.linalg.norm(x[there] - self.rings.points[:, None, None], axis=3)
        self._nu = np.pi / (np.pi + np.where(convex, turned, -turned)[there])
        self._lacks, self._reach = tiles.lacks, 1 - tiles.places[0][0]

    def of(self, values: ComplexArray, kind: str) -> ComplexArray:
        """C' dl at the places along edges (2, m, c), of values at the nodes (n,), or (n, 3, c) of a conductor.

        As it is read off, and as it is known beforehand.
        """
        here = values[self.rings.nodes]
        if kind == "soft":
            return self._forbidden(here[..., None], soft=True)
        if kind != "conductor":
            return self._forbidden(here[..., None], soft=False)
        t = self.rings.tangents
        across = np.cross(self._normals, t[:, None])
        hard = self._forbidden(np.einsum("mfx,mfpxc->mfpc", across, here), soft=False)
        soft = self._forbidden(self._k * np.einsum("mx,mfpxc->mfpc", t, here), soft=True)
        # of waves that do not know of each other
        return np.asarray(np.hypot(np.abs(hard), np.abs(soft)) * np.exp(1j * np.angle(hard + soft)))

    def far(self, values: ComplexArray, kind: str, directions: FloatArray) -> FloatArray:
        """Size of the far field, L, in unit directions (r, 3), and of its mean over all: (r, c)."""
        if not len(self.rings.points):
            return np.zeros((len(directions), values.shape[-1] if kind == "conductor" else 1))
        every = np.concatenate([directions, fibonacci_directions(DIRECTIONS)])
        both = [
            phase_sums(self.rings.points, np.ascontiguousarray(strength.T), every, self._k)
            for strength in self.of(values, kind)
        ]
        f = np.linalg.norm(both, axis=0) / np.pi
        mean = np.mean(f[len(directions) :] ** 2, axis=0)
        return np.asarray(np.sqrt(0.5 * (f[: len(directions)] ** 2 + mean)))

    def _forbidden(self, values: ComplexArray, *, soft: bool) -> ComplexArray:
        """C' dl (2, m, c) of values on both faces (m, 2, p, c)."""
        p, nu, wide = values.shape[2], self._nu[:, None, None], self._distance.max(axis=(1, 2))
        rho = self._distance / wide[:, None, None]
        less = 1.0 if soft else 0.0
        powers = ([2 * nu, 4 * nu] if soft else [0 * nu, 2 * nu, 2 + 0 * nu])[:p]
        # those of one sign on both faces, and those that change it
        face = np.array([1.0, -1.0])[:, None]
        even = [rho ** (q - less) * (face if soft else 1.0) for q in powers]
        odd = [rho ** (q * nu - less) * (1.0 if soft else face) for q in (1, 3, -1)[:p]]
        columns = np.stack([*even, *odd], axis=-1)
        m = len(rho)
        fit = np.linalg.pinv(columns.reshape(m, -1, columns.shape[-1]))
        found = np.einsum("mqs,msc->mqc", fit[:, [len(even), -1]], values.reshape(m, fit.shape[2], -1))
        # rho is over its largest: B rho^nu and C rho^-nu are B and C times powers of that
        lacks = self._lacks[1 if soft else 0] / self._reach ** (2 * self._nu)
        B, C = found[:, 0] * lacks[:, None], found[:, 1] * (p > 2)
        nu, size = self._nu, wide ** (self._nu + less)
        of_wave = np.pi / gamma(nu) * (self._k / 2) ** nu / (nu if soft else 1.0)
        return np.asarray(np.stack([C, B]) * (size * of_wave * self.rings.lengths)[:, None])
