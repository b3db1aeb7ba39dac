"""The wave that rays shed in both orders at once: what the far field asks of each, at every frequency and boundary.

Beyond the passage to the series of `creeping.field.shed_wave` a compiled sum over modes serves, beyond SERIES alone;
before, and for modes that differ from ray to ray or a point source, that module itself.

Sources: Derivations, F4 to F7.
"""

from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import Boundary
from creeping.field.creeping_modes import BETA, decay_slopes, decay_terms, modes_of
from creeping.field.ray_scales import fock_parameter, transverse_ratios
from creeping.field.shed_wave import SECOND_ORDER, shed_wave
from creeping.field.special.fock import SERIES, pekeris_star, pole
from creeping.kernels.threads import in_slices
from creeping.rays.quantities import RayPoints

EACH = 5e-6
"""Seconds of a block of the sum, about."""
_NUMBERS: "WeakKeyDictionary[RayPoints, FloatArray]" = WeakKeyDictionary()
"""What `_numbers_of` has found of rays that are still in use."""


def shed_orders(
    rays: RayPoints, wavenumber: float, boundary: Boundary, *, transverse_weight: float = 0.25
) -> tuple[ComplexArray, ComplexArray]:
    """`shed_wave` of order 1 and of order 2 of rays (n,)."""

    def plain(some: RayPoints, order: int) -> ComplexArray:
        return shed_wave(some, wavenumber, boundary, order, transverse_weight=transverse_weight)

    if boundary.kind == "impedance" or not rays.time.size or np.any(rays.opening > 0):
        return plain(rays, 1), plain(rays, 2)
    xi = fock_parameter(rays, wavenumber)
    first, second = _by_modes(rays, wavenumber, boundary, transverse_weight)
    early = rays.alive & (xi < SECOND_ORDER[1])
    between = np.flatnonzero(rays.alive & ~early & (xi <= SERIES))
    if len(between):
        # what the second order adds, to the series in place of the sum
        change = second[between] - first[between]
        first[between] = pekeris_star(xi[between], boundary.q(xi[between])) - pole(xi[between])
        second[between] = first[between] + change
    turn = np.exp(0.25j * np.pi)
    first, second = (np.where(rays.alive, turn * one, 0.0) for one in (first, second))
    if np.any(early):
        some = rays[early]
        first[early], second[early] = plain(some, 1), plain(some, 2)
    return first, second


def _by_modes(
    rays: RayPoints, wavenumber: float, boundary: Boundary, transverse_weight: float
) -> tuple[ComplexArray, ComplexArray]:
    """Sums over modes of both orders (n,), without e^{iπ/4}."""
    from creeping.field.kernels.mode_orders import mode_orders
    from creeping.kernels.block import BLOCK

    numbers, modes = _numbers_of(rays), _constants_of(boundary)
    out = np.empty((4, numbers.shape[1]))

    def work(part: slice) -> None:
        mode_orders(numbers, modes, wavenumber, transverse_weight, BETA, part.start, part.stop, out)

    in_slices(work, numbers.shape[1] // BLOCK, seconds=EACH, multiple=1)
    out = out[:, : len(rays.time)]
    return out[0] + 1j * out[1], out[2] + 1j * out[3]


def _numbers_of(rays: RayPoints) -> FloatArray:
    """What the sum takes of rays, whatever the frequency and boundary: (lanes, n), whole blocks, kept with the rays."""
    from creeping.field.kernels.mode_orders import LANES
    from creeping.kernels.block import BLOCK

    if rays not in _NUMBERS:
        n = len(rays.time)
        found = np.zeros((LANES, -(-n // BLOCK) * BLOCK))
        curved = [kappa > 0 for kappa in rays.curvature]
        ends = (
            [np.cbrt(2 * np.maximum(kappa, 0.0)) for kappa in rays.curvature],
            rays.radius_rate,
            [np.where(c, np.nan_to_num(r), 0.0) for c, r in zip(curved, transverse_ratios(rays), strict=True)],
            [np.where(c, np.nan_to_num(b), 0.0) for c, b in zip(curved, rays.radius_bend, strict=True)],
        )
        # in the order of the lanes: what is of both ends stands side by side
        found[:, :n] = np.stack([*rays.integrals[:, 1:].T, *(end for pair in ends for end in pair)])
        _NUMBERS[rays] = found
    return _NUMBERS[rays]


def _constants_of(boundary: Boundary) -> FloatArray:
    """What the sum takes of modes that are the same on all rays: (modes, constants, 2)."""
    modes = modes_of(boundary, np.ones(1))
    plain, across, varying = decay_terms(modes, boundary.sign)
    slope, slope_across = decay_slopes(modes, boundary.sign)
    ends = modes.tau**2 + 2 * modes.q_m0 * (modes.tau - modes.q_m0)
    # in the order of the kernel's constants
    each = (modes.tau, modes.residue, plain, across, varying, ends, slope, slope_across, modes.m0**2 / 60)
    constants = np.stack([np.broadcast_to(one, modes.tau.shape) for one in each], axis=1)
    return np.ascontiguousarray(np.stack([constants.real, constants.imag], axis=-1))
