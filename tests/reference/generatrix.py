"""Bodies of revolution with edges and tips: their generatrix in panels, and integrals over it in Fourier modes.

A kernel that depends on the azimuths of x and y by their difference phi has the modes, of an even and an odd one,

    K_m(x, y) = 2 int_0^pi K cos(m phi) dphi,   K_m = 2i int_0^pi K sin(m phi) dphi
    R^2 = (rho - rho')^2 + (z - z')^2 + 4 rho rho' sin^2(phi/2)
    A_m(i, j) = int L_j(s) K_m(x_i, y(s)) rho(s) ds

L_j is the polynomial that is 1 at node j of its panel and 0 at the others. Panels fall in size towards edges and tips,
where densities are singular. Panels near x_i are integrated by rules that fall in size towards their place nearest to
x_i, the azimuth where R is small beside rho by one that falls towards phi = 0, everything else by the nodes of the
panel and equal steps of phi.

Sources: [CK13, sec. 3.6] for graded meshes at corners, [BT04] for L_j.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tests.reference.conditions import ComplexArray, FloatArray
from tests.reference.revolution import Profile

ORDER = 10
"""Nodes of a panel."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(ORDER)
GAUSS = np.polynomial.legendre.leggauss(8)
"""Rule of each cell of graded rules."""
LONGEST, TURN = 0.6, 0.3
"""Length of a panel at most, in wavelengths, and the angle by which it turns, radians."""
RATIO = 0.3
"""Of successive cuts of the last panel before an edge, and of cells of graded rules."""
LEAST, CLOSEST = 1e-6, 1e-8
"""Least cell of a graded rule over its panel, above rounding, and least azimuth, radians."""
NEAR = 0.8
"""Distance from the end of a panel, in its lengths, up to which it is near."""
WIDE = 8.0
"""Distance between points of a circle, in two steps of the azimuth, up to which the azimuth's rule is graded."""

Corner = tuple[float, float]


def pieces_profile(corners: Sequence[Corner], centres: Mapping[int, Corner] | None = None) -> Profile:
    """Profile of straight and circular pieces between corners (rho, z), L, from the upper end to the lower one.

    Piece i, from corner i on, is an arc about ``centres[i]`` if there is one. Every corner between the ends is a joint;
    an end is a tip unless the profile meets the axis there at a right angle.
    """
    ends, about = np.array(corners, dtype=float), dict(centres or {})
    start, stop = ends[:-1], ends[1:]
    arc = np.isin(np.arange(len(start)), list(about))
    centre = np.array([about.get(i, (0.0, 0.0)) for i in range(len(start))])
    first, last = (np.arctan2(*(end - centre)[:, ::-1].T) for end in (start, stop))
    turn = np.where(arc, (last - first + np.pi) % (2 * np.pi) - np.pi, 0.0)
    radius = np.hypot(*(start - centre).T)
    lengths = np.where(arc, np.abs(turn) * radius, np.hypot(*(stop - start).T))
    breaks = np.concatenate([[0.0], np.cumsum(lengths)])
    straight = (stop - start) / np.where(arc, np.inf, lengths)[:, None]

    def at(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        piece = np.clip(np.searchsorted(breaks, s, side="right") - 1, 0, len(lengths) - 1)
        along = np.asarray(s - breaks[piece])[..., None]
        angle = first[piece] + turn[piece] * along[..., 0] / lengths[piece]
        spoke = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        bent, sense = arc[piece][..., None], np.sign(turn[piece])[..., None]
        x = np.where(bent, centre[piece] + radius[piece][..., None] * spoke, start[piece] + along * straight[piece])
        tangent = np.where(bent, sense * np.stack([-spoke[..., 1], spoke[..., 0]], axis=-1), straight[piece])
        return x, np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1)

    length = float(breaks[-1])
    _, n = at(np.array([0.0, length * (1 - 1e-15)]))
    tips = tuple(s for s, lean in zip((0.0, length), n[:, 0], strict=True) if abs(lean) > 1e-9)
    least = np.min(radius[arc]) if np.any(arc) else np.max(ends[:, 0])
    return Profile(at, length, tuple(map(float, breaks[1:-1])), tips, float(least))


class Panels:
    """Panels of a profile with their nodes, for one wavenumber, 1/L.

    Attributes
    ----------
    breaks : (p, 2)
        Arc lengths at which panels begin and end, L.
    x, n : (n, 2)
        rho and z of the nodes, L, and normals there.
    w : (n,)
        Weights w rho of int ... rho ds, L^2.
    """

    def __init__(self, profile: Profile, wavenumber: float, cuts: int) -> None:
        self.profile = profile
        marks = (0.0, *profile.joints, profile.length)
        graded = {*profile.joints, *profile.tips}
        breaks: list[float] = []
        for start, stop in pairwise(marks):
            middle = profile.at(np.linspace(start, stop, 66)[1:-1])[1]
            turn = np.sum(np.arccos(np.clip(np.sum(middle[1:] * middle[:-1], axis=1), -1, 1)))
            count = max(2, int(np.ceil((stop - start) * wavenumber / (2 * np.pi * LONGEST))), int(np.ceil(turn / TURN)))
            own = np.linspace(start, stop, count + 1)
            shares = (own[1] - own[0]) * RATIO ** np.arange(1.0, cuts + 1)
            low = start + shares[::-1] if start in graded else own[:0]
            high = stop - shares if stop in graded else own[:0]
            breaks += [*own[:1], *low, *own[1:-1], *high]
        ends = np.array([*breaks, profile.length])
        self.breaks = np.stack([ends[:-1], ends[1:]], axis=-1)
        half = 0.5 * np.diff(self.breaks, axis=1)
        s = half * NODES + np.mean(self.breaks, axis=1, keepdims=True)
        self.x, self.n = profile.at(s.ravel())
        self.w = (half * WEIGHTS).ravel() * self.x[:, 0]

    def inner(self, wavenumber: float, per_area: float = 12.0) -> FloatArray:
        """Points (rho, z) inside a convex body (m, 2), L, an eighth of a wavelength from its surface."""
        wavelength, rng = 2 * np.pi / wavenumber, np.random.default_rng(1)
        low, high = np.array([0.0, self.x[:, 1].min()]), self.x.max(axis=0)
        c = low + rng.random((20_000, 2)) * (high - low)
        away = np.hypot(*np.moveaxis(c[:, None] - self.x, -1, 0))
        nearest = np.argmin(away, axis=1)
        inside = np.sum((c - self.x[nearest]) * self.n[nearest], axis=1) < 0
        c = c[inside & (np.min(away, axis=1) > 0.12 * wavelength) & (c[:, 0] > 0.05 * wavelength)]
        return np.asarray(c[: int(np.clip(per_area * np.prod(high - low) / wavelength**2, 30, 250))])


class Azimuth(NamedTuple):
    """Rule over phi: cos, sin and sin^2(phi/2) (q,), and weights times 2 cos(m phi) and 2 sin(m phi) (q, orders)."""

    cos: FloatArray
    sin: FloatArray
    half: FloatArray
    even: FloatArray
    odd: FloatArray

    @classmethod
    def of(cls, phi: FloatArray, weights: FloatArray, orders: int) -> "Azimuth":
        """Of angles (q,), radians, with weights."""
        angles = np.outer(phi, np.arange(orders))
        tables = 2 * weights[:, None] * np.cos(angles), 2 * weights[:, None] * np.sin(angles)
        return cls(np.cos(phi), np.sin(phi), np.sin(phi / 2) ** 2, *tables)

    @classmethod
    def even_steps(cls, size: float, orders: int) -> "Azimuth":
        """Of equal steps, for points far from each other on a body of this k rho."""
        count = int(2 * size + orders + 60)
        return cls.of((np.arange(count) + 0.5) * np.pi / count, np.full(count, np.pi / count), orders)

    @classmethod
    def graded(cls, size: float, orders: int) -> "Azimuth":
        """Graded towards phi = 0."""
        edges = np.concatenate(
            [[0.0], 0.25 * RATIO ** np.arange(np.ceil(np.log(CLOSEST / 0.25) / np.log(RATIO)), -1, -1)]
        )
        top = max(8, int(np.ceil(0.6 * (2 * size + orders))))
        edges = np.concatenate([edges[:-1], np.linspace(edges[-1], np.pi, top + 1)])
        return cls.of(*_cells(edges), orders)

    def modes(self, values: FloatArray, odd: bool = False) -> ComplexArray:
        """Modes (pairs, orders) of real and imaginary parts (2, pairs, q) of a kernel."""
        real, imaginary = values @ (self.odd if odd else self.even)
        return np.asarray(1j * real - imaginary if odd else real + 1j * imaginary)


Kernel = Callable[[FloatArray, FloatArray, FloatArray, FloatArray, Azimuth], ComplexArray]
"""Modes (c, pairs, orders) of c kernels, of x and n (2,) and y and n' (pairs, 2)."""


def waves(x: FloatArray, y: FloatArray, k: float, rule: Azimuth) -> tuple[FloatArray, FloatArray]:
    """Real and imaginary parts (2, pairs, q) of G = e^{ikR}/(4 pi R) and of G' = (ik - 1/R) G/R: grad G = G'(x - y)."""
    apart = np.sum((x - y) ** 2, axis=1)[:, None]
    R = np.sqrt(apart + 4 * x[0] * y[:, :1] * rule.half)
    cos, sin = np.cos(k * R), np.sin(k * R)
    g = np.stack([cos, sin]) / (4 * np.pi * R)
    slope = np.stack([-g[0] / R - k * g[1], k * g[0] - g[1] / R]) / R
    return g, slope


def modal_matrix(panels: Panels, kernel: Kernel, size: float, orders: int, components: int) -> ComplexArray:
    """A_m of each kernel (components, orders, n, n); ``size`` is k times the largest rho."""
    x, n, breaks = panels.x, panels.n, panels.breaks
    fine, coarse = Azimuth.graded(size, orders), Azimuth.even_steps(size, orders)
    step = np.pi / len(coarse.cos)
    out = np.empty((components, orders, len(x), len(x)), dtype=complex)
    middle, lengths = panels.profile.at(np.mean(breaks, axis=1))[0], np.diff(breaks, axis=1)[:, 0]
    for i, (at, normal) in enumerate(zip(x, n, strict=True)):
        near = np.flatnonzero(np.hypot(*(middle - at).T) - 0.5 * lengths < NEAR * lengths)
        rest = np.flatnonzero(~np.isin(np.arange(len(x)) // ORDER, near))
        away = np.hypot(*(x[rest] - at).T)
        close = away < WIDE * 2 * step * np.sqrt(at[0] * x[rest, 0])
        far, close_by = rest[~close], rest[close]
        if len(far):
            out[:, :, i, far] = np.swapaxes(kernel(at, normal, x[far], n[far], coarse), 1, 2) * panels.w[far]
        rules = [_near_rule(panels, i, int(panel)) for panel in near]
        s = np.concatenate([rule[0] for rule in rules])
        y, sides = panels.profile.at(s)
        found = kernel(at, normal, np.concatenate([x[close_by], y]), np.concatenate([n[close_by], sides]), fine)
        out[:, :, i, close_by] = np.swapaxes(found[:, : len(close_by)], 1, 2) * panels.w[close_by]
        first = len(close_by)
        for panel, (own, weights, shapes) in zip(near, rules, strict=True):
            stop = first + len(own)
            rho = y[first - len(close_by) : stop - len(close_by), 0]
            columns = slice(ORDER * panel, ORDER * (panel + 1))
            out[:, :, i, columns] = np.swapaxes(found[:, first:stop], 1, 2) @ ((weights * rho)[:, None] * shapes)
            first = stop
    return out


def _near_rule(panels: Panels, i: int, panel: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arc lengths and weights (q,) for a panel near node i, and L_j there (q, nodes)."""
    (start, stop), at = panels.breaks[panel], panels.x[i]
    half, middle = 0.5 * (stop - start), 0.5 * (start + stop)
    if i // ORDER == panel:
        star, least = NODES[i % ORDER], LEAST
    else:
        t = np.linspace(-1, 1, 41)
        away = np.hypot(*(panels.profile.at(middle + half * t)[0] - at).T)
        star = t[np.argmin(away)]
        least = max(LEAST, 0.3 * float(np.min(away)) / half)
    cuts = [np.array([-1.0, 1.0, star])]
    for side in (-1.0, 1.0):
        span = 1 - side * star
        if span > least:
            cuts.append(star + side * span * RATIO ** np.arange(1.0, np.ceil(np.log(least / span) / np.log(RATIO)) + 1))
    t, w = _cells(np.unique(np.clip(np.concatenate(cuts), -1, 1)))
    return middle + half * t, half * w, lagrange(t, NODES)


def _cells(edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gauss's rule on each cell between edges."""
    half = 0.5 * np.diff(edges)[:, None]
    return (half * (GAUSS[0] + 1) + edges[:-1, None]).ravel(), (half * GAUSS[1]).ravel()


def lagrange(t: FloatArray, nodes: FloatArray) -> FloatArray:
    """L_j(t) of nodes (p,) at places (...): (..., p)."""
    weights = np.array([1 / np.prod(node - np.delete(nodes, j)) for j, node in enumerate(nodes)])
    gap = t[..., None] - nodes
    hit = np.abs(gap) < 1e-15
    share = weights / np.where(hit, 1.0, gap)
    share = np.where(hit.any(axis=-1, keepdims=True), hit, share)
    return np.asarray(share / np.sum(share, axis=-1, keepdims=True))
