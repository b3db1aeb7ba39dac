"""The wave of a scalar boundary at nodes of the lit side and of creeping rays.

On rays it is the sum of creeping modes, or, where the admittance varies and there are none, the marched wave

    u = y |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

of `creeping.field.marching.fan_waves`; then what is of second order has u's phase and the size of its error.

Source: Derivations, F16 and F22.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.boundary import Boundary
from creeping.field.currents.lit import lit_currents
from creeping.field.currents.nodes import STEP, LitNodes, RayNodes
from creeping.field.marching.fan_waves import fan_waves, march_alone, marchable, spread_out
from creeping.field.surface import surface_waves


def lit_waves(
    part: LitNodes, direction: FloatArray, extent: float, k: float, kind: Boundary
) -> tuple[ComplexArray, ComplexArray]:
    """Wave at nodes of the lit side of a body of size ``extent``, L, by second and by first order (n,)."""
    along = direction + part.cosine[:, None] * part.normals
    here = kind.at(part.points, along, STEP * extent)
    geometry = part.cosine, part.along, part.across, part.twist, part.rate, part.bend
    wave = np.exp(1j * k * (part.points @ direction))
    second, first = (wave * lit_currents(*geometry, k, here, order) for order in (2, 1))
    return second, first


def ray_waves(nodes: RayNodes, k: float, kind: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Wave at nodes of rays, 0 where there is none, and what of it is of second order (n,)."""
    if march_alone(nodes.fan.body, kind):
        return _marched(nodes, k, kind)
    waves, first = (surface_waves(nodes.rays, k, kind, order) for order in (2, 1))
    # on a caustic of the body the current is infinite and its weight 0
    ok = np.isfinite(waves) & np.isfinite(first)
    return np.where(ok, waves, 0.0), np.where(ok, waves - first, 0.0)


def _marched(nodes: RayNodes, k: float, kind: Boundary) -> tuple[ComplexArray, ComplexArray]:
    if not marchable(nodes.fan, kind, 2):
        some = f"of {len(nodes.fan.status)} rays of this incidence some stand alone, where no wave can be marched"
        if not kind.varies:
            raise SurfaceError(f"the body has joints, and {some}; its far field by rays is known, or another incidence")
        raise InvalidInputError(
            f"the admittance {kind.coating} varies, and {some}; give a constant admittance, or another incidence"
        )
    y, error = fan_waves(nodes.fan, wavenumber=k, boundary=kind).along(nodes.rows, nodes.rays.time)
    wave = spread_out(y, nodes.rays, k)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = wave * np.minimum(error / np.abs(y), 1.0)
    known = np.isfinite(error) & np.isfinite(wave) & np.isfinite(off)
    return np.where(known, wave, 0.0), np.where(known, off, 0.0)
