"""The current that goes with a conductor's wave along rays: what its beams carry.

    J = sum of beams of u with V + M n V',   V = -h (1 + T C) p - t rho j p + (j + h t rho C) b,   V' = -h b

u is the wave "electric hard", j = e v/u (i/k) and C = Du/(2 m^2 u) as in `creeping.field.currents.conductor`. The beam
of u turns by M n, so that -h (p + M n b) is (i/k) grad (h u): beside a ray that is its -e (i kappa_t1/(kJ)) u b, which
grows without bound where J = 0, and the sum does not.

Sources: [P82]; Derivations, F24 and F26.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.currents.conductor import amplitudes, turn_of, vectors_of
from creeping.geometry.quadrature import BodyNodes
from creeping.rays.quantities import RayPoints
from creeping.rays.strips import Strip


@dataclass(frozen=True, eq=False)
class VectorWaves(ABC):
    """Waves of a conductor on the strips of a fan, for incident E0 (3, p): what beams are made of.

    Attributes
    ----------
    strips : tuple of Strip
    times : (steps,), L
    wavenumber : float, 1/L
    direction : (3,)
    electric : (3, p) complex
    """

    strips: tuple[Strip, ...]
    times: FloatArray
    wavenumber: float
    direction: FloatArray
    electric: ComplexArray

    def heights(self, strip: int, sigma: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """H and e (n, p) of the incident waves where rays at places (n,) of a strip begin."""
        rays, back = self.starts(strip, sigma)
        axes = np.broadcast_to(self.direction, rays.first_normal.shape)
        h, e = amplitudes(rays.first_normal, axes, self.direction, self.electric)
        return h[back], e[back]

    def starts(self, strip: int, sigma: FloatArray) -> tuple[RayPoints, IntArray]:
        """Where rays at places (n,) of a strip begin, each once, and which of these belongs to each place (n,)."""
        distinct, back = np.unique(sigma, return_inverse=True)
        return self.strips[strip].at(distinct, np.zeros(len(distinct))), back

    def turn(self, strip: int, sigma: FloatArray, nodes: BodyNodes, p: FloatArray) -> FloatArray:
        """T rho of tangents p (n, 3) at nodes, of rays at places (n,) of a strip."""
        return turn_of(nodes.curvature(p), nodes.twist(p))

    @abstractmethod
    def ratios(self, strip: int, sigma: FloatArray, s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """(i/k) v/u and Du/(2 m^2 u) at places (n,) of a strip."""

    def components(
        self, strip: int, sigma: FloatArray, s: FloatArray, nodes: BodyNodes, p: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """V and V' (n, 3 p) of the beams at places (n,) of a strip, at nodes with tangents p (n, 3)."""
        h, e = self.heights(strip, sigma)
        b = np.cross(nodes.normals, p)
        turn = self.turn(strip, sigma, nodes, p)
        soft, changing = self.ratios(strip, sigma, s)
        V = vectors_of(p, b, h, e * soft[:, None], np.ones(len(p)), turn, changing)
        lean = -b[:, :, None] * h[:, None]
        return V.reshape(len(p), -1), lean.reshape(len(p), -1)
