"""Scattering by two spheres: outgoing multipoles of both centres, fitted to the conditions on both surfaces.

With theta and phi about the line of centres, P of the normal Y = P e^{im phi}, tau = dP/dtheta, pi = m P/sin(theta)
and rho = kr, the waves of a centre, u of a scalar and E = M or N of a conductor, are

    u = h P e^{im phi},   grad u/k = [h' P r + (h/rho) (tau theta + i pi phi)] e^{im phi}
    M = h (i pi theta - tau phi) e^{im phi},   N = [n(n+1) (h/rho) P r + (h' + h/rho) (tau theta + i pi phi)] e^{im phi}
    2 tau = sqrt((n-m)(n+m+1)) P_n^{m+1} - sqrt((n+m)(n-m+1)) P_n^{m-1}
    -2 pi sqrt((2n+3)/(2n+1)) = sqrt((n+m+1)(n+m+2)) P_{n+1}^{m+1} + sqrt((n-m+1)(n-m+2)) P_{n+1}^{m-1}

with every h = h_n(kr) over h_n(ka). Far away h_n ~ (-i)^{n+1} e^{ikr}/kr and h_n' ~ i h_n. What two bodies scatter is
the sum of what each radiates, and multipoles of its centre are complete for each. The line of centres is an axis of
revolution, so each m is solved by itself:

    alpha u + (beta/k) du/dn = 0,   on a conductor n x E = 0

in least squares at Gauss nodes of both generatrices, the incident wave by its modes on the circles through them.
The residual, at points of its own all over the spheres, bounds the error. Orders go to ka and ``extra`` more, where
waves fall by s/a from one to the next, s the limit of the images within a sphere: narrow gaps need more.

    s_1 = a_1^2/(D - s_2),   s_2 = a_2^2/(D - s_1),   D between the centres

Sources: [CK13, sec. 2.4 and 6.5].
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import sph_legendre_p_all, spherical_jn, spherical_yn

from tests.reference.conditions import Boundary, ComplexArray, FloatArray, condition, positive
from tests.reference.dipoles import frames
from tests.reference.fundamental import least_squares

CHECKS = 250
"""Points on each sphere at which the residual is taken."""


Kind: TypeAlias = Boundary | Literal["pec"]
"""Soft, hard, the impedance number eta, or a perfect conductor."""


@dataclass(frozen=True)
class _Waves:
    """Outgoing waves of one centre at points, of orders n to N.

    Attributes
    ----------
    frame : (p, 3, 3)
        Unit vectors r, theta and phi.
    phi : (p,), radians
    P : (N + 2, 2N + 3, p)
        By n and m, negative m at the end.
    h, slope : (N + 1, p)
        h and h'.
    over : (p,)
        1/rho.
    """

    frame: FloatArray
    phi: FloatArray
    P: FloatArray
    h: ComplexArray
    slope: ComplexArray
    over: FloatArray

    def rows(self, m: int, sides: FloatArray, boundary: Kind) -> ComplexArray:
        """What the waves of one m give to the condition: (s p, waves).

        ``sides`` (p, s, 3) are normals, s = 1, or two tangents of a conductor.
        """
        low = max(abs(m), 1 if boundary == "pec" else 0)
        if low >= len(self.h):
            return np.zeros((sides.shape[0] * sides.shape[1], 0), dtype=complex)
        n, h, slope = np.arange(low, len(self.h))[:, None], self.h[low:], self.slope[low:]
        P, up, down = (self.P[low:-1, order] for order in (m, m + 1, m - 1))
        above, below = self.P[low + 1 :, m + 1], self.P[low + 1 :, m - 1]
        tau = 0.5 * (np.sqrt((n - m) * (n + m + 1)) * up - np.sqrt((n + m) * (n - m + 1)) * down)
        pi = np.sqrt((n + m + 1) * (n + m + 2)) * above + np.sqrt((n - m + 1) * (n - m + 2)) * below
        pi *= -0.5 * np.sqrt((2 * n + 1) / (2 * n + 3))
        turn = np.exp(1j * m * self.phi)
        along = np.einsum("psx,plx->slp", sides, self.frame) * turn
        if boundary == "pec":
            both = slope + h * self.over
            M = np.stack([0 * h, 1j * h * pi, -h * tau])
            N = np.stack([n * (n + 1) * h * self.over * P, both * tau, 1j * both * pi])
            E = np.concatenate([M, N], axis=1)
            return np.asarray(np.einsum("slp,lnp->spn", along, E).reshape(-1, E.shape[1]))
        alpha, beta = condition(boundary)
        gradient = np.stack([slope * P, h * self.over * tau, 1j * h * self.over * pi])
        return np.asarray((alpha * h * P * turn + beta * np.einsum("lp,lnp->np", along[0], gradient)).T)


@dataclass(frozen=True)
class TwoSpheres:
    """Fields that two spheres scatter of several plane waves.

    Attributes
    ----------
    centres : (2, 3), L
    radii : (2,), L
    wavenumber : float, 1/L
    directions : (d, 3)
        Unit vectors, where the waves go.
    boundary : "soft", "hard", complex or "pec"
    orders : tuple of int
        Highest order of the waves of each centre.
    strengths : by m
        Of the waves of the first centre, then of the second; a conductor's M before N: (waves, d or 2 d).
    residual : (d,), of a conductor (d, 2)
        Rms of what is left of the condition at points that were not fitted, over that of the incident wave.
    """

    centres: FloatArray
    radii: FloatArray
    wavenumber: float
    directions: FloatArray
    boundary: Kind
    orders: tuple[int, int]
    strengths: dict[int, ComplexArray]
    residual: FloatArray

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field f, L, u_s ~ f e^{ikR}/R, in unit directions r: (m, 3) -> (m, d).

        Of a conductor theta and phi scattered by theta and phi incident (last axis): (m, d, 2, 2).
        """
        r = np.atleast_2d(np.asarray(r, dtype=float))
        pec, k, axes = self.boundary == "pec", self.wavenumber, _axes(self.centres)
        theta, phi = _angles(r @ axes.T)
        waves = []
        for centre, radius, order in zip(self.centres, self.radii, self.orders, strict=True):
            n = np.arange(order + 1)[:, None]
            h = (-1j) ** (n + 1) * np.exp(-1j * k * (r @ centre)) / k / _hankel(order, np.array([k * radius]))[0]
            P = sph_legendre_p_all(order + 1, order + 1, theta)[0]
            waves.append(_Waves(_turned(theta, phi, axes), phi, P, h, 1j * h, 0 * theta))
        f = _total(waves, self.strengths, frames(r) if pec else r[:, None], "pec" if pec else "soft")
        return np.moveaxis(f.reshape(2, len(r), -1, 2), 0, 2) if pec else f


def _axes(centres: FloatArray) -> FloatArray:
    """Three unit vectors, rows, the last along the line of centres."""
    line = centres[1] - centres[0]
    line = line / np.linalg.norm(line)
    first = np.cross(np.eye(3)[np.argmin(np.abs(line))], line)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(line, first), line])


def _angles(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Theta and phi of vectors in those axes, radians: (p, 3) -> (p,), (p,)."""
    return np.arctan2(np.hypot(x[:, 0], x[:, 1]), x[:, 2]), np.arctan2(x[:, 1], x[:, 0])


def _turned(theta: FloatArray, phi: FloatArray, axes: FloatArray) -> FloatArray:
    """Unit vectors r, theta and phi: (p,), (p,) -> (p, 3, 3)."""
    (c, s), (cos, sin) = (np.cos(theta), np.sin(theta)), (np.cos(phi), np.sin(phi))
    local = np.array([[s * cos, s * sin, c], [c * cos, c * sin, -s], [-sin, cos, 0 * cos]])
    return np.asarray(np.einsum("lcp,cx->plx", local, axes))


def _hankel(order: int, rho: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """h_n and h_n' at rho (p,): (order + 1, p) each."""
    n = np.arange(order + 1)[:, None]
    j, y = ([f(n, rho, derivative=derived) for derived in (False, True)] for f in (spherical_jn, spherical_yn))
    return j[0] + 1j * y[0], j[1] + 1j * y[1]


def _waves(x: FloatArray, centre: FloatArray, size: float, k: float, order: int, axes: FloatArray) -> _Waves:
    """Waves at points (p, 3) of a sphere of size ka."""
    local = (x - centre) @ axes.T
    rho, (theta, phi) = k * np.linalg.norm(local, axis=1), _angles(local)
    scale = _hankel(order, np.array([size]))[0]
    h, slope = (part / scale for part in _hankel(order, rho))
    P = sph_legendre_p_all(order + 1, order + 1, theta)[0]
    return _Waves(_turned(theta, phi, axes), phi, P, h, slope, 1 / rho)


def _total(
    waves: Sequence[_Waves], strengths: dict[int, ComplexArray], sides: FloatArray, boundary: Kind
) -> ComplexArray:
    """Sum of the waves of both centres in the condition: (s p, incident waves)."""
    parts = (np.hstack([one.rows(m, sides, boundary) for one in waves]) @ values for m, values in strengths.items())
    return np.asarray(sum(parts))


def _incident(x: FloatArray, sides: FloatArray, k: float, d: FloatArray, boundary: Kind) -> ComplexArray:
    """The plane waves in the condition at points (p, 3): (s p, d or 2 d)."""
    wave = np.exp(1j * k * (x @ d.T))
    if boundary == "pec":
        tangential = np.einsum("psc,dic->spdi", sides, frames(d))
        return np.asarray((tangential * wave[:, :, None]).reshape(2 * len(x), -1))
    alpha, beta = condition(boundary)
    return np.asarray(wave * (alpha + 1j * beta * (sides[:, 0] @ d.T)))


def scatter_spheres(
    centres: ArrayLike, radii: ArrayLike, wavenumber: float, directions: ArrayLike, boundary: Kind, *, extra: int = 26
) -> TwoSpheres:
    """Solve for two spheres that do not touch.

    Parameters
    ----------
    centres, radii : (2, 3) and (2,), L
    wavenumber : float, 1/L
    directions : (d, 3)
    boundary : "soft", "hard", complex or "pec"
        Complex is the impedance number eta, "pec" a perfect conductor, E0 along theta and phi of each direction.
    extra : int
        Orders above ka.
    """
    c, a, k = np.asarray(centres, dtype=float), np.asarray(radii, dtype=float), wavenumber
    gap = float(np.linalg.norm(c[1] - c[0]) - a.sum())
    positive(wavenumber=k, first_radius=a[0], second_radius=a[1], gap=gap)
    d, axes, pec = np.atleast_2d(np.asarray(directions, dtype=float)), _axes(c), boundary == "pec"
    orders = int(np.ceil(k * a[0])) + extra, int(np.ceil(k * a[1])) + extra
    most = max(orders)

    def surface(which: int, theta: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        frame = _turned(theta, phi, axes)
        return c[which] + a[which] * frame[:, 0], frame[:, 1:] if pec else frame[:, :1]

    def about(x: FloatArray) -> list[_Waves]:
        return [_waves(x, c[i], k * a[i], k, orders[i], axes) for i in range(2)]

    count, weights, modes, curves = 4 * most, [], [], []
    for which, order in enumerate(orders):
        u, w = np.polynomial.legendre.leggauss(2 * order)
        theta, around = np.arccos(u), 2 * np.pi / count * np.arange(count)
        x, sides = surface(which, np.repeat(theta, count), np.tile(around, len(u)))
        on_circles = _incident(x, sides, k, d, boundary).reshape(-1, count, len(d) * (2 if pec else 1))
        modes.append(np.fft.fft(on_circles, axis=1) / count)
        weights.append(np.tile(np.sqrt(w), sides.shape[1])[:, None])
        curves.append(surface(which, theta, 0 * theta))
    seen = [(about(x), sides) for x, sides in curves]
    strengths = {}
    for m in range(-most, most + 1):
        rows = [np.hstack([one.rows(m, sides, boundary) for one in waves]) for waves, sides in seen]
        matrix = np.concatenate([w * part for w, part in zip(weights, rows, strict=True)])
        right = np.concatenate([-w * part[:, m] for w, part in zip(weights, modes, strict=True)])
        strengths[m] = least_squares(matrix, right)
    # points in a spiral, each for the same area
    turns = np.arange(0.5, CHECKS, dtype=float)
    spiral = [surface(i, np.arccos(1 - 2 * turns / CHECKS), np.pi * (1 + 5**0.5) * turns) for i in range(2)]
    x, sides = (np.concatenate(part) for part in zip(*spiral, strict=True))
    wave = _incident(x, sides, k, d, boundary)
    left = wave + _total(about(x), strengths, sides, boundary)
    residual = np.linalg.norm(left, axis=0) / np.linalg.norm(wave, axis=0)
    return TwoSpheres(c, a, k, d, boundary, orders, strengths, residual.reshape(-1, 2) if pec else residual)
