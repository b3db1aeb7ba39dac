"""What sources at ports bring by each geodesic, with its error: point sources on hard ground.

Error of a wave u as a share of it, what second order leaves out being of order 1/m^4; r, B and T as in
`creeping.field.ports.waves`:

    share^2 = (A/m^4)^2 + (C xi/m^4)^2 (D + (r - 1)^2 + (B/2)^2 + rho^4 T^4) + (k ds)^2

Sources: Derivations, F20 and F25. The factors were set on a sphere and on the ellipsoids (1, 0.8, 0.6) and
(1.2, 1, 0.8).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.ports.beams import PortBeams
from creeping.field.ports.waves import PathTerms, path_terms, port_waves
from creeping.rays.port_rays import PortRays

FLOOR, GROWING, ROUND = 0.2, 0.4, 0.1
"""A, C and D; on a sphere third order is known, and D is more than it needs."""
COARSER = 0.02
"""Error of polynomials of degree 5, in that of degree 3."""
Sums = Callable[[IntArray, float], tuple[ComplexArray, ComplexArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class PortSources:
    """Waves of geodesics (m,) of one kind of source.

    Attributes
    ----------
    square : (m,)
        M = m1 m2.
    waves : (m,) complex
    sizes, own : (m,)
        Largest value that a wave could have at its end, and its error.
    scale : float
        Of a wave, in that of a point source.
    polarised : bool
        Whether waves may be small for the direction of a source or a receiver only.
    beams : port number -> (port numbers (n,), least arclength, L) -> (n,), (n,), (n,)
        The field there of beams, farther along than that, for both widths, and the largest value it could have.
    """

    square: FloatArray
    waves: ComplexArray
    sizes: FloatArray
    own: FloatArray
    scale: float
    polarised: bool
    beams: Callable[[int], Sums]


def point_sources(rays: PortRays, k: float, order: int) -> PortSources:
    """Waves of point sources, 1/L."""
    terms = path_terms(rays, k)
    return scalar_sources(rays, terms, k, order, lambda of: port_waves(rays, terms, k, of), PortBeams, 1.0)


def scalar_sources(
    rays: PortRays,
    terms: PathTerms,
    k: float,
    order: int,
    waves_of: Callable[[int], ComplexArray],
    kind: type[PortBeams],
    scale: float,
) -> PortSources:
    """Waves (m,) of an order and beams of a kind; their error is a point source's, of order 1 with all that 2 adds."""
    waves = waves_of(order)
    strength = np.abs(waves)
    with np.errstate(invalid="ignore"):
        own = strength * path_error(rays, terms, k)
        if order == 1:
            own = own + np.abs(waves_of(2) - waves)
    own = np.where(np.isfinite(strength), own, 0.0)

    def beams(number: int) -> Sums:
        made = kind(rays.body, rays.ports[number], rays.normals[number], rays.length, k, order)

        def sums(targets: IntArray, beyond: float) -> tuple[ComplexArray, ComplexArray, FloatArray]:
            found, again = (values[:, 0] for values in made.sums(rays.ports[targets], beyond))
            return found, again, np.abs(found)

        return sums

    return PortSources(terms.square, waves, strength, own, scale, False, beams)


def path_error(rays: PortRays, terms: PathTerms, k: float) -> FloatArray:
    """Error of each wave by itself, as a share of it, up to 1 (m,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        bend, lean = np.mean(rays.bend, axis=1), np.mean((rays.torsion / rays.curvature) ** 2, axis=1)
        # r of the whole path, from its second exponent
        r = 4 * (terms.H / terms.xi * terms.square - 0.1 + bend / 60 + 0.15 * lean)
        growing = GROWING * terms.xi * np.sqrt(ROUND + (r - 1) ** 2 + (bend / 2) ** 2 + lean**2)
        parts = (FLOOR / terms.square**2, growing / terms.square**2, COARSER * k * rays.error)
        return np.asarray(np.minimum(np.sqrt(sum(part**2 for part in parts)), 1.0))
