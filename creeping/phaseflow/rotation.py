"""Maps stored as displacements of rotations or of angles: what their kernels need, and the plain numpy twins.

Formulas are those of `phaseflow.kernels.rotation`.

Also here: unit quaternions (w, x, y, z) of rotations, arrays (n, 4).

Also here: packed tables: displacement, Jacobi matrix and attenuation of a leap in eight lanes, read by one contraction.

    (q1, q2, q3, M11, M21, M12, M22, A),   q0 = (1 - |q|^2)^(1/2),   A = int_0^T0 g(c^(3/2) kappa_n)^(2/3) dt

g(k) = k above a threshold, and bends smoothly to a positive constant below it, so that A is a smooth function of the
ray even where kappa_n vanishes and the ray detaches. What A lacks there is told cell by cell: random rays of each are
carried over one leap by A and by the curvature itself, and where one of them differs by more than the tolerance, or
detaches, the cell is flagged and the kernel takes the curvature.

With S the regularised incomplete beta function of (7, 4) and I its integral, g(k) = t [1 - 2 I(1) + 2 I((k + t)/2t)],
whose first four derivatives are those of k at the threshold t, and whose first seven are 0 at -t.

Sources: Derivations, R15 and R17.
"""

from dataclasses import replace
from functools import cache, cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import ToleranceError
from creeping.geodesics.attenuation import halves, kernel_rules
from creeping.geodesics.states import ATTENUATION, DETACHMENT, WHOLE, pack
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_slices, in_threads, pause
from creeping.phaseflow.splines import Grid, Leap, interpolation_operator

ORDERED = 16_384
"""Rays from which on composing them in the order of their cells pays,"""
NEAR = 24_000_000
"""if what a leap reads has so many bytes: more than the caches hold."""
SHARE = 65_536
"""Rays ordered at a time."""
BUDGET = 5000
"""Leaps of blocks after which the kernels come up for signals: 0.01 to 0.2 s."""


class CompiledModel:
    """What rotations and angles share: four lanes, composed by `phaseflow.kernels.composition`."""

    name: str
    lanes = 4
    kind: int
    charts: int
    periodic: tuple[bool, bool]
    is_flat = False
    unit: float

    def __init__(self, body: Surface) -> None:
        self.body = body
        atlas: Any = body.atlas
        source = getattr(atlas, "sphere_map", atlas)
        # a compiled function by itself cannot be pickled
        self._forward, self._inverse = source.compiled_forward, source.compiled_inverse

    @property
    def _there(self) -> tuple[Any, FloatArray]:
        return self._forward.function, self._forward.parameters

    @property
    def _both(self) -> tuple[Any, ...]:
        return *self._there, self._inverse.function, self._inverse.parameters

    def _to_model(self, states: FloatArray, rays: FloatArray) -> None:
        """Put coordinates of states (n, 6 or more) into rays[:, :4]."""
        raise NotImplementedError

    def _to_body(self, rows: FloatArray) -> None:
        """Replace coordinates rows[:, :4] by states rows[:, :6]."""
        raise NotImplementedError

    def _between(self, earlier: FloatArray, later: FloatArray, known: FloatArray | None) -> tuple[FloatArray, float]:
        """Displacement (n, 4) from coordinates to later ones (n, 4), next to the one ``known``, and how sure it is."""
        raise NotImplementedError

    def placement(self, grid: Grid) -> tuple[FloatArray, FloatArray]:
        """Scale and shift from the coordinates of ``locate`` to those of the grid."""
        raise NotImplementedError

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """Coordinates of points of a chart, u and v in [0, 1] on its square, angle in radians: (n,) x 3 -> (n, 4)."""
        raise NotImplementedError

    def states(self, coordinates: FloatArray) -> FloatArray:
        """Points and directions: (n, 4) -> (n, 6)."""
        out = np.empty((len(coordinates), 6))
        out[:, :4] = coordinates
        in_slices(lambda part: self._to_body(out[part]), len(coordinates))
        return out

    def displacement(self, nodes: FloatArray, traced: FloatArray, times: FloatArray) -> FloatArray:
        """Displacement to the last of the traced states (n, m, 6 or more), followed to it: (n, 4).

        Raises
        ------
        ToleranceError
            If the states are too far apart in time to follow.
        """
        n, steps, _ = traced.shape
        rays = np.empty((n * steps, 4))
        states = np.ascontiguousarray(traced).reshape(n * steps, -1)
        in_slices(lambda part: self._to_model(states[part], rays[part]), n * steps)
        found, sure = self._between(nodes, rays[::steps], None)
        for step in range(1, steps):
            found, its = self._between(nodes, rays[step::steps], found)
            # a cosine that is not a number must not get lost
            sure = float(np.min([sure, its]))
        # a cosine of successive displacements that leaves no doubt about the sign of a rotation
        if not sure >= 0.3:
            raise ToleranceError(
                f"displacements over {times[-1] / len(times):.3g} are too long to follow (cosine {sure:.2f}); "
                "give a shorter horizon"
            )
        return found

    def flow(self, grid: Grid, leap: Leap, states: FloatArray, counts: IntArray) -> FloatArray:
        """Compose counts[0], then counts[1], ... maps on states (n, 6, 10 or 12): (n, m, the same)."""
        from creeping.kernels.block import aligned
        from creeping.phaseflow.kernels.composition import flow, flow_ordered

        out = np.empty((len(states), len(counts), states.shape[1]))
        states = np.ascontiguousarray(states, dtype=float)
        counts = np.asarray(counts, dtype=np.int64)
        parts = self.kind, _tables(leap), leap.time, kernel_rules(), grid.degree, *self.placement(grid)
        used = leap.state.nbytes if states.shape[1] == 6 else leap.nbytes
        many = len(states) >= ORDERED and used > NEAR and int(counts.sum()) > 0
        kernel = flow_ordered if many else flow

        def run(part: slice) -> None:
            n, lanes = states[part].shape
            rays, at = np.empty((n, lanes - 2)), np.zeros(4)
            beside: tuple[Any, ...] = ()
            self._to_model(states[part], rays)
            rays[:, 4:] = states[part, 6:]
            if many:
                cells = int(np.prod(leap.state.shape[:3]))
                beside = aligned(n, 8), np.empty((n, lanes - 6)), np.empty(n, np.int32), np.zeros(cells + 1, np.int64)
            while not kernel(*parts, rays, counts, BUDGET, at, *beside, out[part]):
                pause()
            self._to_body(out[part].reshape(-1, lanes))

        # shares that are ordered stay small, so that what is known of their rays stays in the cache
        in_threads(run, len(states), most=SHARE if many else None, even=True)
        return out

    def doubled(self, grid: Grid, leap: Leap, nodes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement (n, 4), Jacobi matrix (n, 4) and curvatures (n, 8) of two leaps from the nodes.

        The last two are empty if the leap does not carry them.
        """
        from creeping.phaseflow.kernels.composition import double

        out = np.empty((len(nodes), 4))
        matrices = np.empty((len(nodes) if leap.has_jacobi else 0, 4))
        curvatures = np.empty((len(nodes) if leap.has_curvature else 0, 16))
        tables = _tables(leap), grid.degree, *self.placement(grid)

        def run(part: slice) -> None:
            double(self.kind, *tables, nodes[part], out[part], matrices[part], curvatures[part])

        in_threads(run, len(nodes))
        return out, matrices, curvatures @ halves().T


class RotationModel(CompiledModel):
    """Rotations [s, q, s x q]; six stereographic charts."""

    name = "rotation"
    kind = 0
    charts = 6
    periodic = (False, False)
    unit = 2.0

    @cached_property
    def _surface_table(self) -> FloatArray:
        """Table of x(u, v) for the kernels, none if psi itself is to be used."""
        return exit_table(self.body)

    def _to_model(self, states: FloatArray, rays: FloatArray) -> None:
        from creeping.phaseflow.kernels import rotation, surface_table

        if len(self._surface_table):
            surface_table.to_rotations(self._surface_table, *self._both[2:], states, rays)
        else:
            rotation.to_rotations(*self._both, states, rays)

    def _to_body(self, rows: FloatArray) -> None:
        from creeping.phaseflow.kernels import rotation, surface_table

        if len(self._surface_table):
            surface_table.from_rotations(self._surface_table, rows)
        else:
            rotation.from_rotations(*self._there, rows)

    def _between(self, earlier: FloatArray, later: FloatArray, known: FloatArray | None) -> tuple[FloatArray, float]:
        # of the two quaternions of a rotation the one next to that known
        turned = quaternion_product(earlier * np.array([1.0, -1.0, -1.0, -1.0]), later)
        cosine = turned[:, 0] if known is None else np.sum(turned * known, axis=1)
        return np.where(cosine < 0, -1.0, 1.0)[:, None] * turned, float(np.min(np.abs(cosine), initial=1.0))

    def placement(self, grid: Grid) -> tuple[FloatArray, FloatArray]:
        """See `CompiledModel`."""
        half = 0.5 * grid.cells[:2]
        return np.array([*half, grid.cells[2]]), np.array([*(grid.origin + half), 0.0])

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """As for all models."""
        # [s, q, s x q] is the chart's own rotation, times that of (u, v) at angle 0, times a turn about s
        u, v = ((np.sqrt(2) - 1) * (2 * np.asarray(value) - 1) for value in (u, v))
        across = 1 + u * u + v * v
        s = np.stack([(2 - across) / across, 2 * u / across, 2 * v / across], axis=1)
        q = np.stack([-s[:, 1], 1 - u * s[:, 1], -v * s[:, 1]], axis=1)
        half = 0.5 * np.asarray(angle)
        zero = np.zeros_like(half)
        spin = np.stack([np.cos(half), np.sin(half), zero, zero], axis=1)
        order = [(k - chart // 2) % 3 for k in range(3)]
        sign = -1.0 if chart % 2 else 1.0
        own = np.diag([sign, sign, 1.0])[order]
        first = quaternions(own[None, :, 0], own[None, :, 1])
        return quaternion_product(quaternion_product(first, quaternions(s, q)), spin)


class OctantModel(RotationModel):
    """Rotations on a body with the three coordinate planes as mirrors: the table covers s >= 0 only.

    A mirror sends R to D_1 R D_2, D_2 = diag(1, 1, -1), and a displacement Q of the reflected ray is D_2 Q D_2 of the
    ray. Splines reach beyond the mirrors by their margin, so nothing is assumed there.
    """

    name = "octant"
    kind = 2
    charts = 3

    def placement(self, grid: Grid) -> tuple[FloatArray, FloatArray]:
        """See `CompiledModel`."""
        return grid.cells, np.array([*grid.origin, 0.0])

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """As for all models; u and v in [0, 1] are those in [1/2, 1] of the whole chart."""
        return super().at(2 * chart, 0.5 + 0.5 * np.asarray(u), 0.5 + 0.5 * np.asarray(v), angle)


class AngleModel(CompiledModel):
    """(u, v, angle) in turns on one doubly periodic chart."""

    name = "angles"
    kind = 1
    charts = 1
    periodic = (True, True)
    unit = 2 * np.pi

    def _to_model(self, states: FloatArray, rays: FloatArray) -> None:
        from creeping.phaseflow.kernels.rotation import to_angles

        to_angles(*self._both, states, rays)

    def _to_body(self, rows: FloatArray) -> None:
        from creeping.phaseflow.kernels.rotation import from_angles

        from_angles(*self._there, rows)

    def _between(self, earlier: FloatArray, later: FloatArray, known: FloatArray | None) -> tuple[FloatArray, float]:
        # angles are known up to whole turns
        before = np.zeros_like(later) if known is None else known
        step = later - earlier - before
        step -= np.floor(step + 0.5)
        return before + step, float(np.min(1.0 - 2.0 * np.abs(step), initial=1.0))

    def placement(self, grid: Grid) -> tuple[FloatArray, FloatArray]:
        """See `CompiledModel`."""
        return grid.cells, np.zeros(3)

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """As for all models."""
        return np.stack([u, v, angle / (2 * np.pi), np.zeros_like(u)], axis=1)


def _tables(leap: Leap) -> tuple[Any, ...]:
    """Arrays of a leap in the order of the kernels."""
    return leap.state, leap.centre, leap.jacobi, leap.matrix, leap.curvature, leap.flagged


def exit_table(body: Surface) -> FloatArray:
    """Coefficients (6, n, n, 4) of x(u, v) on the charts where psi is an iteration, none (0, 1, 1, 4) elsewhere.

    The coarsest table with an rms error of (x, p) below 1e-9, x in body sizes.
    """
    found, model = np.zeros((0, 1, 1, 4)), RotationModel(body)
    model._surface_table = found
    if not getattr(getattr(body.atlas, "sphere_map", None), "iterative", False):
        return found
    rng = np.random.default_rng(0)
    chart = rng.integers(6, size=2048)
    one, other, angle = rng.random((3, 2048))
    at = np.concatenate([model.at(c, one[chart == c], other[chart == c], angle[chart == c]) for c in range(6)])
    exact = model.states(at)
    for side in (48, 72, 108, 160):
        grid = Grid((side, side, 1), 5, (False, False))
        u, v = (values.ravel() for values in np.meshgrid(*grid.axes()[:2], indexing="ij"))
        points = np.stack([model.states(model.at(c, u, v, np.zeros_like(u)))[:, :3] for c in range(6)])
        values = np.zeros((6, side, side, 4))
        values[..., :3] = points.reshape(6, side, side, 3)
        for axis in (1, 2):
            operator = interpolation_operator(side, 5, False)
            values = np.moveaxis(np.tensordot(operator, values, axes=(1, axis)), 0, axis)
        model._surface_table = np.ascontiguousarray(values)
        error = (model.states(at) - exact) / np.array([size(body)] * 3 + [1.0] * 3)
        model._surface_table = found
        if float(np.sqrt(np.mean(np.sum(error**2, axis=1)))) < 1e-9:
            return np.ascontiguousarray(values)
    return found


def quaternions(s: FloatArray, q: FloatArray) -> FloatArray:
    """Unit quaternions (n, 4) of the rotations with columns s, q, s x q, from the largest of their components."""
    matrices = np.stack([s, q, np.cross(s, q)], axis=2)
    return np.asarray(Rotation.from_matrix(matrices).as_quat(scalar_first=True))


def quaternion_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Product a b of quaternions (n or 1, 4)."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a.T, b.T
    rows = (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
    return np.stack(rows, axis=1)


def packed_lanes(model: CompiledModel, values: FloatArray, matrices: FloatArray, bent: FloatArray, time: float) -> Any:
    """Lanes (n, 8) at the nodes of displacements, matrices (n, 4) and curvatures (n, 8); None if they are too long."""
    q = values[:, :3]
    if not isinstance(model, AngleModel):
        turned = np.where(values[:, :1] < 0, -values, values)
        # nearer to 0, q0 is not known well from q
        if turned[:, 0].min() < 0.2:
            return None
        q = turned[:, 1:]
    sampling, _, points, weights, _ = kernel_rules()
    curvature = bent @ sampling[: len(points)].T
    most, least = float(bent.max()), float(curvature.min())
    threshold = min(0.1 * most, 0.5 * least) if least > 0 else 0.1 * most
    attenuation = time * (bent_floor(curvature, threshold) ** (2 / 3) @ weights)
    return np.concatenate([q, matrices, attenuation[:, None]], axis=1)


def bent_floor(curvature: FloatArray, threshold: float) -> FloatArray:
    """g of curvatures (...), 1/L, with the threshold, 1/L: (...)."""
    at = np.clip((curvature + threshold) / (2 * threshold), 0.0, 1.0)
    powers = at[..., None] ** np.arange(12)
    bent = threshold * (1 + 2 * (powers @ _integral() - _integral().sum()))
    return np.asarray(np.where(curvature >= threshold, curvature, bent))


@cache
def _integral() -> FloatArray:
    """Coefficients (12,) of I: S is the polynomial of degree 10 whose derivative is t^6 (1 - t)^3 over its integral."""
    density = np.polynomial.Polynomial([0] * 6 + [1]) * np.polynomial.Polynomial([1, -1]) ** 3
    share = density.integ() / density.integ()(1.0)
    return np.asarray(share.integ().coef)


def with_flags(model: CompiledModel, grid: Grid, leap: Leap, tolerance: float) -> Leap:
    """The packed leap with its cells judged, ``tolerance`` of attenuation over a leap in body sizes^(1/3)."""
    allowed = tolerance * size(model.body) ** (1 / 3)
    rng, cells, origin = np.random.default_rng(0), grid.cells.astype(int), grid.origin.astype(int)
    trusting = replace(leap, flagged=np.zeros(leap.jacobi.shape[:4], dtype=np.uint8))
    careful = replace(leap, flagged=np.ones(leap.jacobi.shape[:4], dtype=np.uint8))
    # beyond the unit square no ray is sought, and none is tested
    flagged = np.ones(leap.jacobi.shape[:4], dtype=np.uint8)
    corner = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1).reshape(-1, 3)
    place = corner + np.array([*origin, 0])
    one = np.array([1])
    for chart in range(model.charts):
        bad = np.zeros(len(corner), dtype=bool)
        for _ in range(4):
            u, v, turns = ((corner + rng.random(corner.shape)) / cells).T
            states = model.states(model.at(chart, u, v, 2 * np.pi * turns))
            states = pack(states[:, :3], states[:, 3:], lanes=WHOLE)
            quick, exact = (model.flow(grid, table, states, one)[:, 0] for table in (trusting, careful))
            bad |= ~(np.abs(quick[:, ATTENUATION] - exact[:, ATTENUATION]) <= allowed)
            bad |= np.isfinite(exact[:, DETACHMENT])
        flagged[chart, place[:, 0], place[:, 1], place[:, 2]] = bad
    return replace(leap, flagged=flagged)
