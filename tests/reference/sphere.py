"""A sphere of radius a in a plane wave: partial waves, scalar and electromagnetic.

With x = ka, alpha u + (beta/k) ∂u/∂n = 0 on the sphere, and c = d.r the cosine of the angle from the forward direction,

    u_s = Σ iⁿ (2n+1) cₙ hₙ(kr) Pₙ(c),    cₙ = -(alpha jₙ + beta jₙ')/Dₙ,    Dₙ = alpha hₙ + beta hₙ',    all at x
    f = (1/ik) Σ (2n+1) cₙ Pₙ(c)

and on the surface, by the Wronskian,

    u = beta (i/x²) Σ iⁿ (2n+1) Pₙ/Dₙ,   ∂u/∂n = -alpha k (i/x²) Σ iⁿ (2n+1) Pₙ/Dₙ

hₙ is climbed by its recurrence, which is stable for the growing solution; jₙ comes from scipy.

Perfect conductor [Bohren and Huffman, section 4.4, with e^{-iωt}]: psi = x jₙ, xi = x hₙ, a = psi'/xi', b = psi/xi,

    S1 = Σ (2n+1)/(n(n+1)) (a πₙ + b tauₙ),    S2 = Σ (2n+1)/(n(n+1)) (a tauₙ + b πₙ)
    f⊥ = (i/k) S1,    f∥ = (i/k) S2

With M and N the vector harmonics of hₙ and ρ = kr, the wave along z and E0 along x,

    E_s = Σ iⁿ (2n+1)/(n(n+1)) (i a N_e - b M_o),    H_s = Σ iⁿ (2n+1)/(n(n+1)) (i b N_o + a M_e)

E_s ~ f E_inc e^{ikR}/R for E across and in the plane of scattering, e∥ = e⊥ x d before, e⊥ x r after. Bohren and
Huffman's e∥ is the opposite on both sides, so the amplitudes are the same. In the specular region
f⊥ → -(a/2) e^{-2i ka sin(θ/2)} and f∥ → +(a/2) e^{-2i ka sin(θ/2)}, as R = -1 soft and +1 hard.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import spherical_jn, spherical_yn

from tests.reference.conditions import Boundary, ComplexArray, FloatArray, condition, positive, series_length


def _hankel(x: FloatArray, orders: int) -> Iterator[ComplexArray]:
    """hₙ(x) for n = 0, 1, ..., orders - 1, each (n,) as x."""
    before = np.exp(1j * x) / x
    here = -1j * before
    # h₋₁ = e^{ix}/x, h₀ = -i e^{ix}/x
    for n in range(orders):
        yield here
        before, here = here, (2 * n + 1) / x * here - before


def _legendre(c: FloatArray) -> Iterator[FloatArray]:
    """Pₙ(c) for n = 0, 1, ..., each shaped as c."""
    before, here = np.zeros_like(c), np.ones_like(c)
    n = 0
    while True:
        yield here
        before, here = here, ((2 * n + 1) * c * here - n * before) / (n + 1)
        n += 1


def _radial(x: float) -> tuple[FloatArray, FloatArray, FloatArray, ComplexArray, ComplexArray]:
    """Orders n and jₙ, jₙ', hₙ, hₙ' at x, each (N,)."""
    n = np.arange(series_length(x))
    j, dj = spherical_jn(n, x), spherical_jn(n, x, derivative=True)
    y, dy = spherical_yn(n, x), spherical_yn(n, x, derivative=True)
    return n.astype(float), j, dj, j + 1j * y, dj + 1j * dy


def _coefficients(x: float, boundary: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Coefficients cₙ and denominators Dₙ, each (N,)."""
    alpha, beta = condition(boundary)
    _, j, dj, h, dh = _radial(x)
    denominators = alpha * h + beta * dh
    return -(alpha * j + beta * dj) / denominators, denominators


def _cosines(cos_theta: ArrayLike) -> FloatArray:
    """Cosines, checked and held to [-1, 1]: (m,) -> (m,)."""
    c = np.asarray(cos_theta, dtype=float)
    worst = float(np.max(np.abs(c), initial=0.0))
    if not worst <= 1 + 1e-9:
        raise ValueError(f"cosines go to {worst!r}; they are cosines of angles: hold them to [-1, 1]")
    return np.asarray(np.clip(c, -1.0, 1.0), dtype=float)


def _angular_sum(coefficients: ComplexArray, c: FloatArray) -> ComplexArray:
    """Σ (2n+1) coefficientₙ Pₙ(c): (N,), (m,) -> (m,)."""
    total = np.zeros(c.shape, dtype=complex)
    for n, (value, p) in enumerate(zip(coefficients, _legendre(c), strict=False)):
        total += (2 * n + 1) * value * p
    return total


def far_field(wavenumber: float, radius: float, cos_theta: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Far field f, u_s ~ f e^{ikR}/R.

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L; measured to ka = 500.
    cos_theta : (m,)
        d.r, 1 forward.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.

    Returns
    -------
    (m,) complex, L
    """
    positive(wavenumber=wavenumber, radius=radius)
    coefficients, _ = _coefficients(wavenumber * radius, boundary)
    return _angular_sum(coefficients, _cosines(cos_theta)) / (1j * wavenumber)


def total_field(
    wavenumber: float, radius: float, points: ArrayLike, direction: ArrayLike, boundary: Boundary
) -> ComplexArray:
    """Total field u_inc + u_s on and outside the sphere about the origin.

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L.
    points : (n, 3), L
        |x| ≥ a up to rounding.
    direction : (3,)
        d, of unit length, where the wave goes.
    boundary : "soft", "hard" or complex

    Returns
    -------
    (n,) complex
    """
    positive(wavenumber=wavenumber, radius=radius)
    x, d = np.asarray(points, dtype=float), np.asarray(direction, dtype=float)
    r, along = np.linalg.norm(x, axis=-1), x @ d
    inside = r < radius * (1 - 1e-12)
    if inside.any():
        raise ValueError(
            f"{inside.sum()} of {r.size} points are inside the sphere (worst r = {r.min():.6g}, a = {radius:g}); "
            "move them out"
        )
    coefficients, _ = _coefficients(wavenumber * radius, boundary)
    scattered = np.zeros(r.shape, dtype=complex)
    waves = zip(coefficients, _hankel(wavenumber * r, len(coefficients)), _legendre(along / r), strict=False)
    for n, (value, h, p) in enumerate(waves):
        scattered += 1j ** (n % 4) * (2 * n + 1) * value * h * p
    return np.asarray(np.exp(1j * wavenumber * along) + scattered)


def surface_field(wavenumber: float, radius: float, cos_theta: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Total field u on the sphere at d.n = cos_theta: (m,) -> (m,); zero when soft."""
    return condition(boundary)[1] * _surface_sum(wavenumber, radius, cos_theta, boundary)


def surface_derivative(wavenumber: float, radius: float, cos_theta: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Outward normal derivative ∂u/∂n of the total field, 1/L, at d.n = cos_theta: (m,) -> (m,); zero when hard."""
    return -condition(boundary)[0] * wavenumber * _surface_sum(wavenumber, radius, cos_theta, boundary)


def _surface_sum(wavenumber: float, radius: float, cos_theta: ArrayLike, boundary: Boundary) -> ComplexArray:
    """(i/x²) Σ iⁿ (2n+1) Pₙ/Dₙ: (m,) -> (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x = wavenumber * radius
    _, denominators = _coefficients(x, boundary)
    turns = 1j ** (np.arange(len(denominators)) % 4)
    return 1j / x**2 * _angular_sum(turns / denominators, _cosines(cos_theta))


def source_on_sphere(
    wavenumber: float, radius: float, distance: float, cos_gamma: ArrayLike, boundary: Boundary
) -> tuple[ComplexArray, ComplexArray]:
    """Total u and ∂u/∂n, 1/L, on the sphere, of a point source e^{ikr}/(4πr): (m,) -> (m,), (m,).

    The source is at ``distance`` from the centre, and gamma the angle between it and the point:

        u = beta (i/x²) (ik/4π) Σ (2n+1) hₙ(k distance)/Dₙ Pₙ(cos gamma),   ∂u/∂n the same with -alpha k for beta
    """
    positive(wavenumber=wavenumber, radius=radius, distance=distance - radius)
    x, y = wavenumber * radius, wavenumber * distance
    alpha, beta = condition(boundary)
    c = _cosines(cos_gamma)
    total = np.zeros(c.shape, dtype=complex)
    # hₙ/h_(n-1) at x and at y: the functions themselves outgrow all numbers where the source is close
    near = far = -1j
    ratio = np.exp(1j * (y - x)) * x / y
    for n, p in enumerate(_legendre(c)):
        # hₙ' = h_(n-1) - (n+1)/x hₙ
        share = (2 * n + 1) * ratio / (alpha + beta * (1 / near - (n + 1) / x))
        total += share * p
        if n > x and abs(share) < 1e-17 * (1 + float(np.max(np.abs(total)))):
            break
        near, far = (2 * n + 1) / x - 1 / near, (2 * n + 1) / y - 1 / far
        ratio *= far / near
    total *= 1j / x**2 * 1j * wavenumber / (4 * np.pi)
    return beta * total, -alpha * wavenumber * total


def pec_amplitudes(wavenumber: float, radius: float, cos_theta: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Bohren and Huffman's S1 (E across the plane of scattering) and S2 (E in it): (m,) -> (m,), (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x, c = wavenumber * radius, _cosines(cos_theta)
    n, j, dj, h, dh = _radial(x)
    a, b = (j + x * dj) / (h + x * dh), j / h
    s1, s2 = np.zeros(c.shape, dtype=complex), np.zeros(c.shape, dtype=complex)
    before, pi = np.zeros_like(c), np.ones_like(c)
    for m, an, bn in zip(n[1:], a[1:], b[1:], strict=True):
        tau = m * c * pi - (m + 1) * before
        weight = (2 * m + 1) / (m * (m + 1))
        s1 += weight * (an * pi + bn * tau)
        s2 += weight * (an * tau + bn * pi)
        before, pi = pi, ((2 * m + 1) * c * pi - (m + 1) * before) / m
    return s1, s2


def pec_far_field(wavenumber: float, radius: float, cos_theta: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Far fields f⊥ and f∥ of a perfectly conducting sphere, L: (m,) -> (m,), (m,)."""
    s1, s2 = pec_amplitudes(wavenumber, radius, cos_theta)
    return 1j / wavenumber * s1, 1j / wavenumber * s2


def pec_surface_field(wavenumber: float, radius: float, cos_theta: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """Total H on a perfectly conducting sphere: (m,) -> (m,), (m,).

    With the wave along z, E0 along x and H0 = 1 along y, H_theta = sin(phi) times the first, H_phi = cos(phi) times the
    second, by the Wronskian psi xi' - psi' xi = i:

        Σ iⁿ (2n+1)/(n(n+1)) [(i/x) πₙ/xi' - tauₙ/(x xi)],   Σ iⁿ (2n+1)/(n(n+1)) [(i/x) tauₙ/xi' - πₙ/(x xi)]
    """
    positive(wavenumber=wavenumber, radius=radius)
    x, c = wavenumber * radius, _cosines(cos_theta)
    n, _, _, h, dh = _radial(x)
    first, second = np.zeros(c.shape, dtype=complex), np.zeros(c.shape, dtype=complex)
    before, pi = np.zeros_like(c), np.ones_like(c)
    for m in n[1:]:
        tau = m * c * pi - (m + 1) * before
        xi, slope = x * h[int(m)], h[int(m)] + x * dh[int(m)]
        weight = 1j ** (m % 4) * (2 * m + 1) / (m * (m + 1)) / x
        first += weight * (1j * pi / slope - tau / xi)
        second += weight * (1j * tau / slope - pi / xi)
        before, pi = pi, ((2 * m + 1) * c * pi - (m + 1) * before) / m
    return first, second


def pec_total_field(
    wavenumber: float, radius: float, points: ArrayLike, direction: ArrayLike, electric: ArrayLike
) -> tuple[ComplexArray, ComplexArray]:
    """Total E and H on and outside a perfectly conducting sphere about the origin: (n, 3), (n, 3).

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L.
    points : (n, 3), L
    direction, electric : (3,)
        d and E0, both of unit length; H is in units of that of the incident wave.
    """
    positive(wavenumber=wavenumber, radius=radius)
    x, d, e = (np.asarray(v, dtype=float) for v in (points, direction, electric))
    h = np.cross(d, e)
    r = np.linalg.norm(x, axis=-1)
    c, phi = np.clip(x @ d / r, -1, 1), np.arctan2(x @ h, x @ e)
    sine, cosine = np.sin(phi), np.cos(phi)
    order, j, dj, h_n, dh = _radial(wavenumber * radius)
    ka, rho = wavenumber * radius, wavenumber * r
    a, b = (j + ka * dj) / (h_n + ka * dh), j / h_n
    electric_parts, magnetic_parts = np.zeros((2, 3, len(x)), dtype=complex)
    before, pi, last = np.zeros_like(c), np.ones_like(c), None
    across = np.sqrt(1 - c**2)
    for m, z in zip(order, _hankel(rho, len(order)), strict=True):
        if m > 0:
            tau = m * c * pi - (m + 1) * before
            slope = last - m * z / rho  # (ρ z)'/ρ
            out = m * (m + 1) * across * pi * z / rho
            weight = 1j ** (m % 4) * (2 * m + 1) / (m * (m + 1))
            ia, ib = 1j * a[int(m)], 1j * b[int(m)]
            electric_parts += weight * np.stack(
                [
                    ia * cosine * out,
                    cosine * (ia * tau * slope + 1j * ib * pi * z),
                    -sine * (ia * pi * slope + 1j * ib * tau * z),
                ]
            )
            magnetic_parts += weight * np.stack(
                [
                    ib * sine * out,
                    sine * (ib * tau * slope + 1j * ia * pi * z),
                    cosine * (ib * pi * slope + 1j * ia * tau * z),
                ]
            )
            before, pi = pi, ((2 * m + 1) * c * pi - (m + 1) * before) / m
        last = z
    aside = cosine[:, None] * e + sine[:, None] * h
    frame = np.stack(
        [x / r[:, None], c[:, None] * aside - across[:, None] * d, -sine[:, None] * e + cosine[:, None] * h]
    )
    wave = np.exp(1j * wavenumber * (x @ d))[:, None]
    total = [np.einsum("in,inc->nc", parts, frame) for parts in (electric_parts, magnetic_parts)]
    return wave * e + total[0], wave * h + total[1]
