"""The field on the body in the shadow: u, or du/dn where u = 0.

    u = e^{ik(d.x0 + s)} (ρ1/ρ2)^(1/6) |J|^(-1/2) e^{-iπN/2} g(ξ)          hard, impedance
    du/dn: the same with (k/m2) F(ξ)                                        soft

At second order each mode of g or F carries the decay c, the attachment factor exp{-i τ² ρ1'/(12 m1)} and, with means of
both ends,

    soft  1 + (τ/60 + τ/12 + r τ/4)/(m1 m2)        hard  1 + ((1/2) ∂c/∂τ - τ/24 - c/(2τ) + r τ/4)/(m1 m2)
"""

import numpy as np

from creeping._errors import InvalidInputError
from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.field.airy import Modes
from creeping.field.coefficients import Boundary, BoundaryLike, decay_slopes, decay_terms, modes_of, scalar_boundaries
from creeping.field.far import checked
from creeping.field.far_geometry import fan_strips
from creeping.field.fock import surface_function
from creeping.field.launching import (
    SECOND_ORDER,
    end_factor,
    end_residue,
    fock_parameter,
    mean_scale,
    mode_waves,
    scales,
    smoothstep,
    transverse_ratios,
)
from creeping.phaseflow.bundle import on_body
from creeping.rays.fan import RayFan
from creeping.rays.ray_points import RayPoints, substeps
from creeping.rays.shedding import shed_on


def surface_field(
    fan: RayFan,
    points: ArrayLike | None = None,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
) -> ComplexArray:
    """Field on the body: u, or du/dn (1/L) of the soft boundary.

    Parameters
    ----------
    fan : RayFan
    points : (..., 3), L, optional
        Points on the body, in the shadow.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or Impedance
    order : 2 or 1

    Returns
    -------
    complex
        (rays, steps), each ray's own contribution, infinite at its caustics and 0 where it has detached; with points
        (...), all rays through each of them summed, 0 where none passes.

    Raises
    ------
    InvalidInputError
        On bad points, wavenumber, boundary or order, and for a weighted body.
    """
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, order)
    if points is None:
        times = [strip.rays[:, :: substeps(fan)] for strip in fan_strips(fan)]
        if not times:
            return np.zeros(fan.spreading.shape, dtype=complex)
        out = np.empty(fan.spreading.shape, dtype=complex)
        for number, rays in enumerate(times):
            out[fan.arc_index == np.unique(fan.arc_index)[number]] = surface_waves(rays, k, kind, order)
        return out
    y = np.asarray(points, dtype=float)
    flat = on_body(fan.body, y).reshape(-1, 3)
    found = shed_on(fan_strips(fan), fan.body, flat)
    total = np.zeros(len(flat), dtype=complex)
    np.add.at(total, found.observer, surface_waves(found.rays, k, kind, order))
    return total.reshape(y.shape[:-1])


def scalar_boundary(boundary: BoundaryLike) -> Boundary:
    """The scalar problem of a boundary.

    Raises
    ------
    InvalidInputError
        If it is unknown, or "pec", whose fields near the body are vectors that this package does not assemble.
    """
    kinds = scalar_boundaries(boundary)
    if len(kinds) > 1:
        raise InvalidInputError(
            "boundary 'pec' is for the far field; on and near the body give 'soft', 'hard' or Impedance"
        )
    return kinds[0]


def surface_waves(rays: RayPoints, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """Contribution of each ray at its point (...)."""
    m1, m2 = scales(rays, wavenumber)
    xi = fock_parameter(rays, wavenumber)
    wave = surface_function(xi, boundary.q(np.sqrt(m1 * m2)))
    if order == 2:
        weight = smoothstep(xi, *SECOND_ORDER)
        some = (weight > 0) & rays.alive
        part = rays[some]
        wave[some] += weight[some] * (_series(part, wavenumber, boundary, 2) - _series(part, wavenumber, boundary, 1))
    first, last = rays.curvature
    phase = wavenumber * rays.eikonal - 0.5 * np.pi * rays.caustics
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.cbrt(np.sqrt(last / first)) / np.sqrt(np.abs(rays.spreading)) * np.exp(1j * phase)
        if boundary.kind == "soft":
            factor = factor * wavenumber / m2
        return np.asarray(np.where(rays.alive, wave * factor, 0.0))


def _series(rays: RayPoints, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """g or F by its residues (...)."""
    modes = modes_of(boundary, mean_scale(rays, wavenumber))
    terms = end_residue(rays, wavenumber, boundary, "surface") * mode_waves(rays, modes, wavenumber, boundary, order)
    if order == 2:
        terms = terms * end_factor(rays, modes, wavenumber, 0.0) * _amplitude(rays, modes, wavenumber, boundary)
    return np.asarray(2j * np.sqrt(np.pi) * np.sum(terms, axis=-1))


def _amplitude(rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary) -> ComplexArray:
    """Second-order amplitude of each mode (..., n)."""
    m1, m2 = scales(rays, wavenumber)
    first, last = transverse_ratios(rays)
    r: FloatArray = 0.5 * (first + last)[..., None]
    tau = modes.tau
    if boundary.kind == "soft":
        bracket = tau / 60 + tau / 12 + r * tau / 4
    else:
        plain, across, _ = decay_terms(modes, boundary.sign)
        slope, slope_across = decay_slopes(modes, boundary.sign)
        bracket = 0.5 * (slope + r * slope_across) - tau / 24 - (plain + r * across) / (2 * tau) + r * tau / 4
    return np.asarray(1 + bracket / (m1 * m2)[..., None])
