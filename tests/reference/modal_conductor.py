"""Scattering by conductors of revolution with edges and tips: the magnetic field's equation of each Fourier mode.

With n the normal, t = (-n_z, n_rho) along the generatrix and phi around, n = phi x t, the current J = n x H is solved
on the generatrix alone (`tests.reference.generatrix`), J_t and J_phi of each mode e^{im phi}:

    J/2 - n x int grad_x G x J dS = n x H_inc,   and   H_inc + int grad_x G x J dS = 0 inside
    f(r) = (ik/4 pi) int [J - r (r.J)] e^{-ik r.y} dS

Both are met together in least squares, as in `tests.reference.modal_equation`. With D = x - y, y turned by phi, and
grad_x G = G' D, what J = t', phi' at y gives n x (grad_x G x J) = grad_x G (n.J) - J (n.grad_x G) along t and phi is

    tt  G' [(t.D)(n.t') - (t.t')(n.D)]                     pt  -G' sin(phi) [rho' (n.t') + t'_rho (n.D)]
    tp  G' sin(phi) [t_rho (n.D) - n_rho (t.D)]            pp   G' [rho' sin^2(phi) n_rho - cos(phi) (n.D)]

tp and pt are odd in phi. A wave whose H has the Cartesian components h_x, h_y, h_z has, with I_m the mode of e^{ikd.x},

    H_rho + i H_phi = (h_x + i h_y) I_{m+1},   H_rho - i H_phi = (h_x - i h_y) I_{m-1},   H_z = h_z I_m

Sources: [CK13, sec. 6.4], [S68].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import jv

from tests.reference.conditions import ComplexArray, FloatArray, positive
from tests.reference.dipoles import frames
from tests.reference.fundamental import least_squares
from tests.reference.generatrix import Azimuth, Panels, modal_matrix, waves
from tests.reference.modal_equation import order_count
from tests.reference.revolution import Profile, wave_directions


@dataclass(frozen=True)
class ModalConductor:
    """Scattered fields of a conductor of revolution for plane waves, E0 along theta and phi of each.

    Attributes
    ----------
    wavenumber : float, 1/L
    polar : (d,)
        theta, radians: the waves go along (sin theta, 0, cos theta).
    panels : Panels
    values : (orders, 2, n, d, 2)
        Modes of J_t and J_phi at the nodes; for E0 along theta J_t is even in phi and J_phi odd, along phi the reverse.
    inside : (d, 2)
        Root mean square of the total H at points inside, |E0| = 1.
    """

    wavenumber: float
    polar: FloatArray
    panels: Panels
    values: ComplexArray
    inside: FloatArray

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (d, 3), where the waves go."""
        return wave_directions(self.polar)

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field, L, theta and phi scattered by theta and phi incident (last axis): (m, 3) to (m, d, 2, 2)."""
        r = np.asarray(r, dtype=float)
        k, x, n = self.wavenumber, self.panels.x, self.panels.n
        orders = np.arange(len(self.values))
        count = 2 * int(k * np.max(x[:, 0]) + len(orders)) + 40
        phi = 2 * np.pi * np.arange(count) / count
        share = np.where(orders == 0, 1, 2) * np.exp(0j)
        even = np.cos(np.outer(phi, orders)) * share
        odd = 1j * np.sin(np.outer(phi, orders)) * share
        total = np.zeros((len(r), 3, len(self.polar), 2), dtype=complex)
        weights = self.panels.w[:, None, None] * 2 * np.pi / count
        for here, e, o in zip(phi, even, odd, strict=True):
            c, s = np.cos(here), np.sin(here)
            along, around = self.values[:, 0] * weights, self.values[:, 1] * weights
            J_t = np.stack([np.tensordot(e, along[..., 0], 1), np.tensordot(o, along[..., 1], 1)], axis=-1)
            J_p = np.stack([np.tensordot(o, around[..., 0], 1), np.tensordot(e, around[..., 1], 1)], axis=-1)
            t_rho, t_z = (part[:, None, None] for part in (-n[:, 1], n[:, 0]))
            J = np.stack([J_t * t_rho * c - J_p * s, J_t * t_rho * s + J_p * c, J_t * t_z], axis=1)
            phase = np.exp(-1j * k * (r @ np.stack([x[:, 0] * c, x[:, 0] * s, x[:, 1]])))
            total += (phase @ J.reshape(len(x), -1)).reshape(total.shape)
        return np.asarray(1j * k / (4 * np.pi) * np.einsum("moc,mcdi->mdoi", frames(r), total))


def scatter_conductor(profile: Profile, wavenumber: float, polar: ArrayLike, *, cuts: int = 6) -> ModalConductor:
    """Solve for a convex conductor of revolution.

    Parameters
    ----------
    profile : Profile
    wavenumber : float, 1/L
    polar : (d,)
        theta, radians, of the waves.
    cuts : int
        Of the last panel at edges and tips.
    """
    positive(wavenumber=wavenumber)
    k, theta = wavenumber, np.atleast_1d(np.asarray(polar, dtype=float))
    panels = Panels(profile, k, cuts)
    size = k * float(np.max(panels.x[:, 0]))
    # along the axis the current has the mode m = 1
    orders = max(2, order_count(size, theta))

    def kernel(x: FloatArray, n: FloatArray, y: FloatArray, sides: FloatArray, rule: Azimuth) -> ComplexArray:
        return _current(x, n, y, sides, rule, waves(x, y, k, rule)[1])

    matrix = modal_matrix(panels, kernel, size, orders, 4)
    inner = panels.inner(k)
    under = _inside(panels, inner, k, size, orders)
    x, n = panels.x, panels.n
    root = np.sqrt(np.tile(panels.w, 2))
    scale = np.sqrt(np.mean(panels.w))
    d = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    h = np.cross(d[:, None], frames(d)).reshape(-1, 3)
    values = np.empty((orders, 2, len(x), len(theta), 2), dtype=complex)
    left = np.zeros((len(inner), len(h)))
    for m in range(orders):
        own = 0.5 * np.eye(2 * len(x)) - np.block([[matrix[0, m], matrix[1, m]], [matrix[2, m], matrix[3, m]]])
        H_rho, H_phi, H_z = _wave(x, k, np.repeat(theta, 2), h, m)
        # n x H: phi x t = n, t x n = phi
        right = np.concatenate([H_phi, n[:, 1:] * H_rho - n[:, :1] * H_z])
        within = np.concatenate(_wave(inner, k, np.repeat(theta, 2), h, m))
        rows = np.swapaxes(under[:, :, m], 1, 2).reshape(3 * len(inner), -1)
        both = np.concatenate([root[:, None] * own / root, -scale * rows / root])
        found = least_squares(both, np.concatenate([root[:, None] * right, scale * within])) / root[:, None]
        values[m] = found.reshape(2, len(x), len(theta), 2)
        off = np.abs(within + rows @ found) ** 2
        left += (1 if m == 0 else 2) * off.reshape(3, len(inner), -1).sum(axis=0)
    inside = np.sqrt(np.mean(left, axis=0)).reshape(len(theta), 2)
    return ModalConductor(k, theta, panels, values, inside)


def _current(
    x: FloatArray, n: FloatArray, y: FloatArray, sides: FloatArray, rule: Azimuth, slope: FloatArray
) -> ComplexArray:
    """Modes of tt, tp, pt and pp (4, pairs, orders)."""
    t = np.array([-n[1], n[0]])
    t_rho, t_z, rho = -sides[:, 1:], sides[:, :1], y[:, :1]
    step = x - y
    # D_rho without differences of what is nearly the same
    D_rho = step[:, :1] + 2 * rho * rule.half
    n_D, t_D = n[0] * D_rho + n[1] * step[:, 1:], t[0] * D_rho + t[1] * step[:, 1:]
    n_t, t_t = n[0] * t_rho * rule.cos + n[1] * t_z, t[0] * t_rho * rule.cos + t[1] * t_z
    return np.stack(
        [
            rule.modes(slope * (t_D * n_t - t_t * n_D)),
            rule.modes(slope * (rule.sin * (t[0] * n_D - n[0] * t_D)), odd=True),
            rule.modes(slope * (-rule.sin * (rho * n_t + t_rho * n_D)), odd=True),
            rule.modes(slope * (rho * rule.sin**2 * n[0] - rule.cos * n_D)),
        ]
    )


def _inside(panels: Panels, inner: FloatArray, k: float, size: float, orders: int) -> ComplexArray:
    """Modes of H_rho, H_phi, H_z inside of J_t and J_phi: (3, 2, orders, points, n)."""
    y, rule = panels.x, Azimuth.graded(size, orders)
    t_rho, t_z, rho = -panels.n[:, 1:], panels.n[:, :1], y[:, :1]
    out = np.empty((3, 2, orders, len(inner), len(y)), dtype=complex)
    for i, at in enumerate(inner):
        _, slope = waves(at, y, k, rule)
        D_rho, D_phi, D_z = at[0] - rho * rule.cos, -rho * rule.sin, (at - y)[:, 1:]
        kernels = [
            [D_phi * t_z - D_z * t_rho * rule.sin, -D_z * rule.cos],
            [D_z * t_rho * rule.cos - D_rho * t_z, -D_z * rule.sin],
            [D_rho * t_rho * rule.sin - D_phi * t_rho * rule.cos, D_rho * rule.cos + D_phi * rule.sin],
        ]
        for row, pair in enumerate(kernels):
            for column, values in enumerate(pair):
                # even are those of H_rho, H_z by J_phi and of H_phi by J_t
                found = rule.modes(slope * values, odd=(row == 1) == (column == 1))
                out[row, column, :, i] = (found * panels.w[:, None]).T
    return out


def _wave(
    x: FloatArray, k: float, theta: FloatArray, h: FloatArray, m: int
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Modes of H_rho, H_phi and H_z of plane waves with H = h e^{ikd.x}, h (waves, 3): (points, waves) each."""
    at, phase = k * np.outer(x[:, 0], np.sin(theta)), np.exp(1j * k * np.outer(x[:, 1], np.cos(theta)))
    before, here, after = (1j**q * jv(q, at) * phase for q in (m - 1, m, m + 1))
    cos, sin = 0.5 * (before + after), (before - after) / 2j
    return h[:, 0] * cos + h[:, 1] * sin, h[:, 1] * cos - h[:, 0] * sin, h[:, 2] * here
