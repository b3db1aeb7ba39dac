"""What the uncertainty of a body does to its creeping rays.

A body known from points offers itself ``coarse_fit`` as well (see `creeping.geometry.surface.Surface`). Rays of a fan
are traced on both, from the same points, projected, and with the same d; they differ by about the error of the coarse
fit, or where the body errs by more than that it says by how much (``coarse_factor``). Or the whole incidence is done
again on it, shadow line and all (`coarse_fan`), for what follows from a fan.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.states import pack, project_bundle
from creeping.geometry.arguments import one_of, whole_number
from creeping.geometry.incident import headings, openings
from creeping.geometry.surface import project
from creeping.rays.ends import RayStatus
from creeping.rays.fan import RayFan, launch
from creeping.rays.tracer import RTOL
from creeping.rays.transport import spread
from creeping.shadow.attachment import line_tangents
from creeping.shadow.line import shadow_line
from creeping.storage.memory import within_budget


@dataclass(frozen=True)
class BodyUncertainty:
    """Rms differences of rays on the two fits of a body, at the rays' ends, scaled to the error of the finer fit.

    Attributes
    ----------
    points : float
        Rms distance, L.
    spreading : float
        Rms difference of J.
    attenuation : float
        Rms difference of the attenuation integral, L^(1/3).
    rays : int
        Number of rays compared; rays that do not creep, or end early on either fit, are left out.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.BodyUncertainty(points=1e-6, spreading=1e-5, attenuation=2e-6, rays=16).rays
    16
    """

    points: float
    spreading: float
    attenuation: float
    rays: int


def body_uncertainty(fan: RayFan, *, n_rays: int = 48) -> BodyUncertainty | None:
    """Estimate the error of a fan caused by the uncertain shape of its body.

    Parameters
    ----------
    fan : RayFan
    n_rays : int
        Number of rays to trace again on the second fit.

    Returns
    -------
    BodyUncertainty or None
        None if the body is known exactly or no ray reaches the end.

    Raises
    ------
    InvalidInputError
        If ``n_rays`` is not a positive whole number.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=0.5, n_rays=8)
    >>> cr.body_uncertainty(fan) is None                                 # a sphere is known exactly
    True
    """
    one_of(fan, "fan", RayFan, "creeping.launch")
    n_rays = whole_number(n_rays, "n_rays")
    within_budget(8.0 * n_rays, f"{n_rays} rays", "ask for fewer")
    coarse_fit: Any = getattr(fan.body, "coarse_fit", None)
    good = np.flatnonzero(fan.status == RayStatus.OK)
    if coarse_fit is None or not len(good):
        return None
    chosen = good[np.unique(np.linspace(0, len(good) - 1, n_rays).astype(int))]
    starts = fan.points[chosen, 0]
    ends = [_ends(body, starts, fan) for body in (fan.body, coarse_fit)]
    both = np.isinf(ends[0][:, 5]) & np.isinf(ends[1][:, 5])
    if not both.any():
        return None
    # times of detachment are infinite here
    off = coarse_factor(fan) * (ends[0][both, :5] - ends[1][both, :5])

    def rms(values: FloatArray) -> float:
        return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))

    return BodyUncertainty(rms(off[:, :3]), rms(off[:, 3:4]), rms(off[:, 4:5]), int(both.sum()))


def coarse_fan(fan: RayFan) -> RayFan | None:
    """The same incidence on the second fit, None for a body that is known exactly.

    As many rays and steps as the fan has, from its own shadow line, by direct integration.
    """
    coarse_fit: Any = getattr(fan.body, "coarse_fit", None)
    if coarse_fit is None:
        return None
    line = shadow_line(coarse_fit, source=fan.line.source)
    rays, steps = max(len(fan.points), 1), len(fan.travel_time) - 1
    flow = DirectFlow(coarse_fit, rtol=RTOL)
    return launch(flow, line, length=fan.length, n_rays=rays, n_steps=steps, max_gap=float("inf"))


def coarse_factor(fan: RayFan) -> float:
    """How much more the body of a fan errs than it differs from its second fit."""
    return float(getattr(fan.body, "coarse_factor", 1.0))


def _ends(body: Any, starts: FloatArray, fan: RayFan) -> FloatArray:
    """x (3), J, attenuation and detachment at the end of rays from points near the body: (n, 6)."""
    wave = fan.line.wave
    x, p = project_bundle(body, project(body, starts), headings(wave, starts))
    states = DirectFlow(body, rtol=RTOL).transport(pack(x, p, lanes=12), fan.travel_time[[0, -1]])
    tangents = line_tangents(body, x, headings(wave, x))
    j, _, _ = spread(body, x, tangents, p, openings(wave, x), states)
    end = states[:, -1]
    return np.column_stack([end[:, :3], j[:, -1], end[:, 10:]])
