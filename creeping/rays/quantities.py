"""What the wave needs to know of a point on a creeping ray; frequency does not enter.

With n the normal, p the ray's tangent, b = n × p, H the Hessian of F:

    κₙ = p.Hp/|∇F|,   κ_t = b.Hb/|∇F|,   ρ = 1/κₙ,   ' = d/ds
    integrals over s of  κₙ^(1/3),  κₙ^(2/3),  κₙ^(4/3),  κₙ^(1/3) κ_t,  κₙ^(4/3) (ρρ'' - (2/3) ρ'²)
    tan φ = -L J'/J, φ(0) = 0, L the body's size: floor(φ/π + 1/2) zeros of J are behind, and 1 + floor(φ/π) of J'

Between the steps of the fan the rays are traced again, so that splines of degree 7 along them give κₙ' and κₙ''. Powers
are taken after interpolation, and the integrals end where κₙ first falls to 0: there the creeping ray ends.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import speed_of
from creeping.geodesics.integrator import pack, trace_states
from creeping.geometry.surface import normal, size
from creeping.rays.fan import RayFan, RayStatus
from creeping.shadow.attachment import line_tangents

LANES = 18
"""x (3), p (3), J, J', φ, κₙ, κₙ', κₙ'', κ_t, and the five integrals."""
START_LANES = 9
"""d.x0, dσ⊥/dσ, κₙ, κₙ', κₙ'', κ_t and n at the launch point."""
GAUSS = 4
"""Gauss points of a step."""
TURN = 0.12
"""Largest angle by which the ray turns in one step; splines of degree 5 then err by about 1e-8."""
GUARD = 4
"""Steps traced beyond both ends, so that derivatives are central there too."""
STEEPEST, SHARPEST = 4.0, 20.0
"""Bounds of |ρ'| and of |ρρ''|, |ρρ'' - (2/3) ρ'²|: where curvature varies faster, as it does before a ray detaches,
the expansion that uses them has no meaning."""


@dataclass(frozen=True, eq=False)
class RayPoints:
    """Points on creeping rays, arrays of one shape (...) with lanes last.

    Attributes
    ----------
    lanes : (..., LANES)
    starts : (..., START_LANES)
        Of the launch points.
    time : (...), L
        Arclength from the launch point.
    alive : (...) of bool
        Whether the creeping ray reaches the point: launched by the wave and not detached before.
    scale : float, L
        Unit of length in the angle φ.
    """

    lanes: FloatArray
    starts: FloatArray
    time: FloatArray
    alive: BoolArray
    scale: float

    def __getitem__(self, index: Any) -> "RayPoints":
        """Part of the points, by an index of the leading axes."""
        return RayPoints(self.lanes[index], self.starts[index], self.time[index], self.alive[index], self.scale)

    @property
    def points(self) -> FloatArray:
        """X (..., 3), L."""
        return self.lanes[..., 0:3]

    @property
    def directions(self) -> FloatArray:
        """Tangents p (..., 3)."""
        return self.lanes[..., 3:6]

    @property
    def spreading(self) -> FloatArray:
        """J."""
        return self.lanes[..., 6]

    @property
    def spreading_rate(self) -> FloatArray:
        """J', 1/L."""
        return self.lanes[..., 7]

    @property
    def prufer(self) -> FloatArray:
        """Angle φ of (J, -J'), continuous along the ray, radians."""
        return self.lanes[..., 8]

    @property
    def caustics(self) -> IntArray:
        """Zeros of J passed."""
        return np.floor(self.prufer / np.pi + 0.5).astype(np.int64)

    @property
    def far_caustics(self) -> IntArray:
        """Zeros of J passed, and of J + l J' for l > 0."""
        return np.floor(self.prufer / np.pi).astype(np.int64) + 1

    @property
    def curvature(self) -> tuple[FloatArray, FloatArray]:
        """κₙ at the launch point and here, 1/L."""
        return self.starts[..., 2], self.lanes[..., 9]

    @property
    def transverse(self) -> tuple[FloatArray, FloatArray]:
        """κ_t at the launch point and here, 1/L."""
        return self.starts[..., 5], self.lanes[..., 12]

    @property
    def radius_rate(self) -> tuple[FloatArray, FloatArray]:
        """ρ' at the launch point and here."""
        return _radius_rate(self.starts[..., 2:5]), _radius_rate(self.lanes[..., 9:12])

    @property
    def radius_bend(self) -> tuple[FloatArray, FloatArray]:
        """ρρ'' at the launch point and here."""
        return _radius_bend(self.starts[..., 2:5]), _radius_bend(self.lanes[..., 9:12])

    @property
    def eikonal(self) -> FloatArray:
        """d.x0 + s, L."""
        return np.asarray(self.starts[..., 0] + self.time)

    @property
    def width(self) -> FloatArray:
        """dσ⊥/dσ: arclength of the shadow line across the ray."""
        return self.starts[..., 1]

    @property
    def first_normal(self) -> FloatArray:
        """N at the launch point (..., 3)."""
        return self.starts[..., 6:9]

    @property
    def integrals(self) -> FloatArray:
        """∫κₙ^(1/3), ∫κₙ^(2/3), ∫κₙ^(4/3), ∫κₙ^(1/3) κ_t, ∫κₙ^(4/3)(ρρ'' - (2/3) ρ'²): (..., 5)."""
        return self.lanes[..., 13:18]


def _radius_rate(kappa: FloatArray) -> FloatArray:
    """ρ' = -κ'/κ² from κ, κ', κ'' (..., 3), within STEEPEST; 0 where κ <= 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.clip(-kappa[..., 1] / kappa[..., 0] ** 2, -STEEPEST, STEEPEST)
    return np.asarray(np.where(kappa[..., 0] > 0, rate, 0.0))


def _radius_bend(kappa: FloatArray) -> FloatArray:
    """ρρ'' = -κ''/κ³ + 2 κ'²/κ⁴ from κ, κ', κ'' (..., 3), within SHARPEST; 0 where κ <= 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = -kappa[..., 2] / kappa[..., 0] ** 3 + 2 * kappa[..., 1] ** 2 / kappa[..., 0] ** 4
    return np.asarray(np.where(kappa[..., 0] > 0, np.clip(bend, -SHARPEST, SHARPEST), 0.0))


def ray_points(fan: RayFan) -> tuple[FloatArray, RayPoints]:
    """Points of every ray of a fan at equal steps, no coarser than its own: times (steps,), points (rays, steps).

    Raises
    ------
    InvalidInputError
        If the body is weighted.
    """
    if speed_of(fan.body) is not None:
        raise InvalidInputError(f"{fan.body!r} has a speed; the diffracted field is that of a plain body")
    parts = substeps(fan)
    step = fan.length / ((len(fan.travel_time) - 1) * parts)
    states = _refined(fan, parts, step)
    times = step * np.arange(states.shape[1] - 2 * GUARD)
    inner = slice(GUARD, -GUARD)
    lanes = np.empty((len(states), len(times), LANES))
    lanes[..., 0:8] = states[:, inner]
    scale = size(fan.body)
    lanes[..., 8] = np.unwrap(np.arctan2(-scale * lanes[..., 7], lanes[..., 6]), axis=1)
    if len(states):
        _along(fan, states, step, lanes)
    launched = np.isin(fan.status, (RayStatus.OK, RayStatus.DETACHED, RayStatus.ROUGH))
    alive = launched[:, None] & (times < fan.detachment[:, None])
    return times, RayPoints(lanes, _starts(fan, lanes), np.broadcast_to(times, alive.shape), alive, scale)


def substeps(fan: RayFan) -> int:
    """Parts of a step of the fan so that the ray turns by no more than TURN in one."""
    step = float(fan.travel_time[1] - fan.travel_time[0])
    steepest = float(np.max(np.abs(fan.curvature), initial=0.0))
    return max(1, int(np.ceil(step * steepest / TURN)), int(np.ceil(16 / (len(fan.travel_time) - 1))))


def _refined(fan: RayFan, parts: int, step: float) -> FloatArray:
    """x, p, J, J' at the finer steps and GUARD steps beyond both ends: (rays, steps, 8)."""
    rays, steps = fan.spreading.shape
    offsets = step * np.arange(max(parts, GUARD + 1), dtype=float)
    forward = np.concatenate([fan.points, fan.directions], axis=-1).reshape(-1, 6)
    traced = trace_states(fan.body, pack(forward[:, :3], forward[:, 3:], jacobi=True), offsets, rtol=1e-11)
    traced = traced.reshape(rays, steps, len(offsets), 10)
    J, rate = fan.spreading[..., None], fan.spreading_rate[..., None]
    out = np.empty((rays, steps, len(offsets), 8))
    out[..., :6] = traced[..., :6]
    out[..., 6] = J * traced[..., 6] + rate * traced[..., 8]
    out[..., 7] = J * traced[..., 7] + rate * traced[..., 9]
    # behind the launch point: the ray that arrives there, traced back
    back = trace_states(fan.body, pack(fan.points[:, 0], -fan.directions[:, 0], jacobi=True), offsets, rtol=1e-11)
    before = np.concatenate([back[..., :3], -back[..., 3:6], back[..., 6:7], -back[..., 7:8]], axis=-1)
    return np.concatenate(
        [
            before[:, GUARD:0:-1],
            out[:, :-1, :parts].reshape(rays, (steps - 1) * parts, 8),
            out[:, -1, : GUARD + 1],
        ],
        axis=1,
    )


def _starts(fan: RayFan, lanes: FloatArray) -> FloatArray:
    starts = np.empty((*lanes.shape[:2], START_LANES))
    starts[..., 0] = fan.eikonal[:, :1]
    n0 = normal(fan.body, fan.points[:, 0])
    b0 = np.cross(n0, fan.line.direction)
    tangents = line_tangents(fan.body, fan.points[:, 0], fan.line.direction)
    starts[..., 1] = np.abs(np.sum(b0 * tangents, axis=-1))[:, None]
    starts[..., 2:5] = lanes[:, :1, 9:12]
    starts[..., 5] = lanes[:, :1, 12]
    starts[..., 6:9] = n0[:, None]
    return starts


def _along(fan: RayFan, states: FloatArray, step: float, lanes: FloatArray) -> None:
    """Fill κₙ with its derivatives, κ_t and the integrals."""
    x, p = states[..., 0:3], states[..., 3:6]
    gradient = fan.body.gradient(x)
    g = np.linalg.norm(gradient, axis=-1)
    H = fan.body.hessian(x)
    b = np.cross(gradient / g[..., None], p)
    curvatures = np.stack([np.einsum("...i,...ij,...j->...", v, H, v) / g for v in (p, b)], axis=-1)
    t = step * (np.arange(states.shape[1], dtype=float) - GUARD)
    both = make_interp_spline(t, curvatures, k=7, axis=1)
    first, second = both.derivative(1), both.derivative(2)
    inner = t[GUARD:-GUARD]
    lanes[..., 9], lanes[..., 12] = curvatures[:, GUARD:-GUARD, 0], curvatures[:, GUARD:-GUARD, 1]
    lanes[..., 10], lanes[..., 11] = first(inner)[..., 0], second(inner)[..., 0]
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)

    def integral(start: Any, length: Any, rays: Any) -> FloatArray:
        """Over steps (m,) from their starts: rays x m x 5."""
        at = (start[:, None] + length[:, None] * (nodes + 1) / 2).ravel()
        values = both(at)[rays]
        terms = _integrands(values[..., 0], first(at)[rays][..., 0], second(at)[rays][..., 0], values[..., 1])
        terms = terms.reshape(*terms.shape[:-2], len(start), GAUSS, 5)
        return np.asarray(np.einsum("...mgi,g->...mi", terms, weights / 2) * length[:, None])

    pieces = integral(inner[:-1], np.diff(inner), slice(None))
    # a ray that detaches within a step is integrated up to there
    ends = np.clip(fan.detachment[:, None] - inner[:-1], 0.0, np.diff(inner))
    for ray in np.flatnonzero(fan.detachment < inner[-1]):
        cut = np.flatnonzero(ends[ray] < np.diff(inner))
        if not len(cut):
            continue
        pieces[ray, cut] = 0.0
        pieces[ray, cut[0]] = integral(inner[cut[:1]], ends[ray, cut[:1]], ray)[0]
    lanes[:, 0, 13:18] = 0.0
    lanes[:, 1:, 13:18] = np.cumsum(pieces, axis=1)


def _integrands(kappa: FloatArray, rate: FloatArray, bend: FloatArray, transverse: FloatArray) -> FloatArray:
    """The five integrands from κₙ, κₙ', κₙ'', κ_t: (...) -> (..., 5)."""
    positive = np.maximum(kappa, 0.0)
    root = np.cbrt(positive)
    with np.errstate(divide="ignore", invalid="ignore"):
        variation = -bend / positive**3 + 4 / 3 * rate**2 / positive**4
    variation = np.clip(np.nan_to_num(variation, nan=0.0), -SHARPEST, SHARPEST)
    return np.stack([root, root**2, root**4, root * transverse, root**4 * variation], axis=-1)
