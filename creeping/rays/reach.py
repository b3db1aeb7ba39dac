"""How long creeping rays have to be: until what the wave on them can still do has died away.

    |exp{i ξ τ}| = exp{-ξ Im τ},   ξ = (k/2)^(1/3) ∫ κₙ^(2/3) ds,   τ = |α'₁| e^{iπ/3} of the slowest mode, hard

The length "auto" is that at which this has fallen by e^-7.5 on all but the tenth of the rays that decay least, and at
most four body sizes. It comes of trial rays of its own: it depends on body, incidence and wavenumber alone. A weighted
body has no field: its rays take the time that 1.5 body sizes take at its median speed.

Sources: [LK59], [AS64, sec. 10.4]; Derivations, F4.
"""

from typing import Final

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import InvalidInputError
from creeping.geodesics.attenuation import curvature_values
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.equations import points_of_charts
from creeping.geodesics.states import ATTENUATION, DETACHMENT, END, WHOLE, pack, whole_lanes
from creeping.geometry.arguments import positive_number, shown
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.evaluators import speed_of, speed_values
from creeping.geometry.surface import Surface, memo, size
from creeping.rays.transport import carried
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.line import ShadowLine, shadow_lines

AUTO: Final = "auto"
HARD_DECAY = 1.0187929716474710 * float(np.sin(np.pi / 3))
"""Im τ of the slowest mode, that of the hard boundary: α'₁ is the first zero of Ai' [AS64, table 10.13]."""
DECAY, SPARED, LONGEST = 7.5, 0.1, 4.0
"""Exponent by which the wave falls, share of the rays that need not, and body sizes after which it does not matter."""
IN_RANGE = 10.0
"""k rho from which the expansions serve; at it, rho the median at the launch points, is k where none is given."""
TRIALS = 64
"""Trial rays of an incidence."""
GRAIN = 0.01
"""Lengths are multiples of this, in body sizes, so that machines that round differently agree."""
INCIDENCES = 12
"""Directions that stand for all, spread evenly over the sphere."""


def ray_length(
    line: ShadowLine,
    length: float | str = AUTO,
    *,
    wavenumber: float | None = None,
    decay: float = HARD_DECAY,
) -> float:
    """Length of the rays of one incidence, asked for as a number or as "auto".

    Parameters
    ----------
    line : ShadowLine
    length : float or "auto", L (travel time for a weighted body)
    wavenumber : float, optional, 1/L
        Lowest that the rays are for; k rho = 10 at the median radius of curvature of the launch points if not given.
    decay : float
        Im τ of the slowest mode, without unit.

    Returns
    -------
    float, L (travel time for a weighted body)

    Raises
    ------
    InvalidInputError
        If length or wavenumber is no positive finite number, or a wavenumber is given for a weighted body.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Sphere(), direction=(0, 0, 1))
    >>> far = 7.5 / (15 ** (1 / 3) * HARD_DECAY)            # xi Im tau = 7.5 on a ball of radius 1
    >>> bool(0 <= ray_length(line, wavenumber=30.0) - far < 0.02)
    True
    """
    body = line.body
    if wavenumber is not None:
        _positive("wavenumber", wavenumber)
        if speed_of(body) is not None:
            raise InvalidInputError(f"wavenumber = {wavenumber!r} is for rays of constant speed; {body!r} has a speed")
    if not (isinstance(length, str) and length == AUTO):
        return asked_length(body, _positive("length", length, ", nor 'auto'"))
    if speed_of(body) is not None:
        return weighted_length(body)
    launch = memo(line, "trial launch points", lambda: line.launch_points(TRIALS))
    return float(decayed_lengths(body, launch, wavenumber, decay)[0])


def asked_length(body: Surface, length: float) -> float:
    """A length that was asked for, if a ray can be meant to have it.

    Raises
    ------
    InvalidInputError
        If it is not from 1e-6 to 1e5 body sizes, beyond which phases have no digits left, or times of a weighted body
        that take as long.
    """
    unit = size(body) if speed_of(body) is None else weighted_length(body)
    for word, wrong, end in (("more", length > 1e5 * unit, 1e5), ("less", length < 1e-6 * unit, 1e-6)):
        if wrong:
            raise InvalidInputError(f"length = {length:g} is {word} than {end:g} sizes of the body; give another")
    return length


def body_length(body: Surface, wavenumber: float | None = None) -> float:
    """The length "auto" for rays of all incidences: the largest of INCIDENCES evenly spread ones.

    Parameters
    ----------
    body : Surface
    wavenumber : float, optional, 1/L
        As for `ray_length`.

    Examples
    --------
    >>> import scatterers as sc
    >>> bool(abs(body_length(sc.Sphere(), 30.0) - 7.5 / (15 ** (1 / 3) * HARD_DECAY)) < 0.02)
    True
    """
    if speed_of(body) is not None:
        return weighted_length(body)
    return float(np.max(decayed_lengths(body, trial_points(body), wavenumber)))


def early_length(body: Surface, wavenumber: float) -> float:
    """Length, L, beyond which xi > 1 on all rays of INCIDENCES evenly spread incidences."""
    return float(np.max(decayed_lengths(body, trial_points(body), wavenumber, DECAY, spared=0.0)))


def trial_points(body: Surface) -> LaunchPoints:
    """Launch points of INCIDENCES evenly spread incidences, cached."""
    return memo(body, "trial points", lambda: shadow_lines(body, fibonacci_directions(INCIDENCES), TRIALS).launch)


def decayed_lengths(
    body: Surface,
    launch: LaunchPoints,
    wavenumber: float | None = None,
    decay: float = HARD_DECAY,
    *,
    spared: float = SPARED,
) -> FloatArray:
    """Lengths (n,), L, at which waves of n incidences have died away; LONGEST body sizes where no ray is launched."""
    most, there = LONGEST * size(body), launch.there
    times: FloatArray = np.linspace(0.0, most, 65)

    def traced() -> tuple[FloatArray, FloatArray]:
        starts = pack(launch.points[there], launch.headings[there])
        curvature = np.full(there.shape, np.nan)
        curvature[there] = curvature_values(body, starts)
        return curvature, carried(DirectFlow(body, rtol=1e-6), launch, times, components=whole_lanes(body))

    # the same for all wavenumbers; lengths are rounded to GRAIN
    curvature, states = memo(launch, "trial rays", traced)
    k = None if wavenumber is None else _positive("wavenumber", wavenumber)
    found = np.full(len(there), most)
    for row in np.flatnonzero(there.any(axis=1)):
        # on a crease the curvature may be that of a flat piece
        rays, typical = states[row, there[row]], float(np.median(curvature[row, there[row]])) or 1 / size(body)
        lowest = IN_RANGE * typical if k is None else k
        wanted = DECAY / (np.cbrt(lowest / 2) * decay)
        ends = [np.interp(wanted, ray[:, ATTENUATION], times, right=most) for ray in rays]
        # a wave ends where its ray detaches, or comes to an edge or a tip
        last = rays[:, -1, DETACHMENT]
        if rays.shape[-1] > WHOLE:
            last = np.minimum(last, rays[:, -1, END])
        found[row] = np.quantile(np.minimum(ends, last), 1 - spared)
    grain = GRAIN * size(body)
    # rays that all end where they begin have a length, too
    return np.clip(np.ceil(found / grain - 1e-6) * grain, grain, most)


def weighted_length(body: Surface) -> float:
    """Travel time in which the rays of a weighted body cross 1.5 body sizes at its median speed."""
    speeds = speed_values(body, points_of_charts(body))
    moving = speeds[speeds > 0]
    return 1.5 * size(body) / (float(np.median(moving)) if len(moving) else 1.0)


def _positive(name: str, value: float | str, alternative: str = "") -> float:
    try:
        return positive_number(value, name)
    except InvalidInputError as error:
        raise InvalidInputError(f"{name} = {shown(value)} is not a positive finite number{alternative}") from error
