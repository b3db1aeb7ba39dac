"""Gaussian beams along geodesics of a body, from a line or from a point: their sum is finite on every caustic.

    u(x) = sum over rays dsigma (k eps/2 pi)^(1/2) (k_c/k)^(1/2) q^(-1/2) y e^{ik S + (i/2) k_c (q'/q) n^2}
    from a line    q = J1 + i eps J2          from a point    q = J2 - i eps J1
    k_c = k - i y_s/y

S is the phase along a ray, (s, n) the foot of x on it and the distance from there, and J1, J2 are the Jacobi fields
J'' + K J = 0 with J1(0) = J2'(0) = 1, J1'(0) = J2(0) = 0. arg q is continuous along the ray, from 0 or -pi/2: it counts
the caustics. By stationary phase each ray that passes through x contributes its own wave, y |J|^(-1/2). eps is free, a
length from a point and its inverse from a line; what it changes is an error. A vector's beams have V + (k_c/k)
(q'/q) n V' for components.

Sources: [P82], [CPP82]; Derivations, F24 and F25.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.geodesics.states import M11, M12, M21, M22, P, X
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_threads

WIDTH = 2.5
"""Eps/a from a point, eps a from a line: free (F24); what another one changes is part of the error, and within it
(``tests/field/test_port_beams.py``)."""
REACH = 0.9
"""How far a beam reaches, in terms of a: (ka)^(1/2) of its widths, so that nothing is lost from ka = 10 on."""
MOST_TURNED = 0.5
"""Bound of |k_c/k - 1|, which is tau/2m^2 of a mode (F24) and infinite where y is 0."""


def beam_length(body: Surface) -> float:
    """Length a, L: the radius of a ball of the body's size."""
    return float(size(body) / np.sqrt(3))


class GaussianBeams:
    """Beams along rays (m,), known at the same steps (steps,).

    Parameters
    ----------
    body : Surface
    wavenumber : float, 1/L
    states : (m, steps, 10)
        Of the rays, with their Jacobi matrix.
    sides : (m, steps, 3)
        b = n x p.
    curvature : (m, steps), 1/L
        Normal curvature along b.
    S : (m, steps), L
        Phase over k.
    logarithm, slope : (m, steps) complex, 1 and 1/L
        log y without jumps, and y_s/y.
    weight : (m,) or float
        dsigma of each ray: L across a line, radians at a point.
    known : (m, steps) complex, or 0
        Added to log y, without a part in k_c.
    """

    def __init__(
        self,
        body: Surface,
        wavenumber: float,
        states: FloatArray,
        sides: FloatArray,
        curvature: FloatArray,
        S: FloatArray,
        logarithm: ComplexArray,
        slope: ComplexArray,
        weight: FloatArray | float,
        known: ComplexArray | float = 0.0,
    ) -> None:
        from creeping.field.kernels.ray_profile import SPAN, spans_of

        self.k, self.a, self.states = wavenumber, beam_length(body), states
        turned = turned_by(slope, wavenumber)
        self.turned = 1 + turned
        strength = logarithm + known
        self.size = strength.real + 0.5 * np.log(np.abs(self.turned)) + np.log(np.reshape(weight, (-1, 1)))
        self.phase = strength.imag + 0.5 * np.angle(self.turned)
        x, p, b, bent, S = (np.ascontiguousarray(of) for of in (states[..., X], states[..., P], sides, curvature, S))
        self.rays = x, p, b, bent, S
        rays, steps = S.shape
        spans = -(-(steps - 1) // SPAN)
        self.balls = np.empty((rays, spans, 3)), np.empty((rays, spans))
        spans_of(x, *self.balls)
        self.V, self.lean = np.ones((1, 1, 1), dtype=complex), np.zeros((1, 1, 1), dtype=complex)

    def carry(self, V: ComplexArray, lean: ComplexArray) -> None:
        """Take V and V' (m, steps, c) for components."""
        self.V, self.lean = (np.ascontiguousarray(part, dtype=complex) for part in (V, lean))

    def sums(self, points: FloatArray, eps: float, cut: int, *, from_point: bool = False) -> ComplexArray:
        """Sums at points (n, 3), by feet before the step ``cut`` and behind it: (2, n, c)."""
        from creeping.field.kernels.ray_profile import add_beams

        one, other = (-1j * eps, 1.0) if from_point else (1.0, 1j * eps)
        q = one * self.states[..., M11] + other * self.states[..., M12]
        rate = one * self.states[..., M21] + other * self.states[..., M22]
        amplitude = self.size - 0.5 * np.log(np.abs(q)) + 0.5 * np.log(self.k * eps / (2 * np.pi))
        phase = self.phase - 0.5 * np.unwrap(np.angle(q), axis=1)
        table = (*self.rays, amplitude, phase, rate / q * self.turned, self.k, cut, REACH * self.a, *self.balls)
        out = np.zeros((2, len(points), self.V.shape[2]), dtype=complex)

        def work(part: slice) -> None:
            add_beams(points[part], *table, self.V, self.lean, out[0, part], out[1, part])

        in_threads(work, len(points), least=64, multiple=1)
        return out


def turned_by(slope: ComplexArray, wavenumber: float) -> ComplexArray:
    """Bounded k_c/k - 1 of waves with y_s/y = slope, 1/L."""
    # where a wave vanishes its slope is infinite, and tells nothing
    turned = np.nan_to_num(-1j / wavenumber * np.where(np.isfinite(slope), slope, 0.0))
    return np.asarray(turned / np.maximum(1.0, np.abs(turned) / MOST_TURNED))
