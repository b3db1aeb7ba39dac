"""What a ray is to the layer that is marched along it: its curvatures, twist, spreading and admittance.

The layer knows the surface under a ray by kappa_n and kappa_t, by its torsion tau = b.dn/ds, b = n x p, and the wave by
how it varies along and across the ray:

    D y = Lambda y_s,   D = (1/J) [d/dsigma_perp - (d.x0)' d/ds]   along b on a wavefront
    V = K/2 + (J'/2J)^2

Where the ray leaves the line Lambda = tau/kappa_n; on a cylinder that the wave meets at an angle it stays so, and
cos^2 = 1/(1 + Lambda^2) is that of the ray's angle to the circle. Waves are traced on the plane curve with that
circle's curvature, kappa_n sqrt(1 + Lambda^2) by the ray's length.

Also here: cubic Hermite elements across the layer, and their matrices.

Unknowns are the value and the slope (times a scale) at each height 0 = n_0 < n_1 < ... < N. With S = 1 beneath T,

    S = 1 + 3i ((n - T)/(N - T))^2 above T
    m = n up to 0.6 c, then 0.6 c + 0.4 c tanh((n - 0.6 c)/(0.4 c)),   t = c_t tanh(n/c_t)
    M[f] = int S f v w dn,   D[f] = int f v' w'/S dn,   M_i = M[m^i],   D_i = D[m^i]

The derivative is stretched into the complex and the potential h^2 - 1 stays real: continued as well, it would grow like
e^{k |kappa| Im n s} over a concave surface. There h = 1 + kappa m(n) stays positive, c = 0.85/|kappa| of the deepest
concave point: above 0.6 c the layer is not the body's any more.

What the torsion of a ray adds holds for low heights only and would turn waves back from above, t instead of n keeps it
there.

Condition w' = g - beta w on the surface is that of the weak form; w = 0 at the top is a row and column of the unit
matrix.

Sources: Derivations, F22; [C93].
"""

from dataclasses import dataclass, fields
from functools import cached_property, lru_cache

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import InvalidInputError

LEAST_NODES = 4
"""Nodes of a piece between two jumps: curvatures are cubics between nodes."""

DEPTH = 0.6
"""Height of the absorber in terms of T."""
KEPT_BELOW, CAP = 0.6, 0.85
"""Share of c up to which m(n) = n, and c |kappa|."""


@dataclass(frozen=True, eq=False)
class RayProfiles:
    """Rays from the lit side on.

    Parameters
    ----------
    s : (rays, m), L
        Arc length on each ray's own nodes, ascending; 0, at the shadow line where p = d, is one of them. A node that
        stands twice parts two pieces, of 4 nodes or more: there curvatures and admittance may jump.
    curvature : (rays, m), 1/L
        kappa_n of the body along the ray, positive where convex.
    transverse : (rays, m), 1/L
        kappa_t across the ray.
    spreading : (rays, m)
        J, 1 at s = 0.
    torsion : (rays, m), 1/L
        tau.
    lean : (rays, m)
        Lambda.
    potential : (rays, m), 1/L^2
        V.
    phase : (rays, m), L
        d.(x - x0) - s.
    climb : (rays, m)
        d.n.
    admittance : (rays, m) complex, optional
        eta along the ray, where it varies.

    Raises
    ------
    InvalidInputError
        If values are not finite.
    """

    s: FloatArray
    curvature: FloatArray
    transverse: FloatArray
    spreading: FloatArray
    torsion: FloatArray
    lean: FloatArray
    potential: FloatArray
    phase: FloatArray
    climb: FloatArray
    admittance: ComplexArray | None = None

    def __post_init__(self) -> None:
        for name, values in self._known.items():
            bad = ~np.all(np.isfinite(values), axis=1)
            if np.any(bad):
                raise InvalidInputError(f"{name} is not finite on {np.sum(bad)} of {len(bad)} rays")

    def __len__(self) -> int:
        return len(self.s)

    @cached_property
    def _known(self) -> dict[str, Any]:
        """What is given, and what follows from it: the bend of the plane curve and kappa_t - tau Lambda across it."""
        found = {one.name: getattr(self, one.name) for one in fields(self) if getattr(self, one.name) is not None}
        found["bend"] = self.curvature * np.sqrt(1 + self.lean**2)
        return found | {"across": self.transverse - self.torsion * self.lean}

    @cached_property
    def _cubics(self) -> dict[str, Any]:
        """Cubics (rays, m - 1, 4) of what has been asked for."""
        return {}

    def cubics_of(self, name: str, ray: int) -> Any:
        """Cubics (m - 1, 4) of a quantity along a ray."""
        from creeping.field.kernels.ray_profile import cubics

        if name not in self._cubics:
            values = self._known[name]
            out = np.empty((*values[:, 1:].shape, 4), values.dtype)
            for number in range(len(self)):
                cubics(self.s[number], values[number], out[number])
            self._cubics[name] = out
        return self._cubics[name][ray]

    @cached_property
    def curves(self) -> FloatArray:
        """Angle psi and position x at the nodes of each ray's plane curve (rays, m, 3)."""
        from creeping.field.kernels.ray_profile import plane_curve

        out = np.empty((*self.s.shape, 3))
        origins = np.argmax(self.s == 0, axis=1)
        for ray in range(len(self)):
            plane_curve(self.s[ray], self.cubics_of("bend", ray), origins[ray], out[ray])
        return out

    def along(self, ray: int, at: FloatArray) -> FloatArray:
        """Curvature, psi and x (n, 4) of a ray's plane curve at places (n,)."""
        from creeping.field.kernels.ray_profile import sample

        out = np.empty((len(at), 4))
        sample(self.s[ray], self.cubics_of("bend", ray), self.curves[ray], at, out)
        return out

    def value_of(self, name: str, ray: int, at: FloatArray) -> Any:
        """A quantity of a ray at places (n,)."""
        s, cubics = self.s[ray], self.cubics_of(name, ray)
        # the second of two nodes at a joint is the first of its piece
        i = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(s) - 2)
        i = np.where((i > 0) & (s[i + 1] <= s[i]), i - 1, i)
        t, c = at - s[i], cubics[i].T
        return c[0] + t * (c[1] + t * (c[2] + t * c[3]))

    def jumps(self, ray: int) -> FloatArray:
        """Places where the curvature may jump."""
        s = self.s[ray]
        return np.asarray(s[1:][np.diff(s) == 0])


@dataclass(frozen=True)
class GridSpec:
    """What decides a grid: rays with equal ones share it.

    Attributes
    ----------
    height : float, L
        T, beneath the absorber.
    element, first : float, L
        Longest element, and the one on the surface.
    cap : float, L
        c, or infinite on a convex surface.
    twist : float, L
        c_t.
    wavenumber : float, 1/L
    """

    height: float
    element: float
    first: float
    cap: float
    twist: float
    wavenumber: float


@dataclass(frozen=True, eq=False)
class LayerGrid:
    """Heights of a layer and its matrices.

    Attributes
    ----------
    nodes : (j,), L
    levels : (4, j)
        m, m', t and t'.
    cut : (j, 2)
        What the total wave is multiplied with when it is first put together, and its slope times the scale.
    fade : (j, 2)
        What the reflected wave is multiplied with at the start, and its slope, 1/L.
    scale : float, L
        Unknown slopes are those of the field times this.
    matrices : (8, 2 j, 8)
        M0, -D0/k², 2 (M1 - D1/k²), M2 - D2/k², M[t²], -2 D[t]/k², -2 D[m t]/k², -D[t²]/k²: entries
        (column - 3 + i, column), real and imaginary parts by turns.
    """

    nodes: FloatArray
    levels: FloatArray
    cut: FloatArray
    fade: FloatArray
    scale: float
    matrices: FloatArray


@lru_cache(64)
def layer_grid(spec: GridSpec) -> LayerGrid:
    """Grid of a specification."""
    nodes = _nodes(spec)
    scale = float(np.median(np.diff(nodes)))
    top = nodes[-1] - spec.height
    # the total wave is faded out from half of T on
    cut = _fade(nodes, 0.5 * spec.height, spec.height + 0.3 * top) * np.array([1.0, scale])
    fade = _fade(nodes, spec.height, nodes[-1])
    levels = np.stack([*_levelled(nodes, spec.cap), *_bounded(nodes, spec.twist)])
    return LayerGrid(nodes, levels, cut, fade, scale, _matrices(spec, nodes, scale))


def _fade(n: FloatArray, begin: float, end: float) -> FloatArray:
    """1 below, 0 above, a quintic between, and its slope (n, 2)."""
    t = np.clip((n - begin) / (end - begin), 0, 1)
    return np.stack([1 - t**3 * (10 - 15 * t + 6 * t**2), -30 * t**2 * (1 - t) ** 2 / (end - begin)], axis=-1)


def _nodes(spec: GridSpec) -> FloatArray:
    element = spec.element
    edges, length = [0.0], min(spec.first, element)
    while length < element:
        edges.append(edges[-1] + length)
        # longer ones next to the surface reflect
        length *= 1.25
    below = max(1, int(np.ceil((spec.height - edges[-1]) / element)))
    straight = np.linspace(edges[-1], spec.height, below + 1)[1:]
    above = max(2, int(np.ceil(DEPTH * spec.height / element)))
    return np.concatenate([edges, straight, spec.height * (1 + DEPTH * np.arange(1, above + 1) / above)])


def _levelled(n: FloatArray, cap: float) -> tuple[FloatArray, FloatArray]:
    """Height m(n) and its derivative."""
    if not np.isfinite(cap):
        return n.copy(), np.ones_like(n)
    kept = KEPT_BELOW * cap
    z = np.maximum((n - kept) / (cap - kept), 0)
    return np.where(z > 0, kept + (cap - kept) * np.tanh(z), n), 1 / np.cosh(np.minimum(z, 300)) ** 2


def _bounded(n: FloatArray, height: float) -> tuple[FloatArray, FloatArray]:
    """Height t(n) and its derivative."""
    return height * np.tanh(n / height), 1 / np.cosh(np.minimum(n / height, 300)) ** 2


def _matrices(spec: GridSpec, nodes: FloatArray, scale: float) -> FloatArray:
    x, gauss = np.polynomial.legendre.leggauss(5)
    x, gauss = (x + 1) / 2, gauss / 2
    length = np.diff(nodes)[:, None]
    n = nodes[:-1, None] + length * x
    one = np.ones_like(length)
    v = np.stack(
        [
            one * (1 - 3 * x**2 + 2 * x**3),
            length / scale * (x - 2 * x**2 + x**3),
            one * (3 * x**2 - 2 * x**3),
            length / scale * (x**3 - x**2),
        ]
    )
    dv = np.stack(
        [
            (6 * x**2 - 6 * x) / length,
            one / scale * (1 - 4 * x + 3 * x**2),
            (6 * x - 6 * x**2) / length,
            one / scale * (3 * x**2 - 2 * x),
        ]
    )
    S = 1 + 3j * np.clip((n - spec.height) / (nodes[-1] - spec.height), 0, 1) ** 2
    m, t = _levelled(n, spec.cap)[0], _bounded(n, spec.twist)[0]
    weight = gauss * length
    mass = [np.einsum("aeg,beg,eg->eab", v, v, weight * S * f) for f in (1, m, m**2, t**2)]
    slope = [
        np.einsum("aeg,beg,eg->eab", dv, dv, weight * f / S) / spec.wavenumber**2 for f in (1, m, m**2, t, m * t, t**2)
    ]
    parts = np.stack(
        [
            mass[0],
            -slope[0],
            2 * (mass[1] - slope[1]),
            mass[2] - slope[2],
            mass[3],
            -2 * slope[3],
            -2 * slope[4],
            -slope[5],
        ]
    )
    size = 2 * len(nodes)
    out = np.zeros((len(parts), size, 8))
    for a in range(4):
        for b in range(a, 4):
            # rows a of element e and columns b: places 2e + a and 2e + b
            to = out[:, b : size - 4 + b + 1 : 2][:, : len(length)]
            at = 2 * (3 + a - b)
            to[:, :, at] += parts[:, :, a, b].real
            to[:, :, at + 1] += parts[:, :, a, b].imag
    top = size - 2
    for column in range(top, size):
        out[:, column, 2 * (3 + top - column) : 2 * (3 + top - column) + 2] = 0
    out[:, top] = 0
    out[0, top, 6] = 1
    return out
