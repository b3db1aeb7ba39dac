"""The wave between ports where geodesics merge: Gaussian beams along all of them from one port, on caustics finite.

    u(x) = Σ dθ (k_c ε/2π)^(1/2) q^(-1/2) y e^{iks + (i/2) k_c (q'/q) n²},   q = J2 - iε J1,   k_c = k - i y_s/y

y is the wave of `creeping.field.ports.waves` without its J2, (s, n) the foot of x on the ray of angle θ and its
distance from there. arg q runs on from -π/2. By stationary phase each geodesic through x has its own wave again, and
the term g² of its second order: it is left out of y. ε = WIDTH a, a length, is free; what it changes tells the error.

Sources: [P82], [CPP82]; Derivations, F24 and F25.
"""

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.ports.waves import PathTerms
from creeping.geodesics.equations import sharpest_curvature
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.port_rays import TURN, traced_fans

WIDTH, OTHER = 2.5, 0.6
"""ε/a, and the factor of the other ε."""
APART, STEP = 0.22, 0.08
"""Angle between beams, in (ka)^(-1/2), and steps, in a/(ka)^(1/3)."""
FEWEST = 128
REACH = 0.9
"""How far a beam reaches, in terms of a."""
EVERY, NOTHING = 4, -690.0
"""Steps between those at which waves are found, and the logarithm of none."""
MOST_TURNED = 0.5
"""Bound of |k_c/k - 1|."""


def beam_length(body: Surface) -> float:
    """A, L: the radius of a ball of the body's size."""
    return float(size(body) / np.sqrt(3))


def beam_width(body: Surface, wavenumber: float) -> float:
    """(a/k)^(1/2), about the width of beams at their port, L."""
    return float(np.sqrt(beam_length(body) / wavenumber))


class PortBeams:
    """Beams of one port at one wavenumber.

    Parameters
    ----------
    body : Surface
    port, outward : (3,), L and 1
        And its normal.
    length : float, L
    wavenumber : float, 1/L
    order : int
    """

    def __init__(
        self, body: Surface, port: FloatArray, outward: FloatArray, length: float, wavenumber: float, order: int
    ) -> None:
        from creeping.field.kernels.ray_profile import SPAN, spans_of
        from creeping.rays.kernels import port_fans as lane

        self.k, self.a = wavenumber, beam_length(body)
        rays = 2 * max(FEWEST // 2, int(np.ceil(np.pi / APART * self.a / beam_width(body, wavenumber))))
        steps = int(np.ceil(length / self.a * max(np.cbrt(wavenumber * self.a) / STEP, self._turns(body) / TURN)))
        self.step = length / steps
        times = self.step * np.arange(steps + lane.GUARD + 1, dtype=float)
        states = traced_fans(body, port[None], outward[None], rays, times)[0]
        lanes = np.zeros((rays, len(times) - 4 + lane.BEHIND, lane.LANES))
        last = np.zeros(rays, dtype=np.int64)
        with evaluators(body) as parts:
            lane.port_fan(parts.level, parts.level_parameters, self.step, size(body), 0.0, states, lanes, last)
        lanes = lanes[:, lane.BEHIND :]
        count = lanes.shape[1]
        S = np.broadcast_to(self.step * np.arange(count), (rays, count))
        logarithm, slope = self._waves(lanes, S, last, order)
        turned = -1j * slope / self.k
        turned /= np.maximum(1.0, np.abs(turned) / MOST_TURNED)
        self.turned = 1 + turned
        ended = np.arange(count) > last[:, None]
        self.size = np.where(ended, NOTHING, logarithm.real) + 0.5 * np.log(np.abs(self.turned))
        self.phase = logarithm.imag + 0.5 * np.angle(self.turned)
        x, p = (np.ascontiguousarray(lanes[..., part]) for part in (slice(0, 3), slice(3, 6)))
        flat = x.reshape(-1, 3)
        b = np.cross(normal(body, flat), p.reshape(-1, 3))
        self.rays = (x, p, b.reshape(x.shape), np.ascontiguousarray(lanes[..., lane.ACROSS]), np.ascontiguousarray(S))
        self.states, self.apart = states[:, :count], 2 * np.pi / rays
        spans = -(-(count - 1) // SPAN)
        self.balls = np.empty((rays, spans, 3)), np.empty((rays, spans))
        spans_of(x, *self.balls)
        # what is carried along, and what beams off their rays add to it
        self.carried = np.ones((1, 1, 1), dtype=complex)
        self.leaning = np.zeros((1, 1, 1), dtype=complex)

    def _turns(self, body: Surface) -> float:
        """Largest angle, radians, by which a ray turns along a length a."""
        return self.a * sharpest_curvature(body)

    def _waves(self, lanes: FloatArray, S: FloatArray, last: IntArray, order: int) -> tuple[ComplexArray, ComplexArray]:
        """Logarithm of y, in 1/L^(1/2), along all rays and its slope, 1/L: (rays, steps), (rays, steps).

        By cubic splines of log y √s through every EVERY-th step; behind the end of a ray they stay.
        """
        from scipy.interpolate import CubicSpline

        from creeping.rays.kernels import port_fans as lane

        count = S.shape[1]
        steps = np.append(np.arange(1, count - 1, EVERY), count - 1)
        # rays of kappa_n <= 0 at their ports have no wave at all
        known = np.take_along_axis(lanes, np.clip(steps, 1, np.maximum(last, 1)[:, None])[..., None], axis=1)
        known = np.where((last > 0)[:, None, None], known, 1.0)
        s = self.step * np.clip(steps, 1, np.maximum(last, 1)[:, None]).ravel()

        def ends(of: int) -> FloatArray:
            start = np.broadcast_to(lanes[:, :1, of], known.shape[:2])
            return np.stack([start.ravel(), known[..., of].ravel()], axis=1)

        curvature = np.abs(ends(lane.CURVATURE))
        integrals = known[..., lane.INTEGRALS : lane.INTEGRALS + lane.PARTS].reshape(-1, lane.PARTS)
        y = self._wave((self.k, s, curvature, ends(lane.TORSION), ends(lane.BEND), integrals), order)
        y = (np.where(np.abs(y) > 0, y, 1e-300) * np.sqrt(s)).reshape(known.shape[:2])
        smooth = np.log(np.abs(y)) + 1j * np.unwrap(np.angle(y), axis=1)
        curve = CubicSpline(steps * self.step, smooth, axis=1)
        # at the port itself y is infinite; beams begin behind it
        at = self.step * np.maximum(np.arange(count), 1)
        self.known, self.at = steps * self.step, at
        return curve(at) - 0.5 * np.log(at), curve(at, 1) - 0.5 / at

    def _wave(self, path: tuple[Any, ...], order: int) -> ComplexArray:
        """Y of paths (m,), what `PathTerms` asks for."""
        return PathTerms(*path).wave(order)

    def sums(self, points: FloatArray, beyond: float) -> tuple[ComplexArray, ComplexArray]:
        """Sums at points (n, 3) by feet farther along than ``beyond``, L, for both ε: (n, c), (n, c), 1/L."""
        from creeping.field.kernels.ray_profile import add_beams

        found = []
        for factor in (1.0, OTHER):
            eps = WIDTH * self.a * factor
            q = self.states[..., 8] - 1j * eps * self.states[..., 6]
            rate = self.states[..., 9] - 1j * eps * self.states[..., 7]
            weight = 0.5 * np.log(self.k * eps / (2 * np.pi)) + np.log(self.apart)
            strength = self.size - 0.5 * np.log(np.abs(q)) + weight
            phase = self.phase - 0.5 * np.unwrap(np.angle(q), axis=1)
            early, late = np.zeros((2, len(points), self.carried.shape[2]), dtype=complex)
            cut = max(2, round(beyond / self.step))
            table = (*self.rays, strength, phase, rate / q * self.turned, self.k, cut, REACH * self.a, *self.balls)
            add_beams(points, *table, self.carried, self.leaning, early, late)
            found.append(late)
        return found[0], found[1]
