"""The wave on the nodes of creeping rays: marched along them, or the sum of creeping modes, whichever errs less.

    u = y |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

with y of `creeping.field.marching.fan_waves`, which has no end where modes have theirs: ground behind an inflection has
a current. What it errs by has the place of what is of second order, e^{i arg u} times the error, where it is larger.

Source: Derivations, F16 and F22.
"""

import numpy as np

from creeping._typing import ComplexArray
from creeping.field.boundary import Boundary
from creeping.field.currents.nodes import RayNodes
from creeping.field.far_geometry import fan_strips
from creeping.field.marching.fan_waves import fan_waves, marchable
from creeping.field.surface import surface_waves


def ray_waves(nodes: RayNodes, k: float, kind: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Wave at nodes (n,), u or du/dn, 0 where there is none, and what of it is of second order."""
    waves, first = (surface_waves(nodes.rays, k, kind, order) for order in (2, 1))
    change = waves - first
    if marchable(nodes.fan, kind, 2):
        _march(nodes, k, kind, waves, change)
    # on a caustic of the body the current is infinite and its weight 0
    ok = np.isfinite(waves) & np.isfinite(change)
    return np.where(ok, waves, 0.0), np.where(ok, change, 0.0)


def _march(nodes: RayNodes, k: float, kind: Boundary, waves: ComplexArray, change: ComplexArray) -> None:
    """Put what is marched in place of what modes give."""
    marched = fan_waves(nodes.fan, wavenumber=k, boundary=kind)
    for number, rows in enumerate(marched.rows):
        order = np.full(len(nodes.fan.status), -1)
        order[rows] = np.arange(len(rows))
        mine = np.flatnonzero(order[nodes.rows] >= 0)
        sigma = fan_strips(nodes.fan)[number].positions[order[nodes.rows[mine]]]
        rays = nodes.rays[mine]
        y, error = (part(number, sigma, rays.time) for part in (marched.at, marched.error))
        with np.errstate(divide="ignore", invalid="ignore"):
            wave = y / np.sqrt(np.abs(rays.spreading)) * np.exp(1j * (k * rays.eikonal - 0.5 * np.pi * rays.caustics))
            off = wave * np.minimum(error / np.abs(y), 1.0)
        known = np.isfinite(error)
        waves[mine] = np.where(known, wave, 0.0)
        change[mine] = np.where(known, np.where(np.abs(change[mine]) > np.abs(off), change[mine], off), 0.0)
