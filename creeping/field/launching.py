"""The wave that a creeping ray sheds: Pekeris function, mode sum of second order, and the passage between them.

    ξ = (k/2)^(1/3) ∫ κₙ^(2/3) ds,   m = (kρ/2)^(1/3),   D = -√(m1 m2) √(2/k) P
    P = 2i√π e^{iπ/4} Σ_p R_p A_p exp{i ξ τ_p + i (2/k)^(1/3) ∫ c_p κₙ^(4/3) ds}

The corrected series of second order diverges at small ξ; there P(ξ; q_eff) of first order stands, with q_eff = -r/(4m²)
for the hard boundary's transverse curvature. For an impedance q varies along the ray: τ_p is taken at the mean of q
weighted by κₙ^(2/3), so that its first-order variation is exact, and R_p at both ends.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.airy import Modes
from creeping.field.coefficients import (
    BETA,
    Boundary,
    decay_slopes,
    decay_terms,
    fock_scale,
    modes_of,
)
from creeping.field.fock import pekeris, pekeris_slope, pekeris_star
from creeping.rays.ray_points import RayPoints

SECOND_ORDER = (0.5, 0.9)
"""ξ between which the series of second order takes over."""


def smoothstep(x: FloatArray, start: float, end: float) -> FloatArray:
    """0 below start, 1 above end, cubic between."""
    t = np.clip((x - start) / (end - start), 0.0, 1.0)
    return np.asarray(t * t * (3 - 2 * t))


def fock_parameter(rays: RayPoints, wavenumber: float) -> FloatArray:
    """ξ (...)."""
    return np.asarray(np.cbrt(wavenumber / 2) * rays.integrals[..., 1])


def scales(rays: RayPoints, wavenumber: float) -> tuple[FloatArray, FloatArray]:
    """m at attachment and launch (...)."""
    first, last = rays.curvature
    return fock_scale(wavenumber, first), fock_scale(wavenumber, last)


def mean_scale(rays: RayPoints, wavenumber: float) -> FloatArray:
    """Mean of m along the ray, weighted by κₙ^(2/3) (...); m at the launch point where the ray has no length."""
    some = rays.integrals[..., 1] > 0
    mean = np.divide(rays.integrals[..., 0], rays.integrals[..., 1], out=np.zeros(some.shape), where=some)
    return np.asarray(np.where(some, np.cbrt(wavenumber / 2) * mean, scales(rays, wavenumber)[0]))


def mode_waves(rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """exp{i ξ τ + i ∫ c/(mρ) ds}, without c at first order: (..., n)."""
    exponent = fock_parameter(rays, wavenumber)[..., None] * modes.tau
    if order == 2:
        plain, across, varying = decay_terms(modes, boundary.sign)
        i = rays.integrals[..., None]
        exponent = exponent + np.cbrt(2 / wavenumber) * (
            plain * i[..., 2, :] + across * i[..., 3, :] + varying * i[..., 4, :]
        )
    return np.asarray(np.exp(1j * exponent))


def end_factor(rays: RayPoints, modes: Modes, wavenumber: float, launch_share: FloatArray | float = 1.0) -> ComplexArray:
    """A = exp{-i τ² ρ1'/(12 m1)} exp{+i τ² ρ2'/(12 m2)}: (..., n).

    ``launch_share`` (...) is the power of the second factor: 0 on the body, 1 far away.
    """
    m1, m2 = scales(rays, wavenumber)
    rate1, rate2 = rays.radius_rate
    with np.errstate(invalid="ignore"):
        turn = np.nan_to_num(-rate1 / m1 + launch_share * rate2 / m2)
    return np.asarray(np.exp(1j * modes.tau**2 * (turn / 12)[..., None]))


def amplitude_factor(
    rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary, transverse_weight: float
) -> ComplexArray:
    """1 + (1/2) Σ [∂c/∂τ + ω r τ + β τ ρρ'']/m² over both ends: (..., n)."""
    plain, across = decay_slopes(modes, boundary.sign)
    total = np.ones((*rays.time.shape, 1), dtype=complex)
    for m, r, bend in zip(scales(rays, wavenumber), transverse_ratios(rays), rays.radius_bend, strict=True):
        with np.errstate(invalid="ignore", divide="ignore"):
            weights = [np.nan_to_num(v / m**2)[..., None] for v in (np.ones_like(m), r, bend)]
        total = total + 0.5 * (
            (plain * weights[0] + across * weights[1])
            + modes.tau * (transverse_weight * weights[1] + BETA * weights[2])
        )
    return total


def transverse_ratios(rays: RayPoints) -> tuple[FloatArray, FloatArray]:
    """R = ρ κ_t at attachment and launch (...)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [t / c for t, c in zip(rays.transverse, rays.curvature, strict=True)]
    return np.nan_to_num(ratios[0]), np.nan_to_num(ratios[1])


def effective_q(rays: RayPoints, wavenumber: float, boundary: Boundary) -> FloatArray:
    """q_eff = -r/(4m²), mean of both ends, sign turned for the electric hard boundary (...)."""
    total = np.zeros(rays.time.shape)
    for m, r in zip(scales(rays, wavenumber), transverse_ratios(rays), strict=True):
        with np.errstate(divide="ignore", invalid="ignore"):
            total = total - 0.125 * boundary.sign * np.nan_to_num(r / m**2)
    return total


def mode_sum(
    rays: RayPoints, wavenumber: float, boundary: Boundary, order: int, transverse_weight: float
) -> ComplexArray:
    """P by its residue series (...)."""
    modes = modes_of(boundary, mean_scale(rays, wavenumber))
    residue = end_residue(rays, wavenumber, boundary, "residue")
    terms = residue * mode_waves(rays, modes, wavenumber, boundary, order)
    if order == 2:
        terms = terms * end_factor(rays, modes, wavenumber)
        terms = terms * amplitude_factor(rays, modes, wavenumber, boundary, transverse_weight)
    return np.asarray(2j * np.sqrt(np.pi) * np.exp(0.25j * np.pi) * np.sum(terms, axis=-1))


def end_residue(rays: RayPoints, wavenumber: float, boundary: Boundary, name: str) -> ComplexArray:
    """Constant of the modes: of the boundary, or the geometric mean of both ends' where q varies: (n,) or (..., n)."""
    m1, m2 = scales(rays, wavenumber)
    if boundary.kind != "impedance":
        return np.asarray(getattr(modes_of(boundary, m1), name))
    return np.asarray(getattr(modes_of(boundary, np.sqrt(m1 * m2)), name))


def shed_wave(
    rays: RayPoints,
    wavenumber: float,
    boundary: Boundary,
    order: int,
    *,
    transverse_weight: float = 0.25,
    star: bool = False,
) -> ComplexArray:
    """P of each ray, or e^{iπ/4} p* without its pole (...).

    At second order the correction to P is the same in both; it vanishes with ξ.
    """
    m1, m2 = scales(rays, wavenumber)
    xi = fock_parameter(rays, wavenumber)
    q = boundary.q(np.sqrt(m1 * m2))
    with np.errstate(invalid="ignore"):
        total = np.exp(0.25j * np.pi) * pekeris_star(xi, q) if star else pekeris(xi, q)
    if order == 1:
        return total
    weight = smoothstep(xi, *SECOND_ORDER)
    some = weight > 0
    part = rays[some]
    total[some] += weight[some] * (
        mode_sum(part, wavenumber, boundary, 2, transverse_weight)
        - mode_sum(part, wavenumber, boundary, 1, transverse_weight)
    )
    early = weight < 1
    if boundary.kind != "soft" and np.any(early):
        slope = pekeris_slope(xi[early], q if np.ndim(q) == 0 else q[early])  # type: ignore[arg-type,index]
        correction = effective_q(rays[early], wavenumber, boundary) * slope * (1 - weight[early])
        total[early] += np.exp(0.25j * np.pi) * correction
    return total
