"""Currents J = n x H of the whole of a perfect conductor, for both polarisations of the incident wave.

On the lit side as `creeping.field.currents.lit_conductor` says. On a creeping ray, with tangent p, b = n x p, h = H0.b
and e = E0.b at its launch point, u and v the waves "electric hard" and "electric soft" there, t = p.Kb the torsion,

    J = -(h u + h (T/(2m^2)) Du + t rho j) p + (j + h (t rho/(2m^2)) Du) b,      T = (t rho)^2, rho = 1/kappa_n
    j = e (i/k) v - e (i kappa_t1/(kJ)) u

Du is u with t under Fock's integral. The current of v flows in the direction conjugate to the ray, b - t rho p; u gives
to b by its rate along the ray, and because h, by which it starts, varies across the rays at the rate kappa_t1 e. Both
are exact on the circular cylinder and on the sphere.

Sources: [F46], [CK13, sec. 6.2]; Derivations, F18.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT
from creeping.field.currents.lit import STEEPEST
from creeping.field.currents.lit_conductor import lit_conductor
from creeping.field.currents.nodes import LitNodes, RayNodes
from creeping.field.currents.radiation import far_of_vector, magnetic_field_of_vector
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.polarisation import spherical_frame
from creeping.field.shed_wave import fock_parameter, scales
from creeping.field.special.fock import surface_function
from creeping.field.surface import ray_factor, surface_waves


@dataclass(frozen=True, eq=False, repr=False)
class ConductorCurrents(SurfaceCurrents):
    """Currents n x H at nodes of a perfect conductor, (n, 3, 2): components, and incident polarisations theta and phi.

    Fields are (m, 2, 2), theta and phi scattered by theta and phi incident, far away, and H (m, 3, 2) near.
    """

    _factors: ClassVar[tuple[float, float]] = (2.8, 2.3)

    def _radiated(self, values: ComplexArray, part: BoolArray, directions: FloatArray) -> ComplexArray:
        strength = values[part] * self.weights[part, None, None]
        f = far_of_vector(self.points[part], strength, directions, self.wavenumber)
        return np.asarray(np.einsum("moc,mci->moi", spherical_frame(directions), f))

    def _field(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        return magnetic_field_of_vector(self.points, values * self.weights[:, None, None], points, self.wavenumber)

    @property
    def _incident(self) -> FloatArray:
        """H0 of both polarisations (3, 2)."""
        return np.cross(self.direction, spherical_frame(self.direction)).T


def conductor_waves(lit: LitNodes, shadow: RayNodes, direction: FloatArray, k: float, order: int) -> ComplexArray:
    """J at the nodes of the lit side, then at those of the rays, for both incident polarisations (n, 3, 2)."""
    bright = lit_conductor(lit.cosine, lit.along, lit.across, lit.twist, lit.rate, lit.bend, k, order)
    bright = bright * np.exp(1j * k * (lit.points @ direction))[:, None, None]
    h, e = _amplitudes(lit.normals, lit.axes, direction)
    b = np.cross(lit.normals, lit.axes)
    rows = bright[:, :, :1] * h[:, None] + bright[:, :, 1:] * e[:, None]
    on_lit = lit.axes[:, :, None] * rows[:, :1] + b[:, :, None] * rows[:, 1:]
    return np.concatenate([on_lit, _on_rays(shadow, direction, k, order)])


def _amplitudes(normals: FloatArray, axes: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """H = H0.b and e = E0.b (n, 2) of both incident polarisations, b = n x a."""
    b, electric = np.cross(normals, axes), spherical_frame(direction)
    return b @ np.cross(direction, electric).T, b @ electric.T


def _on_rays(shadow: RayNodes, direction: FloatArray, k: float, order: int) -> ComplexArray:
    rays = shadow.rays
    h, e = _amplitudes(rays.first_normal, np.broadcast_to(direction, rays.first_normal.shape), direction)
    hard = surface_waves(rays, k, ELECTRIC_HARD, order)
    soft = 1j / k * surface_waves(rays, k, ELECTRIC_SOFT, order)
    p = rays.directions
    b = np.cross(shadow.normals, p)
    along, across = -h * hard[:, None], e * soft[:, None]
    if order == 2:
        m = scales(rays, k)[1]
        turn = np.clip(shadow.twist / rays.curvature[1], -STEEPEST, STEEPEST)
        # 1/J is held where rays cross: J is known to be no narrower than the boundary layer there
        spread = rays.spreading / (rays.spreading**2 + 1 / m**4)
        across = across - e * (1j / k * rays.transverse[0] * spread * hard)[:, None]
        changing = surface_function(fock_parameter(rays, k), 0.0, 1) * ray_factor(rays, k) / (2 * m**2)
        along = along - turn[:, None] * across - h * (turn**2 * changing)[:, None]
        across = across + h * (turn * changing)[:, None]
    values = p[:, :, None] * along[:, None] + b[:, :, None] * across[:, None]
    return np.asarray(np.where(np.isfinite(values), values, 0.0))
