"""Smooth F from points and normals of a body: least squares of a quintic tensor-product B-spline.

In cells of the grid, f = F/h with spacing h, the coefficients c minimise

    sum_v f(v)^2 + w |grad f(v) - n|^2 + OFFSET_WEIGHT (f(v + n) - 1)^2 + OFFSET_WEIGHT (f(v - n) + 1)^2
    + smoothing sum |fourth differences of c - c0 along each axis|^2,

w the weight of the normals, v and n in cells: F is near the signed distance within a cell of the body, which holds
what the points alone leave free; where it is thinner than that, the distance stands for 1. Only coefficients that a
sample sees are unknown; the others keep the distance that the solver starts from. c0 are the coefficients of that
distance where it is as good as the points (`fit`'s ``keep_start``), and else 0: the distance has kinks where it is
continued, at some cells from the body, and to smooth those bends F on it by more than the spline errs (40 to 100 times
in distance, 7 to 130 times in curvature, on bodies of 10 000 vertices). The normal equations are solved by
conjugate gradients, preconditioned by S D^-1 S: S = B^-1 takes coefficients to the cardinal basis (B samples the
B-splines at the nodes), in which the equations are nearly diagonal, D is the density of the samples about each node,
raised by a floor. Steps are few if they start from a good distance: those left to the end change what the samples
hardly see.

Weights are set by trial; Derivations, B6.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import tangents
from scatterers.fits.cloud import left_at
from scatterers.fits.tensor import TensorSpline, cardinal, side_of_cells
from scatterers.kernels.compiled import SYMMETRIC, evaluated
from scatterers.kernels.tensor import OVERREAD

OFFSET_WEIGHT = 0.01
"""Of the samples at one cell's distance from the body."""
SMOOTHING = 1e-8
PADDING = 5.0
"""Cells between the body and the faces of the grid."""
NEAR = 7.0
"""Cells from the points within which a given distance is asked for: beyond, no sample sees what is there."""
ROUGHNESS = np.convolve([1, -4, 6, -4, 1], [1, -4, 6, -4, 1])
"""D^T D away from the ends of an axis, D the fourth differences."""
COARSER = 1.35
"""Spacing of the grid of a second fit, in units of the first."""
SLOPES = (0.5, 1.6)
"""|grad F| on the body: F is near a signed distance, or the fit has failed."""
MAX_NODES = 8_000_000
ACCURACY = 2e-5
"""Change of the curvatures from one look to the next, relative to their rms, at which a fit is done."""


@dataclass(frozen=True)
class Fitted:
    """A spline with what its fit tells.

    Attributes
    ----------
    spline : TensorSpline
    spacing : float
        Of the grid, L.
    change : float
        Rms change of the principal curvatures over the last 20 iterations, 1/L.
    misfit : float
        Rms of F/|grad F| at the points, L.
    turn : float
        Rms angle between grad F and the normals at the points, radians.
    """

    spline: TensorSpline
    spacing: float
    change: float
    misfit: float
    turn: float


def fit(
    points: FloatArray,
    normals: FloatArray,
    spacing: float,
    *,
    distance: Callable[[FloatArray], FloatArray] | None = None,
    middle: FloatArray | None = None,
    trusted: BoolArray | None = None,
    mean_curvature: FloatArray | None = None,
    smoothing: float = SMOOTHING,
    normal_weight: float = 1.0,
    keep_start: bool = False,
    accuracy: float = ACCURACY,
    iterations: int = 480,
    progress: Callable[[str], None] = lambda _: None,
) -> Fitted:
    """Fit F to points (n, 3) of a closed body, L, and outward unit normals (n, 3) there.

    Parameters
    ----------
    spacing : float
        h, L; about 1.6 to 2 distances between neighbouring points.
    distance : callable, optional
        Signed distance from the body to start from, (m, 3) -> (m,); NaN where it is not known.
    middle : (3,), L, optional
        Of the grid, by default that of the points.
    trusted : (n,) bool, optional
        Points that are fitted, by default all; at the others F stays near the distance that it starts from.
    mean_curvature : (n,), 1/L, optional
        Mean curvature at the points by another route, NaN where it is not known. Steps towards the points first add
        ripples and only then remove them: the last F is taken that agrees with it nearly as well as the best one.
    smoothing : float
        Weight of the fourth differences; noisy points need more.
    normal_weight : float
        Weight of grad f = n; less where points are noisy, and normals that come of them more so.
    keep_start : bool
        Smooth the change from the distance that is given, not F: for points without noise.
    accuracy : float
        Change of the curvatures over 20 iterations, relative to their rms, at which the solver stops.
    iterations : int
        Most steps of the solver.
    progress : callable
        Told what is being done.

    Raises
    ------
    ValueError
        If the grid would have more than `MAX_NODES` nodes.
    """
    # iterations from one look at the curvature to the next
    checked = 20
    equations = _Equations(points, normals, spacing, smoothing, normal_weight, middle, trusted)
    c = equations.start(distance)
    watch = _Watch(equations, mean_curvature)
    r = equations.residual(c, targets=True, rough=not keep_start)
    z = equations.preconditioned(r)
    p, rz = z.copy(), _product(r, z)
    q, part = np.empty_like(r), np.empty_like(r)
    before, change, done = watch.curvatures(c), np.inf, 0
    best, kept = watch.off(before), c.copy()
    changes = [np.inf, np.inf]
    while done < iterations and rz > 0:
        # without new arrays: memory that is fresh at every step takes as long as the sums
        equations.residual(p, targets=False, out=q)
        step = -rz / _product(p, q)
        c += np.multiply(p, step, out=part)
        r += np.multiply(q, step, out=part)
        z = equations.preconditioned(r)
        last, rz = rz, _product(r, z)
        p *= rz / last
        p += z
        done += 1
        if done % checked:
            continue
        now = watch.curvatures(c)
        change = float(np.sqrt(np.mean((now - before) ** 2)))
        scale = float(np.sqrt(np.mean(now**2)))
        progress(f"fitting: {done} iterations, curvatures changing by {change / scale:.1e}")
        before, off = now, watch.off(now)
        best = min(best, off)
        # points and normals gain by every step, and some steps cost curvature
        if off <= 2.5 * best:
            kept = c.copy()
        elif done > checked:
            break
        # over two looks: surfaces that are less smooth than their grid go on changing a little
        if change <= accuracy * scale or (keep_start and change > 0.7 * changes[-2]):
            break
        changes.append(change)
    return equations.result(kept if watch.guided else c, change / spacing)


def _product(a: FloatArray, b: FloatArray) -> float:
    """a.b, on this thread: those of BLAS wait for each other, twenty times as long where another process has a core."""
    return float(np.einsum("i,i->", a, b))


def spacing_of(points: FloatArray, nodes: float) -> float:
    """Spacing, L, at which the grid about points (n, 3), L, has ``nodes``."""
    return side_of_cells(np.ptp(points, axis=0), 2 * PADDING + 5, nodes)


class _Equations:
    """Samples and operators of one fit, in cells; coefficients are flat with `OVERREAD` numbers behind."""

    def __init__(
        self,
        points: FloatArray,
        normals: FloatArray,
        spacing: float,
        smoothing: float,
        normal_weight: float,
        middle: FloatArray | None = None,
        trusted: BoolArray | None = None,
    ) -> None:
        from scipy.spatial import cKDTree

        low, high = points.min(0), points.max(0)
        middle = 0.5 * (low + high) if middle is None else middle
        half = np.maximum(high - middle, middle - low) + PADDING * spacing
        # nodes on the middle planes: there the distance to start from has its kinks
        cells = np.ceil(half / spacing).astype(np.int64)
        low, nodes = middle - cells * spacing, 2 * cells + 1
        self.shape = tuple(int(n) + 4 for n in nodes)
        if np.prod(np.array(self.shape, dtype=float)) > MAX_NODES:
            raise ValueError(
                f"a grid of {' x '.join(map(str, nodes))} nodes with spacing {spacing:.3g} has more than {MAX_NODES}; "
                "give a coarser mesh or a larger spacing"
            )
        self.points, self.normals, self.spacing, self.smoothing = points, normals, spacing, smoothing
        self.low, self.normal_weight = low, normal_weight
        self.tree = cKDTree(points)
        # in the order of the cells: neighbouring samples find their coefficients in the cache
        self.fitted = slice(None) if trusted is None else trusted
        points, normals = points[self.fitted], normals[self.fitted]
        places = (points - low) / spacing
        order = np.lexsort(places.astype(np.int64).T[::-1])
        places, self.sorted_normals = places[order], np.ascontiguousarray(normals[order])
        some = slice(None, None, 3)
        self.samples = [places, *(np.ascontiguousarray((places + k * self.sorted_normals)[some]) for k in (1, -1))]
        self.nothing, self.flat = np.zeros(len(places)), np.zeros_like(places)
        self.targets = [self.nothing, *(self._offset_targets(k) for k in (1, -1))]
        # coefficients that some sample sees
        from scipy.ndimage import binary_dilation

        seen = np.zeros(self.shape, dtype=bool)
        for places in self.samples:
            seen[tuple(places.astype(np.int64).T)] = True
        # a sample of cell k sees coefficients k..k + 5
        self.unknown = np.asarray(binary_dilation(seen, np.ones((6, 6, 6)), origin=(-3, -3, -3)))
        # weights of the samples about each node, by hats three cells wide
        size = int(np.prod(self.shape))
        strides = np.array([self.shape[1] * self.shape[2], self.shape[2], 1])
        total = np.zeros(size)
        for weight, places in zip(
            (1 + 3 * self.normal_weight, OFFSET_WEIGHT, OFFSET_WEIGHT), self.samples, strict=True
        ):
            nearest = np.rint(places).astype(np.int64)
            for shift in np.ndindex(3, 3, 3):
                node = nearest + np.array(shift) - 1
                hat = weight * np.prod(1 - np.abs(places - node) / 1.5, axis=1)
                total += np.bincount((node + 2) @ strides, np.maximum(hat, 0.0), minlength=size)
        density = total.reshape(self.shape)
        # a floor: what the equations leave nearly free must not dominate the steps
        self.damping = 1 / (density + 0.03 * density.max() + 3 * ROUGHNESS.max() * smoothing)

    def _nearest(self, where: FloatArray) -> IntArray:
        """Points nearest to all nodes (m, 3), but for some spacings where they are many spacings off.

        A tree of points takes long where many are equally far, as in the middle of a body.
        """
        from scipy.ndimage import distance_transform_edt

        node = np.rint((self.points - self.low) / self.spacing).astype(np.int64) + 2
        one = np.full(self.shape, -1, dtype=np.int64)
        one[tuple(node.T)] = np.arange(len(node))
        cells, index = distance_transform_edt(one < 0, return_indices=True)
        nearest = one[tuple(index)].ravel()
        near = np.flatnonzero(cells.ravel() < NEAR + 2)
        nearest[near] = self.tree.query(where[near])[1]
        return np.asarray(nearest)

    def _plane_distance(self, where: FloatArray, nearest: IntArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Distance (m,) to the tangent plane at the nearest point, far from it to the point; and to the point, L."""
        if nearest is None:
            nearest = self.tree.query(where)[1]
        off = np.linalg.norm(where - self.points[nearest], axis=1)
        plane = np.sum((where - self.points[nearest]) * self.normals[nearest], axis=1)
        return np.where(np.abs(plane) > 0.5 * off, plane, np.copysign(off, plane)), off

    def _offset_targets(self, k: int) -> FloatArray:
        """f at the samples a cell outside (k = 1) or inside (k = -1) the body: k, or less where it is thin."""
        distance = self._plane_distance(self.low + self.spacing * self.samples[k])[0] / self.spacing
        # where it differs by more from a cell the body is thin
        return np.where(np.abs(distance - k) < 0.2, float(k), distance)

    def start(self, distance: Callable[[FloatArray], FloatArray] | None) -> FloatArray:
        """Coefficients of the distance near the body, where it is given, and else of that to the nearest tangent plane.

        Far from a plane's point, of the distance to that point. Coefficients follow from values at the nodes by the
        quasi-interpolant below, which reproduces quintics and reaches two nodes only: kinks far off stay there.
        """
        from scipy.ndimage import convolve1d

        quasi = np.array([13, -112, 438, -112, 13]) / 240
        axes = [self.low[k] + self.spacing * (np.arange(self.shape[k]) - 2.0) for k in range(3)]
        where = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        values, off = self._plane_distance(where, self._nearest(where))
        if distance is not None:
            near = np.flatnonzero(off < NEAR * self.spacing)
            found = distance(where[near])
            # a foot that is farther off than the nearest point is none
            good = np.abs(found) <= off[near] * (1 + 1e-9)
            values[near[good]] = found[good]
        values[self._stray(values, off)] *= -1
        c = values.reshape(self.shape) / self.spacing
        for axis in range(3):
            c = convolve1d(c, quasi, axis=axis, mode="nearest")
        return np.concatenate([c.ravel(), np.zeros(OVERREAD)])

    def _stray(self, values: FloatArray, off: FloatArray) -> BoolArray:
        """Nodes (m,) whose sign is wrong: parts of one sign that keep away from the points, which are so far off, L.

        At a sharp vertex of a coarse mesh the normal may lean so far that nodes in front of it lie behind its plane.
        """
        from scipy.ndimage import label

        # in cells; so near come parts of either sign that the body bounds
        near, stray = off <= 1.2 * self.spacing, np.zeros(len(off), dtype=bool)
        for side in (values < 0, values >= 0):
            part, count = label(side.reshape(self.shape))
            part = part.ravel()
            meant = np.zeros(count + 1, dtype=bool)
            meant[part[near | ~side]] = True
            # thicker than all that is near points, or all of what is outside
            meant[np.argmax(np.bincount(part, side))] = True
            stray |= ~meant[part]
        return stray

    def residual(
        self, c: FloatArray, *, targets: bool, rough: bool = True, out: FloatArray | None = None
    ) -> FloatArray:
        """A^T W (b - A c) less the smoothing's gradient if rough, b = 0 unless targets; zero where c is not unknown."""
        from scipy.ndimage import convolve1d

        from scatterers.kernels.tensor import accumulate

        out = np.empty_like(c) if out is None else out
        out.fill(0.0)
        shape = np.array(self.shape, dtype=np.int64)
        for k, (places, values) in enumerate(zip(self.samples, self.targets, strict=True)):
            weight = np.array([OFFSET_WEIGHT, 0.0] if k else [1.0, self.normal_weight])
            slopes = self.sorted_normals if targets and not k else self.flat
            accumulate(places, values if targets else self.nothing[: len(places)], slopes, weight, shape, c, out)
        if rough:
            # what is unknown keeps four nodes from the ends
            grid = c[:-OVERREAD].reshape(self.shape)
            bent = sum(convolve1d(grid, ROUGHNESS, axis, mode="constant") for axis in range(3))
            out[:-OVERREAD] -= self.smoothing * np.ravel(bent)
        out[:-OVERREAD] *= self.unknown.ravel()
        out[-OVERREAD:] = 0.0
        return out

    def preconditioned(self, r: FloatArray) -> FloatArray:
        """S D^-1 S r on the unknown coefficients."""
        values = cardinal(cardinal(r[:-OVERREAD].reshape(self.shape)) * self.damping) * self.unknown
        return np.concatenate([values.ravel(), np.zeros(OVERREAD)])

    def spline(self, c: FloatArray) -> TensorSpline:
        values = np.ascontiguousarray(c[:-OVERREAD].reshape(self.shape)) * self.spacing
        return TensorSpline(values, self.low, np.full(3, self.spacing))

    def result(self, c: FloatArray, change: float) -> Fitted:
        """The spline, and what is left at the points."""
        spline = self.spline(c)
        misfit, turn = left_at(spline, self.points[self.fitted], self.normals[self.fitted])
        return Fitted(spline, self.spacing, change, misfit, turn)


class _Watch:
    """Curvatures at some of the points, by which the progress of a fit is judged."""

    def __init__(self, equations: _Equations, mean_curvature: FloatArray | None) -> None:
        self.equations = equations
        at, n = equations.points[equations.fitted], equations.normals[equations.fitted]
        self.guided = mean_curvature is not None
        guide = np.zeros(len(at)) if mean_curvature is None else mean_curvature[equations.fitted]
        known = np.flatnonzero(np.isfinite(guide))
        known = known[:: max(1, len(known) // 2000)]
        self.at, n, self.guide = at[known], n[known], guide[known] * equations.spacing
        self.tangents = tangents(n)

    def curvatures(self, c: FloatArray) -> FloatArray:
        """Curvature along two orthogonal tangents, in 1/cells: (2, n)."""
        _, gradient, hessian = evaluated(self.equations.spline(c).compiled, self.at)
        bent = np.einsum("kni,nij,knj->kn", self.tangents, hessian[:, SYMMETRIC], self.tangents)
        return np.asarray(self.equations.spacing * bent / np.linalg.norm(gradient, axis=1))

    def off(self, curvatures: FloatArray) -> float:
        """Rms difference from the mean curvature that was given; 0 without one."""
        if not self.guided:
            return 0.0
        return float(np.sqrt(np.mean((curvatures.mean(axis=0) - self.guide) ** 2)))
