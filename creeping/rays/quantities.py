"""What the wave needs to know of a point on a creeping ray; frequency does not enter.

With n the normal, p the ray's tangent, b = n × p, H the Hessian of F:

    κₙ = p.Hp/|∇F|,   κ_t = b.Hb/|∇F|,   ρ = 1/κₙ,   ' = d/ds
    integrals over s of  κₙ^(1/3),  κₙ^(2/3),  κₙ^(4/3),  κₙ^(1/3) κ_t,  κₙ^(4/3) (ρρ'' - (2/3) ρ'²)
    tan φ = -L J'/J, φ(0) = 0, L the body's size: floor(φ/π + 1/2) zeros of J are behind, and 1 + floor(φ/π) of J'

Polynomials of degree 9 along the ray give κₙ' and κₙ'' (`creeping.rays.kernels.quantities`). Powers are taken after
interpolation, and the integrals end where κₙ first falls to 0: there the creeping ray ends.

Sources: Derivations, R1, R5 and F4.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.patches import Rows

LANES = 18
"""x (3), p (3), J, J', φ, κₙ, κₙ', κₙ'', κ_t, and the five integrals."""
START_LANES = 10
"""d.x0 (or R), dσ⊥/dσ, κₙ, κₙ', κₙ'', κ_t, n and 1/R of the wave at the launch point."""
GAUSS = 4
"""Gauss points of a step."""
GUARD = 5
"""Steps traced beyond both ends, so that derivatives are central there too."""
STRAIGHT = 1e-6
"""Curvature, in inverse body sizes, up to which a ray goes straight, on a body with joints."""
STEEPEST, SHARPEST = 4.0, 20.0
"""Bounds of |ρ'| and of |ρρ''|, |ρρ'' - (2/3) ρ'²|: where curvature varies faster, as it does before a ray detaches,
the expansion that uses them has no meaning."""


@dataclass(frozen=True, eq=False)
class RayPoints(Rows):
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

    @property
    def points(self) -> FloatArray:
        """x (..., 3), L."""
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
        """d.x0 + s, L; of a point source R + s."""
        return np.asarray(self.starts[..., 0] + self.time)

    @property
    def departing(self) -> FloatArray:
        """d.x0 + s - p.x, L: k times it is the far phase of a ray that leaves along its tangent."""
        return np.asarray(self.eikonal - np.sum(self.directions * self.points, axis=-1))

    @property
    def width(self) -> FloatArray:
        """dσ⊥/dσ: arclength of the shadow line across the ray."""
        return self.starts[..., 1]

    @property
    def opening(self) -> FloatArray:
        """1/R of the wave at the launch point, 1/L; 0 of a plane wave."""
        return self.starts[..., 9]

    @property
    def first_normal(self) -> FloatArray:
        """n at the launch point (..., 3)."""
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
