"""Boundaries: soft, hard, impedance, perfect conductor, and the scalar problems that each leads to.

    soft        u = 0
    hard        du/dn = 0
    impedance   du/dn + i k eta u = 0
    conductor   "electric soft" for E along b, "electric hard" for E along n

An admittance may vary over the body: then it is a function of points, and there are no modes.

Of the Airy functions of a mode, q is i m eta: infinite if soft, 0 if hard.

Also here: what a boundary does to a creeping mode: its roots, decay along the ray, corrections at its ends.

Mode p carries exp{i ∫(m/ρ) τ ds + i ∫ c/(mρ) ds}, m = (kρ/2)^(1/3), with M0 = 1/(τ - q²), Y1 = (2τ - q M0)/3,
Y2 = (4τ Y1 - M0)/5 and r = ρ κ_t,

    c = -τ²/4 + τ Y1 - (3/4) Y2 - (1/4)(1 ± r) M0 - (1/12)[ρρ'' - (2/3) ρ'²] Y2

(+ in acoustics, - for the magnetic field: electric "hard"). Soft is M0 = 0; c = τ²/60 there for constant curvature.
Ends, 1 attachment and 2 shedding:

    A = exp{-i a ρ1'/(12 m1)} exp{+i a ρ2'/(12 m2)},   a = τ² + 2 q M0 (τ - q M0)
    1 + (1/2) Σ_{i=1,2} [∂c/∂τ + ω r_i τ + β τ ρ_i ρ_i'']/m_i²,   ω = 1/4 (one ray), 1/2 (fan integral)

The term of varying curvature is that of [KL59], those of constant curvature agree with the zeros of Hankel functions
[AS64, sec. 9.3]; A is derived, the amplitude term with β is fitted to an exact solution on one ellipsoid. The torsion
of the ray has no term here: its effect stayed below 1e-2 wherever it was measured.

Sources: [F65] for q, [PBM80] for the conductor; Derivations, F1, F4 to F6 and F14.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.airy import MODES, Modes
from creeping.field.fock import boundary_modes
from creeping.geometry.arguments import one_of, shown


@dataclass(frozen=True)
class Coating:
    """Admittance that varies over the body: a function of points (n, 3), or an object whose ``value`` is one."""

    given: Any

    def value(self, points: FloatArray) -> ComplexArray:
        """Admittance (n,) at points (n, 3), L.

        Raises
        ------
        InvalidInputError
            If it does not give one finite number per point, or the real part is negative somewhere.
        """
        function = getattr(self.given, "value", self.given)
        eta = np.asarray(function(np.asarray(points)))
        if eta.dtype.kind not in "fciu" or eta.shape not in ((), (len(points),)):
            raise InvalidInputError(
                f"admittance {shown(self.given)} gives {eta.dtype} of shape {eta.shape} for points {np.shape(points)}; "
                "give one number for each row"
            )
        eta = np.broadcast_to(eta, (len(points),)).astype(complex)
        off = ~np.isfinite(eta)
        if np.any(off):
            raise InvalidInputError(
                f"admittance {shown(self.given)} is not finite at {off.sum()} of {len(eta)} points (first: "
                f"{points[np.argmax(off)]})"
            )
        worst = int(np.argmin(eta.real)) if len(eta) else 0
        if len(eta) and eta[worst].real < 0:
            raise InvalidInputError(
                f"admittance {shown(self.given)} gives energy off at {np.sum(eta.real < 0)} of {len(eta)} points "
                f"(worst: {eta[worst]:.3g} at {points[worst]}); give one with a real part >= 0"
            )
        return eta

    def __str__(self) -> str:
        return str(getattr(self.given, "fingerprint", getattr(self.given, "__qualname__", type(self.given).__name__)))


@dataclass(frozen=True)
class ImpedanceBoundary:
    """Impedance boundary du/dn + i k eta u = 0.

    Parameters
    ----------
    admittance : complex or callable
        Relative admittance eta, without unit: 0 is hard, the limit of infinity is soft, 1 absorbs at normal incidence.
        A real part >= 0 makes the boundary passive. An admittance that varies smoothly over the body is a function of
        points (n, 3), L, or an object with such a method ``value``, e.g. ``scatterers.Coating("0.3 + 0.1*z")``. A
        varying admittance has no creeping modes: use fields at points, `far_field` with currents, or the integral
        equation.

    Raises
    ------
    InvalidInputError
        If the admittance is not a finite number, or its real part is negative.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.ImpedanceBoundary(0.5 + 0.2j)
    ImpedanceBoundary(admittance=(0.5+0.2j))
    >>> cr.ImpedanceBoundary(lambda points: 0.3 + 0.1 * points[:, 2]).varies
    True
    """

    admittance: Any

    @property
    def varies(self) -> bool:
        """Whether the admittance varies over the body."""
        return isinstance(self.admittance, Coating)

    def __post_init__(self) -> None:
        given = self.admittance
        if isinstance(given, Coating):
            return
        if callable(given) or callable(getattr(given, "value", None)):
            object.__setattr__(self, "admittance", Coating(given))
            return
        try:
            # Python makes numbers of texts and flags
            if isinstance(given, (Iterable, bool)) or np.asarray(given).dtype.kind in "bSUmM":
                raise TypeError("it is none")
            admittance = complex(given)
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise InvalidInputError(
                f"admittance = {shown(given)} is not a complex number, nor a function of points; for a text in x, y, z "
                "use scatterers.Coating"
            ) from error
        if not np.isfinite(admittance):
            raise InvalidInputError(f"admittance = {self.admittance!r} is not finite; for an infinite one use 'soft'")
        if admittance.real < 0:
            raise InvalidInputError(
                f"admittance = {self.admittance!r} gives energy off (negative real part); give one >= 0"
            )
        object.__setattr__(self, "admittance", admittance)


BoundaryLike = Literal["soft", "hard", "pec"] | ImpedanceBoundary


@dataclass(frozen=True)
class Boundary:
    """One scalar boundary: ``kind`` is "soft", "hard", "impedance", "electric soft", "electric hard" or "conductor".

    The admittance is a number, or with points at hand (`at`) one for each, with its rate ``drift``, 1/L, along a vector
    there; with a ``coating`` it is known at points alone.
    """

    kind: str
    admittance: complex | ComplexArray = 0j
    coating: Coating | None = None
    drift: complex | ComplexArray = 0j

    @property
    def varies(self) -> bool:
        """Whether the admittance varies over the body."""
        return self.coating is not None

    def at(self, points: FloatArray, along: FloatArray | None = None, step: float = 0.0) -> "Boundary":
        """The boundary at points (n, 3), L, of a body, and its drift, by steps of length ``step`` times ``along``."""
        if self.coating is None:
            return self
        eta = self.coating.value(points)
        if along is None:
            return Boundary(self.kind, eta)
        ahead, behind = (self.coating.value(points + sense * step * along) for sense in (1, -1))
        return Boundary(self.kind, eta, drift=(ahead - behind) / (2 * step))

    def part(self, index: Any) -> "Boundary":
        """The boundary at some of the points."""
        if np.ndim(self.admittance) == 0:
            return self
        drift = self.drift[index] if isinstance(self.drift, np.ndarray) else self.drift
        return Boundary(self.kind, np.asarray(self.admittance)[index], drift=drift)

    @property
    def sign(self) -> float:
        """Sign of the transverse curvature's term in dg/dq and in optics."""
        return -1.0 if self.kind.startswith("electric") else 1.0

    def q(self, m: FloatArray) -> ComplexArray | float | None:
        """Parameter q of the Airy functions at a Fock scale m (...): None if soft, 0 if hard, else (...)."""
        if self.coating is not None:
            raise InvalidInputError(
                f"the admittance {self.coating} varies, and creeping modes need a constant one; use fields at "
                "points, or far_field of one incidence with method='currents' (or 'auto')"
            )
        if self.kind == "impedance":
            return np.asarray(1j * m * self.admittance)
        return None if self.kind.endswith("soft") else 0.0


SOFT, HARD = Boundary("soft"), Boundary("hard")
CONDUCTOR = Boundary("conductor")
"""A conductor's vector problem, where its two scalar ones are not told apart."""
ELECTRIC_SOFT, ELECTRIC_HARD = Boundary("electric soft"), Boundary("electric hard")


def scalar_boundaries(boundary: BoundaryLike) -> tuple[Boundary, ...]:
    """Scalar problems of a boundary: one, or for "pec" those of E along b and along n.

    Raises
    ------
    InvalidInputError
        If it is none of those known.
    """
    if isinstance(boundary, ImpedanceBoundary):
        if boundary.varies:
            return (Boundary("impedance", np.nan, boundary.admittance),)
        if boundary.admittance == 0:
            return (HARD,)
        return (Boundary("impedance", boundary.admittance),)
    known = {"soft": (SOFT,), "hard": (HARD,), "pec": (ELECTRIC_SOFT, ELECTRIC_HARD)}
    if isinstance(boundary, str) and boundary in known:
        return known[boundary]
    raise InvalidInputError(
        f"boundary = {boundary!r} is not 'soft', 'hard', 'pec' or ImpedanceBoundary(admittance){meant(boundary, known)}"
    )


def meant(given: object, known: Iterable[str]) -> str:
    """What a text in other letters may have meant, as the end of a message.

    Examples
    --------
    >>> meant("PEC", ["soft", "pec"]), meant("firm", ["soft", "pec"])
    ("; did you mean 'pec'?", '')
    """
    name = given.strip().lower() if isinstance(given, str) else ""
    name = {"conductor": "pec", "dirichlet": "soft", "neumann": "hard", "rigid": "hard"}.get(name, name)
    return f"; did you mean {name!r}?" if name in known else ""


def boundary_name(boundary: BoundaryLike) -> str:
    """Text of a boundary, from which `parse_boundary` makes it again, unless it varies.

    Examples
    --------
    >>> boundary_name(ImpedanceBoundary(1 / 3)), parse_boundary("impedance:0.5+0.2j").admittance
    ('impedance:0.3333333333333333', (0.5+0.2j))
    """
    if isinstance(boundary, str):
        return boundary
    one_of(boundary, "boundary", ImpedanceBoundary, "creeping.ImpedanceBoundary; or give 'soft', 'hard' or 'pec'")
    eta = boundary.admittance
    if boundary.varies:
        return f"impedance:{eta}"
    number = repr(eta.real) if eta.imag == 0 else repr(eta).strip("()")
    return f"impedance:{number}"


def parse_boundary(text: str, *, coating: Callable[[str], Any] | None = None) -> BoundaryLike:
    """Boundary of ``soft``, ``hard``, ``pec`` or ``impedance:ETA``.

    ``coating`` makes an admittance that varies of a text that is no number.

    Raises
    ------
    InvalidInputError
        If it is none of these, or ETA is not a complex number whose real part is not negative.
    """
    scalar: dict[str, BoundaryLike] = {"soft": "soft", "hard": "hard", "pec": "pec"}
    if text in scalar:
        return scalar[text]
    name, _, number = text.partition(":")
    if name != "impedance":
        raise InvalidInputError(
            f"boundary {text!r} is not soft, hard, pec or impedance:ETA, e.g. impedance:0.5+0.2j{meant(text, scalar)}"
        )
    try:
        admittance = complex(number.replace(" ", ""))
    except ValueError:
        if coating is not None:
            return ImpedanceBoundary(coating(number))
        raise InvalidInputError(
            f"boundary {text!r}: {number!r} is not a complex number such as 1 or 0.5+0.2j"
        ) from None
    return ImpedanceBoundary(admittance)


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
