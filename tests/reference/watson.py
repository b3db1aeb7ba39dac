"""The creeping part alone of a sphere's field: residues at the Regge poles (Watson's transformation).

With x = ka, nu = lam - 1/2 and H of order lam at x, the partial waves' denominator is, up to sqrt(π/2x),

    D(lam) = A H + beta H',    A = alpha - beta/(2x),    D(lam_p) = 0,    lam_p ~ x + m tau_p + c/m,    m = (x/2)^{1/3}

The poles are found by Newton from that asymptotic start, in 40 digits. A sum over n turns into

    Σ (2n+1) c_n P_n(cosθ)  ->  -π Σ_p (2nu+1) r_p P_nu(-cosθ)/sin(π nu),    r_p = residue of c
    1/sin(π nu) = -2i e^{iπ nu} Σ_j e^{2πi nu j}

j counts windings around the sphere; with j = 0 alone, P_nu(-cosθ) = E₊ + E₋ holds the long ray, e^{i lam (2π-θ)}, and
the short one, e^{i lam θ}. θ is measured from the forward direction. On the surface, in the shadow θ < π/2, there is
nothing but residues, and the sum is the total field:

    Σ (2n+1) iⁿ P_n(cosθ)/D_n  =  -π Σ_p (2nu+1) e^{-iπ nu/2} P_nu(cosθ)/(sin(π nu) D'(nu))

A perfect conductor has two families: b_n = j/h, soft, and a_n = (x j)'/(x h)', the impedance eta = -i/x; with
P_n' = dP_n/dcosθ, π_n = P_n' and tau_n = n(n+1) P_n - cosθ P_n' in S1 and S2.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.special import ai_zeros

from tests.reference.conditions import Boundary, ComplexArray, condition, positive

DIGITS = 40
STEP = 1e-13
"""Step in lam of the central difference: truncation and rounding are both below 1e-25 at 40 digits."""


def _fock_root(p: int, q: complex | None) -> complex:
    """Root tau_p of w1' = q w1 from q = 0 by dtau/dq = 1/(tau - q²); q None is soft."""
    zeros = ai_zeros(p)
    turn = np.exp(1j * np.pi / 3)
    if q is None:
        return complex(-zeros[0][-1] * turn)
    start = complex(-zeros[1][-1] * turn)
    path = solve_ivp(lambda t, tau: q / (tau - (q * t) ** 2), (0.0, 1.0), [start], rtol=1e-8, atol=1e-8)
    return complex(path.y[0, -1])


def _start(x: float, boundary: Boundary, p: int) -> complex:
    """Asymptotic lam_p, to the order 1/m."""
    m = (x / 2) ** (1 / 3)
    alpha, beta = condition(boundary)
    q = None if beta == 0 else m * alpha
    tau = _fock_root(p, q)
    m0 = 0.0 if q is None else 1 / (tau - q * q)
    y1 = (2 * tau - (q or 0.0) * m0) / 3
    y2 = (4 * tau * y1 - m0) / 5
    return complex(x + m * tau + (-(tau**2) / 4 + tau * y1 - 0.75 * y2 - 0.5 * m0) / m)


def _characteristic(x: float, boundary: Boundary) -> Callable[[Any], Any]:
    """D(lam), in mpmath numbers."""
    alpha, beta = condition(boundary)

    def value(lam: Any) -> Any:
        h = mp.hankel1(lam, x)
        if beta == 0:
            return alpha * h
        return (alpha - mp.mpf(beta) / (2 * mp.mpf(x))) * h + beta * (mp.hankel1(lam - 1, x) - lam / x * h)

    return value


def _slope(value: Callable[[Any], Any], lam: Any) -> Any:
    return (value(lam + STEP) - value(lam - STEP)) / (2 * mp.mpf(STEP))


def _newton(value: Callable[[Any], Any], start: Any) -> tuple[Any, Any]:
    """Zero of an analytic function and the slope there."""
    lam = mp.mpc(start)
    for _ in range(30):
        slope = _slope(value, lam)
        step = value(lam) / slope
        lam -= step
        if abs(step) < 1e-24 * abs(lam):
            return lam, slope
    raise RuntimeError(f"no pole near {complex(start):.6g}: the last step was {float(abs(step)):.1e}")


@lru_cache(maxsize=64)
def _poles(x: float, boundary: Boundary, modes: int) -> tuple[tuple[Any, Any], ...]:
    """Pairs lam_p, D'(lam_p), in order."""
    value = _characteristic(x, boundary)
    found: list[tuple[Any, Any]] = []
    with mp.workdps(DIGITS):
        for p in range(1, modes + 1):
            # high modes have left the asymptotic range at small x, and go on smoothly
            lams = [lam for lam, _ in found[-3:]]
            start = _start(x, boundary, p) if p <= 4 else 3 * lams[2] - 3 * lams[1] + lams[0]
            found.append(_newton(value, start))
    lam = np.array([complex(pair[0]) for pair in found])
    gaps = np.abs(lam[:, None] - lam) + 1e9 * np.eye(modes)
    if gaps.min() < 1e-6:
        raise RuntimeError(f"modes {sorted(np.argwhere(gaps == gaps.min())[0] + 1)} met at one pole; ask for fewer")
    return tuple(found)


def poles(wavenumber: float, radius: float, boundary: Boundary, modes: int = 8) -> ComplexArray:
    """Regge poles lam_p = nu_p + 1/2, in order of decay: (modes,)."""
    positive(wavenumber=wavenumber, radius=radius)
    return np.array([complex(lam) for lam, _ in _poles(wavenumber * radius, boundary, modes)])


def _residue(x: float, boundary: Boundary, lam: Any, slope: Any) -> Any:
    """Residue of c = -(A J + beta J')/D; the numerator by the Wronskian J H' - J' H = 2i/(πx)."""
    alpha, beta = condition(boundary)
    h = mp.hankel1(lam, x)
    wronskian = 2j / (mp.pi * x)
    if beta == 0:
        # at a zero of H, H' = H_{lam-1}
        return -alpha * wronskian / mp.hankel1(lam - 1, x) / slope
    return beta * wronskian / h / slope


def _around(nu: Any, windings: int) -> Any:
    """-2i e^{iπ nu} Σ_{j=0}^{windings} e^{2πi nu j}, which is 1/sin(π nu) after all windings."""
    return -2j * mp.expjpi(nu) * mp.fsum(mp.expjpi(2 * nu * j) for j in range(windings + 1))


def _legendre(nu: Any, c: Any) -> Any:
    """P_nu(c), c > -1."""
    return mp.hyp2f1(-nu, nu + 1, 1, (1 - c) / 2)


def _legendre_slope(nu: Any, c: Any) -> Any:
    """dP_nu/dc, c > -1."""
    return nu * (nu + 1) / 2 * mp.hyp2f1(1 - nu, nu + 2, 2, (1 - c) / 2)


def _travelling(nu: Any, angle: Any, sign: int) -> Any:
    """E₊ or E₋, P_nu(cos angle) = E₊ + E₋, running as e^{±i lam angle}."""
    z = -sign * 1j * mp.expj(sign * angle) / (2 * mp.sin(angle))
    size = mp.gamma(nu + 1) / mp.gamma(nu + mp.mpf(3) / 2) / mp.sqrt(2 * mp.pi * mp.sin(angle))
    half = mp.mpf(1) / 2
    return size * mp.expj(sign * ((nu + half) * angle - mp.pi / 4)) * mp.hyp2f1(half, half, nu + 3 * half, z)


def _terms(x: float, boundary: Boundary, modes: int, windings: int) -> list[tuple[Any, Any]]:
    """Pairs nu_p and -π (2nu+1) r_p times the turns around the sphere."""
    if windings < 0:
        raise ValueError(f"windings is {windings}; 0 is the short ray and the long one")
    pairs = []
    for lam, slope in _poles(x, boundary, modes):
        nu = lam - mp.mpf(1) / 2
        pairs.append((nu, -2 * mp.pi * lam * _residue(x, boundary, lam, slope) * _around(nu, windings)))
    return pairs


def far_field(
    wavenumber: float, radius: float, theta: ArrayLike, boundary: Boundary, *, modes: int = 8, windings: int = 0
) -> ComplexArray:
    """Creeping part of the far field f: both rays at every angle, and their ring focus at θ = π.

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L.
    theta : (m,), rad
        From the forward direction, in (0, π]; at 0 the long ray has its own focus.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.
    modes : int
        Poles summed.
    windings : int
        Full turns after the first arrival that are kept.

    Returns
    -------
    (m,) complex, L
    """
    angles = _angles(theta)
    positive(wavenumber=wavenumber, radius=radius)
    with mp.workdps(DIGITS):
        terms = _terms(wavenumber * radius, boundary, modes, windings)
        sums = [mp.fsum(w * _legendre(nu, -mp.cos(angle)) for nu, w in terms) for angle in angles]
    return np.array([complex(value) for value in sums]) / (1j * wavenumber)


def isolated_rays(
    wavenumber: float, radius: float, theta: ArrayLike, boundary: Boundary, *, modes: int = 8, windings: int = 0
) -> tuple[ComplexArray, ComplexArray]:
    """Short ray, e^{i lam θ}, and long ray, e^{i lam (2π-θ)}, of `far_field`, 0 < θ < π: (m,) -> (m,), (m,)."""
    angles = _angles(theta)
    positive(wavenumber=wavenumber, radius=radius)
    with mp.workdps(DIGITS):
        terms = _terms(wavenumber * radius, boundary, modes, windings)
        both = [
            [mp.fsum(w * _travelling(nu, mp.pi - angle, sign) for nu, w in terms) for angle in angles]
            for sign in (-1, 1)
        ]
    short, long = (np.array([complex(v) for v in values]) / (1j * wavenumber) for values in both)
    return short, long


def pec_far_field(
    wavenumber: float, radius: float, theta: ArrayLike, *, modes: int = 8, windings: int = 0
) -> tuple[ComplexArray, ComplexArray]:
    """Creeping parts of f⊥ and f∥ of a conducting sphere, L, as in `sphere.pec_far_field`: (m,) -> (m,), (m,)."""
    angles = _angles(theta)
    positive(wavenumber=wavenumber, radius=radius)
    x = wavenumber * radius
    across, within = [], []
    with mp.workdps(DIGITS):
        # a and b are -c of their boundary conditions
        magnetic = [(nu, -w / (nu * (nu + 1))) for nu, w in _terms(x, "soft", modes, windings)]
        electric = [(nu, -w / (nu * (nu + 1))) for nu, w in _terms(x, -1j / x, modes, windings)]
        for angle in angles:
            c = mp.cos(angle)
            a_pi, a_tau = _vector_sums(electric, c)
            b_pi, b_tau = _vector_sums(magnetic, c)
            across.append(complex(a_pi + b_tau))
            within.append(complex(a_tau + b_pi))
    return 1j / wavenumber * np.array(across), 1j / wavenumber * np.array(within)


def _vector_sums(terms: list[tuple[Any, Any]], c: Any) -> tuple[Any, Any]:
    """Sums over the poles for π_n and tau_n, from P_n(c) -> P_nu(-c)."""
    slopes = [-w * _legendre_slope(nu, -c) for nu, w in terms]
    values = [w * nu * (nu + 1) * _legendre(nu, -c) for nu, w in terms]
    pi = mp.fsum(slopes)
    return pi, mp.fsum(values) - c * pi


def shadow_surface_field(
    wavenumber: float, radius: float, theta: ArrayLike, boundary: Boundary, *, modes: int = 30
) -> ComplexArray:
    """Total field in the shadow of the sphere, all windings: ∂u/∂n, 1/L, when soft, u otherwise.

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L.
    theta : (m,), rad
        cosθ = d.n, in [0, π/2): 0 is the far side. Mode p decays as e^{-Im lam_p (π/2 - θ)}.
    boundary : "soft", "hard" or complex
    modes : int

    Returns
    -------
    (m,) complex
    """
    angles = _angles(theta, least=0.0, below=np.pi / 2)
    positive(wavenumber=wavenumber, radius=radius)
    x = wavenumber * radius
    alpha, beta = condition(boundary)
    with mp.workdps(DIGITS):
        weights = []
        for lam, slope in _poles(x, boundary, modes):
            nu = lam - mp.mpf(1) / 2
            weights.append((nu, -2 * mp.pi * lam * mp.expjpi(-nu / 2) / (mp.sinpi(nu) * slope)))
        sums = [mp.fsum(w * _legendre(nu, mp.cos(angle)) for nu, w in weights) for angle in angles]
    series = 1j / x**2 * np.sqrt(2 * x / np.pi) * np.array([complex(value) for value in sums])
    return np.asarray(-alpha * wavenumber * series if beta == 0 else beta * series)


def _angles(theta: ArrayLike, least: float = 1e-9, below: float = np.pi + 1e-12) -> list[float]:
    """Angles as floats, checked."""
    angles = np.atleast_1d(np.asarray(theta, dtype=float))
    wrong = ~((angles >= least) & (angles < below))
    if wrong.any():
        example = float(angles[wrong][0])
        raise ValueError(f"{wrong.sum()} of {angles.size} angles are outside [{least:g}, {below:.6g}), as {example!r}")
    return [float(min(angle, np.pi)) for angle in angles]
