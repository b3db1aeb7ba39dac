"""What a boundary does to a creeping mode: its roots, decay along the ray, corrections at its ends.

Mode p carries exp{i ∫(m/ρ) τ ds + i ∫ c/(mρ) ds}, m = (kρ/2)^(1/3), with M0 = 1/(τ - q²), Y1 = (2τ - q M0)/3,
Y2 = (4τ Y1 - M0)/5 and r = ρ κ_t,

    c = -τ²/4 + τ Y1 - (3/4) Y2 - (1/4)(1 ± r) M0 - (1/12)[ρρ'' - (2/3) ρ'²] Y2

(+ in acoustics, - for the magnetic field: electric "hard"). Soft is M0 = 0; c = τ²/60 there for constant curvature.
Ends, 1 attachment and 2 shedding:

    A = exp{-i a ρ1'/(12 m1)} exp{+i a ρ2'/(12 m2)},   a = τ² + 2 q M0 (τ - q M0)
    1 + (1/2) Σ_{i=1,2} [∂c/∂τ + ω r_i τ + β τ ρ_i ρ_i'']/m_i²,   ω = 1/4 (one ray), 1/2 (fan integral)

The term of varying curvature is that of [KL59], those of constant curvature agree with the zeros of Hankel functions
[AS64, sec. 9.3]; A is derived, the amplitude term with β is fitted to an exact solution on one ellipsoid. The torsion
of the ray has no term here: its effect stayed below 1e-2 wherever it was measured. Derivations, F4 to F6.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import Boundary
from creeping.field.special.airy import MODES, Modes
from creeping.field.special.fock import boundary_modes

BETA = 0.08
"""Weight of ρρ'' in the amplitude of a mode."""


def fock_scale(wavenumber: float, curvature: FloatArray) -> FloatArray:
    """m = (k/(2 κₙ))^(1/3) without unit, inf where κₙ <= 0: k and κₙ in 1/L, (...) -> (...).

    Examples
    --------
    >>> fock_scale(54.0, np.array([1.0, -1.0]))
    array([ 3., inf])
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.cbrt(wavenumber / (2 * np.maximum(curvature, 0.0))))


def slowest_decay(boundary: Boundary, m: FloatArray, points: FloatArray) -> float:
    """Least Im tau of the modes at a Fock scale m (1,); of an admittance that varies, over points (n, 3), L."""
    if boundary.varies:
        boundary, m = boundary.at(points), np.repeat(m, len(points))
    return float(np.min(modes_of(boundary, m).tau.imag))


def modes_of(boundary: Boundary, m: FloatArray, n: int = MODES) -> Modes:
    """Modes at Fock scales m (...): (n,) for soft and hard, (..., n) for an impedance."""
    return boundary_modes(boundary.q(m), n)


def decay_terms(modes: Modes, sign: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Parts of c (n,), without unit, that are multiplied by 1, by r = ρ κ_t and by ρρ'' - (2/3) ρ'²."""
    tau, m0 = modes.tau, modes.m0
    y1 = (2 * tau - modes.q_m0) / 3
    y2 = (4 * tau * y1 - m0) / 5
    return -(tau**2) / 4 + tau * y1 - 0.75 * y2 - 0.25 * m0, -0.25 * sign * m0, -y2 / 12


def decay_slopes(modes: Modes, sign: float) -> tuple[ComplexArray, ComplexArray]:
    """∂c/∂τ (n,) at constant q, without unit, parts multiplied by 1 and by r; ∂M0/∂τ = -M0²."""
    tau, m0 = modes.tau, modes.m0
    dm0 = -(m0**2)
    # q M0 ∂M0/∂M0: the derivative of q M0 is -q M0²
    y1, dy1 = (2 * tau - modes.q_m0) / 3, (2 + modes.q_m0 * m0) / 3
    dy2 = (4 * y1 + 4 * tau * dy1 - dm0) / 5
    return -tau / 2 + y1 + tau * dy1 - 0.75 * dy2 - 0.25 * dm0, -0.25 * sign * dm0
