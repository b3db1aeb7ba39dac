"""The waves of a whole fan at points of the body, by marching: rays that pass through, and beams where those merge.

    u = (u_r e_b^2 + u_b e_r^2)/(e_r^2 + e_b^2)

u_r is the sum over the rays through the point, u_b that of beams. Both have the error of the marched wave itself; the
rest of it is, for rays that merge, e_r as of `creeping.field.ray_sums`; for beams

    e_b^2 = sum min(|u_i|, 1.5 |y_i|)^2 (A + B eta)^2 + A^2 |u_b|^2 + C^2 |u_b - u_b'|^2
    eta = |d(log y)/dsigma_perp|^2/(2 k eps)

with u_b' by beams of another width: eta is what a beam that varies across itself errs by. What u_r and u_b differ by
beyond 2 e_b is added to e_r: on the dark side of a caustic rays know nothing of it.

Sources: [P82]; Derivations, F22 and F24. A to C were set on the triaxial and the twisted ellipsoid.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.beams import CUT, WIDTH, YOUNG, BeamSums, beam_sums, length_scale, width
from creeping.field.boundary import Boundary
from creeping.field.far_geometry import fan_strips
from creeping.field.marching.fan_waves import FanWaves, fan_waves
from creeping.field.point_result import FieldStatus
from creeping.field.ray_sums import FADED, LOST, RaySum, fan_decay, fold_share, merging_error, total_of
from creeping.field.shed_wave import fock_parameter, smoothstep
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays
from creeping.rays.status import RayStatus

LEAST, VARIES, BROADER = 0.02, 0.5, 1.5
"""A, B and C."""
STRONG = 1.5
"""Bound of |J|^(-1/2) in errors: on a caustic a ray is no stronger than its neighbours."""
FACTORS = (1.3, 0.8)
"""Widths of the beams that serve, and of those by which they are judged."""
FEWEST = 8
"""Rays of a strip from which waves are interpolated between them."""
LONGEST = 60.0
"""Seconds that beams may take."""


def marches(fan: RayFan, boundary: Boundary, order: int, count: int, wavenumber: float) -> bool:
    """Whether the waves of a fan can be marched, and cost little enough at ``count`` points."""
    from creeping.field.beams import seconds

    strips = fan_strips(fan)
    rays = sum(len(strip.positions) for strip in strips)
    return (
        order == 2
        and boundary.kind in ("soft", "hard", "impedance")
        and len(strips) > 0
        and rays == len(fan.status)
        and min(len(strip.positions) for strip in strips) >= FEWEST
        and bool(np.all(np.isin(fan.status, (RayStatus.OK, RayStatus.DETACHED))))
        and seconds(fan, strips, wavenumber, count) < LONGEST
    )


def marched_sum(
    fan: RayFan,
    shed: ShedRays,
    points: FloatArray,
    share: FloatArray | None,
    young: BoolArray,
    wavenumber: float,
    boundary: Boundary,
) -> RaySum:
    """Sum of the marched waves at points (n, 3), L.

    ``share`` (n,) is that of the rays next to the line, of which ``young`` (m,) says which of the rays found they are.
    """
    k, count = wavenumber, len(points)
    waves = fan_waves(fan, wavenumber=k, boundary=boundary)
    y, slope, off = _on_rays(waves, shed)
    rays, observer = shed.rays, shed.observer
    with np.errstate(divide="ignore", invalid="ignore"):
        own = y / np.sqrt(np.abs(rays.spreading)) * np.exp(1j * (k * rays.eikonal - 0.5 * np.pi * rays.caustics))
        eta = np.abs(slope / (y * rays.width)) ** 2 * length_scale(fan) / (2 * k * WIDTH * FACTORS[0])
    share = np.ones(count) if share is None else share
    # an infinite wave is that of a caustic: beams serve there
    own, eta = np.where(np.isfinite(own), own, 0.0), np.nan_to_num(eta, nan=0.0, posinf=1.0)
    own = own * np.where(young, share[observer], 1.0)
    size = np.minimum(np.abs(own), STRONG * np.abs(y))
    near, clear = _apart_from_line(fan, shed, k, count)
    alone = total_of(np.where(near, own, 0.0), observer, count)

    def together(sums: BeamSums) -> ComplexArray:
        return np.asarray(clear * (share * sums.early + sums.late) + (1 - clear) * (alone + sums.late))

    by_beams, others = (together(sums) for sums in beam_sums(fan, waves, points, FACTORS))
    by_rays = total_of(own, observer, count)
    e_b = np.sqrt(total_of((size * (LEAST + np.minimum(VARIES * eta, 1.0))) ** 2, observer, count))
    e_b = np.linalg.norm([e_b, LEAST * np.abs(by_beams), BROADER * np.abs(by_beams - others)], axis=0)
    bent = np.where(near, 0.0, np.minimum(fold_share(fan_strips(fan), shed, k), 1.0))
    merging = merging_error(shed, np.abs(own), k, count)
    e_r = np.sqrt(total_of(np.abs(own) ** 2 * bent, observer, count) + merging**2)
    e_r = np.sqrt(e_r**2 + np.maximum(0.0, np.abs(by_beams - by_rays) ** 2 - (2 * e_b) ** 2))
    both = e_r**2 + e_b**2
    with np.errstate(invalid="ignore", divide="ignore"):
        beta = np.where(both > 0, e_r**2 / both, 0.0)
        rest = np.where(both > 0, e_r * e_b / np.sqrt(both), 0.0)
        part = np.where(np.abs(y) > 0, off / np.abs(y), 0.0)
    values = (1 - beta) * by_rays + beta * by_beams
    bounded = np.where(np.isfinite(part), np.minimum(part, 1.0), 1.0)
    # at a focus more rays come than those that are found
    strength = total_of(size, observer, count)
    more = np.maximum(1.0, np.abs(values) / np.maximum(strength, 1e-300))
    error = np.hypot(more * total_of(size * bounded, observer, count), rest)
    return _judged(fan, shed, size, values, error, part >= 1, k, boundary)


def _on_rays(waves: FanWaves, shed: ShedRays) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Y, dy/dsigma and the error of y of the rays found (m,)."""
    y, slope = np.zeros((2, len(shed.sigma)), dtype=complex)
    error = np.zeros(len(shed.sigma))
    for number in range(len(waves.strips)):
        mine = np.flatnonzero(shed.strip == number)
        at = number, shed.sigma[mine], shed.rays.time[mine]
        y[mine], slope[mine], error[mine] = waves.at(*at), waves.across(*at), waves.error(*at)
    return y, slope, error


def _apart_from_line(fan: RayFan, shed: ShedRays, k: float, count: int) -> tuple[BoolArray, FloatArray]:
    """Which rays stand by themselves next to the line (m,), and how far points are from where beams are cut (n,)."""
    w = width(fan, k)
    near = shed.rays.time < CUT * w
    clear = np.ones(count)
    np.minimum.at(clear, shed.observer[near], smoothstep(shed.rays.time[near] / w, *YOUNG))
    return near, clear


def _judged(
    fan: RayFan,
    shed: ShedRays,
    size: FloatArray,
    values: ComplexArray,
    error: FloatArray,
    lacking: BoolArray,
    k: float,
    boundary: Boundary,
) -> RaySum:
    """The sum with its status: what ends with the fan, and what no wave is known of."""
    count, observer = len(values), shed.observer
    decay, end = fan_decay(fan, k, boundary)
    xi = fock_parameter(shed.rays, k)
    strength = total_of(size, observer, count)
    lost = total_of(np.where(size > 0, size * np.exp(-decay * np.maximum(end - xi, 0.0)), 0.0), observer, count)
    # a ray without a wave, or with one that errs by its size
    none = np.zeros(count, dtype=bool)
    none[observer[lacking & (size == 0)]] = True
    unknown = none | (total_of(np.where(lacking, size, 0.0), observer, count) > LOST * strength)
    status = np.select(
        [unknown, strength == 0, lost > LOST * strength],
        [
            FieldStatus.DETACHED,
            FieldStatus.TRUNCATED if np.exp(-decay * end) > FADED else FieldStatus.NO_RAY,
            FieldStatus.TRUNCATED,
        ],
        FieldStatus.OK,
    )
    error = np.hypot(error, lost)
    error = np.where(status == FieldStatus.OK, error, np.fmax(error, strength))
    return RaySum(values, error, status.astype(np.int64), total_of(np.exp(-decay * xi), observer, count))
