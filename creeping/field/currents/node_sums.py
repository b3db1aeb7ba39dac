"""Sums over the nodes of currents at points of their own surface: what the equation of the second kind integrates.

    hard        2 int u dG/dn_y dS_y               soft        -2 int du/dn dG/dn_x dS_y
    impedance   2 int u (dG/dn_y + ik eta_y G) dS   conductor   2 n_x x int grad_x G x J dS_y

Next to x the integrals are weakly singular, since J is tangential: grad G (n_x.J_y) - J_y (n_x.grad G), n_x.J_y = O(R).
With chi = e^{-(R/a)^2}, a some 1/k, K the shape operator, kappa = (kappa_1 + kappa_2)/2,

    int chi dG_0/dn dS = -(sqrt(pi)/8) a kappa,   int chi G_0 dS = (sqrt(pi)/4) a
    int chi n_x x (grad G_0 x J_x) dS = (sqrt(pi)/8) a (kappa - K) J_x

are taken off from the sums over nodes, with the current at x, and put back.

Source: Derivations, F30 and F32.
"""

from functools import cached_property
from typing import Protocol

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.currents.smooth_kernel import SmoothKernel
from creeping.field.currents.split_sums import CURL, ONE_LAYER, TWO_LAYERS, Load, SplitSums, best_split, cells_of
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.kept import kept
from creeping.geometry.quadrature import SYMMETRIC
from creeping.kernels.threads import in_threads, thread_count

NEIGHBOURS = 4.5
"""Distance, over a, of nodes that are next to a point: chi is 1e-9 there."""
EACH = 2.5e-9
"""Seconds of one pair, about."""
VECTOR = 2.8
"""What a pair of a conductor takes of that, both polarisations."""
PATCH = 5e-10
"""Seconds of a pair when what is next to points is found."""
KEPT = 3
"""Series kept with a body, of so many wavenumbers and splits."""
WHOLE = 3.4
"""Distance, over 1/k, from which 1 - e^{-(kR)^2} is 1 to 1e-5."""
TOUCHING = 1e-6
"""Distance, over 1/k, below which a node is the point itself."""


class Sums(Protocol):
    """The sums over nodes at points (m,) of the body or inside it."""

    def total(self, values: ComplexArray, mine: ComplexArray) -> ComplexArray:
        """What the points, whose own current is ``mine`` (m, ...), receive of values (n, ...) at the nodes."""

    def closed(self, values: ComplexArray, wave: ComplexArray) -> ComplexArray:
        """The points' own current (m, ...) that is ``wave`` (m, ...) and what they receive of values at the nodes."""


def sums_at(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: FloatArray | float) -> Sums:
    """The sums over the nodes of currents, of any boundary; parameters as of `NodeSums`."""
    of = currents, points, normals, window
    return VectorSums(*of) if currents.boundary.kind == "conductor" else NodeSums(*of)


def _split_sums(
    currents: SurfaceCurrents, places: tuple[FloatArray, FloatArray], near: FloatArray, load: Load, each: float
) -> SplitSums | None:
    """The sums at points with normals (m, 3) by their split, if all pairs of ``each`` seconds take longer."""
    points, normals = places
    seconds = each * len(points) * len(currents.points) / thread_count()
    k, body = currents.wavenumber, currents.body
    low, high = body.bounds

    known: dict[tuple[float, float], SmoothKernel] = kept(body, "smooth kernels", dict)

    def make(split: float) -> SmoothKernel:
        return known.get((k, split)) or SmoothKernel(k, high - low, split)

    # of nodes that are not alike what is left out is near
    least = 0.0 if currents.even.all() else min(float(np.max(near, initial=0.0)), WHOLE / k)
    best = best_split(make, points, currents.points, load, seconds, least)
    if best is None:
        return None
    while len(known) >= KEPT:
        known.pop(next(iter(known)))
    known[k, best.split] = best
    of_nodes = currents.points, currents.normals, currents.weights / (4 * np.pi), currents.even
    return SplitSums(best, points, normals, *of_nodes, near)


def _each(window: FloatArray | float, points: FloatArray) -> FloatArray:
    """A window for each of the points (m,)."""
    return np.ascontiguousarray(np.broadcast_to(np.asarray(window, dtype=float), (len(points),)))


class NodeSums:
    """The sums over nodes of currents at points of the body with normals (m, 3), for any values at the nodes.

    Parameters
    ----------
    currents : SurfaceCurrents
        Whose nodes, not values, are taken.
    points, normals : (m, 3), L and 1
    window : (m,) or float, L
        The width a; 0 where points are so far inside the body that nothing stands next to them.
    """

    def __init__(
        self, currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: FloatArray | float
    ) -> None:
        self.k, kind = currents.wavenumber, currents.boundary
        self._currents, self._places, self.window = currents, (points, normals), _each(window, points)
        self.soft = kind.kind == "soft"
        self._eta, self._ours = (
            np.zeros(len(x)) if self.soft else np.broadcast_to(kind.at(x).admittance, (len(x),))
            for x in (points, currents.points)
        )
        self._points = [np.ascontiguousarray(part.T) for part in (points, normals)]
        self._nodes = [np.ascontiguousarray(part.T) for part in (currents.points, currents.normals)]

    @cached_property
    def _split(self) -> SplitSums | None:
        # of a soft body along the normals of points, of others along those of nodes; an impedance has values too
        load = ONE_LAYER if self.soft or not self._ours.any() else TWO_LAYERS
        return _split_sums(self._currents, self._places, NEIGHBOURS * self.window, load, EACH)

    def of(self, values: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """What the points receive of values (n,) at the nodes, but for a share of their own; and that share: (m,)."""
        single = 1j * self.k * self._ours
        if self._split is None:
            return 2 * self._of_pairs(single * values, values), self.own
        if self.soft:
            return 2 * self._split.tilted_at_points(values), self.own
        rest = self._split.tilted_at_nodes(values)
        return 2 * (rest + self._split.values(single * values) if single.any() else rest), self.own

    def _of_pairs(self, single: ComplexArray, double: ComplexArray) -> ComplexArray:
        """Sum of a G and b dG/dn over all pairs (m,), of a and b (n,)."""
        from creeping.field.kernels.second_kind import from_nodes

        weights = self._currents.weights / (4 * np.pi)
        both = [np.ascontiguousarray(np.stack([w.real, w.imag])) for w in (weights * single, weights * double)]
        out = np.empty((len(self._eta), 2))

        def work(part: slice) -> None:
            given = (
                *self._points,
                *self._nodes,
                self._currents.even,
                *both,
                self.k,
                NEIGHBOURS * self.window,
                self.soft,
            )
            from_nodes(*given, part.start, part.stop, out)

        in_threads(work, len(out), least=16, multiple=1, seconds=EACH * len(double))
        return np.asarray(out[:, 0] + 1j * out[:, 1])

    @cached_property
    def own(self) -> ComplexArray:
        """What multiplies the points' own current (m,): put back and taken off in the windows."""
        from creeping.field.kernels.near_pairs import window_sums

        currents, k = self._currents, self.k
        a = np.where(self.window > 0, self.window, 1 / k)
        if not len(a):
            return np.zeros(0, dtype=complex)
        cells = cells_of(currents.points, float(np.median(a)) * NEIGHBOURS / 2)
        y, sides = (np.ascontiguousarray(part[:, cells.order]) for part in self._nodes)
        of_nodes = (part[cells.order] for part in (currents.weights, currents.mean_curvature, currents.even))
        out = np.zeros((len(a), 4))
        given = *self._points, y, sides, *of_nodes, *cells.grid, a, NEIGHBOURS * self.window, k, self.soft

        def work(part: slice) -> None:
            window_sums(*given, part.start, part.stop, out)

        in_threads(work, len(out), least=64, multiple=1, seconds=PATCH * y.shape[1])
        area, bent, still, tilted = out.T
        cover, bend = area / (np.pi * a**2), bent / (np.pi * a**2)
        sign, root = 1 if self.soft else -1, np.sqrt(np.pi) * a
        taken_off = (1j * k * self._eta * still + tilted) / (4 * np.pi)
        put_back = 1j * k * self._eta * cover * root / 4 + sign * bend * root / 8
        return np.asarray(2 * (put_back - taken_off))

    def total(self, values: ComplexArray, mine: ComplexArray) -> ComplexArray:
        """What the points, whose own current is ``mine`` (m,), receive of values (n,) at the nodes."""
        rest, own = self.of(values)
        return np.asarray(rest + own * mine)

    def closed(self, values: ComplexArray, wave: ComplexArray) -> ComplexArray:
        """The points' own current (m,) that is ``wave`` (m,) and what they receive of values (n,) at the nodes."""
        rest, own = self.of(values)
        return np.asarray((wave + rest) / (1 - own))


class VectorSums:
    """As `NodeSums`, of a conductor: currents (n, 3, p) of p incident waves.

    Attributes
    ----------
    own : (m, 3, 3)
        What multiplies the current of the points themselves.
    """

    def __init__(
        self, currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: FloatArray | float
    ) -> None:
        windows = _each(window, points)
        self.k, self._near = currents.wavenumber, NEIGHBOURS * windows
        self._currents, self._places = currents, (points, normals)
        self._points = [np.ascontiguousarray(part.T) for part in (points, normals)]
        self._nodes = np.ascontiguousarray(currents.points.T)
        self._alike = currents.even
        self._strength = (currents.weights / (4 * np.pi))[:, None, None]
        self.own = np.zeros((len(points), 3, 3))
        at = np.flatnonzero(windows > 0)
        if not len(at):
            return
        shape, static = self._patches(currents, windows, at)
        across = np.eye(3) - normals[at, :, None] * normals[at, None]
        shape = across @ shape @ across
        mean = 0.5 * np.trace(shape, axis1=1, axis2=2)[:, None, None]
        put_back = (mean * across - shape) / (8 * np.sqrt(np.pi) * windows[at, None, None])
        self.own[at] = 2 * (put_back + across @ static @ across / (4 * np.pi))

    @cached_property
    def _split(self) -> SplitSums | None:
        return _split_sums(self._currents, self._places, self._near, CURL, EACH * VECTOR)

    def _patches(self, currents: SurfaceCurrents, windows: FloatArray, at: IntArray) -> tuple[FloatArray, FloatArray]:
        """Sums S and T (m, 3, 3) of `creeping.field.kernels.vector_sums` at some of the points (m,)."""
        from creeping.field.kernels.vector_sums import patches

        sides = np.ascontiguousarray(currents.normals.T)
        out, mine = np.empty((len(at), 15)), [np.ascontiguousarray(part[:, at]) for part in self._points]

        def work(part: slice) -> None:
            given = (*mine, self._nodes, sides, currents.weights, currents.shapes, self._alike)
            patches(*given, windows[at], TOUCHING / self.k, self._near[at], part.start, part.stop, out)

        in_threads(work, len(out), least=16, multiple=1, seconds=PATCH * len(sides.T))
        return out[:, SYMMETRIC], out[:, 6:].reshape(-1, 3, 3)

    def total(self, values: ComplexArray, mine: ComplexArray) -> ComplexArray:
        """What the points, whose own current is ``mine`` (m, 3, p), receive of values (n, 3, p) at the nodes."""
        return np.asarray(self._rest(values) + self.own @ mine)

    def closed(self, values: ComplexArray, wave: ComplexArray) -> ComplexArray:
        """The points' own current that is ``wave`` (m, 3, p) and what they receive of values (n, 3, p) at the nodes."""
        return np.asarray(np.linalg.solve(np.eye(3) - self.own, wave + self._rest(values)))

    def _rest(self, values: ComplexArray) -> ComplexArray:
        """What the points receive of values (n, 3, p) at the nodes, but for a share of their own: (m, 3, p)."""
        if self._split is not None:
            return 2 * np.cross(self._places[1][:, :, None], self._split.curl(values), axis=1)
        from creeping.field.kernels.vector_sums import vectors_from_nodes

        turned = np.moveaxis(values * self._strength, 0, 2)
        J = np.ascontiguousarray(np.concatenate([turned.real, turned.imag]).transpose(1, 0, 2))
        out = np.empty((self._points[0].shape[1], len(J), 6))

        def work(part: slice) -> None:
            given = (*self._points, self._nodes, self._alike, J, self.k, self._near)
            vectors_from_nodes(*given, part.start, part.stop, out)

        in_threads(work, len(out), least=16, multiple=1, seconds=EACH * VECTOR * len(values))
        return np.asarray(np.moveaxis(out[..., :3] + 1j * out[..., 3:], 1, 2))
