"""How much of a body with edges and tips the creeping rays of an incidence do not serve.

    line        (l_e + l_t)/(l + l_e + l_t)               l of the curves, l_e on edges, l_t next to tips
    rays        sum' h e^(-ξ Im τ)/sum h                  h the spacing of rays, sum' over those that ended there
    outline     the same as line, dl |T - (T.d) d| for dl, of l the attached part alone

ξ = (k/2)^(1/3) A with the attenuation integral A up to the end; Im τ is that of the slowest mode of any boundary, so
the share is one of amplitudes and rather too large.

Sources: Derivations, R6 and F3.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creeping._typing import FloatArray
from creeping.rays.reach import HARD_DECAY, IN_RANGE
from creeping.rays.status import AT_CREASES

if TYPE_CHECKING:
    from creeping.rays.fan import RayFan
    from creeping.shadow.line import ShadowLine


class Losses(NamedTuple):
    """Shares, from 0 to 1, that edges and tips take; 0 of a smooth body.

    Attributes
    ----------
    line : float
        Of the length of the shadow line: it goes on along edges, where no creeping ray starts.
    rays : float
        Of the rays, that end at an edge or a tip, each by what is left of its wave there.
    outline : float
        Of the outline of the lit side seen along d, that has no creeping wave.
    """

    line: float
    rays: float
    outline: float


def losses_of(fan: "RayFan", wavenumber: float | None = None) -> Losses:
    """Losses of a fan at a wavenumber, 1/L; where k rho is 10 at the median of the launch points if not given."""
    return Losses(fan.line.edge_share, _of_rays(fan, wavenumber), outline_share(fan.line))


def _of_rays(fan: "RayFan", wavenumber: float | None) -> float:
    launched = fan.launched
    ended = launched & np.isin(fan.status, AT_CREASES)
    if not np.any(ended):
        return 0.0
    k = IN_RANGE * float(np.median(fan.curvature[launched, 0])) if wavenumber is None else wavenumber
    # a ray that has ended stays where it is, and so does its attenuation
    left = np.exp(-np.cbrt(max(k, 0.0) / 2) * fan.attenuation[ended, -1] * HARD_DECAY)
    return float(np.sum(fan.spacing[ended] * left) / np.sum(fan.spacing[launched]))


def outline_share(line: "ShadowLine") -> float:
    """Share of the outline that is on edges and tips."""
    lost = line.at_tips + sum(_across(part.points, line.direction) for part in line.on_edges)
    if not lost:
        return 0.0
    kept = 0.0
    for curve in line.curves:
        for start, end, status in curve.arcs:
            if status == "attached":
                kept += _across(curve.at(np.linspace(start, end, 257)), line.direction)
    return float(lost / (lost + kept))


def _across(points: FloatArray, direction: FloatArray) -> float:
    """Length of a polyline seen along d, L."""
    chords = np.diff(points, axis=0)
    return float(np.sum(np.linalg.norm(chords - (chords @ direction)[:, None] * direction, axis=1)))
