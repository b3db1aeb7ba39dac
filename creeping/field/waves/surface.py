"""The wave of each creeping ray on the body and off it, in the shadow: u, or du/dn where u = 0.

    u = e^{ik(d.x0 + s)} (ρ1/ρ2)^(1/6) |J|^(-1/2) e^{-iπN/2} g(ξ)          hard, impedance
    du/dn: the same with (k/m2) F(ξ)                                        soft

Of a point source at the distance R from x0, e^{ikR}/(4πR) is in place of e^{ik d.x0}, and modes have the factors of
`creeping.field.waves.shed_wave`.

Second order, as a factor of 1 + ( )/(m1 m2) of each mode or, at small ξ, under the integrals of g and F, r the mean of
both ends:

    soft          τ (1/10 + r/4)
    otherwise     τ (r/4 - 1/30) - (1/10 ± r/4 + (2/15) q τ) d/dq
    attachment    -(ρ1'/m1) [i τ²/12 + (i/6) q (1 + q d/dq)], in modes exp{-i a ρ1'/(12 m1) + q M0 (q2 - q)}

from the expansions of Hankel functions in the transition region [AS64, sec. 9.3] for the circular cylinder
and the sphere; the decay c and a are those of `creeping.field.boundary`; q is the geometric mean of both ends, q2
that of the point.

Also here: the wave of each creeping ray whose tangent passes through a point off the body, near it or far from it.

    u = D e^{ik(d.x0 + s + l)} / √(l |J + l J'|) e^{-iπN/2},   D = -√(m1 m2) √(2/k) P̂(ξ, Y),   Y = (m2 l/ρ2)²
    P̂ = 2i√π e^{iπ/4} Σ_p R_p A_p exp{...} H_p(Y),   H_p the height gain, its end factor to the power Y/(1 + Y)

Near the body the leading order is Fock's integral of the same modes, which holds down to ξ = 0. Farther off the modes
add up by themselves but for a last ξ, where UTD's form stands, with X = k l ξ²/(2 m1 m2),

    P̂ = P(ξ) + (e^{iπ/4}/(2√π ξ)) [1 - F_t(X)].

N counts zeros of J on (0, s) and of J + l' J' on (0, l).

Sources: [F46], [LK59], [P79], [KP74] for F_t; Derivations, F3, F8 and F9. The power Y/(1 + Y) was found by trial.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.airy import MODES, Modes
from creeping.field.arguments import fock_parameter, mean_scale, scales, transverse_ratios
from creeping.field.boundary import Boundary, BoundaryLike, modes_of, scalar_boundaries
from creeping.field.fock import (
    FAR_HEIGHT,
    height_gain,
    near_pekeris,
    pekeris_star,
    surface_function,
    surface_slope,
    transition_rate,
)
from creeping.field.waves.shed_wave import (
    SECOND_ORDER,
    amplitude_factor,
    end_residue,
    limited,
    mode_waves,
    nearness,
    of_alive,
    smoothstep,
)
from creeping.rays.quantities import RayPoints


def scalar_boundary(boundary: BoundaryLike) -> Boundary:
    """Boundary of the one scalar problem.

    Raises
    ------
    InvalidInputError
        If the boundary is unknown, or "pec", whose fields are vectors.
    """
    kinds = scalar_boundaries(boundary)
    if len(kinds) > 1:
        raise InvalidInputError(
            "the field of boundary 'pec' is no scalar: creeping.conductor_field gives its E and H, "
            "creeping.conductor_current n x H on the body"
        )
    return kinds[0]


def surface_waves(rays: RayPoints, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """Contribution of each ray at its point (...), u or du/dn in 1/L, 0 where the creeping ray has ended."""
    if not np.all(rays.alive):
        return of_alive(rays, lambda some: surface_waves(some, wavenumber, boundary, order))
    m2 = scales(rays, wavenumber)[1]
    wave = _first_order(rays, wavenumber, boundary)
    if order == 2:
        weight = _by_residues(rays, wavenumber, boundary)
        early, late = weight < 1, weight > 0
        change = _early_correction(rays[early], wavenumber, boundary)
        wave[early] += (1 - weight[early]) * limited(change, 0.5 * np.abs(wave[early]))
        part = rays[late]
        wave[late] += weight[late] * (_series(part, wavenumber, boundary, 2) - _series(part, wavenumber, boundary, 1))
    return np.asarray(
        wave * ray_factor(rays, wavenumber) * (wavenumber / m2 if boundary.kind.endswith("soft") else 1.0)
    )


def _first_order(rays: RayPoints, wavenumber: float, boundary: Boundary) -> ComplexArray:
    """g or F, of a point source with its factor exp{i τ² e/4} (...), e of `creeping.field.waves.shed_wave`.

    At small ξ that is one of t under the integral, of which the first power is taken; where it makes the series of
    residues converge that is summed instead.
    """
    m1, m2 = scales(rays, wavenumber)
    xi = fock_parameter(rays, wavenumber)
    q = boundary.q(np.sqrt(m1 * m2))
    wave = surface_function(xi, q)
    turn = nearness(rays, wavenumber) / 4
    if not np.any(turn):
        return wave
    weight = _by_residues(rays, wavenumber, boundary)
    late = (turn > 0) & (weight > 0)
    change = 1j * turn * surface_function(xi, q, 2) - 0.5 * turn**2 * surface_function(xi, q, 4)
    first = wave + limited(change, 0.5 * np.abs(wave))
    series = first.copy()
    if np.any(late):
        # where the series holds without a source, its own change: of an impedance g and its series differ
        some, deep = rays[late], smoothstep(xi[late], *SECOND_ORDER)
        of_plane = wave[late] - _series(some, wavenumber, boundary, 1, plane=True)
        series[late] = _series(some, wavenumber, boundary, 1) + np.where(deep > 0, deep * of_plane, 0.0)
    return np.asarray(np.where(turn > 0, weight * series + (1 - weight) * first, wave))


def _by_residues(rays: RayPoints, wavenumber: float, boundary: Boundary) -> FloatArray:
    """Share of the series of residues (...): its last term falls like exp{-(ξ |τ| + e |τ|²/4) sin 60°}."""
    xi, turn = fock_parameter(rays, wavenumber), nearness(rays, wavenumber) / 4
    if np.any(turn):
        xi = xi + turn * np.abs(modes_of(boundary, mean_scale(rays, wavenumber)).tau[..., -1])
    return smoothstep(xi, *SECOND_ORDER)


def ray_factor(rays: RayPoints, wavenumber: float) -> ComplexArray:
    """e^{ik(d.x0 + s)} (ρ1/ρ2)^(1/6) |J|^(-1/2) e^{-iπN/2} of rays that are alive (...), infinite on their caustics."""
    first, last = rays.curvature
    phase = wavenumber * rays.eikonal - 0.5 * np.pi * rays.caustics
    strength = np.where(rays.opening > 0, rays.opening / (4 * np.pi), 1.0)
    with np.errstate(divide="ignore", over="ignore"):
        factor = strength * np.cbrt(np.sqrt(last / first)) / np.sqrt(np.abs(rays.spreading)) * np.exp(1j * phase)
    return np.asarray(factor)


def _series(rays: RayPoints, wavenumber: float, boundary: Boundary, order: int, *, plane: bool = False) -> ComplexArray:
    """g or F by its residues (...), with ``plane`` as if there were no point source."""
    modes = modes_of(boundary, mean_scale(rays, wavenumber))
    waves = mode_waves(rays, modes, wavenumber, boundary, order, shed_share=0.0, plane=plane)
    terms = end_residue(rays, wavenumber, boundary, "surface") * waves
    if order == 2:
        if boundary.kind == "impedance":
            # the mode's height at the point, of the admittance there
            m1, m2 = scales(rays, wavenumber)
            shift = boundary.q(m2) - boundary.q(np.sqrt(m1 * m2))  # type: ignore[operator]
            terms = terms * np.exp(limited(np.asarray(modes.q_m0 * np.asarray(shift)[..., None]), 1.0))
        terms = terms * surface_amplitude(rays, modes, wavenumber, boundary)
    return np.asarray(np.sum(terms, axis=-1) * (2j * np.sqrt(np.pi)))


def _early_correction(rays: RayPoints, wavenumber: float, boundary: Boundary) -> ComplexArray:
    """What second order adds to g or F at small ξ: each power of τ is one of t under their integral (...)."""
    m1, m2 = scales(rays, wavenumber)
    q = boundary.q(np.sqrt(m1 * m2))
    xi = fock_parameter(rays, wavenumber)
    first, last = transverse_ratios(rays)
    r = 0.5 * (first + last)
    i = rays.integrals
    attachment = rays.radius_rate[0] / m1 / 12
    turn = np.cbrt(2 / wavenumber) * (i[..., 2] / 60 - 2 / 45 * i[..., 4]) - attachment
    bend = varying_curvature(rays)
    linear = (1 / 10 - bend / 60 if q is None else -1 / 30 + bend / 180) + r / 4 + rays.radius_rate[0] ** 2 / 36
    linear = linear / (m1 * m2) + nearness(rays, wavenumber) ** 2 / 4
    total = 1j * turn * surface_function(xi, q, 2) + linear * surface_function(xi, q, 1)
    if q is not None:
        slope = surface_slope(xi, q)
        total = total - (0.1 + 0.25 * boundary.sign * r - bend / 60) / (m1 * m2) * slope
        if np.ndim(q):
            total = total - 2j * attachment * q * (surface_function(xi, q) + q * slope)
            total = total - 2 / 15 * q / (m1 * m2) * surface_slope(xi, q, 1)
    return np.asarray(total)


def varying_curvature(rays: RayPoints) -> FloatArray:
    """ρρ'' - (2/3) ρ'², mean of both ends (...)."""
    pairs = zip(rays.radius_bend, rays.radius_rate, strict=True)
    return np.asarray(0.5 * sum(bend - 2 / 3 * rate**2 for bend, rate in pairs))


def surface_amplitude(rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary) -> ComplexArray:
    """Second-order amplitude of each mode (..., n), without unit."""
    m1, m2 = scales(rays, wavenumber)
    first, last = transverse_ratios(rays)
    r: FloatArray = 0.5 * (first + last)[..., None]
    tau, m0, q_m0 = modes.tau, modes.m0, modes.q_m0
    bend = varying_curvature(rays)[..., None]
    attached = rays.radius_rate[0][..., None] ** 2 / 36
    if boundary.kind.endswith("soft"):
        bracket = tau * (1 / 10 + r / 4 - bend / 60 + attached)
    else:
        # q² M0 = τ M0 - 1
        crossed = tau * (tau * m0 - 1) - tau * q_m0 * m0 + q_m0
        bracket = (
            tau * (r / 4 - 1 / 30 + bend / 180 + attached)
            + (0.1 + 0.25 * boundary.sign * r) * (m0**2 - q_m0)
            - 2 / 15 * crossed
        )
    return np.asarray(1 + limited(bracket / (m1 * m2)[..., None], 2.0))


SERIES = (0.5, 0.9)
"""ξ + √Y between which the second order of decay and amplitude comes in: it is what the height gain adds to ξ."""
ENDS = (0.4, 0.9)
"""ξ between which the factors of varying curvature come in."""
HARD_BY = 0.04
"""ξ below which, far from the body, even 45 modes do not add up; the shadow boundary is hard by."""


def shed_waves(rays: RayPoints, reach: FloatArray, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """Contribution of each ray (n,) to u at l = reach (n,), L, along its tangent; 0 where the ray has ended."""
    if not np.all(rays.alive):
        return of_alive(rays, lambda some: shed_waves(some, reach[rays.alive], wavenumber, boundary, order))
    m1, m2 = scales(rays, wavenumber)
    J, rate = rays.spreading, rays.spreading_rate
    tube = J + reach * rate
    zeros = rays.caustics + (J * tube < 0)
    phase = wavenumber * (rays.eikonal + reach) - 0.5 * np.pi * zeros
    with np.errstate(divide="ignore", over="ignore"):
        amplitude = -np.sqrt(2 * m1 * m2 / wavenumber / (reach * np.abs(tube)))
    height = height_above(rays, reach, wavenumber)
    wave = _uniform(rays, reach, height, wavenumber, boundary, order) * np.exp(1j * phase)
    return np.asarray(np.where(np.isinf(amplitude), np.inf, np.where(np.isinf(amplitude), 0.0, amplitude) * wave))


def height_above(rays: RayPoints, reach: FloatArray, wavenumber: float) -> FloatArray:
    """Y of rays (n,) at l = reach (n,), L, along their tangents."""
    return np.asarray((scales(rays, wavenumber)[1] * reach * rays.curvature[1]) ** 2)


def first_order_share(rays: RayPoints, height: FloatArray, wavenumber: float) -> FloatArray:
    """Share in which waves at heights Y are of leading order, though the second is asked for: (n,)."""
    return 1 - smoothstep(fock_parameter(rays, wavenumber) + np.sqrt(height), *SERIES)


def _uniform(
    rays: RayPoints, reach: FloatArray, height: FloatArray, wavenumber: float, boundary: Boundary, order: int
) -> ComplexArray:
    """P̂ (n,): near the body Fock's integral and what second order changes in the modes, farther the modes alone."""
    xi = fock_parameter(rays, wavenumber)
    m1, m2 = scales(rays, wavenumber)
    q = boundary.q(np.sqrt(m1 * m2))
    out = np.zeros(len(xi), dtype=complex)
    # beyond ξ = 3 the sum of modes stands alone
    low = (height <= FAR_HEIGHT) & (xi <= 3)
    tall = (height > FAR_HEIGHT) & (xi < HARD_BY)
    if np.any(low):
        out[low] = near_pekeris(xi[low], height[low], _part(q, low))
        if order == 2:
            out[low] += _second(rays[low], height[low], wavenumber, boundary)
    if np.any(tall):
        # P + (1 - F_t(X))/(2 √π ξ) of the edge without the poles of both: F_t(X)/ξ is finite on the shadow boundary
        per = np.sqrt(wavenumber * reach[tall] / (2 * m1[tall] * m2[tall]))
        edge = transition_rate(per * xi[tall]) * per / (2 * np.sqrt(np.pi))
        star = pekeris_star(xi[tall], _part(q, tall))
        out[tall] = (1 - smoothstep(xi[tall], 0, HARD_BY)) * np.exp(0.25j * np.pi) * (star - edge)
    series = (~low) & (xi > 0)
    if np.any(series):
        part = rays[series]
        weight = smoothstep(xi[series], *ENDS) if order == 2 else np.zeros(len(part.time))
        plain, whole = (
            _series_above(part, height[series, None], wavenumber, boundary, order, ends=ends, n=45)
            for ends in (False, True)
        )
        taken = np.where(height[series] > FAR_HEIGHT, smoothstep(xi[series], 0, HARD_BY), 1.0)
        out[series] += taken * ((1 - weight) * plain + weight * whole)
    return out


def _second(rays: RayPoints, height: FloatArray, wavenumber: float, boundary: Boundary) -> ComplexArray:
    """What second order changes in the sum of modes (n,): c and amplitudes by ξ + √Y, the ends by ξ."""
    xi = fock_parameter(rays, wavenumber)
    total = np.zeros(len(xi), dtype=complex)
    for by, range_, new, old in (
        (xi + np.sqrt(height), SERIES, (2, False), (1, False)),
        (xi, ENDS, (2, True), (2, False)),
    ):
        weight = smoothstep(by, *range_)
        some = weight > 0
        if np.any(some):
            part, tall = rays[some], height[some, None]
            pair = [_series_above(part, tall, wavenumber, boundary, order, ends=ends) for order, ends in (new, old)]
            total[some] += weight[some] * (pair[0] - pair[1])
    return total


def _part(q: ComplexArray | float | None, mask: BoolArray) -> ComplexArray | float | None:
    return q if q is None or np.ndim(q) == 0 else q[mask]  # type: ignore[index]


def _series_above(
    rays: RayPoints,
    height: FloatArray,
    wavenumber: float,
    boundary: Boundary,
    order: int,
    *,
    ends: bool,
    n: int = MODES,
) -> ComplexArray:
    """Sum of modes with height gain (n,); ``ends`` with the factors of varying curvature at both ends."""
    modes = modes_of(boundary, mean_scale(rays, wavenumber), n)
    share = height[..., 0] / (1 + height[..., 0])
    waves = mode_waves(rays, modes, wavenumber, boundary, order, shed_share=share if ends else None)
    terms = end_residue(rays, wavenumber, boundary, "residue", n) * waves
    if order == 2:
        # from the amplitude on the body to that far away
        far = np.sqrt(share)[..., None]
        amplitude = far * amplitude_factor(rays, modes, wavenumber, boundary, 0.25)
        terms = terms * (amplitude + (1 - far) * surface_amplitude(rays, modes, wavenumber, boundary))
    terms = terms * height_gain(modes.tau, height)
    return np.asarray(2j * np.sqrt(np.pi) * np.exp(0.25j * np.pi) * np.sum(terms, axis=-1))
