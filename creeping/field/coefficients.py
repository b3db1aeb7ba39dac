"""Boundaries, and what each does to a creeping mode: decay along the ray, corrections at its ends.

Mode p carries exp{i ∫(m/ρ) τ ds + i ∫ c/(mρ) ds}, m = (kρ/2)^(1/3), with M0 = 1/(τ - q²), Y1 = (2τ - q M0)/3,
Y2 = (4τ Y1 - M0)/5 and r = ρ κ_t,

    c = -τ²/4 + τ Y1 - (3/4) Y2 - (1/4)(1 ± r) M0 - (1/12)[ρρ'' - (2/3) ρ'²] Y2

(+ in acoustics, - for the magnetic field: electric "hard"). Soft is M0 = 0; c = τ²/60 there for constant curvature.
Ends, 1 attachment and 2 launch:

    A = exp{-i τ² ρ1'/(12 m1)} exp{+i τ² ρ2'/(12 m2)}
    1 + (1/2) Σ_{i=1,2} [∂c/∂τ + ω r_i τ + β τ ρ_i ρ_i'']/m_i²,   ω = 1/4 (one ray), 1/2 (fan integral)

After Keller and Levy; the amplitude term with β is fitted to an exact solution, see the README's table of errors.
The torsion of the ray has no term here: its effect stayed below 1e-2 wherever it was measured.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from creeping._errors import InvalidInputError
from creeping._typing import ComplexArray, FloatArray
from creeping.field.airy import MODES, Modes
from creeping.field.fock import boundary_modes

BETA = 0.08
"""Weight of ρρ'' in the amplitude of a mode."""


@dataclass(frozen=True)
class Impedance:
    """Impedance boundary du/dn + i k eta u = 0.

    Parameters
    ----------
    eta : complex
        Relative admittance: 0 is hard, infinite is soft, 1 absorbs at normal incidence; Re eta >= 0 is passive.
    """

    eta: complex

    def __post_init__(self) -> None:
        try:
            eta = complex(self.eta)
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"eta = {self.eta!r} is not a complex number") from error
        if not np.isfinite(eta):
            raise InvalidInputError(f"eta = {self.eta!r} is not finite; for an infinite one use 'soft'")
        if eta.real < 0:
            raise InvalidInputError(f"eta = {self.eta!r} gives energy off (Re eta < 0); give Re eta >= 0")
        object.__setattr__(self, "eta", eta)


BoundaryLike = Literal["soft", "hard", "pec"] | Impedance


@dataclass(frozen=True)
class Boundary:
    """One scalar boundary: ``kind`` is "soft", "hard", "impedance", "electric soft" or "electric hard"."""

    kind: str
    eta: complex = 0j

    @property
    def sign(self) -> float:
        """Sign of the transverse curvature's term."""
        return -1.0 if self.kind == "electric hard" else 1.0

    def q(self, m: FloatArray) -> ComplexArray | float | None:
        """Parameter q of the Airy functions at a Fock scale m (...): None if soft, 0 if hard, else (...)."""
        if self.kind == "impedance":
            return np.asarray(1j * m * self.eta)
        return None if self.kind.endswith("soft") else 0.0


SOFT, HARD = Boundary("soft"), Boundary("hard")
ELECTRIC_SOFT, ELECTRIC_HARD = Boundary("electric soft"), Boundary("electric hard")


def scalar_boundaries(boundary: BoundaryLike) -> tuple[Boundary, ...]:
    """Scalar problems of a boundary: one, or for "pec" those of E along b and along n.

    Raises
    ------
    InvalidInputError
        If it is none of those known.
    """
    if isinstance(boundary, Impedance):
        if boundary.eta == 0:
            return (HARD,)
        return (Boundary("impedance", boundary.eta),)
    known = {"soft": (SOFT,), "hard": (HARD,), "pec": (ELECTRIC_SOFT, ELECTRIC_HARD)}
    if isinstance(boundary, str) and boundary in known:
        return known[boundary]
    raise InvalidInputError(f"boundary = {boundary!r} is not 'soft', 'hard', 'pec' or Impedance(eta)")


def parse_boundary(text: str) -> BoundaryLike:
    """Boundary of ``soft``, ``hard``, ``pec`` or ``impedance:ETA``.

    Raises
    ------
    InvalidInputError
        If it is none of these, or ETA is not a complex number with Re ETA >= 0.
    """
    scalar: dict[str, BoundaryLike] = {"soft": "soft", "hard": "hard", "pec": "pec"}
    if text in scalar:
        return scalar[text]
    name, _, number = text.partition(":")
    if name != "impedance":
        raise InvalidInputError(f"boundary {text!r} is not soft, hard, pec or impedance:ETA, e.g. impedance:0.5+0.2j")
    try:
        eta = complex(number.replace(" ", ""))
    except ValueError:
        raise InvalidInputError(
            f"boundary {text!r}: {number!r} is not a complex number such as 1 or 0.5+0.2j"
        ) from None
    return Impedance(eta)


def fock_scale(wavenumber: float, curvature: FloatArray) -> FloatArray:
    """m = (k/(2 κₙ))^(1/3), inf where κₙ <= 0: (...) -> (...)."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.cbrt(wavenumber / (2 * np.maximum(curvature, 0.0))))


def modes_of(boundary: Boundary, m: FloatArray, n: int = MODES) -> Modes:
    """Modes at Fock scales m (...): (n,) for soft and hard, (..., n) for an impedance."""
    return boundary_modes(boundary.q(m), n)


def decay_terms(modes: Modes, sign: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Parts of c that are multiplied by 1, by r = ρ κ_t and by ρρ'' - (2/3) ρ'²."""
    tau, m0 = modes.tau, modes.m0
    y1 = (2 * tau - modes.q_m0) / 3
    y2 = (4 * tau * y1 - m0) / 5
    return -(tau**2) / 4 + tau * y1 - 0.75 * y2 - 0.25 * m0, -0.25 * sign * m0, -y2 / 12


def decay_slopes(modes: Modes, sign: float) -> tuple[ComplexArray, ComplexArray]:
    """∂c/∂τ at constant q, parts multiplied by 1 and by r; ∂M0/∂τ = -M0²."""
    tau, m0 = modes.tau, modes.m0
    dm0 = -(m0**2)
    # q M0 ∂M0/∂M0: the derivative of q M0 is -q M0²
    y1, dy1 = (2 * tau - modes.q_m0) / 3, (2 + modes.q_m0 * m0) / 3
    dy2 = (4 * y1 + 4 * tau * dy1 - dm0) / 5
    return -tau / 2 + y1 + tau * dy1 - 0.75 * dy2 - 0.25 * dm0, -0.25 * sign * dm0
