"""The wave of each creeping ray whose tangent passes through a point off the body, near it or far from it.

    u = D e^{ik(d.x0 + s + l)} / √(l |J + l J'|) e^{-iπN/2},   D = -√(m1 m2) √(2/k) P̂(ξ, Y),   Y = (m2 l/ρ2)²
    P̂ = 2i√π e^{iπ/4} Σ_p R_p A_p exp{...} H_p(Y),   H_p the height gain, its end factor to the power Y/(1 + Y)

Near the body the leading order is Fock's integral of the same modes, which holds down to ξ = 0. Farther off the modes
add up by themselves but for a last ξ, where UTD's form stands, with X = k l ξ²/(2 m1 m2),

    P̂ = P(ξ) + (e^{iπ/4}/(2√π ξ)) [1 - F_t(X)].

N counts zeros of J on (0, s) and of J + l' J' on (0, l).

Sources: [LK59], [P79], [KP74] for F_t; Derivations, F3 and F8. The power Y/(1 + Y) was found by trial.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.arguments import fock_parameter, mean_scale, scales
from creeping.field.boundary import Boundary
from creeping.field.creeping_modes import modes_of
from creeping.field.special.airy import MODES
from creeping.field.special.fock import FAR_HEIGHT, height_gain, near_pekeris, pekeris_star, transition_rate
from creeping.field.waves.shed_wave import amplitude_factor, end_residue, mode_waves, smoothstep
from creeping.field.waves.surface import surface_amplitude
from creeping.rays.quantities import RayPoints

SERIES = (0.5, 0.9)
"""ξ + √Y between which the second order of decay and amplitude comes in: it is what the height gain adds to ξ."""
ENDS = (0.4, 0.9)
"""ξ between which the factors of varying curvature come in."""
DEEP = 3.0
"""ξ beyond which the sum of modes stands alone."""
HARD_BY = 0.04
"""ξ below which, far from the body, even MANY modes do not add up; the shadow boundary is hard by."""
MANY = 45


def shed_waves(rays: RayPoints, reach: FloatArray, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """Contribution of each ray (n,) to u at l = reach (n,), L, along its tangent; 0 where the ray has ended."""
    if not np.all(rays.alive):
        out = np.zeros(rays.time.shape, dtype=complex)
        out[rays.alive] = shed_waves(rays[rays.alive], reach[rays.alive], wavenumber, boundary, order)
        return out
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
    low = (height <= FAR_HEIGHT) & (xi <= DEEP)
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
            _series(part, height[series, None], wavenumber, boundary, order, ends=ends, n=MANY)
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
            pair = [_series(part, tall, wavenumber, boundary, order, ends=ends) for order, ends in (new, old)]
            total[some] += weight[some] * (pair[0] - pair[1])
    return total


def _part(q: ComplexArray | float | None, mask: BoolArray) -> ComplexArray | float | None:
    return q if q is None or np.ndim(q) == 0 else q[mask]  # type: ignore[index]


def _series(
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
