"""Rays that pass through points of the body, and beams where those merge: which of the two, and how far off.

    u = (u_r e_b^2 + u_b e_r^2)/(e_r^2 + e_b^2)

u_r is the sum over the rays through the point, u_b that of beams. Both have the error of the wave itself; the rest of
it is, for rays that merge, e_r as of `creeping.field.ray_sums`; for beams

    e_b^2 = sum min(|u_i|, 1.5 |y_i|)^2 (A + B eta)^2 + A^2 |u_b|^2 + C^2 |u_b - u_b'|^2
    eta = |d(log y)/dsigma_perp|^2/(2 k eps)

with u_b' by beams of another width: eta is what a beam that varies across itself errs by. What u_r and u_b differ by
beyond 2 e_b is added to e_r: on the dark side of a caustic rays know nothing of it.

Sources: [P82]; Derivations, F22 and F24. A to C were set on the triaxial and the twisted ellipsoid.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.beams import CUT, WIDTH, YOUNG, BeamSums, Components, StripWaves, beam_sums, length_scale, width
from creeping.field.boundary import Boundary
from creeping.field.far_geometry import fan_strips
from creeping.field.point_result import FieldStatus
from creeping.field.ray_scales import fock_parameter
from creeping.field.ray_sums import (
    FADED,
    LOST,
    RaySum,
    fan_decay,
    fold_share,
    magnitude,
    merging_error,
    total_of,
)
from creeping.field.shed_wave import smoothstep
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays

LEAST, VARIES, BROADER = 0.02, 0.5, 1.5
"""A, B and C."""
STRONG = 1.5
"""Bound of |J|^(-1/2) in errors: on a caustic a ray is no stronger than its neighbours."""
CROWD, FOCUSED = 8, 2.0
"""Rays from which a point is a focus of all of them, and how much stronger than the field its waves are there."""
FACTORS = (1.3, 0.8)
"""Widths of the beams that serve, and of those by which they are judged."""


def variation(fan: RayFan, shed: ShedRays, y: ComplexArray, across: ComplexArray, wavenumber: float) -> FloatArray:
    """Eta (m,) of waves y whose derivative in sigma is ``across`` (m,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        eta = np.abs(across / (y * shed.rays.width)) ** 2 * length_scale(fan) / (2 * wavenumber * WIDTH * FACTORS[0])
    return np.nan_to_num(eta, nan=0.0, posinf=1.0)


def beams_beside_rays(
    fan: RayFan,
    waves: StripWaves,
    shed: ShedRays,
    points: FloatArray,
    own: ComplexArray,
    share: FloatArray,
    components: Components | None = None,
) -> tuple[ComplexArray, ComplexArray]:
    """Sums of beams of both widths at points (n, 3), the waves ``own`` (m, ...) of young rays with them: (n, ...)."""
    near, clear = _apart_from_line(fan, shed, waves.wavenumber, len(points))
    alone = total_of(np.where(_wide(near, own), own, 0.0), shed.observer, len(points))
    clear, share = _wide(clear, alone), _wide(share, alone)

    def together(sums: BeamSums) -> ComplexArray:
        early, late = sums.early.reshape(alone.shape), sums.late.reshape(alone.shape)
        return np.asarray(clear * (share * early + late) + (1 - clear) * (alone + late))

    by_beams, others = (together(sums) for sums in beam_sums(fan, waves, points, FACTORS, components))
    return by_beams, others


def blended_sum(
    fan: RayFan,
    shed: ShedRays,
    own: ComplexArray,
    strength: FloatArray,
    size: FloatArray,
    part: FloatArray,
    eta: FloatArray,
    beams: tuple[ComplexArray, ComplexArray],
    wavenumber: float,
    boundary: Boundary,
) -> RaySum:
    """Sum of the waves ``own`` (m, ...) of rays and of beams at points, both sums (n, ...).

    Where rays merge they err by shares of ``strength``, by themselves by shares of ``size`` (m,), which is bounded.
    ``part`` (m,) is the error of each wave as a share of it, 1 or more where there is none.
    """
    values, rest = _blended(fan, shed, own, strength, size, eta, beams, wavenumber)
    bounded = np.where(np.isfinite(part), np.minimum(part, 1.0), 1.0)
    # at a focus more rays come than those that are found
    sums = total_of(size, shed.observer, len(values))
    field = magnitude(values, sums)
    more = np.maximum(1.0, field / np.maximum(sums, 1e-300))
    # and at one where all rays of a fan come their number says how dense it is, and no more
    crowd = total_of(np.ones(len(size)), shed.observer, len(values)) > CROWD
    more = np.where(crowd, np.minimum(more, FOCUSED * field / np.maximum(sums, 1e-300)), more)
    error = np.hypot(more * total_of(size * bounded, shed.observer, len(values)), rest)
    return _judged(fan, shed, size, values, error, part >= 1, wavenumber, boundary)


def _blended(
    fan: RayFan,
    shed: ShedRays,
    own: ComplexArray,
    strength: FloatArray,
    size: FloatArray,
    eta: FloatArray,
    beams: tuple[ComplexArray, ComplexArray],
    wavenumber: float,
) -> tuple[ComplexArray, FloatArray]:
    """The field (n, ...) of rays (m, ...) and of beams, and the error of merging."""
    by_beams, others = beams
    count, observer = len(by_beams), shed.observer
    plain = np.zeros(count)
    by_rays = total_of(own, observer, count)
    e_b = np.sqrt(total_of((size * (LEAST + np.minimum(VARIES * eta, 1.0))) ** 2, observer, count))
    e_b = np.linalg.norm(
        [e_b, LEAST * magnitude(by_beams, plain), BROADER * magnitude(by_beams - others, plain)], axis=0
    )
    near = _apart_from_line(fan, shed, wavenumber, count)[0]
    bent = np.where(near, 0.0, np.minimum(fold_share(fan_strips(fan), shed, wavenumber), 1.0))
    e_r = np.sqrt(total_of(strength**2 * bent, observer, count) + merging_error(shed, strength, wavenumber, count) ** 2)
    e_r = np.sqrt(e_r**2 + np.maximum(0.0, magnitude(by_beams - by_rays, plain) ** 2 - (2 * e_b) ** 2))
    both = e_r**2 + e_b**2
    with np.errstate(invalid="ignore", divide="ignore"):
        beta = _wide(np.where(both > 0, e_r**2 / both, 0.0), by_beams)
        rest = np.where(both > 0, e_r * e_b / np.sqrt(both), 0.0)
    return np.asarray((1 - beta) * by_rays + beta * by_beams), rest


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


def _wide(values: FloatArray | BoolArray, like: ComplexArray) -> FloatArray:
    """Values (n,) with as many axes as ``like`` (n, ...)."""
    return np.asarray(values, dtype=float).reshape(-1, *(1,) * (like.ndim - 1))


def _apart_from_line(fan: RayFan, shed: ShedRays, k: float, count: int) -> tuple[BoolArray, FloatArray]:
    """Which rays stand by themselves next to the line (m,), and how far points are from where beams are cut (n,)."""
    w = width(fan, k)
    near = shed.rays.time < CUT * w
    clear = np.ones(count)
    np.minimum.at(clear, shed.observer[near], smoothstep(shed.rays.time[near] / w, *YOUNG))
    return near, clear
