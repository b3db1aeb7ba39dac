"""A cylinder of any section in a plane wave across its axis: integral equations on the section.

With G = (i/4) H0(k|x - y|), single and double layers S and K, K' and T their normal derivatives, for the total wave:

    soft        (1/2 + K' - ikS) ∂u/∂n = ∂u_0/∂n - ik u_0
    impedance   [1/2 - K - ikS eta - iR (ik eta/2 + ik K' eta + T)] u = u_0 + iR ∂u_0/∂n,   hard: eta = 0
    T = d/ds S d/ds + k² n.S n,   R = 2 S_q,   S_q of the kernel K0(q|x - y|)/2π,   q = 2π over the circumference

which have one solution at every wavenumber, as k is real and R positive. R smooths what T makes of rounding where nodes
are close [BET12]. Kernels a + b log(4 sin²(w/2)) are integrated by Kress's weights for the
logarithm and the trapezium rule, d/ds is that of the trigonometric interpolant [CK13, sec. 3.6]. Errors are 1e-12 on
smooth sections and with nodes graded towards joints.

The time factor is e^{-iωt}, n the outward normal; far away, as for the circular cylinder,

    u_s ~ F e^{ikr}/√r,   F = √(2/πk) e^{-iπ/4} (i/4) int [u (-ik r.n) - ∂u/∂n] e^{-ikr.y} ds

Also here: a circular cylinder of radius a in a plane wave across its axis: the series.

With x = ka, phi from the forward direction, alpha u + (beta/k) ∂u/∂n = 0, ε₀ = 1 and εₙ = 2,

    u_s = Σ εₙ iⁿ cₙ Hₙ(kr) cos(n phi),    cₙ = -(alpha Jₙ + beta Jₙ')/Dₙ,    Dₙ = alpha Hₙ + beta Hₙ',    all at x
    u_s ~ F e^{ikr}/√r,    F = √(2/πk) e^{-iπ/4} Σ εₙ cₙ cos(n phi)

and on the surface, by the Wronskian,

    u = beta (2i/πx) Σ εₙ iⁿ cos(n phi)/Dₙ,    ∂u/∂n = -alpha k (2i/πx) Σ εₙ iⁿ cos(n phi)/Dₙ

A wave that comes at an angle gamma to the axis z, sin gamma = s, is that across it with k s in place of k, times
e^{ikz cos gamma}. On a perfect conductor H_z is hard and E_z soft, and along l, against phi, on the surface

    H_l = (i/(k s²)) [cos(gamma) ∂H_z/∂l - ∂E_z/∂n],    J = n x H:  J_l = H_z,  J_z = -H_l
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import hankel1, i0, jv, k0

from tests.reference.conditions import Boundary, ComplexArray, FloatArray, condition, positive, series_length
from tests.reference.section_shapes import Nodes, Section

PER_LENGTH, MORE, WITH_JOINTS = 1.5, 160, 640
"""Nodes for each unit of k ds, those beyond, and the fewest with joints."""
EULER = 0.5772156649015329


@dataclass(frozen=True)
class SectionField:
    """Total wave on a section: u at its nodes, or ∂u/∂n if soft (n,)."""

    wavenumber: float
    nodes: Nodes
    soft: bool
    values: ComplexArray
    eta: ComplexArray

    def far(self, directions: FloatArray, values: ComplexArray | None = None) -> ComplexArray:
        """F (m,), √L, in unit directions (m, 2), of other surface data if given."""
        k, places = self.wavenumber, self.nodes.places
        data = self.values if values is None else values
        weight = self.nodes.speed * 2 * np.pi / len(self.nodes.s)
        phase = np.exp(-1j * k * directions @ places.points.T)
        if self.soft:
            total = -phase @ (weight * data)
        else:
            # ∂u/∂n = -ik eta u
            total = (phase * (-1j * k * (directions @ places.normals.T) + 1j * k * self.eta)) @ (weight * data)
        return np.asarray(np.sqrt(2 / (np.pi * k)) * np.exp(-0.25j * np.pi) * 0.25j * total)


def surface_data(
    section: Section, wavenumber: float, angle: float, boundary: str | complex | ComplexArray
) -> SectionField:
    """Wave on a section for incidence along (cos angle, sin angle).

    Parameters
    ----------
    section : Section
    wavenumber : float, 1/L
    angle : float, rad
    boundary : "soft", "hard", complex or (n,)
        The last two are eta, at the nodes of ``section_nodes``.
    """
    return SectionSolver(section, wavenumber).solve(angle, boundary)


class SectionSolver:
    """Operators of a section at a wavenumber, for all boundaries and incidences."""

    def __init__(self, section: Section, wavenumber: float, per_length: float = PER_LENGTH) -> None:
        positive(wavenumber=wavenumber)
        self.k = wavenumber
        count = int(per_length * wavenumber * section.length) + MORE
        count = max(count, WITH_JOINTS if len(section.joints) else 0)
        self.nodes = section.nodes(count + count % 2)

    @cached_property
    def _apart(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Differences x - y, their length, log(4 sin²(w/2)) and Kress's weights."""
        points, n = self.nodes.places.points, len(self.nodes.s)
        apart = points[:, None] - points[None]
        distance = np.hypot(apart[..., 0], apart[..., 1]) + np.eye(n)
        steps = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
        log = np.log(4 * np.sin(np.pi * np.arange(n) / n) ** 2 + (np.arange(n) == 0))[steps]
        j, m = np.arange(n), np.arange(1, n // 2)
        weights = np.cos(2 * np.pi * np.outer(j, m) / n) @ (1 / m)
        weights = -(4 * np.pi / n) * weights - (4 * np.pi / n**2) * (-1.0) ** j
        return apart, distance, log, weights[steps]

    @cached_property
    def _h0(self) -> ComplexArray:
        return np.asarray(hankel1(0, self.k * self._apart[1]))

    @cached_property
    def _h1(self) -> ComplexArray:
        return np.asarray(hankel1(1, self.k * self._apart[1]))

    def _operator(self, kernel: Any, log_part: FloatArray, diagonal: tuple[Any, Any]) -> ComplexArray:
        """Matrix of a kernel whose part with the logarithm is known; ``diagonal`` are both parts there."""
        _, _, log, weights = self._apart
        rest = kernel - log_part * log
        log_part = np.array(log_part)
        np.fill_diagonal(log_part, diagonal[0])
        np.fill_diagonal(rest, diagonal[1])
        return np.asarray(weights * log_part + 2 * np.pi / len(rest) * rest)

    def _single(self, density: FloatArray) -> ComplexArray:
        """S of a density times ds/dw."""
        speed = self.nodes.speed
        first = -density / (4 * np.pi)
        rest = (0.25j - EULER / (2 * np.pi) - np.log(self.k * speed / 2) / (2 * np.pi)) * density
        return self._operator(0.25j * self._h0 * density, -self._h0.real * density / (4 * np.pi), (first, rest))

    @cached_property
    def single(self) -> ComplexArray:
        """S."""
        return self._single(self.nodes.speed)

    def _double(self, lean: FloatArray) -> ComplexArray:
        """K or K', by the cosine of x - y to one of the normals."""
        speed, kappa = self.nodes.speed, self.nodes.places.curvature
        factor = -0.25 * self.k * lean * speed
        nothing = np.zeros(len(speed))
        limit = -kappa * speed / (4 * np.pi)
        return self._operator(1j * factor * self._h1, -factor * self._h1.real / np.pi, (nothing, limit))

    @cached_property
    def smoothing(self) -> FloatArray:
        """R, L."""
        speed = self.nodes.speed
        q = 1 / np.mean(speed)
        near = q * self._apart[1]
        rest = -(EULER + np.log(q * speed / 2)) / np.pi * speed
        logarithm = -speed / (2 * np.pi)
        return self._operator(k0(near) / np.pi * speed, i0(near) * logarithm, (logarithm, rest)).real

    @cached_property
    def double(self) -> ComplexArray:
        """K."""
        apart, distance, *_ = self._apart
        return self._double(-np.einsum("ijc,jc->ij", apart, self.nodes.places.normals) / distance)

    @cached_property
    def adjoint(self) -> ComplexArray:
        """K'."""
        apart, distance, *_ = self._apart
        return self._double(np.einsum("ijc,ic->ij", apart, self.nodes.places.normals) / distance)

    @cached_property
    def hypersingular(self) -> ComplexArray:
        """T."""
        n, normals = len(self.nodes.s), self.nodes.places.normals
        waves = np.fft.fftfreq(n, 1 / n)
        waves[n // 2] = 0
        slope = np.fft.ifft(1j * waves[:, None] * np.fft.fft(np.eye(n), axis=0), axis=0).real
        tangential = slope @ self._single(np.ones(n)) @ slope / self.nodes.speed[:, None]
        return np.asarray(tangential + self.k**2 * self.single * (normals @ normals.T))

    def solve(self, angle: float, boundary: str | complex | ComplexArray) -> SectionField:
        """Wave on the section for incidence along (cos angle, sin angle)."""
        k, places = self.k, self.nodes.places
        direction = np.array([np.cos(angle), np.sin(angle)])
        wave = np.exp(1j * k * places.points @ direction)
        slope = 1j * k * (places.normals @ direction) * wave
        one = np.eye(len(wave))
        eta: Any = np.zeros(len(wave), complex)
        if isinstance(boundary, str) and boundary == "soft":
            values: Any = np.linalg.solve(0.5 * one + self.adjoint - 1j * k * self.single, slope - 1j * k * wave)
            return SectionField(k, self.nodes, True, np.asarray(values), eta)
        smoothed, derivative = 1j * self.smoothing, self.hypersingular
        matrix = 0.5 * one - self.double
        if not isinstance(boundary, str):
            eta = eta + boundary
            matrix = matrix - 1j * k * self.single * eta
            derivative = derivative + 1j * k * (0.5 * one + self.adjoint) * eta
        values = np.linalg.solve(matrix - smoothed @ derivative, wave + smoothed @ slope)
        return SectionField(k, self.nodes, False, np.asarray(values), eta)


def directions(angles: ArrayLike) -> FloatArray:
    """Unit directions (m, 2) at angles (m,), rad."""
    angles = np.asarray(angles, dtype=float)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _coefficients(x: float, boundary: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Coefficients cₙ and denominators Dₙ, each (N,)."""
    alpha, beta = condition(boundary)
    n = np.arange(series_length(x))
    j, h = jv(n, x), hankel1(n, x)
    dj, dh = jv(n - 1, x) - n / x * j, hankel1(n - 1, x) - n / x * h
    denominators = alpha * h + beta * dh
    return -(alpha * j + beta * dj) / denominators, denominators


def _angular_sum(coefficients: ComplexArray, phi: ArrayLike) -> ComplexArray:
    """Σ εₙ coefficientₙ cos(n phi): (N,), (m,) -> (m,)."""
    n = np.arange(len(coefficients))
    weights = np.where(n == 0, 1.0, 2.0) * coefficients
    return np.asarray(np.cos(np.multiply.outer(np.asarray(phi, dtype=float), n)) @ weights)


def scattered_field(wavenumber: float, radius: float, r: ArrayLike, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Scattered field on and outside the cylinder.

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L; measured to ka = 500.
    r, phi : (n,)
        Distance from the axis, L, at least a; angle from the forward direction, rad.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.

    Returns
    -------
    (n,) complex
    """
    positive(wavenumber=wavenumber, radius=radius)
    r, phi = np.broadcast_arrays(np.asarray(r, dtype=float), np.asarray(phi, dtype=float))
    if np.any(r < radius * (1 - 1e-12)):
        raise ValueError(f"{np.sum(r < radius)} of {r.size} points are inside the cylinder; move them out")
    coefficients, _ = _coefficients(wavenumber * radius, boundary)
    kr = wavenumber * r
    before, here = hankel1(0, kr), hankel1(1, kr)
    total = coefficients[0] * before
    # the recurrence upwards is stable for Hₙ, the growing solution
    for n in range(1, len(coefficients)):
        total = total + 2 * 1j ** (n % 4) * coefficients[n] * here * np.cos(n * phi)
        before, here = here, 2 * n / kr * here - before
    return np.asarray(total)


def far_field(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Far field F, √L, u_s ~ F e^{ikr}/√r, at angles from the forward direction: (m,) -> (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    coefficients, _ = _coefficients(wavenumber * radius, boundary)
    factor = np.sqrt(2 / (np.pi * wavenumber)) * np.exp(-0.25j * np.pi)
    return np.asarray(factor * _angular_sum(coefficients, phi))


def surface_field(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Total field u on the cylinder at angles from the forward direction: (m,) -> (m,); zero when soft."""
    return condition(boundary)[1] * _surface_sum(wavenumber, radius, phi, boundary)


def surface_derivative(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Outward normal derivative ∂u/∂n of the total field, 1/L: (m,) -> (m,); zero when hard."""
    return -condition(boundary)[0] * wavenumber * _surface_sum(wavenumber, radius, phi, boundary)


def _surface_sum(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """(2i/πx) Σ εₙ iⁿ cos(n phi)/Dₙ: (m,) -> (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x = wavenumber * radius
    _, denominators = _coefficients(x, boundary)
    turns = 1j ** (np.arange(len(denominators)) % 4)
    return np.asarray(2j / (np.pi * x) * _angular_sum(turns / denominators, phi))


def pec_currents(
    wavenumber: float, radius: float, phi: ArrayLike, gamma: float, electric: complex, magnetic: complex
) -> tuple[ComplexArray, ComplexArray]:
    """J_l and J_z on a perfect conductor at z = 0 for a wave whose E_z and H_z are given: (m,) -> (m,), (m,)."""
    s, phi = np.sin(gamma), np.asarray(phi, dtype=float)
    k = wavenumber * s
    x = k * radius
    _, denominators = _coefficients(x, "hard")
    n = np.arange(len(denominators))
    weights = 2j / (np.pi * x) * np.where(n == 0, 1.0, 2.0) * 1j ** (n % 4) / denominators
    along = magnetic * surface_field(k, radius, phi, "hard")
    # d/dl is -(1/a) d/dphi
    rate = magnetic / radius * np.sin(np.multiply.outer(phi, n)) @ (n * weights)
    slope = electric * surface_derivative(k, radius, phi, "soft")
    return along, -1j / (wavenumber * s * s) * (np.cos(gamma) * rate - slope)
