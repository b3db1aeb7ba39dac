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

from typing import Protocol

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.quadrature import SYMMETRIC
from creeping.kernels.threads import in_threads

NEIGHBOURS = 4.5
"""Distance, over a, of nodes that are next to a point: chi is 1e-9 there."""
EACH = 2.5e-9
"""Seconds of one pair, about."""
VECTOR = 2.8
"""What a pair of a conductor takes of that, both polarisations."""
PATCH = 5e-10
"""Seconds of a pair when what is next to points is found."""
TOUCHING = 1e-6
"""Distance, over 1/k, below which a node is the point itself."""


class Sums(Protocol):
    """The sums over nodes at points (m,) of the body or inside it."""

    def total(self, values: ComplexArray, mine: ComplexArray) -> ComplexArray:
        """What the points, whose own current is ``mine`` (m, ...), receive of values (n, ...) at the nodes."""

    def closed(self, values: ComplexArray, wave: ComplexArray) -> ComplexArray:
        """The points' own current (m, ...) that is ``wave`` (m, ...) and what they receive of values at the nodes."""


def sums_at(
    currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: FloatArray | float | None
) -> Sums:
    """The sums over the nodes of currents, of any boundary; parameters as of `NodeSums`."""
    of = currents, points, normals, window
    return VectorSums(*of) if currents.boundary.kind == "conductor" else NodeSums(*of)


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
    window : (m,) or float or None, L
        The width a; None where the points are so far inside the body that nothing stands next to them.
    """

    def __init__(
        self, currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: FloatArray | float | None
    ) -> None:
        self.k, kind = currents.wavenumber, currents.boundary
        self.window = None if window is None else _each(window, points)
        self.soft = kind.kind == "soft"
        self._eta, ours = (
            np.zeros(len(x)) if self.soft else np.broadcast_to(kind.at(x).admittance, (len(x),))
            for x in (points, currents.points)
        )
        self._double = currents.weights / (4 * np.pi)
        self._single = 1j * self.k * ours * self._double
        self._points = [np.ascontiguousarray(part.T) for part in (points, normals)]
        places = [np.ascontiguousarray(part.T) for part in (currents.points, currents.normals)]
        self._nodes = *places, currents.weights, currents.mean_curvature, currents.even

    def of(self, values: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """What the points receive of values (n,) at the nodes, but for a share of their own; and that share: (m,)."""
        from creeping.field.kernels.second_kind import from_nodes

        k, soft = self.k, self.soft
        far = np.zeros(len(self._eta))
        a, near = (1 / k + far, far) if self.window is None else (self.window, NEIGHBOURS * self.window)
        both = [
            np.ascontiguousarray(np.stack([w.real, w.imag])) for w in (self._single * values, self._double * values)
        ]
        out = np.empty((len(self._eta), 6))

        def work(part: slice) -> None:
            given = (*self._points, *self._nodes, *both, k, a, near, soft)
            from_nodes(*given, part.start, part.stop, out)

        in_threads(work, len(out), least=16, multiple=1, seconds=EACH * len(values))
        real, imaginary, area, bent, still, tilted = out.T
        cover, bend = area / (np.pi * a**2), bent / (np.pi * a**2)
        sign, root = 1 if soft else -1, np.sqrt(np.pi) * a
        taken_off = (1j * k * self._eta * still + tilted) / (4 * np.pi)
        put_back = 1j * k * self._eta * cover * root / 4 + sign * bend * root / 8
        return 2 * (real + 1j * imaginary), np.asarray(2 * (put_back - taken_off))

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
        self, currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: FloatArray | float | None
    ) -> None:
        windows = _each(0.0 if window is None else window, points)
        self.k, self._near = currents.wavenumber, NEIGHBOURS * windows
        self._points = [np.ascontiguousarray(part.T) for part in (points, normals)]
        self._nodes = np.ascontiguousarray(currents.points.T)
        self._alike = currents.even
        self._strength = (currents.weights / (4 * np.pi))[:, None, None]
        self.own = np.zeros((len(points), 3, 3))
        if window is None:
            return
        shape, static = self._patches(currents, windows)
        across = np.eye(3) - normals[:, :, None] * normals[:, None]
        shape = across @ shape @ across
        mean = 0.5 * np.trace(shape, axis1=1, axis2=2)[:, None, None]
        put_back = (mean * across - shape) / (8 * np.sqrt(np.pi) * windows[:, None, None])
        self.own = 2 * (put_back + across @ static @ across / (4 * np.pi))

    def _patches(self, currents: SurfaceCurrents, window: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sums S and T (m, 3, 3) of `creeping.field.kernels.vector_sums`."""
        from creeping.field.kernels.vector_sums import patches

        sides = np.ascontiguousarray(currents.normals.T)
        out = np.empty((self._points[0].shape[1], 15))

        def work(part: slice) -> None:
            given = (*self._points, self._nodes, sides, currents.weights, currents.shapes, self._alike)
            patches(*given, window, TOUCHING / self.k, self._near, part.start, part.stop, out)

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
        from creeping.field.kernels.vector_sums import vectors_from_nodes

        turned = np.moveaxis(values * self._strength, 0, 2)
        J = np.ascontiguousarray(np.concatenate([turned.real, turned.imag]).transpose(1, 0, 2))
        out = np.empty((self._points[0].shape[1], len(J), 6))

        def work(part: slice) -> None:
            given = (*self._points, self._nodes, self._alike, J, self.k, self._near)
            vectors_from_nodes(*given, part.start, part.stop, out)

        in_threads(work, len(out), least=16, multiple=1, seconds=EACH * VECTOR * len(values))
        return np.asarray(np.moveaxis(out[..., :3] + 1j * out[..., 3:], 1, 2))
