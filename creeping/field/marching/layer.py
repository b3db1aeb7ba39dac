"""Waves on the surface along rays, by marching the boundary layer above them.

In coordinates (s, n) along a ray, with h = 1 + kappa_n n and h_t = 1 + kappa_t n, what is marched is y, the wave less
its tube and its phase:

    y = u sqrt(J h_t) e^{-iks},   y_s = ik (sqrt(1 + X) - 1) y
    X = [h^2 d_nn + h kappa_n d_n]/k^2 + h^2 - 1 + ((kappa_n - kappa_t)^2 - kappa_n^2)/(4k^2)
    soft u = 0;   else u_n + ik eta u = 0:   y_n + (ik eta - kappa_t/2) y = 0

The surface need be neither convex nor smooth, and amplitudes of any order come out. The scattered wave starts on the
lit side as that of optics and is driven by the incident one on the surface; where the ray has turned away the incident
wave is added, and the total goes on by itself. Waves that come back along the ray are left out.

Also here: how far a marched wave may be off: what the one-way equation, its start and its arithmetic leave out.

    error^2 = [0.4 kappa*/k + 1.5 z (1 - r/0.6)^2 + 0.08 sqrt(V)]^2 |y|^2 + [1e-4 max |y|]^2
    kappa* = 0.4 max |kappa_n| + 0.6 (max kappa_n - min kappa_n) since the start,   V = int |d eta/ds| ds
    z = kappa/(2k sin^3 alpha) at the start,   r = (s - s_a)/|s_a| up to 0.6

The first term stands for waves that come back and for curvature that varies (on a circle nothing comes back), the
second for the next order of optics, the third for an admittance that varies, the last for what the top of the layer
lets through. The factors were found on sections of cylinders, k rho of 3 to 300: there 98 of 100 places are covered,
and most errors are a tenth of it. What varies across rays in space is not in it.

Also here: rational steps of the one-way equation: poles and weights of its Pade approximants.

    exp{i delta (sqrt(1 + X) - 1)} = sum_j c_j/(1 + b_j X),   delta = k ds,   j = 1..p

is the [p-1/p] approximant about X = 0, p = 4. It has |f| <= 1 on the real axis and falls at both its ends, so that
evanescent waves are damped; [p/p] does not damp them. In partial fractions the poles need one right-hand side only.

The Taylor series is that of an exponential of a series, and the equations for the denominator are solved in rational
numbers, since in floating point they lose all digits. Ordered by their real parts, poles vary smoothly with delta: they
are tabulated once over log delta and interpolated by polynomials of degree 7, to 1e-8 in f.

Sources: [C93]; Derivations, F22; [C93], [BG96].
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked
from creeping.field.boundary import Boundary
from creeping.field.marching.plan import MarchPlan, MarchStatus, march_plan
from creeping.field.marching.profile import LayerGrid, RayProfiles, layer_grid
from creeping.kernels.threads import in_threads

ORDER = 4
"""Order p of the rational steps."""
PER_OCTAVE = 8
"""Tabulated steps in a factor 2 of delta."""


@dataclass(frozen=True, eq=False, repr=False)
class MarchedRays:
    """Waves on the surface along rays.

    Attributes
    ----------
    s : (rays, n), L
        Places of each ray; the last one is repeated where a ray has fewer.
    values : (rays, n) complex
        sqrt(J) e^{-iks} times u, or times du/dn if soft, for a wave of phase 0 at s = 0.
    counts : (rays,)
        Places of each ray.
    start, switch : (rays,), L
        Where the wave of optics was taken, and where the driven part ends.
    status : (rays,) of int
        Codes of `MarchStatus`.
    reliable : (rays,), L
        s up to which the status does not touch the wave.
    error : (rays, n)
        Of the values where the status is OK or s is up to ``reliable``, meant to hold at 95 of 100 places of plane
        sections; infinite where there is no wave.
    misfit : (rays,)
        Largest share of the incident wave by which its traces at the poles fail to add up to it.
    wavenumber : float, 1/L
    """

    s: FloatArray
    values: ComplexArray
    counts: IntArray
    start: FloatArray
    switch: FloatArray
    status: IntArray
    reliable: FloatArray
    error: FloatArray
    misfit: FloatArray
    wavenumber: float
    profiles: RayProfiles

    def at(self, ray: int, s: ArrayLike) -> ComplexArray:
        """Values (m,) of a ray at places (m,), L; 0 where it was not marched.

        Splines between jumps of the curvature: of the wave in terms of the incident one where that drives it.
        """
        from scipy.interpolate import CubicSpline

        at = np.asarray(s, dtype=float)
        found = np.zeros(at.shape, dtype=complex)
        if self.status[ray] in (MarchStatus.UNLIT, MarchStatus.UNSTABLE):
            return found
        places, values = self.s[ray, : self.counts[ray]], self.values[ray, : self.counts[ray]]
        lead = self._incident_phase(ray, places)
        marks = np.unique([places[0], *self.profiles.jumps(ray), self.switch[ray], places[-1]])
        marks = marks[(marks >= places[0]) & (marks <= places[-1])]
        for low, high in pairwise(marks):
            inside = (places >= low - 1e-12) & (places <= high + 1e-12)
            asked = (at >= low) & (at <= high)
            if not np.any(asked):
                continue
            turn = np.exp(-1j * lead[inside]) if high <= self.switch[ray] else 1.0
            if np.sum(inside) > 1:
                spline = CubicSpline(places[inside], values[inside] * turn)
                found[asked] = spline(at[asked])
            if high <= self.switch[ray]:
                found[asked] *= np.exp(1j * self._incident_phase(ray, at[asked]))
        return found

    def _incident_phase(self, ray: int, at: FloatArray) -> FloatArray:
        """Phase k (d.x - s) of the incident wave at places."""
        return np.asarray(self.wavenumber * self.profiles.value_of("phase", ray, at))


def march_rays(profiles: RayProfiles, *, wavenumber: float, boundary: Boundary) -> MarchedRays:
    """March the wave along each ray of a batch, from the lit side to its end.

    Parameters
    ----------
    profiles : RayProfiles
    wavenumber : float, 1/L
    boundary : Boundary
        Soft, hard or impedance; an impedance that varies is in the profiles, else its admittance holds.

    Returns
    -------
    MarchedRays

    Raises
    ------
    InvalidInputError
        If the wavenumber is no positive number, or the boundary none of these.
    """
    k = checked(wavenumber, 2)
    if boundary.kind not in ("soft", "hard", "impedance", "electric hard"):
        raise InvalidInputError(f"boundary of kind {boundary.kind!r} is not marched; give soft, hard or impedance")
    return _March(profiles, march_plan(profiles, k), k, boundary).run()


class _March:
    """Rays on their way: steps and boundary data by ray, blocks of rays that share a grid."""

    def __init__(self, profiles: RayProfiles, plan: MarchPlan, k: float, boundary: Boundary) -> None:
        self.profiles, self.plan, self.k = profiles, plan, k
        self.soft = boundary.kind == "soft"
        self.admittance = boundary.admittance if boundary.kind == "impedance" else 0j
        self.varies = boundary.kind == "impedance" and profiles.admittance is not None
        self.electric = boundary.kind == "electric hard"
        ends = [self._edges(ray) for ray in range(len(profiles))]
        self.edges = [np.concatenate([first, second[1:]]) for first, second in ends]
        self.driven = np.array([len(first) - 1 for first, _ in ends])
        most = max(len(edges) for edges in self.edges)
        self.s = np.stack([np.pad(edges, (0, most - len(edges)), mode="edge") for edges in self.edges])
        self.values = np.zeros(self.s.shape, dtype=complex)
        self.error = np.full(self.s.shape, np.inf)
        self.misfit = np.zeros(len(ends))
        self.status = plan.status.copy()
        self.reliable = plan.reliable.copy()
        middles = [0.5 * (edges[1:] + edges[:-1]) for edges in self.edges]
        leans = [profiles.value_of("lean", ray, at) for ray, at in enumerate(middles)]
        ways = [np.diff(edges) / (1 + lean**2) for edges, lean in zip(self.edges, leans, strict=True)]
        # a joint may stand next to the end of a step
        sizes = np.maximum(np.round(k * np.concatenate(ways), 9), 1e-9)
        distinct, which = np.unique(sizes, return_inverse=True)
        self.rational = rational_step(distinct)
        self.which = np.split(which, np.cumsum([len(edges) - 1 for edges in self.edges])[:-1])

    def run(self) -> MarchedRays:
        """March all blocks."""
        from creeping.kernels.vectors import LANES

        live = [ray for ray, status in enumerate(self.status) if status != MarchStatus.UNLIT]
        counts = np.array([len(edges) - 1 for edges in self.edges])
        # rays of one grid and about as many steps make a block
        order = sorted(live, key=lambda ray: (hash(self.plan.specs[ray]), counts[ray]))
        blocks: list[list[int]] = []
        for ray in order:
            if not blocks or len(blocks[-1]) == LANES or self.plan.specs[blocks[-1][0]] != self.plan.specs[ray]:
                blocks.append([])
            blocks[-1].append(ray)

        def work(part: slice) -> None:
            for block in blocks[part]:
                self._march_block(block)

        in_threads(work, len(blocks), least=2, multiple=1, first=1)
        return MarchedRays(
            s=self.s,
            values=self.values,
            counts=counts + 1,
            start=self.plan.start,
            switch=np.array([edges[n] for edges, n in zip(self.edges, self.driven, strict=True)]),
            status=self.status,
            reliable=self.reliable,
            error=self.error,
            misfit=self.misfit,
            wavenumber=self.k,
            profiles=self.profiles,
        )

    def _edges(self, ray: int) -> tuple[FloatArray, FloatArray]:
        """Ends of the steps of the driven part and of the rest; steps end at jumps."""
        plan, jumps = self.plan, self.profiles.jumps(ray)
        stops = (plan.start[ray], plan.switch[ray], self.profiles.s[ray, -1])
        ways = []
        for low, high, step in zip(stops[:-1], stops[1:], plan.steps[ray], strict=True):
            marks = [low, *jumps[(jumps > low + 1e-9 * step) & (jumps < high - 1e-9 * step)], high]
            parts = [np.array([low])]
            for a, b in pairwise(marks):
                # marks that differ by their rounding make no step
                if b - a <= 1e-6 * step:
                    continue
                parts.append(np.linspace(a, b, max(1, int(np.ceil((b - a) / step))) + 1)[1:])
            ways.append(np.concatenate(parts))
        return ways[0], ways[1]

    def _march_block(self, block: list[int]) -> None:
        """March one block of rays and keep what is on the surface."""
        from creeping.field.kernels.layer_march import march_block
        from creeping.kernels.vectors import LANES

        grid = layer_grid(self.plan.specs[block[0]])
        data = _BlockData(max(len(self.edges[ray]) for ray in block) - 1, len(grid.nodes), LANES)
        for lane, ray in enumerate(block):
            self._load(ray, lane, grid, data)
        data.fill_from_first(len(block))
        out = np.empty((len(data.beta) + 1, 2, 2 * LANES))
        march_block(
            *(grid.matrices, grid.levels, grid.cut, grid.scale, self.k, self.soft, data.steps),
            *(data.poles, data.weights, data.drive, data.beta, data.switch),
            *(data.incident.ravel(), data.wave.ravel(), out),
        )
        for lane, ray in enumerate(block):
            self._take(ray, out[:, int(self.soft), lane] + 1j * out[:, int(self.soft), LANES + lane])

    def _load(self, ray: int, lane: int, grid: LayerGrid, data: "_BlockData") -> None:
        """Put a ray's steps, start and boundary data into a lane."""
        from creeping.field.kernels.ray_load import load_steps, load_waves

        profiles, edges, driven = self.profiles, self.edges[ray], int(self.driven[ray])
        s, start = profiles.s[ray], float(edges[0])
        # what steps ask of a profile, in the kernel's order
        names = "curvature", "across", "spreading", "torsion", "lean", "potential", "phase", "climb"
        of = {name: profiles.cubics_of(name, ray) for name in names}
        eta = self._admittance(ray)
        lit = np.empty((driven + 1, 4))
        b, c = (part[self.which[ray]] for part in self.rational)
        self.misfit[ray] = load_steps(
            *(self.k, self.soft, lane, s, tuple(of.values()), eta, edges, driven, b, c),
            *(data.steps, data.poles, data.weights, data.drive, data.beta, lit),
        )
        data.switch[lane] = driven
        bend, heights = profiles.cubics_of("bend", ray), (grid.nodes, grid.levels, grid.fade, grid.scale)
        load_waves(
            *(self.k, self.soft, lane, s, bend, profiles.curves[ray], of["across"], of["lean"], eta),
            *(start, self.plan.stop[ray], lit, heights, data.wave, data.incident),
        )
        y = np.sqrt(lit[:, 3]) * np.exp(1j * self.k * lit[:, 1])
        # the total is the scattered wave and this, or its slope
        self.values[ray, : driven + 1] = (1j * self.k * lit[:, 0] + 0.5 * lit[:, 2]) * y if self.soft else y

    def _admittance(self, ray: int) -> ComplexArray:
        """Cubics of the admittance along a ray."""
        if self.varies:
            return np.asarray(self.profiles.cubics_of("admittance", ray))
        if self.electric:
            return np.asarray(self.profiles.cubics_of("transverse", ray) / (1j * self.k))
        cubics = np.zeros((self.profiles.s.shape[1] - 1, 4), dtype=complex)
        cubics[:, 0] = self.admittance
        return cubics

    def _take(self, ray: int, found: ComplexArray) -> None:
        """Keep a ray's wave, or say that it did not stay finite."""
        count = len(self.edges[ray])
        found = found[:count]
        if not np.all(np.isfinite(found)):
            self.status[ray], self.reliable[ray] = MarchStatus.UNSTABLE, self.edges[ray][0]
            self.values[ray] = 0
            return
        driven = int(self.driven[ray]) + 1
        self.values[ray, :driven] += found[:driven]
        self.values[ray, driven:count] = found[driven:]
        self.values[ray, count:] = found[-1]
        mine, error = self.s[ray, :count], self.error[ray]
        error[:count] = march_error(self.profiles, ray, self.k, mine, self.values[ray, :count], varies=self.varies)
        error[count:] = error[count - 1]


class _BlockData:
    """What the kernel wants of a block: all its arrays, by step and lane, real parts before imaginary ones."""

    def __init__(self, steps: int, nodes: int, lanes: int) -> None:
        self.steps = np.zeros((steps, 4, lanes))
        self.poles, self.weights = (np.zeros((steps, ORDER, 2 * lanes)) for _ in range(2))
        self.drive = np.zeros((steps, ORDER + 1, 2 * lanes))
        self.beta = np.zeros((steps, 2 * lanes))
        self.switch = np.zeros(lanes, dtype=np.int64)
        self.incident, self.wave = np.zeros((2 * nodes, 2 * lanes)), np.zeros((2 * nodes, 2 * lanes))
        self.lanes = lanes

    def fill_from_first(self, count: int) -> None:
        """Let the lanes from ``count`` on, which have no ray, march the first once more."""
        n = self.lanes
        self.steps[..., count:] = self.steps[..., :1]
        self.switch[count:] = self.switch[0]
        for part in (self.poles, self.weights, self.drive, self.beta, self.incident, self.wave):
            part[..., count:n], part[..., n + count :] = part[..., :1], part[..., n : n + 1]


def march_error(
    profiles: RayProfiles, ray: int, wavenumber: float, s: FloatArray, values: ComplexArray, *, varies: bool
) -> FloatArray:
    """Error (n,) of the values at places s (n,) of a ray, the first of them its start."""
    k, start = wavenumber, float(s[0])
    at = np.linspace(start, float(s[-1]), 300)
    kappa = profiles.along(ray, at)[:, 0]
    largest, least = np.maximum.accumulate(kappa), np.minimum.accumulate(kappa)
    bend = 0.4 * np.maximum(largest, -least) + 0.6 * (largest - least)
    share = 0.4 * np.interp(s, at, bend) / k
    kappa = np.abs(kappa)
    sine = max(abs(float(np.sin(profiles.along(ray, s[:1])[0, 1]))), 0.1)
    left = np.maximum(0, 1 - (s - start) / (0.6 * max(abs(start), 1e-300)))
    share = share + 1.5 * kappa[0] / (2 * k * sine**3) * left**2
    if varies and profiles.admittance is not None:
        eta, nodes = profiles.admittance[ray], profiles.s[ray]
        change = np.concatenate([[0], np.cumsum(np.abs(np.diff(eta)))])
        share = share + 0.08 * np.sqrt(np.maximum(np.interp(s, nodes, change) - np.interp(start, nodes, change), 0))
    size = np.abs(values)
    return np.asarray(np.hypot(share * size, 1e-4 * np.max(size, initial=0.0)))


def rational_step(delta: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Poles b and weights c of steps delta = k ds (n,): (n, ORDER) each.

    Examples
    --------
    >>> b, c = rational_step(np.array([1.5]))
    >>> X = -0.4
    >>> exact = np.exp(1.5j * (np.sqrt(1 + X) - 1))
    >>> bool(abs(np.sum(c / (1 + b * X)) - exact) < 1e-5)
    True
    """
    at = PER_OCTAVE * np.log2(delta)
    # polynomials of degree 7
    nodes = np.floor(at).astype(int)[:, None] + np.arange(-3, 5)
    used = np.arange(nodes.min(), nodes.max() + 1)
    table = np.array([tabulated_step(int(node)) for node in used])
    # Lagrange's weights on unit nodes
    far = at[:, None] - nodes
    weights = np.ones_like(far)
    for i, j in np.argwhere(~np.eye(8, dtype=bool)):
        weights[:, i] *= far[:, j] / (i - j)
    found = np.einsum("ni,nixp->xnp", weights, table[nodes - used[0]])
    return found[0], found[1]


@cache
def tabulated_step(node: int) -> ComplexArray:
    """Poles and weights (2, ORDER) of delta = 2^(node/PER_OCTAVE)."""
    # exact and short
    delta = Fraction(round(2.0 ** (node / PER_OCTAVE) * 2**40), 2**40)
    numerator, denominator = _pade(*_taylor(delta, 2 * ORDER))
    zeros = np.roots(denominator[::-1])
    poles = -1 / zeros
    order = np.argsort(-poles.real)
    zeros, poles = zeros[order], poles[order]
    others = 1 + poles[None, :] * zeros[:, None]
    np.fill_diagonal(others, 1)
    return np.stack([poles, np.polyval(numerator[::-1], zeros) / np.prod(others, axis=1)])


def _taylor(delta: Fraction, count: int) -> tuple[list[Fraction], list[Fraction]]:
    """Real and imaginary parts of the coefficients of exp{i delta (sqrt(1 + X) - 1)}.

    With i g its exponent, j e_j = i sum_i i g_i e_(j-i).
    """
    root, g = Fraction(1), [Fraction(0)]
    for j in range(1, count):
        root *= (Fraction(3, 2) - j) / j
        g.append(delta * root)
    real, imaginary = [Fraction(1)], [Fraction(0)]
    for j in range(1, count):
        parts = [sum((i * g[i] * of[j - i] for i in range(1, j + 1)), Fraction(0)) / j for of in (real, imaginary)]
        real.append(-parts[1])
        imaginary.append(parts[0])
    return real, imaginary


def _pade(real: list[Fraction], imaginary: list[Fraction]) -> tuple[ComplexArray, ComplexArray]:
    """Numerator (p) and denominator (p + 1) of [p-1/p], lowest powers first, of 2p Taylor coefficients."""
    p = len(real) // 2
    # sum_i s_(m-i) b_i = -s_m, i from 1 on: real parts of b are the first p unknowns, imaginary ones the others
    rows = []
    for m in range(p, 2 * p):
        re, im = ([of[m - i] for i in range(1, p + 1)] for of in (real, imaginary))
        rows += [[*re, *(-x for x in im), -real[m]], [*im, *re, -imaginary[m]]]
    A = np.array(rows, dtype=object)
    for column in range(2 * p):
        pivot = column + int(np.flatnonzero(A[column:, column])[0])
        A[[column, pivot]] = A[[pivot, column]]
        A[column, column:] = A[column, column:] / A[column, column]
        others = np.arange(2 * p) != column
        A[others, column:] -= np.outer(A[others, column], A[column, column:])
    re, im = [Fraction(1), *A[:p, -1]], [Fraction(0), *A[p:, -1]]
    numerator = [
        complex(
            sum(re[i] * real[m - i] - im[i] * imaginary[m - i] for i in range(m + 1)),
            sum(re[i] * imaginary[m - i] + im[i] * real[m - i] for i in range(m + 1)),
        )
        for m in range(p)
    ]
    return np.array(numerator), np.array([complex(*of) for of in zip(re, im, strict=True)])
