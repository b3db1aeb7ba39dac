"""The field of each geodesic between two slots in a conductor: its components along b and t at both ends.

Per unit of the moment and times the impedance of free space, with w the wave of `creeping.field.ports.waves` without
its V, T0 = T/kappa_n at source (s) and receiver (r), M = m1 m2 and c = J2'/J2, the mean of both ends, A as there,

    H_b from b   ik [w V + T0s T0r w V_1/M] - i c f - (i/J2) g + T0s T0r S0
    H_t from t   S + i c g + (i/J2) f
    H_b from t   T0r S0 + X_s,         H_t from b   T0s S0 + X_r
    X = ik w [(T0 - K0/2) V_1/m^2 + (K0/2) iV/(2 xi M)],   K0 = A_b kappa_n^(-2/3), minus that at the source
    S = (k/(2 xi M)) w [U + (i/(2 xi M)) U],   S0 = (k/(2 xi M)) w U
    f = -i w [V - (V_1 - iV/(2 xi))/(2M) + (i/2k) (c - 1/s) V]
    g = (1/(2 xi M)) w [U - (U_1 - 3iU/(2 xi))/(2M) + (i/2k) (c - 1/s) U]

X with T0, K0 and m of one end, A_b the change of A with that end's place along b. V and the first U of S and g to
second order, that of "electric hard" and "electric soft" waves: V with H less (1/2) (2/k)^(1/3) int kappa^(-2/3) K ds,
K the Gaussian curvature, and U, under its integral and in its modes, with

    i E t^2 + L t + i P/xi,          exp{i E tau^2} [1 + L tau + i P/xi],       P = (15/4) E/xi - (3/2) L
    L = (2/ks) (k/2)^(1/3) int kappa_n^(2/3) [r/3 - 1/12 - (5/18) rho^2 T^2] ds + [(1 + rho^2 T^2)/6 - B/9]/M

and, third order, the exponent i xi (-tau^3/1400 - 1/140)/M^2. On a plane, with 2 xi M = ks, this is exact.

Also here: what slots at ports bring by each geodesic, with its error, and by beams where these merge.

A beam carries H = A b + B p, its components as in `creeping.field.ports.antenna_waves` without the terms in J2'/J2 and
1/J2: off its ray H turns with its front, to b - (q'/q) n p and p + (q'/q) n b, and by stationary phase those terms come
back.

Error: that of a point source's wave, of all components, and what was not derived.

Also here: the field of each geodesic between two monopoles on a conductor, E along n of an electric moment along n.

Per unit of the moment and times the admittance of free space, with the letters of `creeping.field.ports.antenna_waves`,

    E_n = ik w {V + (T0s² + T0r²) V_1/(2M) + [(ν² - 1/4)/(ka)²] - 1} + T0s T0r S0

V to second order, of "electric hard" waves: what a slot across the path gives along b, H_b, and the charge at the foot,
E_n = (i/k) (curl H)_n. The bracket stands under the integral of V, with all that it has there,

    p t/M + a t²/M²,   a = q + p E M/ξ,   p = 1, q = 1/4,
    p [V_1 + iE V_3 + L V_2 + i(P/ξ) V_1 - iH V]/M + a V_2/M² + r V,
    r = (4q - 3a) (i/(2 ξ M))² - p (3 E/ξ - L)/(2 ξ² M),   which leaves 1 + i/ks + (i/ks)² on a plane, 2 ξ M = ks

and in modes as a factor g = 1 + p τ/M + a τ²/M² of [1 + L τ + (H/ξ)/τ² + iP/ξ], less (H/ξ) g'/τ, since R² has a double
pole: t R² = 1 - R', so that under the integral it is iξ V.

Sources: [PW81] for leading order; [P82]; Derivations, F28, F24 and F33.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.ports.beams import PortBeams
from creeping.field.ports.sources import PortSources, Sums, path_error
from creeping.field.ports.waves import LIMIT, PathTerms, path_terms, second_order
from creeping.field.special.airy import coupling_function, hard_modes, soft_coupling_function, soft_modes
from creeping.field.waves.shed_wave import limited
from creeping.geometry.surface import Surface
from creeping.rays.port_rays import PortRays

TURNED = 1.5
"""Bound of |K0|."""
NEAR, VARIES, TWIST = 0.5, 0.4, 0.2
"""Shares that are unsure: of the difference of both lengths of the near field, of that of T0 at both ends, of T0."""


@dataclass(frozen=True, eq=False)
class SlotWaves:
    """Fields of geodesics (m,), infinite on their caustics.

    Attributes
    ----------
    components : (m, 2, 2) complex, 1/L^2
        Along b and t at the receiver, the second port, of moments along b and t at the source.
    frames : (m, 2, 2, 3)
        b and t at both ends.
    missing : (m, 2, 2), 1/L^2
        Bounds of what was not derived in each component.
    """

    components: ComplexArray
    frames: FloatArray
    missing: FloatArray

    def along(self, source: FloatArray, receiver: FloatArray) -> ComplexArray:
        """Fields (m,) along axes at the receiver (m, 3) of moments along axes at the source (m, 3), 1/L^2."""
        there, here = self._ends(source, receiver)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.einsum("ma,mac,mc->m", here, self.components, there))

    def bounds(self, source: FloatArray, receiver: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sum of magnitudes of the terms of `along`, and their error by what was not derived (m,), (m,), 1/L^2."""
        there, here = np.abs(self._ends(source, receiver))
        with np.errstate(invalid="ignore"):
            sizes, missing = (
                np.einsum("ma,mac,mc->m", here, of, there) for of in (np.abs(self.components), self.missing)
            )
        return np.asarray(sizes), np.asarray(missing)

    def _ends(self, source: FloatArray, receiver: FloatArray) -> FloatArray:
        """Components of axes along b and t (2, m, 2)."""
        return np.asarray(np.einsum("meac,emc->ema", self.frames, np.stack([source, receiver])))


class SlotTerms:
    """What the waves of geodesics (m,) depend on beside length and spreading, at one wavenumber.

    Parameters as of `creeping.field.ports.waves.PathTerms`, with all five integrals (m, 5), and ``turning`` (m, 2) as
    of `creeping.rays.port_rays.PortRays`; beams have none, their sum brings it in.
    """

    def __init__(
        self,
        wavenumber: float,
        arclength: FloatArray,
        curvature: FloatArray,
        torsion: FloatArray,
        bend: FloatArray,
        integrals: FloatArray,
        turning: FloatArray | None = None,
    ) -> None:
        electric = integrals.copy()
        electric[:, 2] -= 0.5 * integrals[:, 4]
        self.hard = PathTerms(wavenumber, arclength, curvature, torsion, bend, electric)
        self.k, self.arclength = wavenumber, arclength
        self.xi, self.square, self.E = self.hard.xi, self.hard.square, self.hard.E
        root = np.cbrt(wavenumber / 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            self.T0, self.near = torsion / curvature, 0.5 / (self.xi * self.square)
            self.uneven = np.cbrt(curvature / curvature[:, ::-1])
            self.K0 = np.zeros_like(curvature)
            if turning is not None:
                lean = turning * (-1, 1) / np.cbrt(curvature) ** 2
                self.K0 = np.clip(np.nan_to_num(lean), -TURNED, TURNED)
            ends = np.mean((1 + self.T0**2) / 6 - bend / 9, axis=1) / self.square
            self.L = 2 * root * integrals[:, 3] / (wavenumber * arclength) + ends
            self.P = 3.75 * self.E / self.xi - 1.5 * self.L

    def soft(self, order: int) -> ComplexArray:
        """U to second order, without the factor of the wave (m,)."""
        plain = soft_coupling_function(self.xi)
        if order == 1:
            return plain
        return np.asarray(plain + second_order(self.xi, plain, self._early, self._late))

    def _early(self, some: IntArray, plain: ComplexArray) -> ComplexArray:
        xi, E, L, P = (values[some] for values in (self.xi, self.E, self.L, self.P))
        first, second = (soft_coupling_function(xi, power) for power in (1, 2))
        return limited(1j * E * second + L * first + 1j * P / xi * plain, LIMIT * np.abs(plain))

    def _late(self, some: IntArray, count: int) -> ComplexArray:
        tau = soft_modes(count).tau
        xi, E, L, P = (values[some, None] for values in (self.xi, self.E, self.L, self.P))
        leading = 1j * xi * tau
        third = -xi / self.square[some, None] ** 2 * (tau**3 / 1400 + 1 / 140)
        exponent = limited(1j * (E * tau**2 + third), 0.5 * np.abs(leading))
        bracket = limited(L * tau + 1j * P / xi, 2.0)
        total = np.sum(np.exp(leading) * (np.exp(exponent) * (1 + bracket) - 1), axis=-1)
        return np.asarray(2 * np.exp(-0.25j * np.pi) * np.sqrt(np.pi) * self.xi[some] ** 1.5 * total)

    def carried(self, order: int) -> ComplexArray:
        """Components along b and t without w, J2'/J2 and 1/J2 (m, 2, 2), 1/L."""
        k, xi, M, (source, receiver) = self.k, self.xi, self.square, self.T0.T
        V1, near = coupling_function(xi, 1), self.near
        S0 = k * near * soft_coupling_function(xi)
        across = 1j * k * (self.hard.wave(order) / self.hard.factor + source * receiver * V1 / M)
        rows = [
            [across + source * receiver * S0, receiver * S0 + self.twisted(0)],
            [source * S0 + self.twisted(1), k * near * self.soft(order)],
        ]
        return np.moveaxis(np.array(rows), -1, 0)

    def twisted(self, end: int) -> ComplexArray:
        """X of the first or the second end (m,), 1/L: along t there, of the hard wave."""
        V, V1 = coupling_function(self.xi), coupling_function(self.xi, 1)
        half = 0.5 * self.K0[:, end]
        turned = (self.T0[:, end] - half) * self.uneven[:, end] * V1 / self.square
        return np.asarray(1j * self.k * (turned + 1j * half * self.near * V))

    def near_field(self, spreading: FloatArray, cot: FloatArray, order: int) -> ComplexArray:
        """What J2, L, and J2'/J2, 1/L, add to the components without w (m, 2, 2), 1/L."""
        k, xi, M, near = self.k, self.xi, self.square, self.near
        V, U = coupling_function(xi), soft_coupling_function(xi)
        f, g = V, U
        if order == 2:
            V1, U1 = coupling_function(xi, 1), soft_coupling_function(xi, 1)
            turned = limited(np.asarray(0.5j / k * (cot - 1 / self.arclength), dtype=np.complex128), LIMIT)
            f = self.hard.wave(2) / self.hard.factor - limited((V1 - 0.5j * V / xi) / (2 * M), LIMIT * np.abs(V))
            g = self.soft(2) - limited((U1 - 1.5j * U / xi) / (2 * M), LIMIT * np.abs(U))
            f, g = f + turned * V, g + turned * U
        f, g, none = -1j * f, near * g, np.zeros_like(f)
        rows = [
            [-1j * cot * f - 1j * g / spreading, none],
            [none, 1j * k * near**2 * U + 1j * cot * g + 1j * f / spreading],
        ]
        return np.moveaxis(np.array(rows), -1, 0)

    def missing(self) -> FloatArray:
        """Bounds of what was not derived in the components without w (m, 2, 2), 1/L."""
        V, V1 = np.abs(coupling_function(self.xi)), np.abs(coupling_function(self.xi, 1))
        lengths = NEAR * np.abs(2 * self.near - 2 / (self.k * self.arclength)) * V
        turning = VARIES * np.abs(self.T0[:, 0] - self.T0[:, 1]) + TWIST * np.max(np.abs(self.T0), axis=1)
        turning = turning * V1 / self.square
        return np.asarray(self.k * np.moveaxis(np.array([[0 * V, turning], [turning, lengths]]), -1, 0))


def slot_waves(rays: PortRays, wavenumber: float, order: int) -> SlotWaves:
    """Of all geodesics (m,)."""
    terms = SlotTerms(*paths_of(rays, wavenumber))
    w, cot = geodesic_waves(rays, terms, wavenumber, order)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        components = terms.carried(order) + terms.near_field(rays.spreading, cot, order)
        components = components * w[:, None, None]
        missing = terms.missing() * np.abs(w)[:, None, None]
    normals = np.stack([rays.normals[rays.first], rays.normals[rays.second]], axis=1)
    ends = np.stack([np.cross(normals, rays.directions), rays.directions], axis=2)
    return SlotWaves(components, ends, missing)


def paths_of(rays: PortRays, k: float) -> tuple[Any, ...]:
    """What `SlotTerms` asks for, of all geodesics."""
    ends = rays.curvature, rays.torsion, rays.bend
    return k, rays.arclength, *ends, rays.integrals, rays.turning


def geodesic_waves(rays: PortRays, terms: SlotTerms, k: float, order: int) -> tuple[ComplexArray, FloatArray]:
    """W, 1/L, infinite on caustics, and J2'/J2, 1/L: (m,), (m,)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        phase = np.exp(1j * (k * rays.arclength - 0.5 * np.pi * rays.caustics))
        w = terms.hard.factor * phase / np.sqrt(np.abs(rays.spreading))
        cot = np.mean(rays.rates, axis=1) / rays.spreading
        if order == 2:
            w = w * (1 + limited(-0.125j / k * (cot - 1 / rays.arclength), LIMIT))
    return w, cot


def slot_sources(
    rays: PortRays,
    axes: FloatArray,
    k: float,
    order: int,
    waves_of: Callable[[PortRays, float, int], SlotWaves] = slot_waves,
    kind: type["SlotBeams"] | None = None,
) -> PortSources:
    """Waves of slots along unit tangents (n, 3) at their ports, 1/L^2, and beams of a kind, by default `SlotBeams`."""
    terms = path_terms(rays, k)
    made = waves_of(rays, k, order)
    source, receiver = axes[rays.first], axes[rays.second]
    waves = made.along(source, receiver)
    with np.errstate(invalid="ignore"):
        sizes = np.sqrt(np.sum(np.abs(made.components) ** 2, axis=(1, 2)))
        strength, missing = made.bounds(source, receiver)
        own = strength * path_error(rays, terms, k) + missing
        if order == 1:
            own = own + np.abs(waves_of(rays, k, 2).along(source, receiver) - waves)
    own = np.where(np.isfinite(sizes), own, 0.0)

    def beams(number: int) -> Sums:
        place = rays.body, rays.ports[number], rays.normals[number], axes[number], rays.length
        made = (kind or SlotBeams)(*place, k, order)

        def sums(targets: IntArray, beyond: float) -> tuple[ComplexArray, ComplexArray, FloatArray]:
            both = made.sums(rays.ports[targets], beyond)
            found, again = (made.received(field, axes[targets]) for field in both)
            return found, again, np.linalg.norm(both[0], axis=1)

        return sums

    return PortSources(terms.square, waves, sizes, own, k, True, beams)


class SlotBeams(PortBeams):
    """Beams of a slot along an axis (3,), a unit tangent at its port; their fields H (n, 3), 1/L^2."""

    def __init__(
        self,
        body: Surface,
        port: FloatArray,
        outward: FloatArray,
        axis: FloatArray,
        length: float,
        wavenumber: float,
        order: int,
    ) -> None:
        super().__init__(body, port, outward, length, wavenumber, order)
        from scipy.interpolate import CubicSpline

        _, p, b = self.rays[:3]
        shape = len(p), len(self.known), *self._components.shape[1:]
        components = CubicSpline(self.known, self._components.reshape(shape), axis=1)(self.at)
        start = np.stack([b[:, 0], p[:, 0]], axis=1) @ axis
        self._carry(components, start)

    def received(self, fields: ComplexArray, axes: FloatArray) -> ComplexArray:
        """Fields of `sums` along axes (n, 3): (n,)."""
        return np.asarray(np.einsum("nc,nc->n", fields, axes))

    def _carry(self, components: ComplexArray, start: FloatArray) -> None:
        """Take what is carried (rays, steps, components, 2) of the axis, along b and p at its port (rays, 2)."""
        _, p, b = self.rays[:3]
        along = np.einsum("rsac,rc->rsa", components, start)
        side, front = along[..., :1], along[..., 1:]
        self.carried = np.ascontiguousarray(side * b + front * p)
        self.leaning = np.ascontiguousarray((front * b - side * p) / self.turned[..., None])

    def _wave(self, path: tuple[Any, ...], order: int) -> ComplexArray:
        hard, components = self._of_paths(path, order)
        y = hard.wave(order)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = components * (hard.factor / y)[:, None, None]
        self._components = np.where(np.isfinite(ratio), ratio, 0.0)
        return y

    def _of_paths(self, path: tuple[Any, ...], order: int) -> tuple[PathTerms, ComplexArray]:
        """The hard wave's terms, and what is carried of moments along b and p (m, components, 2)."""
        terms = SlotTerms(*path)
        return terms.hard, terms.carried(order)


class MonopoleTerms(SlotTerms):
    """What the waves of geodesics (m,) depend on beside length and spreading; parameters as of `SlotTerms`."""

    def upright(self, order: int) -> ComplexArray:
        """E_n without w (m,), 1/L."""
        V1 = coupling_function(self.xi, 1)
        # a slot has T0s T0r at V_1; the mean of squares is more than that by half the square of the difference
        charge = 0.5 * (self.T0[:, 0] - self.T0[:, 1]) ** 2 * V1 / self.square
        charge = charge + self.bracket(order, np.ones_like(self.xi), 0.25)
        return np.asarray(self.carried(order)[:, 0, 0] + 1j * self.k * charge)

    def bracket(self, order: int, first: FloatArray, rest: float) -> ComplexArray:
        """What the factor p t/M + a t²/M², a = q + p E M/ξ, adds to V (m,); p is ``first`` and q ``rest``.

        For small ξ p i/ks + 4q (i/ks)² of V, 2 ξ M = ks, is left.
        """
        V = coupling_function(self.xi)
        if order == 1:
            return np.asarray(first * coupling_function(self.xi, 1) / self.square - 4 * rest * self.near**2 * V)

        def early(some: IntArray, V: ComplexArray) -> ComplexArray:
            return self._early_bracket(some, V, first[some], rest)

        def late(some: IntArray, count: int) -> ComplexArray:
            return self._late_bracket(some, count, first[some, None], rest)

        return second_order(self.xi, V, early, late)

    def _early_bracket(self, some: IntArray, V: ComplexArray, first: FloatArray, rest: float) -> ComplexArray:
        """Under the integral."""
        hard = self.hard
        xi, M, near, E, H, L, P = (of[some] for of in (self.xi, self.square, self.near, hard.E, hard.H, hard.L, hard.P))
        V1, V2, V3 = (coupling_function(xi, power) for power in (1, 2, 3))
        a = rest + first * E * M / xi
        r = (3 * a - 4 * rest) * near**2 - first * (3 * E / xi - L) / (2 * xi**2 * M)
        turned = V1 + 1j * E * V3 + L * V2 + 1j * P / xi * V1 - 1j * H * V
        return np.asarray(first * turned / M + a * V2 / M**2 + r * V)

    def _late_bracket(self, some: IntArray, count: int, first: FloatArray, rest: float) -> ComplexArray:
        """By so many modes."""
        xi, root, E = self.xi[some], np.sqrt(np.pi * self.xi[some]), self.hard.E[some]
        tau, small = hard_modes(count).tau, 1 / self.square[some, None]
        a = rest * small**2 + first * (E / xi)[:, None] * small
        decayed, bracket = self.hard.modes_of_second_order(some, count)
        twice = (self.hard.H[some] / xi)[:, None] * (first * small + 2 * a * tau) / tau
        total = np.sum(decayed * (bracket * (first * small * tau + a * tau**2) - twice), axis=-1)
        return np.asarray(np.exp(0.25j * np.pi) * root * total)


def monopole_waves(rays: PortRays, wavenumber: float, order: int) -> ComplexArray:
    """E_n of all geodesics (m,), 1/L^2; infinite on caustics."""
    terms = MonopoleTerms(*paths_of(rays, wavenumber))
    w, _ = geodesic_waves(rays, terms, wavenumber, order)
    with np.errstate(invalid="ignore"):
        return np.asarray(w * terms.upright(order))
