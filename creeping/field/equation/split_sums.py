"""Sums of G = e^{ikR}/R over n nodes at m points, in fewer steps than n m: near pairs one by one, the rest by a series.

    sum_y w_y (a + b n_y.grad_y) G(|x - y|),   sum_y w_y b n_x.grad_x G,   sum_y w_y grad_x G x J

G = S + D: D ends within a reach, and its pairs make a sparse matrix; S is a Fourier series, and its sums are two
nonuniform transforms, from the nodes to the series and from there to the points [BMK19], with a derivative for each
is. Between them the sums are within 3e-5, rms, of those over all pairs.

Also here: what of G = e^{ikR}/R is smooth everywhere, as a Fourier series, and the rest, which is real and ends within
a reach.

    G = S + D,   D = E/R,   E = Re[e^{ikR} erfc(aR + ib)],   b = k/2a
    E' = -k Im[e^{ikR} erfc(aR + ib)] - (2a/sqrt(pi)) e^{b^2 - (aR)^2}
    E'' = -k^2 E + (4a^3 R/sqrt(pi)) e^{b^2 - (aR)^2}
    S = (cos kR - E)/R + i sin(kR)/R -> 2a e^{b^2}/sqrt(pi) - k erfi(b) + ik at R = 0
    S(x) = sum_s c_s e^{is.x},   |x_i| <= W_i,   s_i = 2 pi m/P_i,   |s_i| < (k^2 + 4a^2 L)^(1/2),   L = -log TOLERANCE

Beyond W_i, up to P_i/2 and back, distances are those of folded coordinates: what is folded is smooth and even, so that
its series ends where that of S does. The fold's second derivative is a Kaiser window.

Sources: [E21], [BMK19]; Derivations, F35; [E21].
"""

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.kernels.threads import in_threads, openmp_threads
from creeping.storage.memory import budget

SPLITS = (3.0, 2.2, 1.6, 1.2, 0.9, 0.75, 0.62, 0.5, 0.4, 0.33, 0.27)
"""a/k: the larger, the fewer pairs are near, and the more waves the series has."""
LONGEST = 2000.0
"""Period, over 1/k, beyond which places in single precision err by more than the series."""
TRANSFORM = 2e-5
"""Tolerance of a transform, in single precision."""
PER_MODE, PER_POINT = 5e-8, 4e-7
"""Seconds of a transform, for each wave and for each node or point."""
USES = 4
"""Sums for which it is reckoned whether splitting pays."""
SHARE, TRIED = 0.5, 256
"""Of the memory's budget that may be taken, and points by which near pairs are counted."""

TOLERANCE = 1e-5
"""What S and its series leave out, of 1/R."""
WIDE = 1.3
"""Width of the fold over the least that its window asks for."""
ROWS = 1024
"""Intervals of the table of E, over each of which cubics err by less than 1e-10."""
FOLD = 20_001
"""Places between which a fold is interpolated."""
ASKED = 1.01
"""What the series is made for, over the widths asked for."""


class SmoothKernel:
    """S of a wavenumber for places as far apart as the widths (3,), L, along the axes; ``split`` is a/k.

    Attributes
    ----------
    reach : float, L
        Distance beyond which D is nothing.
    modes : (3,) of int
        Waves of the series along each axis, even.
    period : (3,), L
    """

    def __init__(self, wavenumber: float, widths: FloatArray, split: float) -> None:
        self.k, self.split, self.a = wavenumber, split, split * wavenumber
        self._widths = ASKED * np.asarray(widths, dtype=float)
        self._b, enough = 0.5 / split, -np.log(TOLERANCE)
        self.reach = float(np.sqrt(enough + self._b**2) / self.a)
        highest = np.sqrt(self.k**2 + 4 * self.a**2 * enough)
        self._window = enough + 1
        self.period = 2 * self._widths + WIDE * 2 * self._window / (highest - self.k)
        self.modes: IntArray = np.array([_composite(p * highest / np.pi) for p in self.period])

    def __repr__(self) -> str:
        return f"SmoothKernel(k = {self.k:g}, {' x '.join(map(str, self.modes))} waves, reach {self.reach:.3g} L)"

    def near(self, distances: FloatArray) -> FloatArray:
        """E, E' and E'' (3, ...), 1, 1/L and 1/L^2, at distances (...), L."""
        from scipy.special import wofz

        R, root = np.asarray(distances, dtype=float), np.sqrt(np.pi)
        bell = np.exp(self._b**2 - (self.a * R) ** 2)
        wave = bell * wofz(1j * self.a * R - self._b)
        slope = -self.k * wave.imag - 2 * self.a / root * bell
        return np.stack([wave.real, slope, -(self.k**2) * wave.real + 4 * self.a**3 / root * R * bell])

    @cached_property
    def table(self) -> FloatArray:
        """`near` at equal steps from 0 to the reach (ROWS + 1, 3)."""
        return np.ascontiguousarray(self.near(np.linspace(0, self.reach, ROWS + 1)).T)

    @cached_property
    def at_zero(self) -> float:
        """Real part of S at R = 0, 1/L."""
        from scipy.special import erfi

        return float(2 * self.a / np.sqrt(np.pi) * np.exp(self._b**2) - self.k * erfi(self._b))

    @cached_property
    def waves(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """S of the series along each axis, 1/L, from the lowest up."""
        x, y, z = (2 * np.pi / p * np.arange(-(n // 2), n // 2) for n, p in zip(self.modes, self.period, strict=True))
        return x, y, z

    @cached_property
    def series(self) -> np.ndarray:
        """Coefficients c of the series, for 1/L, single precision: as many as modes."""
        from scipy.fft import dctn

        lengths = zip(self.modes, self.period, self._widths, strict=True)
        x, y, z = (self._folded(np.arange(n // 2 + 1) * (p / n), width, p) for n, p, width in lengths)
        R = np.sqrt(x[:, None, None] ** 2 + y[:, None] ** 2 + z**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.exp(1j * self.k * R) / R
            inside = R < self.reach
            values[inside] -= self.near(R[inside])[0] / R[inside]
        values[0, 0, 0] = self.at_zero + 1j * self.k
        octant = (dctn(values.real, type=1) + 1j * dctn(values.imag, type=1)) / np.prod(self.modes)
        whole = np.ix_(*(np.abs(np.arange(-(n // 2), n // 2)) for n in self.modes))
        return np.asarray(octant[whole], dtype=np.complex64)

    def _folded(self, places: FloatArray, width: float, period: float) -> FloatArray:
        """Places in half a period along an axis, folded beyond a width."""
        u, step = np.linspace(-1, 1, FOLD, retstep=True)
        window = np.i0(self._window * np.sqrt(np.maximum(1 - u**2, 0.0)))
        half = 0.5 * period - width
        # once to slopes from 1 to -1, and again to places
        slope = _integral(window)
        slope = 1 - 2 * slope / slope[-1]
        fold = width + half * float(step) * _integral(slope)
        return np.where(places <= width, places, np.interp((places - width) / half - 1, u, fold))


def _integral(values: FloatArray) -> FloatArray:
    """Integral of values at equal steps of 1 by trapezia, from 0."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])


def _composite(least: float) -> int:
    """The least even number from one on that is a product of 2, 3 and 5."""
    from scipy.fft import next_fast_len

    n = int(np.ceil(least))
    while True:
        n = int(next_fast_len(n, real=True))
        if n % 2 == 0:
            return n
        n += 1


class Split(NamedTuple):
    """A kernel that splits sums, and the seconds and bytes that a sum takes, about."""

    kernel: SmoothKernel
    seconds: float
    memory: float


class Load(NamedTuple):
    """What a sum takes: transforms, seconds of a near pair, in it and to be made, and bytes of a wave and of a pair."""

    transforms: int
    per_pair: float
    for_pair: float
    mode_bytes: float
    pair_bytes: float


ONE_LAYER, TWO_LAYERS, CURL = Load(4, 4e-9, 4e-8, 40, 12), Load(6, 8e-9, 8e-8, 40, 24), Load(12, 2e-8, 0.0, 75, 0)
"""Of a soft or hard body, of an impedance, and of a conductor's two waves, whose pairs are summed anew each time."""


class Cells(NamedTuple):
    """Nodes (n,) ordered by cells of a side: where cells begin, how many along each axis, and the nodes' numbers."""

    origin: FloatArray
    side: float
    counts: IntArray
    begins: IntArray
    order: IntArray

    @property
    def grid(self) -> tuple[Any, ...]:
        """What kernels are told of the cells."""
        return self.origin, self.side, self.counts, self.begins


def cells_of(nodes: FloatArray, side: float) -> Cells:
    """Cells of a side, L, for nodes (n, 3), no more than 64 along an axis."""
    origin = nodes.min(axis=0, initial=np.inf) if len(nodes) else np.zeros(3)
    side = max(side, float(np.max(nodes - origin, initial=0.0)) / 64, 1e-300)
    places = np.floor((nodes - origin) / side).astype(np.int64)
    counts = places.max(axis=0, initial=0) + 1
    number = np.ravel_multi_index(tuple(places.T), tuple(counts))
    order = np.argsort(number, kind="stable")
    begins = np.searchsorted(number[order], np.arange(np.prod(counts) + 1))
    return Cells(origin, side, counts, begins, order)


class SplitSums:
    """Sums over nodes (n, 3) at points (m, 3), L, for any values at the nodes.

    Parameters
    ----------
    kernel : SmoothKernel
    points, normals : (m, 3), L and 1
    nodes, sides : (n, 3), L and 1
        Places of the nodes, and their normals.
    weights : (n,)
    """

    def __init__(
        self,
        kernel: SmoothKernel,
        points: FloatArray,
        normals: FloatArray,
        nodes: FloatArray,
        sides: FloatArray,
        weights: FloatArray,
    ) -> None:
        self.kernel, self._points, self._normals, self._sides = kernel, points, normals, sides
        self._nodes, self._weights = nodes, weights
        self._made: dict[str, Any] = {}

    def values(self, a: ComplexArray) -> ComplexArray:
        """Sum of w a G (m,), of values (n,)."""
        series = self._to_series(a * self._weights) * self.kernel.series
        return np.asarray(self._from_series(series) + self._pairs("values", a))

    def tilted_at_nodes(self, b: ComplexArray) -> ComplexArray:
        """Sum of w b n_y.grad_y G (m,), of values (n,)."""
        dipoles = (b * self._weights)[:, None] * self._sides
        series: Any = 0.0
        for axis, s in self._waves():
            series = series + s * self._to_series(dipoles[:, axis])
        return np.asarray(self._from_series(-1j * self.kernel.series * series) + self._pairs("tilted at nodes", b))

    def tilted_at_points(self, b: ComplexArray) -> ComplexArray:
        """Sum of w b (-n_x.grad_x) G (m,), of values (n,)."""
        series = -1j * self._to_series(b * self._weights) * self.kernel.series
        smooth = sum(self._normals[:, axis] * self._from_series(s * series) for axis, s in self._waves())
        return np.asarray(smooth + self._pairs("tilted at points", b))

    def curl(self, J: ComplexArray) -> ComplexArray:
        """Sum of w grad_x G x J (m, 3, p), of vectors (n, 3, p)."""
        out, waves = np.empty((len(self._points), *J.shape[1:]), dtype=complex), dict(self._waves())
        there, back = self._plans_of_three
        for column in range(J.shape[2]):
            mine = (J[:, :, column] * self._weights[:, None]).T
            series = there.execute(np.ascontiguousarray(mine, dtype=np.complex64))
            series *= 1j * self.kernel.series
            turned = np.empty_like(series)
            for axis in range(3):
                one, two = (axis + 1) % 3, (axis + 2) % 3
                turned[axis] = waves[one] * series[two] - waves[two] * series[one]
            out[:, :, column] = back.execute(turned).T
        return out + self._near_curl(J)

    def _near_curl(self, J: ComplexArray) -> ComplexArray:
        """What near pairs give of it, in double precision: their terms are large, and what is left of them is not."""
        from creeping.field.kernels.near_pairs import near_vectors

        cells, kernel, m = self._cells, self.kernel, len(self._points)
        mine = np.moveaxis(J * self._weights[:, None, None], 2, 1)[cells.order]
        mine = np.ascontiguousarray(np.concatenate([mine.real, mine.imag], axis=2))
        x, y = np.ascontiguousarray(self._points.T), np.ascontiguousarray(self._nodes[cells.order].T)
        given = x, y, mine, *cells.grid
        table = kernel.reach, kernel.k, kernel.table, kernel.at_zero
        out = np.empty((m, mine.shape[1], 6))

        def work(part: slice) -> None:
            near_vectors(*given, *table, part.start, part.stop, out)

        in_threads(work, m, least=64, multiple=1)
        return np.asarray(np.moveaxis(out[..., :3] + 1j * out[..., 3:], 1, 2))

    def _waves(self) -> Iterator[tuple[int, Any]]:
        """Each axis with the s of the series along it."""
        for axis, s in enumerate(self.kernel.waves):
            yield axis, s.astype(np.float32).reshape([-1 if k == axis else 1 for k in range(3)])

    @cached_property
    def _plans(self) -> tuple[Any, Any]:
        return self._plan(1, self._nodes, -1), self._plan(2, self._points, 1)

    @cached_property
    def _plans_of_three(self) -> tuple[Any, Any]:
        return self._plan(1, self._nodes, -1, 3), self._plan(2, self._points, 1, 3)

    def _plan(self, kind: int, places: FloatArray, sign: int, together: int = 1) -> Any:
        """Transforms, ``together`` at once, between places (n, 3) and the series; one thread each adds in one order.

        Places are counted from the middle of the nodes, or single precision knows less of those far from the origin.
        """
        import finufft

        middle = 0.5 * (self._nodes.max(axis=0) + self._nodes.min(axis=0))

        plan = finufft.Plan(
            kind,
            tuple(int(n) for n in self.kernel.modes),
            eps=TRANSFORM,
            isign=sign,
            dtype="complex64",
            nthreads=openmp_threads(together),
            spread_thread=2,
            n_trans=together,
            upsampfac=1.25,
        )
        plan.setpts(*np.ascontiguousarray((2 * np.pi * (places - middle) / self.kernel.period).T, dtype=np.float32))
        return plan

    def _to_series(self, values: ComplexArray) -> np.ndarray:
        return np.asarray(self._plans[0].execute(np.ascontiguousarray(values, dtype=np.complex64)))

    def _from_series(self, series: np.ndarray) -> ComplexArray:
        return np.asarray(self._plans[1].execute(np.ascontiguousarray(series, dtype=np.complex64)), dtype=complex)

    def _pairs(self, kind: str, values: ComplexArray) -> ComplexArray:
        """What near pairs give of values (n,) or (n, columns): (m, ...)."""
        columns = np.ascontiguousarray(values.reshape(len(values), -1), dtype=np.complex64).view(np.float32)
        out = (self._near(kind) @ columns).view(np.complex64).astype(complex)
        return np.asarray(out.reshape(len(self._points), *values.shape[1:]))

    @cached_property
    def _cells(self) -> Cells:
        return cells_of(self._nodes, 0.5 * self.kernel.reach)

    def _near(self, kind: str) -> Any:
        """The sparse matrix of near pairs."""
        from scipy.sparse import csr_array

        from creeping.field.kernels.near_pairs import count_near, fill_near

        if kind in self._made:
            return self._made[kind]
        cells, kernel, m = self._cells, self.kernel, len(self._points)
        x, normals = (np.ascontiguousarray(part.T) for part in (self._points, self._normals))
        y, sides = (np.ascontiguousarray(part[cells.order].T) for part in (self._nodes, self._sides))
        weights = self._weights[cells.order]
        counts = np.zeros(m + 1, dtype=np.int64)

        def count(part: slice) -> None:
            count_near(x, y, *cells.grid, kernel.reach, part.start, part.stop, counts[1:])

        in_threads(count, m, least=64, multiple=1)
        starts = np.cumsum(counts)
        columns, entries = np.empty(starts[-1], dtype=np.int32), np.empty(starts[-1], dtype=np.float32)
        given = x, normals, y, sides, weights, *cells.grid, cells.order
        table = kernel.reach, kernel.k, kernel.table, kernel.at_zero
        tilt = kind != "values", kind == "tilted at points"

        def fill(part: slice) -> None:
            fill_near(*given, *table, *tilt, starts, part.start, part.stop, columns, entries)

        in_threads(fill, m, least=64, multiple=1)
        small = starts.astype(np.int32) if starts[-1] < 2**31 else starts
        self._made[kind] = csr_array((entries, columns, small), (m, len(weights)))
        return self._made[kind]


def best_split(
    make: Callable[[float], SmoothKernel],
    points: FloatArray,
    nodes: FloatArray,
    load: Load,
    seconds: float,
) -> Split | None:
    """What splits sums over nodes (n, 3) at points (m, 3) best, or None where all pairs are done sooner.

    Parameters
    ----------
    make : callable
        Gives the kernel of a split a/k.
    points, nodes : (m, 3), (n, 3), L
    load : Load
    seconds : float
        What a sum over all pairs takes.
    """
    from scipy.spatial import cKDTree

    if not len(points) or not len(nodes) or seconds < 0.02:
        return None
    tree, some = cKDTree(nodes), points[:: max(1, len(points) // TRIED)]
    best, least, room = None, USES * seconds, SHARE * budget()
    for split in SPLITS:
        kernel = make(split)
        modes = float(np.prod(kernel.modes.astype(float)))
        if kernel.k * kernel.period.max() > LONGEST:
            continue
        if least <= USES * load.transforms * PER_MODE * modes or load.mode_bytes * modes > room:
            continue
        pairs = float(np.mean(tree.query_ball_point(some, kernel.reach, return_length=True))) * len(points)
        if load.mode_bytes * modes + load.pair_bytes * pairs > room:
            break
        places = PER_MODE * modes + PER_POINT * 0.5 * (len(points) + len(nodes))
        each = load.transforms * places + load.per_pair * pairs
        whole = USES * each + load.for_pair * pairs + 4 * PER_MODE * modes
        if whole < least:
            best, least = Split(kernel, each, load.mode_bytes * modes + load.pair_bytes * pairs), whole
    return best
