"""The wave of each geodesic between ports, for the moments and receivers that are there, with its error.

    wave = here^T (components of `creeping.field.ports.tensor`) there

there and here are the axes of source and receiver along b and t of the path; 1 for what has no axis, or one along n.
Error of a wave as a share of it, what second order leaves out being of order 1/m^4; r, B and T as in
`creeping.field.ports.waves`:

    share^2 = (A/m^4)^2 + (C xi/m^4)^2 (D + (r - 1)^2 + (B/2)^2 + rho^4 T^4) + (k ds)^2

and what was not derived of the components; of order 1 all that order 2 adds.

Sources: Derivations, F20, F25 and F28. The factors were set on a sphere and on the ellipsoids (1, 0.8, 0.6) and
(1.2, 1, 0.8).
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.ports.tensor import TENSORS, PointTensor
from creeping.field.ports.waves import HardWave, bare_waves, path_of
from creeping.rays.port_rays import PortRays

FLOOR, GROWING, ROUND = 0.2, 0.4, 0.1
"""A, C and D, measured by ``python -m studies port_coverage``: 95 of 100 covered; D is more than a sphere needs."""
COARSER = 0.02
"""Error of polynomials of degree 5, in that of degree 3 (F25); on great circles below it (``tests/rays``)."""


@dataclass(frozen=True, eq=False)
class PathWaves:
    """Waves of geodesics (m,) from ports of one kind to ports of one kind.

    Attributes
    ----------
    rays : PortRays
    tensor : type
    axes : (n, 3)
        Unit tangents along slots; of no meaning for other ports.
    wavenumber : float, 1/L
    order : int
    values : (m,) complex, 1/L, or 1/L^2 on a conductor
        Infinite or NaN on caustics.
    sizes, own : (m,)
        Largest value that a wave could have for other axes, and its error.
    square : (m,)
        M = m1 m2.
    scale : float
        Of a wave, in that of a point source.
    polarised : bool
        Whether waves may be small for the axes of source and receiver only.
    """

    rays: PortRays
    tensor: type[PointTensor]
    axes: FloatArray
    wavenumber: float
    order: int
    values: ComplexArray
    sizes: FloatArray
    own: FloatArray
    square: FloatArray
    scale: float
    polarised: bool


def path_waves(rays: PortRays, kinds: tuple[str, str], axes: FloatArray, k: float, order: int) -> PathWaves:
    """Waves of all geodesics, from ports of the first kind to ports of the second."""
    kind = TENSORS[kinds]
    tensor = kind(path_of(rays, k))
    components, bare = _components(tensor, rays, order)
    there, here = (_along(rays, end, axes, components.shape[2 - end]) for end in (0, 1))
    with np.errstate(invalid="ignore", over="ignore"):
        values = np.einsum("mf,mfg,mg->m", here, components, there)
        sizes = np.sqrt(np.sum(np.abs(components) ** 2, axis=(1, 2)))
        parts = np.abs(components), tensor.missing() * np.abs(bare)[:, None, None]
        strength, missing = (np.einsum("mf,mfg,mg->m", np.abs(here), part, np.abs(there)) for part in parts)
        own = strength * _share(rays, k) + missing
        if order == 1:
            own = own + np.abs(np.einsum("mf,mfg,mg->m", here, _components(tensor, rays, 2)[0] - components, there))
    own = np.where(np.isfinite(sizes), own, 0.0)
    polarised = components.shape[2] > 1
    return PathWaves(rays, kind, axes, k, order, values, sizes, own, tensor.M, tensor.scale, polarised)


def _components(tensor: PointTensor, rays: PortRays, order: int) -> tuple[ComplexArray, ComplexArray]:
    """Components (m, fields, moments), 1/L or 1/L^2, and the waves w in them (m,)."""
    w = bare_waves(rays, tensor.hard.factor, tensor.k, order)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        whole = tensor.carried(order) + tensor.spread(rays.spreading, rays.rates, order)
        return whole * w[:, None, None], w


def _along(rays: PortRays, end: int, axes: FloatArray, count: int) -> FloatArray:
    """Axes of the ports at an end, 0 or 1, along b and t there (m, 2); (m, 1) of ones for those without."""
    if count == 1:
        return np.ones((len(rays), 1))
    ports, t = (rays.first, rays.second)[end], rays.directions[:, end]
    frames = np.stack([np.cross(rays.normals[ports], t), t], axis=1)
    return np.asarray(np.einsum("mac,mc->ma", frames, axes[ports]))


def _share(rays: PortRays, k: float) -> FloatArray:
    """Error of each wave by itself, as a share of it, up to 1 (m,)."""
    wave = HardWave(path_of(rays, k))
    with np.errstate(divide="ignore", invalid="ignore"):
        bend, lean = np.mean(rays.bend, axis=1), np.mean((rays.torsion / rays.curvature) ** 2, axis=1)
        # r of the whole path, from its second exponent
        r = 4 * (wave.H / wave.xi * wave.M - 0.1 + bend / 60 + 0.15 * lean)
        growing = GROWING * wave.xi * np.sqrt(ROUND + (r - 1) ** 2 + (bend / 2) ** 2 + lean**2)
        parts = (FLOOR / wave.M**2, growing / wave.M**2, COARSER * k * rays.error)
        return np.asarray(np.minimum(np.sqrt(sum(part**2 for part in parts)), 1.0))
