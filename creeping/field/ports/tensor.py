"""What a geodesic takes from a source at one port to a field at another: components, moments in and fields out.

Per unit of the moment, with w, V, U of `creeping.field.ports.waves`, T0 = T/κₙ at source (s) and receiver (r), b and t
at both ends across and along the path, and n the normal:

    point     u of e^{ikr}/(4πr)   w V

on a conductor, H times and electric moments by the impedance of free space, all of them "electric" waves:

    slot      H_b from b           ik [w V + T0s T0r w V_1/M] - i c f - (i/J2) g + T0s T0r S0
              H_t from t           S + i c g + (i/J2) f
              H_b from t           T0r S0 + X_s
              H_t from b           T0s S0 + X_r
    monopole  E_n from n           ik w {V + (T0s² + T0r²) V_1/(2M) + charge(1, 1/4)} + T0s T0r S0
    mixed     E_n from b          -ik w {V + (T0s²/m1² + T0r²/m2²) V_1/2 + charge(m1/(2 m2), 0) + (i/2k) c V}
                                   - T0s T0r S0
              E_n from t          -T0r S0 - X_s

    X = ik w [(T0 - K0/2) V_1/m² + (K0/2) iV/(2 ξ M)],   K0 = A_b κₙ^(-2/3), minus that at the source
    S = (k/(2 ξ M)) w [U + (i/(2 ξ M)) U],   S0 = (k/(2 ξ M)) w U
    f = -i w [V - (V_1 - iV/(2ξ))/(2M) + (i/2k) (c - 1/s) V]
    g = (1/(2 ξ M)) w [U - (U_1 - 3iU/(2ξ))/(2M) + (i/2k) (c - 1/s) U]

X with T0, K0 and m of one end, A_b the change of A with that end's place along b; c = J2'/J2, the mean of both ends, in
the mixed row that of the slot's end. V, and the first U of S and of g, to second order. On a plane 2 ξ M = ks, and all
is exact. A monopole is the charge of a slot across the path, E_n = (i/k) (curl H)_n, which multiplies V by a factor,
`creeping.field.ports.waves.HardWave.charge`. By reciprocity H along b and t of a moment along n is minus the mixed row.

Also here: the wave of each geodesic between ports, for the moments and receivers that are there, with its error.

    wave = here^T (components) there

there and here are the axes of source and receiver along b and t of the path; 1 for what has no axis, or one along n.
Error of a wave as a share of it, what second order leaves out being of order 1/m^4; r, B and T as in
`creeping.field.ports.waves`:

    share^2 = (0.2/m^4)^2 + (0.4 xi/m^4)^2 (0.1 + (r - 1)^2 + (B/2)^2 + rho^4 T^4) + (k ds)^2

and what was not derived of the components; of order 1 all that order 2 adds.

Sources: [PW81] for leading order; [P82]; Derivations, F20, F25, F28, F33 and F34. The factors of the error
were set on a sphere and on the ellipsoids (1, 0.8, 0.6) and (1.2, 1, 0.8), by ``python -m studies port_coverage``: 95
of 100 are covered; 0.1 is more than a sphere needs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.airy import coupling_function, soft_coupling_function
from creeping.field.ports.waves import LIMIT, HardWave, Path, SoftWave, bare_waves, path_of
from creeping.field.waves.shed_wave import limited
from creeping.rays.port_rays import PortRays

NEAR, VARIES, TWIST = 0.5, 0.4, 0.2
"""Shares that are unsure: of the difference of both lengths of the near field, of that of T0 at both ends, of T0 (F28).

Measured by ``tests/field/test_slots.py`` and ``test_coupling.py``: 95 of 100 entries are covered."""


Number = TypeVar("Number", np.float64, np.complex128)


class PointTensor:
    """Point sources on a hard body; the parameter is a `creeping.field.ports.waves.Path` of geodesics (m,)."""

    electric = False

    def __init__(self, path: Path) -> None:
        self.k, self.arclength = path.wavenumber, path.arclength
        self.hard = HardWave(path, electric=self.electric)
        self.xi, self.M = self.hard.xi, self.hard.M

    @property
    def scale(self) -> float:
        """Size of the components, in that of a point source."""
        return self.k if self.electric else 1.0

    def carried(self, order: int) -> ComplexArray:
        """Components without w, J2'/J2 and 1/J2 (m, fields, moments): what beams carry."""
        return self.hard.value(order)[:, None, None]

    def spread(self, spreading: FloatArray, rates: FloatArray, order: int) -> ComplexArray | float:
        """What J2 (m,), L, and its slopes (m, 2) add to the components without w."""
        return 0.0

    def missing(self) -> FloatArray:
        """Bounds of what was not derived in the components without w (m, fields, moments)."""
        return np.zeros((len(self.xi), 1, 1))


class _ConductorTensor(PointTensor):
    """Dipoles on a conductor."""

    electric = True

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        curvature = path.curvature
        self.soft = SoftWave(path, self.hard)
        with np.errstate(divide="ignore", invalid="ignore"):
            self.T0, self.near = path.torsion / curvature, 0.5 / (self.xi * self.M)
            # M/m² of both ends
            self.uneven = np.cbrt(curvature / curvature[:, ::-1])
            lean = path.turning * (-1, 1) / np.cbrt(curvature) ** 2
        # infinite on caustics: on an ellipsoid (1, 0.8, 0.6) 0.2 in the median, and beyond 1.5 for 1 of 100
        self.K0 = np.clip(np.nan_to_num(lean), -1.5, 1.5)

    @cached_property
    def v(self) -> ComplexArray:
        """V to first order."""
        return coupling_function(self.xi)

    @cached_property
    def v1(self) -> ComplexArray:
        """V_1 to first order."""
        return coupling_function(self.xi, 1)

    @cached_property
    def u(self) -> ComplexArray:
        """U to first order."""
        return soft_coupling_function(self.xi)

    def across(self, hard: ComplexArray, squares: FloatArray) -> ComplexArray:
        """From b to b, or n, without what spreads, of V with its charge and the factor of V_1/M (m,)."""
        source, receiver = self.T0.T
        charged = 1j * self.k * (hard + squares * self.v1 / self.M)
        return np.asarray(charged + source * receiver * self.k * self.near * self.u)

    def turned(self, end: int) -> ComplexArray:
        """From t at one end, 0 or 1, to b or n at the other (m,): the torsion of both, and X of that end."""
        half = 0.5 * self.K0[:, end]
        there = (self.T0[:, end] - half) * self.uneven[:, end] * self.v1 / self.M
        twisted = 1j * self.k * (there + 1j * half * self.near * self.v)
        return np.asarray(self.T0[:, 1 - end] * self.k * self.near * self.u + twisted)

    def unsure(self) -> FloatArray:
        """Bound of what torsion may add to `turned` (m,)."""
        torsion = VARIES * np.abs(self.T0[:, 0] - self.T0[:, 1]) + TWIST * np.max(np.abs(self.T0), axis=1)
        return np.asarray(self.k * torsion * np.abs(self.v1) / self.M)


class SlotTensor(_ConductorTensor):
    """Slots: H along b and t of magnetic moments along b and t."""

    def carried(self, order: int) -> ComplexArray:
        """Components without w, J2'/J2 and 1/J2 (m, 2, 2), 1/L."""
        across = self.across(self.hard.value(order), np.prod(self.T0, axis=1))
        along = self.k * self.near * self.soft.value(order)
        return _matrix([[across, self.turned(0)], [self.turned(1), along]])

    def spread(self, spreading: FloatArray, rates: FloatArray, order: int) -> ComplexArray:
        """What J2 (m,), L, and its slopes (m, 2) add to the components without w (m, 2, 2), 1/L."""
        k, xi, M, near, V, U = self.k, self.xi, self.M, self.near, self.v, self.u
        c = np.mean(rates, axis=1) / spreading
        f, g = V, U
        if order == 2:
            U1 = soft_coupling_function(xi, 1)
            turned = limited(np.asarray(0.5j / k * (c - 1 / self.arclength), dtype=np.complex128), LIMIT)
            f = self.hard.value(2) - limited((self.v1 - 0.5j * V / xi) / (2 * M), LIMIT * np.abs(V)) + turned * V
            g = self.soft.value(2) - limited((U1 - 1.5j * U / xi) / (2 * M), LIMIT * np.abs(U)) + turned * U
        f, g, none = -1j * f, near * g, np.zeros_like(f)
        along = 1j * k * near**2 * U + 1j * c * g + 1j * f / spreading
        return _matrix([[-1j * c * f - 1j * g / spreading, none], [none, along]])

    def missing(self) -> FloatArray:
        """Bounds of what was not derived in the components without w (m, 2, 2), 1/L."""
        lengths = self.k * NEAR * np.abs(2 * self.near - 2 / (self.k * self.arclength)) * np.abs(self.v)
        return _matrix([[np.zeros_like(lengths), self.unsure()], [self.unsure(), lengths]])


class MonopoleTensor(_ConductorTensor):
    """Monopoles: E along n of electric moments along n."""

    def carried(self, order: int) -> ComplexArray:
        """The component without w (m, 1, 1), 1/L."""
        hard = self.hard.value(order) + self.hard.charge(order, np.ones_like(self.xi), 0.25)
        return self.across(hard, 0.5 * np.sum(self.T0**2, axis=1))[:, None, None]


class MixedTensor(_ConductorTensor):
    """From slots to monopoles: E along n of magnetic moments along b and t."""

    def carried(self, order: int) -> ComplexArray:
        """Components without w and J2'/J2 (m, 1, 2), 1/L."""
        # a monopole stands for a slot along -b
        hard = self.hard.value(order) + self.hard.charge(order, 0.5 * self.uneven[:, 1], 0.0)
        across = self.across(hard, 0.5 * np.sum(self.uneven * self.T0**2, axis=1))
        return _matrix([[-across, -self.turned(0)]])

    def spread(self, spreading: FloatArray, rates: FloatArray, order: int) -> ComplexArray:
        """What the slope of J2 at the slot's end adds to the components without w (m, 1, 2), 1/L."""
        added = 0.5 * rates[:, 0] / spreading * self.hard.value(order)
        return _matrix([[added, np.zeros_like(added)]])

    def missing(self) -> FloatArray:
        """Bounds of what was not derived in the components without w (m, 1, 2), 1/L."""
        return _matrix([[np.zeros_like(self.arclength), self.unsure()]])


def _matrix(rows: Sequence[Sequence[np.ndarray[Any, np.dtype[Number]]]]) -> np.ndarray[Any, np.dtype[Number]]:
    """Matrices (m, rows, columns) of their entries (m,)."""
    return np.moveaxis(np.array(rows), -1, 0)


TENSORS = {
    ("point", "point"): PointTensor,
    ("slot", "slot"): SlotTensor,
    ("monopole", "monopole"): MonopoleTensor,
    ("slot", "monopole"): MixedTensor,
}
"""By the kinds of source and receiver."""


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
        growing = 0.4 * wave.xi * np.sqrt(0.1 + (r - 1) ** 2 + (bend / 2) ** 2 + lean**2)
        # polynomials of degree 5 err by a fiftieth of those of degree 3 (F25), on great circles by less
        parts = (0.2 / wave.M**2, growing / wave.M**2, 0.02 * k * rays.error)
        return np.asarray(np.minimum(np.sqrt(sum(part**2 for part in parts)), 1.0))
