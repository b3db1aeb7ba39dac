"""The integral equation of the second kind on a body's surface, and one step of it from the currents of the body.

    hard        u = 2 u_inc + 2 int u dG/dn_y dS_y
    soft        du/dn = 2 du_inc/dn - 2 int du/dn dG/dn_x dS_y
    impedance   (1 + eta/c) u = 2 u_inc + 2 int u (dG/dn_y + ik eta_y G) dS_y + (eta/c) u,   c = -n.d
    conductor   J = 2 n x H_inc + 2 n x int grad_x G x J dS_y

The expansions of lit ground know its curvature at a place and no more; where it jumps, at a joint, the true field
passes from one to the other over the paths by which waves come from either side. The right side, with the expansions
in it, holds these waves. On lit ground a step makes what is wrong smaller, by what a wave that grazes less than c
suffers from one place to the next, kappa/(k c^3); behind the line it does not, and there rays serve. What an impedance
does to a plane mirror, (eta/c) u, stands on the left too: it is not small.

The sums over nodes are those of `creeping.field.currents.node_sums`.

Source: Derivations, F30 and F32.
"""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.node_sums import NodeSums, sums_at
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.served import Served
from creeping.field.shed_wave import smoothstep
from creeping.geometry.surface import normal

NEAR, NEAR_VECTOR = 2.0, 0.8
"""Width a of the window, over 1/k; of a conductor, whose sums need no more and notice how curvature varies in it."""
LEAST = 0.05
"""Least c with which the wave of an impedance is parted."""
OWN, EVERYWHERE, STILL = 1.5, 2.0, 0.25
"""Error of a step, in what currents leave of the incident wave inside, and in what it changes everywhere; and what it
leaves of the error before."""
SAMPLE, CLEAR, QUARTER = 128, 0.3, 0.25
"""Nodes, of c above this, by which that is judged, and the quantile."""
WHOLE = 0.5
"""Share of lit ground from which on the step is taken whole: behind the line its error grows."""
_EVERYWHERE: "WeakKeyDictionary[SurfaceCurrents, float]" = WeakKeyDictionary()


def with_a_step(field: Served, currents: SurfaceCurrents, points: FloatArray, share: FloatArray, unit: float) -> Served:
    """The field on a body with joints, at points (n, 3), L, of which ``share`` (n,) is lit ground, by the equation.

    A step is taken as far as it changes more than it errs by itself, as a share of the incident wave's ``unit``.
    """
    at = np.flatnonzero((share > 0) & np.isfinite(field.values))
    if not len(at):
        return field
    values = field.values[at]
    change = stepped(currents, points[at], normal(currents.body, points[at]), values) - values
    own = unit * np.hypot(OWN * currents.extinction, EVERYWHERE * _everywhere(currents, unit))
    size, reach = np.abs(change), smoothstep(share[at], 0.0, WHOLE)
    taken = reach * size**2 / np.maximum(size**2 + own**2, 1e-300)
    wave, error = field.wave.copy(), field.error.copy()
    wave[at] += taken * change
    error[at] = np.hypot(error[at], (reach - taken * (1 - STILL)) * size)
    return replace(field, wave=wave, error=error)


def _everywhere(currents: SurfaceCurrents, unit: float) -> float:
    """What a step changes far from joints too, over the wave's ``unit``: where currents elsewhere are wrong."""
    if currents not in _EVERYWHERE:
        clear = np.flatnonzero(currents.lit & (currents.normals @ currents.direction < -CLEAR))
        some = clear[:: max(1, len(clear) // SAMPLE)]
        points, normals, values = currents.points[some], currents.normals[some], currents.values[some]
        change = np.abs(stepped(currents, points, normals, values) - values)
        _EVERYWHERE[currents] = float(np.quantile(change, QUARTER) / unit) if len(some) else 0.0
    return _EVERYWHERE[currents]


def stepped(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, values: ComplexArray) -> ComplexArray:
    """Field u, du/dn if soft, or J, at points of the body with normals (m, 3) by one step from ``values`` (m, ...)."""
    wide = NEAR_VECTOR if currents.boundary.kind == "conductor" else NEAR
    window, wave = wide / currents.wavenumber, twice_incident(currents, points, normals)
    if currents.boundary.kind != "impedance":
        return wave + sums_at(currents, points, normals, window).total(currents.values, values)
    rest, own = NodeSums(currents, points, normals, window).of(currents.values)
    eta = np.broadcast_to(currents.boundary.at(points).admittance, (len(points),))
    share = eta / np.maximum(-normals @ currents.direction, LEAST)
    return np.asarray((wave + rest + (own + share) * values) / (1 + share))


def twice_incident(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray) -> ComplexArray:
    """2 u_inc, 2 du_inc/dn if soft, or 2 n x H_inc, at points of the body with normals (m, 3)."""
    k, d = currents.wavenumber, currents.direction
    wave = 2 * np.exp(1j * k * (points @ d))
    if isinstance(currents, ConductorCurrents):
        magnetic = np.cross(d, currents.incident_electric, axisb=0).T
        return np.asarray(wave[:, None, None] * np.cross(normals[:, :, None], magnetic[None], axis=1))
    return np.asarray(1j * k * (normals @ d) * wave if currents.boundary.kind == "soft" else wave)
