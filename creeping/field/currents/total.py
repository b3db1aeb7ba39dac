"""The total field at points off the body by currents, with its error.

With epsilon what currents leave of the incident wave inside the body, epsilon' what u', of second order, leaves there,
R the distance from the body's middle and f_rms the rms of the far field,

    error = epsilon [(L s)^2 + (S |u'|/epsilon')^2]^(1/2),   |u'|^2 = |u'_lit|^2 + |u'_rays|^2
    s = [1 + (R/f_rms)^2]^(-1/2) in the light,   s = [1 + (R/(k f_rms^2))^2]^(-1/2) in the shadow

since the scattered field is f_rms/R, rms over all directions, and f(d)/R = k f_rms^2/R at most, straight ahead, where
it is no more than the incident wave itself.

Sources: [CK13, sec. 3.2]; Derivations, F17 and F20. L and S were set on four bodies (`studies.near_coverage`).
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.quadrature import body_nodes
from creeping.geometry.surface import Surface

LIT_LEVEL, DARK_LEVEL, SHAPE = 2.0, 4.0, 2.0
"""Factors L and S of the error."""
ABSORBING_LEVEL = 1.3
"""L in the light of an impedance: most of what is wrong with its currents stands at the line and radiates ahead."""
OFF = 0.25
"""Least distance from the body, in wavelengths, at which currents serve."""


def far_enough(body: Surface, wavenumber: float, points: FloatArray, least: float = OFF) -> BoolArray:
    """Whether points (n, 3), L, are so far off the body that sums over nodes are integrals: (n,).

    ``least`` is the distance asked for, in wavelengths.

    Raises
    ------
    SurfaceError
        If the wavenumber, 1/L, is too high for any mesh of the body.
    """
    # the nodes of the lit side, on the whole of the body
    return body_nodes(body, 2 * wavenumber).distance(points) > least * 2 * np.pi / wavenumber


def total_at(
    currents: SurfaceCurrents, points: FloatArray, dark: BoolArray
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Incident and scattered field and the error of their sum at points (n, 3), L, some of them in the dark: (n,)."""
    incident = np.exp(1j * currents.wavenumber * (points @ currents.direction))
    lit = ABSORBING_LEVEL if currents.boundary.kind == "impedance" else LIT_LEVEL
    level = level_at(currents, points, dark, currents.mean_amplitude, lit, DARK_LEVEL)
    scattered, shape = currents.scattered_and_changed(points)
    return incident, scattered, currents.extinction * np.hypot(level, SHAPE * shape)


def level_at(
    currents: SurfaceCurrents, points: FloatArray, dark: BoolArray, mean: float, lit: float, shadow: float
) -> FloatArray:
    """L s (n,) at points (n, 3), L, some in the dark, with f_rms = ``mean`` and L in the light and the shadow."""
    middle = np.mean(np.asarray(currents.body.bounds, dtype=float), axis=0)
    away = np.linalg.norm(points - middle, axis=1)
    in_shadow = shadow / np.hypot(1, away / (currents.wavenumber * mean**2))
    return np.asarray(np.where(dark, in_shadow, lit / np.hypot(1, away / mean)))
