"""The wave that a creeping ray sheds: Pekeris function, mode sum of second order, and the passage between them.

    ξ = (k/2)^(1/3) ∫ κₙ^(2/3) ds,   m = (kρ/2)^(1/3),   D = -√(m1 m2) √(2/k) P
    P = 2i√π e^{iπ/4} Σ_p R_p A_p exp{i ξ τ_p + i (2/k)^(1/3) ∫ c_p κₙ^(4/3) ds}

At small ξ the corrected series diverges. There each power of τ is read as one of t under the integral of P, where it is
a derivative of P, and M0 = dτ/dq as a change of q; both forms are the same series. For an impedance q varies along the
ray: τ_p is taken at the mean of q weighted by κₙ^(2/3), so that its first-order variation is exact, and R_p at the
geometric mean of both ends.

Also here: the wave that rays shed in both orders at once: what the far field asks of each, at every frequency and
boundary.

Beyond the passage to the series of `creeping.field.waves.shed_wave` a compiled sum over modes serves, beyond SERIES
alone; before, and for modes that differ from ray to ray or a point source, that module itself.

Also here: what the creeping wave of a point source has more than that of a plane wave.

A mode of angular momentum k ρ1 + m1 τ' takes of the source what the Hankel function of its distance has there. With R
the distance from the source to the attachment point and e = ρ1/(m1 R), each mode is multiplied by

    exp{i τ'² e/4 + i τ³ e³/24} (1 + τ e²/4),   τ' = τ + c/m1²

the first factor of order 1/m1, the others of second order and more; c is the decay of `creeping.field.boundary`.
What is left out is of the size τ⁴ e⁵/64 and (τ e²/4)², and where curvature varies at the line τ³ e ρ1'/m1.

Sources: [AS64, sec. 9.3]; Derivations, F4 to F7 and R19.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.airy import MODES, Modes
from creeping.field.arguments import fock_parameter, mean_scale, scales, transverse_ratios
from creeping.field.boundary import BETA, Boundary, decay_slopes, decay_terms, modes_of
from creeping.field.fock import SERIES, pekeris_slope, pekeris_star, pole
from creeping.geometry.surface import memo
from creeping.kernels.threads import in_slices
from creeping.rays.quantities import RayPoints

SECOND_ORDER = (0.5, 0.9)
"""ξ between which the series of second order takes over."""


def smoothstep(x: FloatArray, start: float, end: float) -> FloatArray:
    """0 below start, 1 above end, cubic between: (...) -> (...), all of one unit.

    Examples
    --------
    >>> smoothstep(np.array([0.0, 0.5, 2.0]), 0.0, 1.0)
    array([0. , 0.5, 1. ])
    """
    t = np.clip((x - start) / (end - start), 0.0, 1.0)
    return np.asarray(t * t * (3 - 2 * t))


def limited(change: ComplexArray, bound: ComplexArray | FloatArray | float) -> ComplexArray:
    """A correction (...) limited to a bound in magnitude; below a third of it, changed by at most 1 %."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(np.abs(change) / np.abs(bound), nan=0.0, posinf=1e30)
    return np.asarray(change / np.sqrt(np.sqrt(1 + ratio**4)))


def mode_waves(
    rays: RayPoints,
    modes: Modes,
    wavenumber: float,
    boundary: Boundary,
    order: int,
    *,
    shed_share: FloatArray | float | None = 1.0,
    plane: bool = False,
) -> ComplexArray:
    """exp{i ξ τ} of each mode, at second order with the decay c and the factors A of both ends: (..., n).

    ``plane`` leaves out what a point source adds. ``shed_share`` (...) is the power of the factor of shedding: 0 on
    the body, 1 far away; None leaves both ends out. The correction to the exponent is held below half of it:
    beyond, as before a ray detaches, the expansion has broken down.
    """
    leading = fock_parameter(rays, wavenumber)[..., None] * modes.tau

    def source(order: int) -> ComplexArray | float:
        return 0.0 if plane else of_source(rays, modes, wavenumber, boundary, order)

    if order == 1:
        return np.asarray(np.exp(1j * (leading + source(1))))
    plain, across, varying = decay_terms(modes, boundary.sign)
    i = rays.integrals[..., None]
    change = np.cbrt(2 / wavenumber) * (plain * i[..., 2, :] + across * i[..., 3, :] + varying * i[..., 4, :])
    if shed_share is not None:
        (rate1, rate2), (m1, m2) = rays.radius_rate, scales(rays, wavenumber)
        ends = ((shed_share * rate2 / m2 - rate1 / m1) / 12)[..., None]
        change = change + (modes.tau**2 + 2 * modes.q_m0 * (modes.tau - modes.q_m0)) * ends
    change = limited(change, 0.5 * leading)
    return np.asarray(np.exp(1j * (leading + change + source(2))))


def amplitude_factor(
    rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary, transverse_weight: float
) -> ComplexArray:
    """1 + (1/2) Σ [∂c/∂τ + ω r τ + β τ ρρ'']/m² over both ends: (..., n)."""
    plain, across = decay_slopes(modes, boundary.sign)
    change = np.zeros((*rays.time.shape, 1), dtype=complex)
    for m, r, bend in _ends(rays, wavenumber):
        by_curvature = transverse_weight * r + BETA * bend
        change = change + 0.5 * (
            plain / m**2 + across * r / m**2 + modes.tau * by_curvature / m**2 - modes.m0**2 * bend / (60 * m**2)
        )
    return np.asarray(1 + limited(change, 2.0))


def _ends(rays: RayPoints, wavenumber: float) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """m, r and ρρ'' at both ends, each (..., 1); m is inf and the rest 0 where κₙ <= 0."""
    found = []
    for k in range(2):
        values = (transverse_ratios(rays)[k], rays.radius_bend[k])
        m = scales(rays, wavenumber)[k][..., None]
        r, bend = (np.where(np.isfinite(m), np.nan_to_num(v)[..., None], 0.0) for v in values)
        found.append((m, r, bend))
    return found


def mode_sum(
    rays: RayPoints, wavenumber: float, boundary: Boundary, order: int, transverse_weight: float
) -> ComplexArray:
    """P by its residue series (...)."""
    modes = modes_of(boundary, mean_scale(rays, wavenumber))
    residue = end_residue(rays, wavenumber, boundary, "residue")
    # named before they are multiplied: numpy works in place in a large temporary, and swaps the factors if it is the
    # second, which changes the last digit of a complex product; a ray's field would depend on how many others there are
    waves = mode_waves(rays, modes, wavenumber, boundary, order)
    terms = residue * waves
    if order == 2:
        amplitude = amplitude_factor(rays, modes, wavenumber, boundary, transverse_weight)
        terms = terms * amplitude
    total = np.sum(terms, axis=-1)
    return np.asarray(total * (2j * np.sqrt(np.pi) * np.exp(0.25j * np.pi)))


def end_residue(rays: RayPoints, wavenumber: float, boundary: Boundary, name: str, n: int = MODES) -> ComplexArray:
    """Constant of the modes, at the geometric mean of both ends' q where it varies: (n,) or (..., n)."""
    m1, m2 = scales(rays, wavenumber)
    return np.asarray(getattr(modes_of(boundary, np.sqrt(m1 * m2), n), name))


def shed_wave(
    rays: RayPoints,
    wavenumber: float,
    boundary: Boundary,
    order: int,
    *,
    transverse_weight: float = 0.25,
    pole_share: FloatArray | float = 1.0,
) -> ComplexArray:
    """e^{iπ/4} [p* - share/(2√π ξ)] of each ray (...): P where the share is 1, 0 where the creeping ray has ended.

    Parameters
    ----------
    transverse_weight : float
        ω: 1/4 for one ray, 1/2 under an integral over the shadow line.
    pole_share : (...) or float
        Where the pole is taken care of otherwise, second order leaves it alone too.
    """
    share = np.broadcast_to(np.asarray(pole_share, dtype=float), rays.time.shape)
    if not np.all(rays.alive):
        more = partial(shed_wave, transverse_weight=transverse_weight, pole_share=share[rays.alive])
        return of_alive(rays, lambda some: more(some, wavenumber, boundary, order))
    m1, m2 = scales(rays, wavenumber)
    xi = fock_parameter(rays, wavenumber)
    q = boundary.q(np.sqrt(m1 * m2))
    total = pekeris_star(xi, q) - shared_pole(xi, share)
    if order == 2:
        weight = smoothstep(xi, *SECOND_ORDER)
        early, late = weight < 1, weight > 0
        if np.any(early):
            some = rays[early]
            change = early_correction(some, wavenumber, boundary, transverse_weight)
            q_early = q if q is None or np.ndim(q) == 0 else q[early]  # type: ignore[index]
            total[early] += (1 - weight[early]) * limited(change, 0.5 * np.abs(pekeris_star(xi[early], q_early)))
        if np.any(late):
            some = rays[late]
            second = mode_sum(some, wavenumber, boundary, 2, transverse_weight)
            change = (second - mode_sum(some, wavenumber, boundary, 1, transverse_weight)) * np.exp(-0.25j * np.pi)
            squared, linear = pole_operator(some, wavenumber, transverse_weight)
            change += (1 - share[late]) * (pole(xi[late], 2) * squared + linear * pole(xi[late], 1))
            total[late] += weight[late] * change
    return np.asarray(np.exp(0.25j * np.pi) * total)


def of_alive(rays: RayPoints, wave: Callable[[RayPoints], ComplexArray]) -> ComplexArray:
    """A wave of rays (...), 0 where the creeping ray has ended."""
    out = np.zeros(rays.time.shape, dtype=complex)
    out[rays.alive] = wave(rays[rays.alive])
    return out


def shared_pole(xi: FloatArray, share: FloatArray, power: int = 0) -> ComplexArray:
    """Share of the pole, 0 where the share or ξ is: a ray of no length sheds nothing (...)."""
    some = (share > 0) & (xi != 0)
    out = np.zeros(xi.shape, dtype=complex)
    out[some] = share[some] * pole(xi[some], power)
    return out


def pole_operator(rays: RayPoints, wavenumber: float, transverse_weight: float) -> tuple[ComplexArray, FloatArray]:
    """Factors of τ² and τ in the second order of a mode: from c, the ends, and the amplitude (...)."""
    i = rays.integrals
    turn = np.cbrt(2 / wavenumber) * (i[..., 2] / 60 - 2 / 45 * i[..., 4])
    linear = np.zeros(rays.time.shape)
    rates = rays.radius_rate
    for sign, rate, (m, r, bend) in zip((-1, 1), rates, _ends(rays, wavenumber), strict=True):
        with np.errstate(invalid="ignore"):
            turn = turn + sign * np.nan_to_num(rate / m[..., 0]) / 12
        linear = linear + 0.5 * ((1 / 30 + transverse_weight * r + BETA * bend) / m**2)[..., 0]
    return 1j * turn, linear


def early_correction(rays: RayPoints, wavenumber: float, boundary: Boundary, transverse_weight: float) -> ComplexArray:
    """What second order adds to p* at small ξ, where its series diverges (...); a pole is left alone.

    Under the integral of p* each power of τ is one of t, and M0 is dτ/dq:
    c = τ²/60 - (2/45) B τ² - (1/10 ± r/4 - B/60) M0 - (2/15) q τ M0, B = ρρ'' - (2/3) ρ'². In amplitudes B is ρρ''.
    """
    xi = fock_parameter(rays, wavenumber)
    m1, m2 = scales(rays, wavenumber)
    q = boundary.q(np.sqrt(m1 * m2))
    squared, linear = pole_operator(rays, wavenumber, transverse_weight)
    total = pekeris_star(xi, q, 2) * squared + linear * pekeris_star(xi, q, 1)
    if q is not None:
        shift = sum(
            ((bend / 60 - 0.1 - 0.25 * boundary.sign * r) / (2 * m**2))[..., 0]
            for m, r, bend in _ends(rays, wavenumber)
        )
        total = total + shift * pekeris_slope(xi, q)
        if np.ndim(q):
            total = total - 2 / 15 * q / (m1 * m2) * pekeris_slope(xi, q, 1)
    return np.asarray(total)


def shed_orders(
    rays: RayPoints, wavenumber: float, boundary: Boundary, *, transverse_weight: float = 0.25
) -> tuple[ComplexArray, ComplexArray]:
    """`shed_wave` of order 1 and of order 2 of rays (n,)."""

    def plain(some: RayPoints, order: int) -> ComplexArray:
        return shed_wave(some, wavenumber, boundary, order, transverse_weight=transverse_weight)

    if boundary.kind == "impedance" or not rays.time.size or np.any(rays.opening > 0):
        return plain(rays, 1), plain(rays, 2)
    xi = fock_parameter(rays, wavenumber)
    first, second = _by_modes(rays, wavenumber, boundary, transverse_weight)
    early = rays.alive & (xi < SECOND_ORDER[1])
    between = np.flatnonzero(rays.alive & ~early & (xi <= SERIES))
    if len(between):
        # what the second order adds, to the series in place of the sum
        change = second[between] - first[between]
        first[between] = pekeris_star(xi[between], boundary.q(xi[between])) - pole(xi[between])
        second[between] = first[between] + change
    turn = np.exp(0.25j * np.pi)
    first, second = (np.where(rays.alive, turn * one, 0.0) for one in (first, second))
    if np.any(early):
        some = rays[early]
        first[early], second[early] = plain(some, 1), plain(some, 2)
    return first, second


def _by_modes(
    rays: RayPoints, wavenumber: float, boundary: Boundary, transverse_weight: float
) -> tuple[ComplexArray, ComplexArray]:
    """Sums over modes of both orders (n,), without e^{iπ/4}."""
    from creeping.field.kernels.ray_profile import mode_orders
    from creeping.kernels.block import BLOCK

    numbers, modes = _numbers_of(rays), _constants_of(boundary)
    out = np.empty((4, numbers.shape[1]))

    def work(part: slice) -> None:
        mode_orders(numbers, modes, wavenumber, transverse_weight, BETA, part.start, part.stop, out)

    in_slices(work, numbers.shape[1] // BLOCK, multiple=1)
    out = out[:, : len(rays.time)]
    return out[0] + 1j * out[1], out[2] + 1j * out[3]


def _numbers_of(rays: RayPoints) -> FloatArray:
    """What the sum takes of rays, whatever the frequency and boundary: (lanes, n), whole blocks, kept with the rays."""
    from creeping.kernels.block import BLOCK

    def make() -> FloatArray:
        n = len(rays.time)
        curved = [kappa > 0 for kappa in rays.curvature]
        ends = (
            [np.cbrt(2 * np.maximum(kappa, 0.0)) for kappa in rays.curvature],
            rays.radius_rate,
            [np.where(c, np.nan_to_num(r), 0.0) for c, r in zip(curved, transverse_ratios(rays), strict=True)],
            [np.where(c, np.nan_to_num(b), 0.0) for c, b in zip(curved, rays.radius_bend, strict=True)],
        )
        # in the order of the lanes: what is of both ends stands side by side
        rows = np.stack([*rays.integrals[:, 1:].T, *(end for pair in ends for end in pair)])
        return np.pad(rows, ((0, 0), (0, -n % BLOCK)))

    return memo(rays, "numbers of the sum over modes", make)


def _constants_of(boundary: Boundary) -> FloatArray:
    """What the sum takes of modes that are the same on all rays: (modes, constants, 2)."""
    modes = modes_of(boundary, np.ones(1))
    plain, across, varying = decay_terms(modes, boundary.sign)
    slope, slope_across = decay_slopes(modes, boundary.sign)
    ends = modes.tau**2 + 2 * modes.q_m0 * (modes.tau - modes.q_m0)
    # in the order of the kernel's constants
    each = (modes.tau, modes.residue, plain, across, varying, ends, slope, slope_across, modes.m0**2 / 60)
    constants = np.stack([np.broadcast_to(one, modes.tau.shape) for one in each], axis=1)
    return np.ascontiguousarray(np.stack([constants.real, constants.imag], axis=-1))


def nearness(rays: RayPoints, wavenumber: float) -> FloatArray:
    """e = ρ1/(m1 R) (...), without unit; 0 of a plane wave."""
    with np.errstate(divide="ignore", invalid="ignore"):
        e = rays.opening / (rays.curvature[0] * scales(rays, wavenumber)[0])
    return np.asarray(np.where(rays.opening > 0, e, 0.0))


def of_source(rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray | float:
    """What the exponents of modes have of a point source, (..., n); 0 of a plane wave.

    It is not limited: Im τ² > 0, so that it makes the series converge.
    """
    if not np.any(rays.opening > 0):
        return 0.0
    e, tau = nearness(rays, wavenumber)[..., None], modes.tau
    if order == 1:
        return np.asarray(tau**2 * e / 4)
    plain, across, varying = decay_terms(modes, boundary.sign)
    rate, bend = rays.radius_rate[0], rays.radius_bend[0]
    c = plain + across * transverse_ratios(rays)[0][..., None] + varying * (bend - 2 / 3 * rate**2)[..., None]
    shifted = tau + c / scales(rays, wavenumber)[0][..., None] ** 2
    return np.asarray(shifted**2 * e / 4 + tau**3 * e**3 / 24 - 1j * np.log1p(tau * e**2 / 4))


def left_out(rays: RayPoints, wavenumber: float, boundary: Boundary) -> FloatArray:
    """Share of a wave (...) that its source has beyond these factors: by the first mode, and more next to the line.

    How much more, 2, is from spheres, the weight 1/16 of varying curvature from an ellipsoid.
    """
    if not np.any(rays.opening > 0):
        return np.zeros(rays.time.shape)
    e = nearness(rays, wavenumber)
    first = np.abs(modes_of(boundary, mean_scale(rays, wavenumber)).tau[..., 0])
    tau = first + 2 * np.exp(-0.5 * fock_parameter(rays, wavenumber))
    varying = first**3 / 16 * e * np.abs(rays.radius_rate[0]) / scales(rays, wavenumber)[0]
    return np.asarray(np.where(e > 0, tau**4 * e**5 / 64 + (tau * e**2 / 4) ** 2 + varying, 0.0))
