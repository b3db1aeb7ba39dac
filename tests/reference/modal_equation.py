"""Scattering by bodies of revolution with edges and tips: the integral equation of each Fourier mode.

With e^{ikd.x} = sum_m eps_m i^m J_m(k rho sin theta) e^{ikz cos theta} cos(m phi), d = (sin theta, 0, cos theta), each
mode of u, or of v = du/dn where u = 0, is solved on the generatrix alone (`tests.reference.generatrix`):

    hard, impedance   u/2 - int u (dG/dn_y + ik eta G) dS = u_inc,   u_inc + int u (dG/dn_y + ik eta G) dS = 0 inside
    soft              v/2 + int v (dG/dn_x - ik G) dS = du_inc/dn - ik u_inc
    f(r) = (1/4 pi) int [-ik (r.n - eta) u - v] e^{-ik r.y} dS

The two conditions of the first line are met together in least squares [S68], since the first alone has waves that stand
inside at resonances; the second is one that has none [BM71]. Inside, soft fields check themselves:
u_inc - int v G dS = 0. Weights: rows and columns are scaled by sqrt(w), so that edges do not outweigh the rest.

Sources: [CK13, sec. 3.2], [S68], [BM71].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import jv, jvp

from tests.reference.conditions import Boundary, ComplexArray, FloatArray, condition, positive
from tests.reference.fundamental import least_squares
from tests.reference.generatrix import Azimuth, Panels, modal_matrix, waves
from tests.reference.revolution import Profile, wave_directions


@dataclass(frozen=True)
class ModalSolution:
    """Scattered fields of a body of revolution for several plane waves.

    Attributes
    ----------
    wavenumber : float, 1/L
    polar : (d,)
        theta, radians: the waves go along (sin theta, 0, cos theta).
    boundary : "soft", "hard" or complex
    panels : Panels
    values : (orders, n, d)
        Modes of u at the nodes, or of v, 1/L, if soft.
    inside : (d,)
        Root mean square of the total field at points inside, which is 0: least squares make it so unless soft.
    """

    wavenumber: float
    polar: FloatArray
    boundary: Boundary
    panels: Panels
    values: ComplexArray
    inside: FloatArray

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (d, 3), where the waves go."""
        return wave_directions(self.polar)

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field f, L, u_s ~ f e^{ikR}/R, in unit directions: (m, 3) to (m, d)."""
        r = np.asarray(r, dtype=float)
        phi, sine = np.arctan2(r[:, 1], r[:, 0]), np.hypot(r[:, 0], r[:, 1])[:, None]
        k, x, n = self.wavenumber, self.panels.x, self.panels.n
        at, phase = k * sine * x[:, 0], np.exp(-1j * k * np.outer(r[:, 2], x[:, 1])) * self.panels.w
        alpha, beta = condition(self.boundary)
        out = np.zeros((len(r), len(self.polar)), dtype=complex)
        for m, values in enumerate(self.values):
            # int cos(m psi) e^{-ia cos psi} dpsi = 2 pi (-i)^m J_m(a)
            J = jv(m, at)
            lean = n[:, 0] * sine * 1j * jvp(m, at) + n[:, 1] * r[:, 2:] * J
            source = -J if beta == 0 else -1j * k * lean + k * alpha * J
            share = (1 if m == 0 else 2) * 0.5 * (-1j) ** m * np.cos(m * phi)[:, None]
            out += share * ((phase * source) @ values)
        return out


def scatter_by_modes(
    profile: Profile, wavenumber: float, polar: ArrayLike, boundary: Boundary, *, cuts: int = 6
) -> ModalSolution:
    """Solve for a convex body of revolution.

    Parameters
    ----------
    profile : Profile
    wavenumber : float, 1/L
    polar : (d,)
        theta, radians, of the waves.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.
    cuts : int
        Of the last panel at edges and tips.
    """
    positive(wavenumber=wavenumber)
    k, theta = wavenumber, np.atleast_1d(np.asarray(polar, dtype=float))
    alpha, beta = condition(boundary)
    panels = Panels(profile, k, cuts)
    size = k * float(np.max(panels.x[:, 0]))
    orders = order_count(size, theta)

    def kernel(x: FloatArray, n: FloatArray, y: FloatArray, sides: FloatArray, rule: Azimuth) -> ComplexArray:
        g, slope = waves(x, y, k, rule)
        step = y - x
        # n'.(y - x) and n.(x - y) without differences of what is nearly the same
        if beta:
            along = (sides * step).sum(axis=1)[:, None] + 2 * x[0] * sides[:, :1] * rule.half
            double = rule.modes(slope * along)
            return (double + k * alpha * rule.modes(g) if alpha else double)[None]
        along = -(step @ n)[:, None] + 2 * n[0] * y[:, :1] * rule.half
        return (rule.modes(slope * along) - 1j * k * rule.modes(g))[None]

    (matrix,) = modal_matrix(panels, kernel, size, orders, 1)
    inner = panels.inner(k)
    under = _inside(panels, inner, k, alpha, beta, size, orders)
    x, n, root = panels.x, panels.n, np.sqrt(panels.w)
    scale = np.sqrt(np.mean(panels.w))
    values = np.empty((orders, len(x), len(theta)), dtype=complex)
    left = np.zeros((len(inner), len(theta)))
    for m in range(orders):
        wave, slope = _wave(x, n, k, theta, m)
        within, _ = _wave(inner, np.zeros_like(inner), k, theta, m)
        if beta:
            own = root[:, None] * (0.5 * np.eye(len(x)) - matrix[m]) / root
            both = np.concatenate([own, -scale * under[m] / root])
            found = least_squares(both, np.concatenate([root[:, None] * wave, scale * within]))
        else:
            own = root[:, None] * (0.5 * np.eye(len(x)) + matrix[m]) / root
            found = np.asarray(np.linalg.solve(own, root[:, None] * (slope - 1j * k * wave)), dtype=complex)
        values[m] = found / root[:, None]
        left += (1 if m == 0 else 2) * np.abs(within + under[m] @ values[m]) ** 2
    return ModalSolution(k, theta, boundary, panels, values, np.sqrt(np.mean(left, axis=0)))


def order_count(size: float, theta: FloatArray) -> int:
    """Fourier modes that waves at angles theta to the axis have on a body of this k rho."""
    across = float(np.max(np.abs(np.sin(theta))))
    return 1 if across < 1e-9 else int(size * across + 2.5 * size ** (1 / 3)) + 9


def _wave(x: FloatArray, n: FloatArray, k: float, theta: FloatArray, m: int) -> tuple[ComplexArray, ComplexArray]:
    """Mode m of the plane waves and of their slopes along n, eps_m left out: (points, d) each."""
    sine, cosine = np.sin(theta), np.cos(theta)
    at = k * np.outer(x[:, 0], sine)
    phase = 1j**m * np.exp(1j * k * np.outer(x[:, 1], cosine))
    J = jv(m, at)
    return phase * J, k * phase * (n[:, :1] * sine * jvp(m, at) + 1j * n[:, 1:] * cosine * J)


def _inside(
    panels: Panels, inner: FloatArray, k: float, alpha: complex, beta: complex, size: float, orders: int
) -> ComplexArray:
    """What points inside receive of each mode of u or v: (orders, points, n)."""
    x, n, rule = panels.x, panels.n, Azimuth.graded(size, orders)
    out = np.empty((orders, len(inner), len(x)), dtype=complex)
    for i, at in enumerate(inner):
        g, slope = waves(at, x, k, rule)
        along = (n * (x - at)).sum(axis=1)[:, None] + 2 * at[0] * n[:, :1] * rule.half
        found = rule.modes(slope * along) + k * alpha * rule.modes(g) if beta else -rule.modes(g)
        out[:, i] = (found * panels.w[:, None]).T
    return out
