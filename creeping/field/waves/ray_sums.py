"""Sums of creeping rays' waves at points, with their error and with what is the matter.

With T = J + l J' the width of a ray's tube, T' its slope across the rays, and J' along them, L the length of a ray,

    error^2 = (sum |ui| e_i)^2 + sum_i |ui|^2 f_i + (sum_pairs P (|ui| + |uj|)/(k |Li - Lj|))^2 + (sum |ui| g_i)^2
    f = (5/8k) T'^2/T^4/(3 |J'/T| + 1/(s + l)),   g = e^(-a (xi_end - xi))
    e = [(0.3/m^2)^2 + (B V)^2 + (E S/m^2)^2]^(1/2) off the body
    e = [(C |u2/u1 - 1|^2)^2 + xi^2 (B V)^2 + xi^2 (D r^2)^2]^(1/2) on it
    V = (|rho rho''| + rho'^2)/m^2,   r = rho kappa_t/m^2;   1/m^2, V and r means of both ends;
    S the share in which the wave is of leading order, close above the ground behind the shadow line;
    of a conductor r/m^2 for r^2, and of either polarisation 0.8 of what grows with xi of the other one's |u| more

f is the next term of the transport equation, at a fold the 5/(72 zeta) of Airy's function; near caustics the error
is of its root's size. Two waves of which one has touched a caustic that the other has not are the leading terms of one
Airy or Bessel function, whose next terms fall with their difference in phase. A ray beyond the end of the fan is weaker
than one found by the decay a of the first mode, g.

Also here: what the polarisations of a conductor's creeping rays do to each other.

    c = i κ_t1 κ_t2/(k J')                                 of the other's wave comes with each, exact on the sphere
    ξ √((0.3 B)² + (0.5 (r - 1))²)/m²                      may pass on the way: an error, 0 on the sphere

with B = |ρρ''| + ρ'² and r = ρ κ_t, means of both ends.

Sources: [LK59], [AS64, sec. 9.2 and 10.4]; Derivations, F20. 0.3 and B to D were set on four
bodies (`studies.accuracy.point_coverage`), the turning on three ellipsoids; Derivations, F14.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.arguments import fock_parameter, scales, transverse_ratios
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT, Boundary, fock_scale, slowest_decay
from creeping.field.results.point_result import FieldStatus
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.shed_wave import left_out
from creeping.field.waves.surface import first_order_share
from creeping.rays.ends import RayStatus
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays
from creeping.rays.strips import Strip


class RayFactors(NamedTuple):
    """Factors of the error of a boundary's rays.

    Attributes
    ----------
    leading : float
        E: what second order is worth on spheres of ka = 10 to 60, 0.56 to 0.62 (soft), 0.35 to 0.36 (hard) and up to
        0.2 (impedance) at 95 of 100 points.
    varies_near, varies : float
        B off the body and on it.
    squared, across : float
        C and D.
    """

    leading: float
    varies_near: float
    varies: float
    squared: float
    across: float


FACTORS = {
    "soft": RayFactors(0.65, 0.4, 0.1, 1.3, 0.3),
    "hard": RayFactors(0.37, 0.2, 0.15, 3.0, 0.3),
    "impedance": RayFactors(0.25, 0.25, 0.25, 1.8, 0.3),
    "conductor": RayFactors(0.65, 0.4, 0.15, 3.0, 1.1),
    # on the body alone
    "electric hard": RayFactors(np.nan, np.nan, 0.15, 3.0, 0.3),
}
LEAST_XI = 0.7
"""The least xi that the error on the body grows with, and what a conductor's polarisations turn by."""
MERGING = 0.3
"""P: 5/36 at a fold, 1/4 on the axis of a sphere."""
NARROW = 0.25
"""m |T|/(|J| + l |J'|) below which a ray is on a caustic, whatever else there is."""
LOST = 0.3
"""Share of the waves that rays beyond the end of the fan may have at a point that is still OK."""
FADED = 1e-3
"""Wave at the end of the rays below which no longer ones are asked for."""

CROSSED = {ELECTRIC_SOFT: (1, ELECTRIC_HARD), ELECTRIC_HARD: (-1, ELECTRIC_SOFT)}
"""Polarisations of a conductor and the other of each, with the sign of their coupling."""


@dataclass(frozen=True, eq=False)
class RaySum:
    """Sum of the waves at points (n,).

    Attributes
    ----------
    values : (n,) or (n, 3) complex
        Infinite on a caustic.
    error : (n,)
        The whole of the waves, in magnitude, where the status is not OK; 0 where no ray comes.
    status : (n,) of int
        Codes of `FieldStatus`, LIT not among them.
    faded : (n,)
        What decay alone has left of the waves.
    """

    values: ComplexArray
    error: FloatArray
    status: IntArray
    faded: FloatArray


def ray_sum(
    fan: RayFan,
    shed: ShedRays,
    count: int,
    waves: ComplexArray,
    own_error: FloatArray,
    wavenumber: float,
    boundary: Boundary,
    size: FloatArray | None = None,
) -> RaySum:
    """Sum over the rays found (m,) of their waves (m,) or (m, 3), each with its own error, at ``count`` points.

    Where waves merge they err by shares of ``size`` (m,): of |waves| if it is not given.
    """
    rays, observer = shed.rays, shed.observer
    size = magnitude(waves, rays.time) if size is None else size
    values = total_of(waves, observer, count)
    strength = total_of(size, observer, count)
    # a wave may be infinite
    with np.errstate(invalid="ignore", over="ignore"):
        merging = merging_error(shed, size, wavenumber, count)
        bent = np.minimum(fold_share(fan_strips(fan), shed, wavenumber), 1.0)
        folded = total_of(np.where(size > 0, size * bent, 0.0), observer, count)
        root = total_of(np.where(size > 0, size**2 * bent, 0.0), observer, count)
        narrow = (size > 0) & (tube_share(rays, shed.reach) * fock_scale(wavenumber, rays.curvature[1]) < NARROW)
        caustic = (merging > 0.04 * strength) | (folded > 0.008 * strength)
        error = np.sqrt(total_of(own_error, observer, count) ** 2 + root + merging**2)
    caustic[observer[narrow]] = True
    ended = np.zeros(count, dtype=bool)
    ended[observer[~rays.alive]] = True
    return judged_sum(fan, shed, size, values, error, (ended, caustic), wavenumber, boundary)


def judged_sum(
    fan: RayFan,
    shed: ShedRays,
    size: FloatArray,
    values: ComplexArray,
    error: FloatArray,
    trouble: tuple[BoolArray, BoolArray],
    wavenumber: float,
    boundary: Boundary,
) -> RaySum:
    """Sum (n, ...) of waves of sizes (m,), with its status; the error includes what is beyond the fan.

    ``trouble`` says where rays have ended, and where they merge on a caustic: (n,), (n,).
    """
    observer, count = shed.observer, len(values)
    strength = total_of(size, observer, count)
    decay, end = fan_decay(fan, wavenumber, boundary)
    xi = fock_parameter(shed.rays, wavenumber)
    with np.errstate(invalid="ignore", over="ignore"):
        lost = total_of(np.where(size > 0, size * np.exp(-decay * np.maximum(end - xi, 0.0)), 0.0), observer, count)
        error = np.hypot(error, lost)
    none = FieldStatus.TRUNCATED if np.exp(-decay * end) > FADED else FieldStatus.NO_RAY
    status = np.select(
        [trouble[0], strength == 0, trouble[1], lost > LOST * strength],
        [FieldStatus.DETACHED, none, FieldStatus.CAUSTIC, FieldStatus.TRUNCATED],
        FieldStatus.OK,
    )
    error = np.where(status == FieldStatus.OK, error, np.fmax(error, strength))
    return RaySum(values, error, status.astype(np.int64), total_of(np.exp(-decay * xi), observer, count))


def own_error(
    rays: RayPoints,
    waves: tuple[ComplexArray, ComplexArray],
    wavenumber: float,
    boundary: Boundary,
    order: int,
    *,
    height: FloatArray | None = None,
    mixed: FloatArray | None = None,
) -> FloatArray:
    """Error (...) of each ray's wave, on the body or off it; ``waves`` are of this order and of the other one.

    ``height`` (...) is Y of waves off the body. Waves may have a last axis of components. ``mixed`` (...) is |u| of
    a conductor's ray, of which torsion may bring a part into this wave: that part counts as error.
    """
    size, of = magnitude(waves[0], rays.time), FACTORS[boundary.kind]
    # a wave may be infinite
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        change = magnitude(waves[0] - waves[1], rays.time)
        ends = zip(scales(rays, wavenumber), rays.radius_rate, rays.radius_bend, strict=True)
        small, varying = np.mean([[m**-2, (np.abs(bend) + rate**2) / m**2] for m, rate, bend in ends], axis=0)
        if height is None:
            # rho kappa_t/m^2, mean of both ends
            pairs = zip(transverse_ratios(rays), scales(rays, wavenumber), strict=True)
            across = np.mean([np.abs(r) / m**2 for r, m in pairs], axis=0)
            power = small if boundary.kind == "conductor" else across
            growing = np.hypot(of.varies * varying, of.across * across * power)
            growing = growing * np.maximum(fock_parameter(rays, wavenumber), LEAST_XI)
            share = np.hypot(of.squared * (change / size) ** 2, growing)
            share = np.hypot(share, left_out(rays, wavenumber, boundary))
        else:
            growing = np.zeros_like(size)
            leading = of.leading * first_order_share(rays, height, wavenumber) * small
            share = np.linalg.norm([0.3 * small, of.varies_near * varying, leading], axis=0)
        error = size * np.minimum(share, 1.0) + (change if order == 1 else 0.0)
        if mixed is not None:
            error = np.hypot(error, 0.8 * np.minimum(growing, 1.0) * mixed)
    return np.asarray(np.where(size > 0, error, 0.0))


def magnitude(values: ComplexArray, like: Any) -> FloatArray:
    """|values| in the shape of ``like``; a last axis beyond it is that of a vector's components."""
    size = np.abs(values)
    return np.asarray(size if size.ndim == np.ndim(like) else np.sqrt(np.sum(size**2, axis=-1)))


def fold_share(strips: tuple[Strip, ...], shed: ShedRays, wavenumber: float) -> FloatArray:
    """f of each ray (n,)."""
    rays, reach = shed.rays, shed.reach
    slope = np.zeros(len(reach))
    for number, strip in enumerate(strips):
        mine = np.flatnonzero(shed.strip == number)
        if len(mine):
            bend = strip.slopes(shed.sigma[mine], rays.time[mine])[:, 6:8]
            slope[mine] = (bend[:, 0] + reach[mine] * bend[:, 1]) / rays.width[mine]
    tube = rays.spreading + reach * rays.spreading_rate
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        near = 3 * np.abs(rays.spreading_rate / tube) + 1 / (rays.time + reach)
        return np.nan_to_num(5 / 8 / wavenumber * slope**2 / tube**4 / near, nan=0.0, posinf=1.0)


def tube_share(rays: RayPoints, reach: FloatArray) -> FloatArray:
    """|J + l J'| as a share of |J| + l |J'|, on the body of |J| + rho |J'| (...): 0 on a caustic."""
    J, rate = rays.spreading, rays.spreading_rate
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.where(reach > 0, reach, 1 / rays.curvature[1])
        share = np.abs(J + reach * rate) / (np.abs(J) + length * np.abs(rate))
    return np.asarray(np.nan_to_num(share))


def total_of(values: Any, observer: IntArray, count: int) -> Any:
    """Sum of real or complex values (m, ...) by observer: (count, ...)."""
    out = np.zeros((count, *np.shape(values)[1:]), dtype=np.result_type(values, float))
    np.add.at(out, observer, values)
    return out


def merging_error(shed: ShedRays, size: FloatArray, wavenumber: float, count: int) -> FloatArray:
    """Error of pairs of waves (count,) that have an odd number of caustics between them."""
    rays = shed.rays
    zeros = rays.caustics + (rays.spreading * (rays.spreading + shed.reach * rays.spreading_rate) < 0)
    by = np.argsort(shed.observer, kind="stable")
    by = by[size[by] > 0]
    length = (rays.eikonal + shed.reach)[by]
    return merging_of(shed.observer[by], zeros[by], length, size[by], wavenumber, count)


def merging_of(
    observer: IntArray, zeros: IntArray, length: FloatArray, size: FloatArray, wavenumber: float, count: int
) -> FloatArray:
    """`merging_error` of waves (n,) sorted by observer, with zeros of J passed and path lengths (n,), L."""
    parity, out, apart = zeros % 2, np.zeros(count), 1
    # pairs of one observer stand at most as far apart as it has rays
    while apart < len(observer):
        first = np.flatnonzero(observer[apart:] == observer[:-apart])
        if not len(first):
            break
        first = first[parity[first] != parity[first + apart]]
        other = first + apart
        with np.errstate(divide="ignore"):
            share = np.minimum(MERGING / (wavenumber * np.abs(length[first] - length[other])), 1.0)
        np.add.at(out, observer[first], share * (size[first] + size[other]))
        apart += 1
    return out


def fan_decay(fan: RayFan, wavenumber: float, boundary: Boundary) -> tuple[float, float]:
    """Decay of the first mode by xi, and xi at the end of the tenth that decays least; infinite if none goes so far."""
    whole = fan.status == RayStatus.OK
    if not np.any(whole):
        return 1.0, np.inf
    curvature = np.array(np.median(np.maximum(fan.curvature[whole, 0], 0.0)))
    decay = slowest_decay(boundary, fock_scale(wavenumber, curvature[None]), fan.points[whole, 0])
    return decay, float(np.cbrt(wavenumber / 2) * np.quantile(fan.attenuation[whole, -1], 0.1))


def gradient_coupling(rays: RayPoints, wavenumber: float) -> ComplexArray:
    """i κ_t1 κ_t2/(k J'): how much of one polarisation's wave goes with the other's (n,), without unit.

    An amplitude n0.E that varies across the rays has a transverse field of higher order in 1/k; the soft wave is so
    weak that this outweighs it. Found on the sphere, exactly; κ_t at both ends, for reciprocity, on other bodies.
    """
    first, last = rays.transverse
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1j * np.maximum(first * last, 0.0) / (wavenumber * rays.spreading_rate))


def held_coupling(coupling: ComplexArray) -> ComplexArray:
    """The coupling c limited to size 1, c/(1 + |c|⁴)^(1/4).

    As the next order of a wave it cannot be larger than what it comes from.
    """
    # the size first: its fourth power may not be a number
    large = np.abs(coupling) > 1
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        out = np.where(large, coupling / np.abs(coupling) / (1 + np.abs(coupling) ** -4.0) ** 0.25, coupling)
        out = np.where(large, out, coupling / (1 + np.abs(coupling) ** 4) ** 0.25)
    return np.asarray(np.nan_to_num(out, nan=1.0))


def strong_coupling(rays: RayPoints, wavenumber: float, boundary: Boundary) -> BoolArray:
    """Whether the wave of the other polarisation is too large a part of a ray's for an expansion (n,)."""
    if boundary not in CROSSED:
        return np.zeros(rays.alive.shape, dtype=bool)
    return np.asarray(~(np.abs(gradient_coupling(rays, wavenumber)) < 0.5))


def turning(rays: RayPoints, wavenumber: float) -> FloatArray:
    """About how much of a conductor's creeping wave may pass into the other polarisation on its way (n,), at most 1.

    Nothing of it is known beyond the sphere, where nothing does. It is taken as ξ/m² times what is not as on a sphere.
    """
    ends = zip(transverse_ratios(rays), scales(rays, wavenumber), rays.radius_rate, rays.radius_bend, strict=True)
    unlike = [
        np.hypot(0.3 * (np.abs(bend) + rate**2), 0.5 * np.minimum(np.abs(r - 1), 1)) / m**2 for r, m, rate, bend in ends
    ]
    xi = np.maximum(fock_parameter(rays, wavenumber), LEAST_XI)
    return np.asarray(np.minimum(np.mean(unlike, axis=0) * xi, 1.0))
