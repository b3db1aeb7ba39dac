"""How far a wave is from the limit that its expansions are about: two numbers of a fan and a wavenumber.

    k rho              large where the wave is short against the radius of curvature along the rays, rho = 1/kappa_n
    kappa_t rho/m^2    small where the body is not much more curved across the rays than along them, m^3 = k rho/2

The first alone says nothing of a slender body seen along its axis. Both are taken over the rays that the wave launches,
as long as xi < 1: what comes after has died away.

Sources: [LK59]; Derivations, F4.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray
from creeping.field.arguments import checked
from creeping.field.boundary import fock_scale
from creeping.geodesics.attenuation import curvature_values
from creeping.geodesics.equations import sharpest_curvature
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import ATTENUATION, P, X, pack
from creeping.geodesics.tableaus import RUNGE_KUTTA_4
from creeping.geometry.arguments import one_of
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.surface import Surface, normal
from creeping.rays.fan import RayFan
from creeping.rays.reach import early_length, trial_points
from creeping.shadow.attachment import LaunchPoints, evenly_chosen

EARLY = 1.0
"""xi up to which a ray matters."""
SOME, TURN = 32, 0.25
"""Rays of an incidence that stand for all in `validities`, and the largest angle by which they turn in a step."""
WITHIN, EDGE = (10.0, 1.0), (4.0, 2.0)
"""Least k rho and largest kappa_t rho/m^2 within the range of the expansions, and at its edge: there currents erred by
0.1 to 2 % rms of the largest |f| on a sphere and an ellipsoid, rays by 0.5 to 5 %; beyond, by up to 19 and 42 %."""


class Validity(NamedTuple):
    """Least k rho and largest |kappa_t| rho/m^2 on the rays of a fan, without unit; NaN if there are no rays.

    rho = 1/kappa_n; kappa_n and kappa_t are the normal curvatures along and across the ray; m = (k rho/2)^(1/3).

    Examples
    --------
    >>> Validity(24.0, 0.8)
    Validity(least_k_rho=24.0, largest_transverse=0.8)
    """

    least_k_rho: float
    largest_transverse: float


def validity(fan: RayFan, *, wavenumber: float) -> Validity:
    """Least k rho and largest |kappa_t| rho/m^2 on the rays of a fan.

    rho = 1/kappa_n; kappa_n and kappa_t are the normal curvatures along and across the ray; m = (k rho/2)^(1/3).
    The expansions need a large k rho and a small kappa_t rho/m^2.

    Parameters
    ----------
    fan : RayFan
    wavenumber : float, 1/L

    Raises
    ------
    InvalidInputError
        On a bad wavenumber.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere(radius=2.0)
    >>> fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, direction=(0, 0, 1)), length=3.0, n_rays=16)
    >>> found = cr.validity(fan, wavenumber=27.0)               # k a and 1/m^2
    >>> round(found.least_k_rho, 6), round(found.largest_transverse, 6)
    (54.0, 0.111111)
    """
    one_of(fan, "fan", RayFan, "creeping.launch")
    k = checked(wavenumber, 2)
    if not len(fan.points):
        return Validity(np.nan, np.nan)
    launched = fan.launched
    there = (fan.curvature > 0) & (fan.travel_time < fan.detachment[:, None]) & launched[:, None]
    there &= np.cbrt(k / 2) * fan.attenuation < EARLY
    if not np.any(there):
        return Validity(np.nan, np.nan)
    along, across = fan.curvature[there], _across(fan.body, fan.points[there], fan.directions[there])
    return Validity(float(k / along.max()), float((across / along / fock_scale(k, along) ** 2).max()))


def validities(
    body: Surface, launch: LaunchPoints, until: float, wavenumbers: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """Least k rho and largest |kappa_t| rho/m^2 for n incidences and k wavenumbers: (n, k) each.

    From all launch points and along SOME rays of each incidence. Where curvature changes within their spacing, as at
    the tip of a slender body, or falls to 0 beside a concave region, a fan of more rays finds more extreme values.

    Parameters
    ----------
    body : Surface
        Without a speed.
    launch : LaunchPoints
        Of n incidences.
    until : float, L
        Length of the rays, such as `creeping.rays.reach.early_length` at the lowest wavenumber.
    wavenumbers : tuple of float, 1/L
    """
    radius, transverse = launch_validity(body, launch)
    ks = np.array(wavenumbers)
    least, largest = radius[:, None] * ks, transverse[:, None] / np.cbrt(ks) ** 2
    incidence, ray = np.nonzero(evenly_chosen(launch.there, SOME))
    if not len(ray):
        return least, largest
    starts = pack(launch.points[incidence, ray], launch.directions[incidence], jacobi=True)
    starts = np.concatenate([starts, np.zeros((len(starts), 1))], axis=1)
    # equal steps: a ray comes out the same in whatever company
    steps = max(8, int(np.ceil(until * sharpest_curvature(body) / TURN)))
    times: FloatArray = until * np.arange(steps + 1, dtype=float) / steps
    states = trace_states(body, starts, times, rtol=0.0, step=times[1], method=RUNGE_KUTTA_4)
    early = np.cbrt(min(wavenumbers) / 2) * states[..., ATTENUATION] < EARLY
    row, step = np.nonzero(early)
    some = states[row, step]
    along, across = np.zeros(early.shape), np.zeros(early.shape)
    along[row, step], across[row, step] = curvature_values(body, some), _across(body, some[:, X], some[:, P])
    early &= np.logical_and.accumulate(along > 0, axis=1)
    first = np.flatnonzero(np.diff(incidence, prepend=-1))
    rows = incidence[first]
    for j, k in enumerate(wavenumbers):
        mine = early & (np.cbrt(k / 2) * states[..., ATTENUATION] < EARLY)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(mine, across / along / fock_scale(k, along) ** 2, -np.inf).max(axis=1)
        sharpest = np.where(mine, along, 0.0).max(axis=1)
        sharpest, ratio = np.maximum.reduceat(sharpest, first), np.maximum.reduceat(ratio, first)
        known = sharpest > 0
        mine_of = rows[known]
        least[mine_of, j] = np.fmin(least[mine_of, j], k / sharpest[known])
        largest[mine_of, j] = np.fmax(largest[mine_of, j], ratio[known])
    return least, largest


def launch_validity(body: Surface, launch: LaunchPoints) -> tuple[FloatArray, FloatArray]:
    """Least rho, L, and largest 2^(2/3) |kappa_t| rho^(1/3), L^(-2/3), at launch points of n incidences: twice (n,).

    They give the two numbers at the start of the rays for any k, as k rho and k^(-2/3) times the second.
    """
    incidence, ray = np.nonzero(launch.there)
    least, largest = np.full(len(launch.directions), np.nan), np.full(len(launch.directions), np.nan)
    points, directions = launch.points[incidence, ray], launch.directions[incidence]
    along, across = curvature_values(body, pack(points, directions)), _across(body, points, directions)
    kept = along > 0
    incidence, along, across = incidence[kept], along[kept], across[kept]
    first = np.flatnonzero(np.diff(incidence, prepend=-1))
    if len(first):
        least[incidence[first]] = 1 / np.maximum.reduceat(along, first)
        largest[incidence[first]] = np.maximum.reduceat(np.cbrt(4 / along) * across, first)
    return least, largest


def body_validity(body: Surface, *, wavenumber: float) -> Validity:
    """Least k rho and largest |kappa_t| rho/m^2 over twelve incidences; NaN if none launches a ray.

    Examples
    --------
    >>> import scatterers as sc
    >>> round(body_validity(sc.Sphere(radius=2.0), wavenumber=27.0).least_k_rho, 6)
    54.0
    """
    k = checked(wavenumber, 2)
    launch = trial_points(body)
    least, largest = validities(body, launch, early_length(body, k), (k,))
    known = np.isfinite(least)
    return (
        Validity(float(least[known].min()), float(largest[known].max())) if np.any(known) else Validity(np.nan, np.nan)
    )


def is_reached(body: Surface, wavenumber: float) -> bool:
    """Whether the expansions of rays and currents reach to a wavenumber, at their edge at least."""
    found = body_validity(body, wavenumber=wavenumber)
    return found.least_k_rho >= EDGE[0] and found.largest_transverse <= EDGE[1]


def validity_words(found: Validity, *, measured: bool = False) -> str:
    """Text on the range of the expansion at these numbers; ``measured`` if the field's error was measured.

    Examples
    --------
    >>> validity_words(Validity(24.0, 0.8))
    'k rho >= 24, kappa_t rho/m^2 <= 0.8; within the range of the expansion'
    >>> validity_words(Validity(7.7, 0.7), measured=True)
    'k rho >= 7.7, kappa_t rho/m^2 <= 0.7; at the edge of the range of the expansion, go by the error measured'
    """
    numbers = validity_numbers(found)
    inside, near = (
        found.least_k_rho >= k_rho and found.largest_transverse <= across for k_rho, across in (WITHIN, EDGE)
    )
    if inside:
        return f"{numbers}; within the range of the expansion"
    where = "at the edge of" if near else "on some rays beyond"
    said = "go by the error measured" if measured else "errors may be " + ("some per cent" if near else "large")
    return f"{numbers}; {where} the range of the expansion, {said}"


def validity_numbers(found: Validity) -> str:
    """Text of k rho and kappa_t rho/m^2."""
    return f"k rho >= {found.least_k_rho:.3g}, kappa_t rho/m^2 <= {found.largest_transverse:.2g}"


def _across(body: Surface, points: FloatArray, directions: FloatArray) -> FloatArray:
    """|kappa_t| (n,), 1/L, at points (n, 3) of rays in the directions (n, 3)."""
    return np.abs(normal_curvature(body, points, np.cross(normal(body, points), directions)))
