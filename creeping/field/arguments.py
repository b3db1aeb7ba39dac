"""Arguments that fields have in common.

Also here: scales of a creeping ray at a wavenumber: Fock's ξ and m, and the ratio of curvatures.

    ξ = (k/2)^(1/3) ∫ κₙ^(2/3) ds,   m = (kρ/2)^(1/3),   r = ρ κ_t

Sources: Derivations, F4.
"""

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import fock_scale
from creeping.geometry.arguments import positive_number, real_array, shown
from creeping.geometry.checks import unit_of
from creeping.geometry.directions import unit_directions
from creeping.geometry.evaluators import speed_of
from creeping.geometry.piecewise import checked_smooth, has_edges
from creeping.geometry.surface import Surface
from creeping.rays.quantities import RayPoints

ACROSS = (3e-4, 1e6)
"""Wavelengths across of bodies that have a field. Below, the equation loses it: f of a sphere is within 1.1 % at 3e-4,
and 100, 20 and 33 % off at 3e-5, soft, rigid and conducting. Above, 1e-6 of the size is a wavelength: rays err so."""
METHODS = ("auto", "currents", "rays", "equation")
PLAIN = ("auto", "equation")
"""Methods of fields on the body, and of conductors."""
UNRESOLVED = 0.1
"""Error, as a share of the largest |f|, from which a direction counts as unresolved."""


def checked_method(method: str, order: int, methods: tuple[str, ...] = METHODS) -> None:
    """Refuse a method that is none, and currents of the first order."""
    if not isinstance(method, str) or method not in methods:
        raise InvalidInputError(f"method = {method!r} is not one of {', '.join(map(repr, methods))}")
    if method in ("currents", "equation") and order != 2:
        other = "rays" if "rays" in methods else "auto"
        raise InvalidInputError(f"method {method!r} has no order {order}; give method={other!r}")


def observers_of(observation: ArrayLike) -> FloatArray:
    """Unit directions of a caller's observers (m, 3), of which there may be none."""
    looks = real_array(observation, "observation directions")
    if looks.shape == (0, 3):
        return looks
    return unit_directions(looks, "observation directions").reshape(-1, 3)


def checked_plain(body: Surface, *, smooth: str = "", edgeless: str = "") -> None:
    """Refuse a weighted body; and one with edges, joints or tips where ``smooth`` says what needs a smooth one.

    ``edgeless`` says what does not mind joints and tips, but edges.
    """
    if speed_of(body) is not None:
        raise InvalidInputError(f"{body!r} has a speed; diffracted fields need a body without speed")
    if smooth or (edgeless and has_edges(body)):
        checked_smooth(body, smooth or edgeless, "its far field is known, by creeping.far_field")


def wavelengths_across(body: Surface, wavenumber: float) -> float:
    """Longest side of the body's box in wavelengths.

    Examples
    --------
    >>> import scatterers as sc
    >>> round(wavelengths_across(sc.Sphere(0.15), 209.585), 3)
    10.007
    """
    return float(np.max(np.ptp(np.asarray(body.bounds, dtype=float), axis=0))) * wavenumber / (2 * np.pi)


def checked_across(body: Surface, *wavenumbers: float) -> None:
    """Refuse a body that is absurdly small or large in wavelengths: a unit was forgotten.

    Raises
    ------
    InvalidInputError
        With its size in wavelengths as ``across``.
    """
    for k in wavenumbers:
        across = wavelengths_across(body, k)
        if not ACROSS[0] <= across <= ACROSS[1]:
            unit = unit_of(body)
            raise InvalidInputError(
                f"the body is {across:.2g} wavelengths across ({2 * np.pi * across / k:.4g} {unit} at wavenumber "
                f"{k:.4g}/{unit}), {'more' if across > 1 else 'fewer'} than any field here is valid for, {ACROSS[0]:g} "
                f"to {ACROSS[1]:g}; give k in 1/{unit}: creeping.wavenumber('10 GHz') for a body in metres",
                across=across,
            )


def checked(wavenumber: float, order: int, body: Surface | None = None) -> float:
    """The wavenumber, if it and the order are usable, and the body, if given, not absurdly small or large at it."""
    given: Any = wavenumber
    if isinstance(given, str):
        raise InvalidInputError(
            f"wavenumber = {given!r} is text; give creeping.wavenumber({given!r}), in 1/m, for a body in "
            "metres; for sound give sound_speed="
        )
    if isinstance(wavenumber, complex | np.complexfloating):
        raise InvalidInputError(f"wavenumber = {wavenumber!r} is complex; give a real one: losses belong to the medium")
    if isinstance(given, list | tuple) or (isinstance(given, np.ndarray) and given.ndim):
        raise InvalidInputError(
            f"wavenumber = {shown(wavenumber)} is not one number; for several frequencies call "
            "creeping.backscatter, creeping.sweep_directions, creeping.t_matrices or creeping.orientation_averages"
        )
    k = positive_number(wavenumber, "wavenumber")
    if not 1e-100 <= k <= 1e100:
        raise InvalidInputError(f"wavenumber = {k:g} has squares that are no numbers; take another unit of length")
    if isinstance(order, bool) or not isinstance(order, int | np.integer) or order not in (1, 2):
        raise InvalidInputError(f"order = {order!r} is neither 1 nor 2")
    if body is not None:
        checked_across(body, k)
    return k


def fock_parameter(rays: RayPoints, wavenumber: float) -> FloatArray:
    """Fock parameter ξ (...), without unit; k in 1/L."""
    return np.asarray(np.cbrt(wavenumber / 2) * rays.integrals[..., 1])


def scales(rays: RayPoints, wavenumber: float) -> tuple[FloatArray, FloatArray]:
    """m at the attachment and the shedding point (...), without unit; k in 1/L."""
    first, last = rays.curvature
    return fock_scale(wavenumber, first), fock_scale(wavenumber, last)


def mean_scale(rays: RayPoints, wavenumber: float) -> FloatArray:
    """Mean of m along the ray, weighted by κₙ^(2/3) (...); m at attachment where the ray has no length."""
    some = rays.integrals[..., 1] > 0
    mean = np.divide(rays.integrals[..., 0], rays.integrals[..., 1], out=np.zeros(some.shape), where=some)
    return np.asarray(np.where(some, np.cbrt(wavenumber / 2) * mean, scales(rays, wavenumber)[0]))


def transverse_ratios(rays: RayPoints) -> tuple[FloatArray, FloatArray]:
    """r = ρ κ_t at the attachment and the shedding point (...), without unit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [t / c for t, c in zip(rays.transverse, rays.curvature, strict=True)]
    return np.nan_to_num(ratios[0]), np.nan_to_num(ratios[1])
