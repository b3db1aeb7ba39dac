"""Where a march starts, turns to the total wave and how finely it goes.

With L = (2 rho^2/k)^(1/3) and m = (k rho/2)^(1/3) at the shadow line, delta = (2 k^2 kappa)^(-1/3), alpha the angle of
the tangent to d, and psi that by which it has turned away behind the line:

    start     kappa > 0 and sin^3(alpha)/kappa largest for alpha of 50..75 degrees: optics is best there
    switch    the last place with psi < min(1/m, 60 degrees) before psi = 100 degrees
    steps     0.12 L, in the driven part at most 0.3 wavelengths
    height    20 delta; where flatter max(20 delta, min(14 delta(kappa_min), 6 sqrt(flat length/k)))
    elements  0.2 delta(kappa_max) on the surface growing to min(0.6 delta, 1.3/(k sin alpha))
    twist     up to 8 delta

Heights and elements are rounded to powers of 1.35 and 1.2, towards the finer grid, so that rays share grids: closer
ones fill fewer lanes. So are caps, of 1.04, to the nearest: none is finer, a low one takes the body's shape from the
wave and a high one may fold the layer. A cap off by 5 % costs the penumbra before a concave surface half of its
accuracy where k over the curvature is 20.

Sources: [C93]; Derivations, F22.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.field.marching.profile import CAP, KEPT_BELOW, GridSpec, RayProfiles

AWAY = np.radians(100.0)
"""Angle behind the line at which a ray has turned away for good."""
FLAT = 0.3
"""Share of the curvature at the shadow line below which the surface is flat."""
LEAST_CURVATURE = 0.05
"""Share of the largest curvature that scales are taken from at least."""


class MarchStatus(IntEnum):
    """Status of a marched wave."""

    OK = 0
    SHARP = 1
    """k rho < 3 somewhere: from ``reliable`` on the wave may be off by its whole size."""
    DEEP = 2
    """A dip deeper or steeper than a layer over it can be: the wave behind ``reliable`` is not that of the body."""
    UNLIT = 3
    """No convex part of the lit side to start from: there is no wave."""
    HOLLOW = 4
    """The lit side behind the start is concave: what it reflects along the body is left out everywhere."""
    UNSTABLE = 5
    """The march did not stay finite: there is no wave."""


@dataclass(frozen=True, eq=False)
class MarchPlan:
    """Plan of each ray (rays,).

    Attributes
    ----------
    start, stop, switch : (rays,), L
        Where the march starts, from where on the rays of optics come that make up the wave there, and where it turns.
    steps : (rays, 2), L
        Longest step before and after the switch.
    specs : list of GridSpec
    status : (rays,) of int
        Codes of `MarchStatus`.
    reliable : (rays,), L
        s up to which the wave is to be trusted.
    """

    start: FloatArray
    stop: FloatArray
    switch: FloatArray
    steps: FloatArray
    specs: list[GridSpec]
    status: IntArray
    reliable: FloatArray


def march_plan(profiles: RayProfiles, wavenumber: float) -> MarchPlan:
    """Plan the marches of rays."""
    k, rays = wavenumber, len(profiles)
    ends = profiles.s[:, [0, -1]]
    at = ends[:, :1] + np.linspace(0, 1, 512) * (ends[:, 1:] - ends[:, :1])
    look = np.stack([profiles.along(ray, at[ray]) for ray in range(rays)])
    kappa, psi = look[..., 0], look[..., 1]
    floor = LEAST_CURVATURE * np.max(np.abs(kappa), axis=1)
    edge = np.stack([profiles.along(ray, np.array([-1e-9, 0.0]) * ends[ray, 1])[:, 0] for ray in range(rays)])
    reference = np.maximum(np.max(edge, axis=1), floor)
    start, alpha = _starts(at, kappa, psi)
    here = np.stack([profiles.along(ray, start[ray : ray + 1])[0, 0] for ray in range(rays)])
    # the rays of optics come from three radii of curvature behind the start at most
    stop = np.maximum(ends[:, 0], start - 3 / np.maximum(here, floor))
    layer = (2 / (reference**2 * k)) ** (1 / 3)
    scale = (k / (2 * reference)) ** (1 / 3)
    past = (at >= 0) & (np.cumsum((at >= 0) & (psi > AWAY), axis=1) == 0)
    turned = past & (psi < np.minimum(1 / scale, np.radians(60.0))[:, None])
    switch = _at_last(at, turned)
    step = 0.12 * layer
    steps = np.stack([np.minimum(step, 0.3 * 2 * np.pi / k), step], axis=1)
    served = at >= start[:, None]
    # the second half of a closed way decides no height: what comes there has decayed
    ahead = (at >= 0) & (at < 0.65 * ends[:, 1:])
    least = np.min(np.where(ahead, kappa, np.inf), axis=1)
    lowest = np.min(np.where(served, kappa, np.inf), axis=1)
    most = np.maximum(np.max(np.where(served, kappa, -np.inf), axis=1), reference)
    flat = np.mean((at >= 0) & (kappa < FLAT * reference[:, None]), axis=1) * (ends[:, 1] - ends[:, 0])
    delta = (2 * k * k * reference) ** (-1 / 3)
    delta_least, delta_most = ((2 * k * k * of) ** (-1 / 3) for of in (np.maximum(least, 0.2 * floor), most))
    height = np.maximum(20 * delta, np.minimum(14 * delta_least, 6 * np.sqrt(flat / k)))
    height = _rounded(height, k, 1.35, np.ceil)
    element = _rounded(np.minimum(0.6 * delta, 1.3 / (k * np.sin(np.maximum(alpha, 0.3)))), k, 1.2, np.floor)
    first, twist = _rounded(0.2 * delta_most, k, 1.35, np.floor), _rounded(8 * delta, k, 1.35, np.floor)
    cap = _rounded(CAP / np.maximum(-lowest, 1e-6 * most), k, 1.04, np.round)
    cap = np.where(lowest < -1e-6 * most, cap, np.inf)
    status, reliable = _status(k, at, look, alpha, cap, served)
    rows = np.stack([height, element, first, cap, twist], axis=1).tolist()
    specs = [GridSpec(a, b, c, d, e, k) for a, b, c, d, e in rows]
    return MarchPlan(start, stop, switch, steps, specs, status, reliable)


def _rounded(length: FloatArray, k: float, lattice: float, to: Callable[..., FloatArray]) -> FloatArray:
    """Lengths (rays,) on a lattice that does not depend on their unit."""
    return np.asarray(lattice ** to(np.log(k * length) / np.log(lattice)) / k)


def _at_last(at: FloatArray, mask: BoolArray) -> FloatArray:
    """Last place (rays,) where a mask holds, 0 if nowhere."""
    last = at.shape[1] - 1 - np.argmax(mask[:, ::-1], axis=1)
    return np.where(np.any(mask, axis=1), at[np.arange(len(at)), last], 0.0)


def _starts(at: FloatArray, kappa: FloatArray, psi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Start and its angle to d (rays,)."""
    rows = np.arange(len(at))
    alpha = np.where(at < 0, np.arccos(np.cos(psi)), -1.0)
    largest = at[rows, np.argmax(alpha, axis=1)]
    low, high = (
        np.where(np.any(alpha >= a, axis=1), _at_last(at, alpha >= a), largest) for a in np.radians([75.0, 50.0])
    )
    worth = np.sin(np.maximum(alpha, 0)) ** 3 / np.maximum(kappa, 0.1 * np.max(np.abs(kappa), axis=1, keepdims=True))
    worth = np.where((at >= low[:, None]) & (at <= high[:, None]) & (kappa > 0), worth, 0)
    best = np.where(np.max(worth, axis=1) > 0, np.argmax(worth, axis=1), np.argmin(np.abs(at - low[:, None]), axis=1))
    return at[rows, best], alpha[rows, best]


def _status(
    k: float, at: FloatArray, look: FloatArray, alpha: FloatArray, cap: FloatArray, served: BoolArray
) -> tuple[IntArray, FloatArray]:
    """Status and place up to which the wave is reliable (rays,)."""
    kappa = look[..., 0]
    status = np.full(len(at), MarchStatus.OK, dtype=np.int64)
    reliable = at[:, -1].copy()
    for ray in range(len(at)):
        sharp = served[ray] & (kappa[ray] > k / 3)
        if np.any(sharp):
            status[ray], reliable[ray] = MarchStatus.SHARP, at[ray, np.argmax(sharp)]
        deep = _too_deep(at[ray], look[ray], KEPT_BELOW * cap[ray], served[ray])
        if deep < reliable[ray]:
            status[ray], reliable[ray] = MarchStatus.DEEP, deep
        lit = (at[ray] < 0) & (np.cumsum((np.sin(look[ray, ::-1, 1]) >= 0) & (at[ray, ::-1] < 0))[::-1] == 0)
        if np.any(lit & ~served[ray] & (kappa[ray] < -FLAT * np.max(kappa[ray]) * LEAST_CURVATURE)):
            status[ray], reliable[ray] = MarchStatus.HOLLOW, at[ray, 0]
        # optics has no value next to the line
        if alpha[ray] < np.radians(20.0):
            status[ray], reliable[ray] = MarchStatus.UNLIT, at[ray, 0]
    return status, reliable


def _too_deep(s: FloatArray, look: FloatArray, depth: float, served: BoolArray) -> float:
    """Place behind which the chord over a dip is higher than ``depth`` above it, or too steep; infinite if none is.

    The chord begins at the last place before the dip whose tangent no later place rises above.
    """
    if not np.isfinite(depth):
        return np.inf
    some = np.flatnonzero(served & (s >= 0))[::2]
    s, kappa, psi, x = s[some], look[some, 0], look[some, 1], look[some, 2:]
    tangent, normal = np.stack([np.cos(psi), np.sin(psi)], 1), np.stack([np.sin(psi), -np.cos(psi)], 1)
    for dip in np.flatnonzero((kappa[:-1] > 0) & (kappa[1:] <= 0)):
        off = x[None, :] - x[: dip + 1, None]
        above = np.einsum("ijc,ic->ij", off, normal[: dip + 1])
        ahead = np.abs(psi[None, :] - psi[: dip + 1, None]) < AWAY
        clear = np.all((above <= 1e-9) | ~ahead | (s[None, :] <= s[: dip + 1, None]), axis=1)
        # none is where the ground ahead is lit again: the wave that grazes the shadow line is the chord
        i = np.max(np.flatnonzero(clear), initial=0)
        turn = psi[i:] - psi[i]
        towards = np.cos(turn)
        here = np.maximum(towards, 0.05)
        # the chord meets the normal of a place at this height
        length = np.sum((x[i:] - x[i]) * tangent[i:], axis=1) / here
        height = np.sum((x[i] + length[:, None] * tangent[i] - x[i:]) * normal[i:], axis=1)
        # it lands where it meets the ground, or where a rising surface turns parallel to it again
        rising = np.maximum.accumulate((turn < 0) & (s[i:] > s[dip]))
        landed = (towards < 0.1) | ((height < 0) & (s[i:] > s[dip])) | (rising & (turn >= 0))
        over = np.cumsum(landed) == 0
        # the rational step follows the wave up to 50 degrees between tangent and chord
        if np.any(over & ((height > depth) | (np.abs(turn) > np.radians(50.0)))):
            return float(s[i])
    return np.inf
