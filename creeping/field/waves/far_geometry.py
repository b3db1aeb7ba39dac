"""Geometry of the far field: what every frequency and boundary shares, of many incidences with their observers.

Rays of the fans, carried in long steps, tell where to look; those that matter are traced again, exactly. Observers are
numbered through: (incidence 0, its first observer), (incidence 0, its second), ...

Also here: the fold caustic of the reflected field, where the lit side has K = 0: how large the field is about it.

On one side of it, where a direction's normal n_w = (r - d)/|r - d| is taken twice near a parabolic point, two specular
points merge; on the other there is none, and the field of isolated points is 0. About it physical optics gives, with
c = n_w.r, g and kappa_2 of `creeping.geometry.curvature` and u pointing to the side of the two,

    |f| = (kc/2 pi) [pi/(kc |kappa_2|)]^(1/2) 2 pi a |Ai(-X)|,   a = (kcg)^(-1/3),   X = 2kc a (n_w - n).u

On the dark side that is what isolated points miss; on the other they err by some 0.15 X^(-7/4) in place of Ai.

Sources: [LK59] for the caustic; Derivations, F19.
"""

from collections.abc import Callable
from functools import cached_property
from weakref import ref

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import airy

from creeping._typing import Any, ArrayLike, BoolArray, FloatArray, IntArray
from creeping.field.arguments import observers_of
from creeping.field.waves.likely_cells import RayEnds, likely_found
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.states import END, WITH_END, WITH_JACOBI
from creeping.geometry.curvature import ParabolicPoints, parabolic_points
from creeping.geometry.directions import first_of_equals
from creeping.geometry.evaluators import evaluators
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, memo, memo_of, normal, size
from creeping.geometry.triangulation import Triangulation
from creeping.rays.fan import RayFan
from creeping.rays.observer_contour import HorizonRays, MidHorizon, forward_nodes
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays, free_ways
from creeping.rays.specular import SpecularPoints, specular_points
from creeping.rays.strips import Strip, strips_of
from creeping.rays.tracer import TURN, RaySearch, RayTracer, same_within
from creeping.rays.transport import Flow, carried
from creeping.shadow.attachment import LaunchPoints, occluded
from creeping.shadow.line import ShadowLine, shares_of
from creeping.shadow.meshes import prepared
from creeping.shadow.status import NO_RAY, PointState
from creeping.storage.memory import within_budget

EARLY = 0.28
"""Time, in body sizes, before which a horizon crossing does not count for merging."""
TAPERED = 0.2
"""p.r up to which a crossing is no node of the fan integral: its taper starts at 0.3."""
APART = 2.0
"""Spacing of the nodes of a fan integral, in 1/k: a periodic integrand sampled so errs by less than 1e-6 of itself."""


def fan_strips(fan: RayFan) -> tuple[Strip, ...]:
    """Strips of a fan, cached, without those of a single ray, which have nothing to interpolate."""
    return memo(fan, "strips", lambda: tuple(strip for strip in strips_of(fan) if len(strip.positions) > 1))


def far_geometry(fan: RayFan, observation: ArrayLike) -> "FarGeometry":
    """Geometry of a fan for directions (..., 3), cached until other directions are asked for."""
    r = observers_of(observation)

    def make() -> FarGeometry:
        tracer = RayTracer(fan.body, fan.length)
        # not the fan itself: this is kept as long as the fan lives
        line, known = fan.line, ref(fan)

        def forward(_: int) -> tuple[ShadowLine, tuple[Strip, ...]]:
            found = known()
            assert found is not None
            return line, fan_strips(found)

        attached = np.array([(line.fractions if is_piecewise(line.body) else shares_of(line))["attached"]])
        return FarGeometry(fan.flow, launched_by(fan), tracer, r[None], attached, forward)

    return memo_of(fan, "far geometry", r.tobytes(), make, 1)


def launched_by(fan: RayFan) -> LaunchPoints:
    """Launch points of the rays of a fan that the wave itself launches: n is 1.

    Each run of neighbours among them is an arc of its own, closed if it is a whole closed arc of the fan.
    """
    creeping = fan.launched
    mine = np.flatnonzero(creeping)
    starts = fan.arc_index[mine[1:]] != fan.arc_index[mine[:-1]]
    arc = np.cumsum(np.concatenate([[0], starts | (np.diff(mine) > 1)])) if len(mine) else np.zeros(0)
    whole = [bool(creeping[fan.arc_index == k].all()) and closed for k, closed in enumerate(fan.closed_arcs)]
    closed = np.array([whole[k] for k in fan.arc_index[mine]], dtype=float)
    x = fan.points[mine, 0]
    rows: tuple[Any, ...] = (
        x,
        fan.arclength[mine],
        fan.curve_index[mine],
        arc.astype(float),
        fan.spacing[mine],
        closed,
        np.full(len(mine), PointState.ATTACHED),
    )
    return LaunchPoints(fan.line.direction[None], *(row[None] for row in rows))


def off_axis(directions: FloatArray, axis: FloatArray) -> FloatArray:
    """Unit directions (m, 3); those within 1e-6 rad of the axis are rotated to 1e-6 rad from it."""
    near = np.linalg.norm(directions - axis, axis=1) < 1e-6
    aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    turned = axis + 1e-6 * aside / np.linalg.norm(aside)
    return np.where(near[:, None], turned, directions)


def merging(rays: RayPoints) -> FloatArray:
    """χ = |J|/(|J| + ρ|J'|): 1 where rays to a far observer merge, J' = 0, and 0 on a caustic of the surface (n,)."""
    J, rate = np.abs(rays.spreading), np.abs(rays.spreading_rate)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(J / (J + rate / rays.curvature[1]))


class FarGeometry:
    """What the far field of n incidences in m directions each is assembled from.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
        Of a plain body.
    launch : LaunchPoints
        Of the incidences (n); the attached ones alone.
    tracer : RayTracer
        Its length is that of the rays.
    observers : (n, m, 3)
        Unit directions r.
    attached : (n,)
        Share of each shadow line that launches rays.
    forward : callable
        The shadow line and the strips of the fan of an incidence, for its forward lobe.

    Attributes
    ----------
    directions, direction : (n m, 3)
        r and d of each observer.
    incidence : (n m,) of int
    ends : RayEnds
        Of the rays.
    unserved : (n m,)
        Share of the shadow line that launches none.
    """

    def __init__(
        self,
        flow: Flow,
        launch: LaunchPoints,
        tracer: RayTracer,
        observers: FloatArray,
        attached: FloatArray,
        forward: Callable[[int], tuple[ShadowLine, tuple[Strip, ...]]],
    ) -> None:
        self.flow, self.body, self.launch, self.tracer = flow, flow.body, launch, tracer
        n, m = observers.shape[:2]
        self.observers = np.ascontiguousarray(observers)
        self.directions = self.observers.reshape(-1, 3)
        self.incidence = np.repeat(np.arange(n), m)
        self.direction = launch.directions[self.incidence]
        self.unserved = 1 - attached[self.incidence]
        self._forward = forward
        self._lobes: dict[tuple[int, bytes], tuple[HorizonRays, MidHorizon, IntArray]] = {}
        self._search()

    @cached_property
    def angle(self) -> FloatArray:
        """Angle from d (n m,), accurate at 0 and π."""
        apart = np.linalg.norm(self.directions - self.direction, axis=1)
        return np.asarray(2 * np.arctan2(apart, np.linalg.norm(self.directions + self.direction, axis=1)))

    def _search(self) -> None:
        """Carry the fans, and find cells and crossings."""
        from creeping.rays.kernels.shed_search import PARTS, quintic_weights, seek_all

        launch, (n, many) = self.launch, self.observers.shape[:2]
        rays = launch.arc_index.shape[1]
        times = coarse_times(self.flow, self.tracer.length)
        lanes = WITH_END if is_piecewise(self.body) else WITH_JACOBI
        states = carried(self.flow, launch, times, components=lanes)
        # a ray that has come to an edge or tip stays there: what the search sees beyond is nothing
        ends = states[:, :, -1, END : END + 2].copy() if lanes == WITH_END else None
        states = np.ascontiguousarray(states[..., :WITH_JACOBI])
        self._chi, self._roots = np.zeros((n, many)), np.ones(n)
        back = np.ascontiguousarray((self.angle > np.pi / 2).reshape(n, many))
        # a ray crosses about once in every half turn; at worst each sample is a cell and a crossing
        most = len(times) * PARTS
        # room at first, of which rays that part at tips take more; more is made where they need it
        cells, crossings = (
            min(2048 if is_piecewise(self.body) else 64, most * rays),
            2 + int(self.tracer.steps * TURN / np.pi),
        )
        arc = np.where(launch.curve_index == NO_RAY, np.nan, launch.arc_index)
        closed = np.ascontiguousarray(launch.closed)
        self.ends = RayEnds(self.tracer, launch, states, times)
        pieces = [(np.empty((0, 4), np.int64), np.empty((0, 2)), np.empty((0, 4)))]
        # parts of a size that is the same wherever it runs: what is passed over depends on the observers of a call;
        # signals are heard between them, after 0.1 s
        share = max(1, 20_000_000 // max(1, rays * most))
        each, weights = max(1, share // max(1, many)), quintic_weights(times[1])
        for row, seen in np.ndindex(-(-n // each), -(-many // share)) if rays else ():
            here, some = slice(row * each, (row + 1) * each), slice(seen * share, (seen + 1) * share)
            observers, chi = self.observers[here, some].copy(), self._chi[here, some].copy()
            behind = np.ascontiguousarray(back[here, some])
            while True:
                found, places = np.empty((cells * chi.size, 4), np.int64), np.empty((cells * chi.size, 2))
                crossed = np.empty((crossings * rays * max(1, int(behind.sum())), 4))
                with evaluators(self.body) as parts:
                    a, b = seek_all(
                        *parts[:2], times[1], weights, states[here], arc[here], closed[here],
                        observers, behind, EARLY * size(self.body), 0.9, cells * chi.shape[1], crossings * rays,
                        found, places, crossed, chi, self._roots[here],
                    )  # fmt: skip
                if a >= 0:
                    break
                cells, crossings = min(8 * cells, most * rays), min(2 * crossings, most)
            self._chi[here, some] = chi
            for rows in (found[:a, 0], crossed[:b, 0]):
                own, observer = np.divmod(rows, chi.shape[1])
                rows[:] = (here.start + own) * many + some.start + observer
            pieces.append((found[:a], places[:a], crossed[:b]))
        self._found, self._places, self._crossed = (np.concatenate(kind) for kind in zip(*pieces, strict=True))
        self._fine = times[:-1, None] + np.diff(times)[:, None] * (np.arange(PARTS) / PARTS)
        if ends is not None:
            of = self.incidence[self._found[:, 0]], self._found, self.directions, self._places
            likely = likely_found(self.body, states, ends, launch.spacing, PARTS, float(times[1]), *of)
            self._found, self._places = self._found[likely], self._places[likely]

    @property
    def mean_root_radius(self) -> FloatArray:
        """Mean of ρ^(1/3) over the launch points (n m,): m̄ = (k/2)^(1/3) times it."""
        return np.asarray(self._roots[self.incidence])

    @property
    def least_merging(self) -> FloatArray:
        """Least χ = |J|/(|J| + ρ|J'|) over crossings of the horizon with p.r > 0.9, of observers behind, else 0."""
        return self._chi.ravel()

    @cached_property
    def _shed(self) -> tuple[ShedRays, BoolArray]:
        row, ray, after, sample = self._found.T
        launch, which = self.launch, self.incidence[row]
        across, along = self._places[:, :1], self._places[:, 1]
        near = (1 - across) * launch.points[which, ray] + across * launch.points[which, after]
        fine = np.append(self._fine.ravel(), self.tracer.length)
        long = fine[sample + 1] - fine[sample]
        begin = fine[sample] + along * long
        cell = np.stack([launch.spacing[which, ray], long], axis=1)
        search = RaySearch(self.tracer, self.direction[row], self.directions[row], near, begin, cell)
        one, found = search.result()
        row, ray, cell, across, which = row[found], ray[found], cell[found], across[found, 0], which[found]
        arc = launch.arc_index
        same = arc[which] == arc[which, ray][:, None]
        if not len(which):
            # of no rays at all there is no first one
            same = np.zeros((0, 1), dtype=bool)
        first, last = np.argmax(same, axis=1), same.shape[1] - 1 - np.argmax(same[:, ::-1], axis=1)
        place = ray + across + search.moved[found]
        inside = (launch.closed[which, ray] == 1) | ((place >= first - 0.5) & (place <= last + 0.5))
        kept = np.flatnonzero(inside)
        starts, found_rays = one.starts[kept], one.rays[kept]
        ends, width = found_rays.time, same_within(found_rays, cell[kept])

        def alike(i: IntArray, j: IntArray) -> BoolArray:
            late = np.abs(ends[i] - ends[j]) < width[i, 1]
            return np.asarray(late & (np.linalg.norm(starts[i] - starts[j], axis=1) < width[i, 0]))

        kept = kept[first_of_equals(row[kept], alike)]
        shed = ShedRays(row[kept], np.zeros_like(kept), place[kept], one.rays[kept], np.full(len(kept), np.inf))
        return shed, one.risen[kept]

    @property
    def shed(self) -> ShedRays:
        """Rays with p = r."""
        return self._shed[0]

    @cached_property
    def long(self) -> BoolArray:
        """Whether a shed ray has crossed the observer's horizon before (s,)."""
        shed, risen = self._shed
        return np.asarray(risen | (np.sum(shed.rays.first_normal * self.directions[shed.observer], axis=1) > 0))

    @cached_property
    def specular(self) -> SpecularPoints:
        """Specular points of the lit side."""
        return specular_points(self.body, self.direction, self.directions, prepared(self.body).coarsest)

    def fold(self, wavenumber: float) -> FloatArray:
        """What specular points miss at a caustic of the reflected field (n m,), L; that of the last k is kept."""
        where = self.body, prepared(self.body).coarsest, self.direction, self.directions
        return memo_of(self, "fold", wavenumber, lambda: fold_error(*where, wavenumber), 1)

    @cached_property
    def typical(self) -> float:
        """Rms of |f| over all directions, L, of a body that scatters twice its mean silhouette: sqrt(A/(8 pi))."""
        return float(np.sqrt(prepared(self.body).coarsest.area / (8 * np.pi)))

    def fan_nodes(self, wavenumber: float, wanted: BoolArray) -> HorizonRays:
        """Nodes of the fan integral for the wanted observers, at most APART/k apart on the shadow line."""
        spacing = np.nan_to_num(self.launch.spacing)
        widest = np.max(spacing, axis=1, initial=0.0)
        # rays stand for themselves unless too far apart; powers of two, so that frequencies share them
        parts = 2 ** np.ceil(np.log2(np.maximum(wavenumber * widest / APART, 1.0)) - 1e-9).astype(np.int64)
        key = parts.tobytes() + wanted.tobytes()
        return memo_of(self, "fan nodes", key, lambda: self._fan_nodes(parts, wanted), 64)

    def _fan_nodes(self, parts: IntArray, wanted: BoolArray) -> HorizonRays:
        row, ray = self._crossed[:, :2].astype(np.int64).T
        mine = np.flatnonzero(wanted[row] & (self._crossed[:, 3] > TAPERED))
        row, ray, time = row[mine], ray[mine], self._crossed[mine, 2]
        share = parts[self.incidence[row]]
        # node j of a crossing starts at fraction (j + 1/2)/parts of the piece of line that the ray stands for
        row, ray, time, total = (np.repeat(v, share) for v in (row, ray, time, share))
        number = np.arange(len(row)) - np.repeat(np.cumsum(share) - share, share)
        which = self.incidence[row]
        several, width = int(parts.max(initial=1)), self.launch.spacing.shape[1]
        code = (which * width + ray) * several + number
        codes, owner = np.unique(code, return_inverse=True)
        one, part = np.divmod(codes, several)
        at, start = np.divmod(one, width)
        directions, spacing = self.launch.directions[at], self.launch.spacing[at, start]
        starts, tangents = self.tracer.onto_line(self.launch.points[at, start], directions, 1)
        offset = (part + 0.5) / parts[at] - 0.5
        starts = starts + (offset * spacing)[:, None] * tangents
        weight = self.launch.spacing[which, ray] / total
        rays = self.tracer.crossing(directions, starts, owner, self.directions[row], time).rays
        ahead = np.sum(rays.directions * self.directions[row], axis=1) > 0
        return HorizonRays(row[ahead], rays[ahead], (weight * rays.width)[ahead])

    def forward_nodes(self, wavenumber: float, wanted: BoolArray) -> tuple[HorizonRays, MidHorizon, IntArray]:
        """Nodes of both halves of the forward integral for the wanted observers, and observers that lack some."""
        fineness = int(np.ceil(4 * np.log2(max(wavenumber * size(self.body), 16.0))))
        key = (fineness, wanted.tobytes())
        if key not in self._lobes:
            parts = []
            for incidence in np.unique(self.incidence[wanted]):
                rows = np.flatnonzero(wanted & (self.incidence == incidence))
                line, strips = self._forward(int(incidence))
                # at r = d every ray meets the horizon where it starts, at r = -d the bisector contour is no curve;
                # the lobe is flat at both to second order
                r = off_axis(off_axis(self.directions, line.direction), -line.direction)
                reach = 2 ** (fineness / 4) * 2 * np.sin(self.angle[rows] / 2)
                wanted_nodes = 48 + 1.5 * reach
                within_budget(
                    600.0 * float(np.sum(wanted_nodes)),
                    f"{np.sum(wanted_nodes):.2g} nodes of the forward integral",
                    "lower the wavenumber, or ask for fewer directions near d",
                )
                counts = wanted_nodes.astype(np.int64)
                parts.append(forward_nodes(strips, line, rows, r, counts))
            shadow, lit, missing = zip(*parts, strict=True)
            self._lobes[key] = HorizonRays.joined(shadow), MidHorizon.joined(lit), np.concatenate(missing)
        return self._lobes[key]

    def line_of(self, incidence: int) -> ShadowLine:
        """The shadow line of an incidence, for its forward lobe."""
        return self._forward(incidence)[0]

    @cached_property
    def shed_normals(self) -> FloatArray:
        """Normals where shed rays leave (s, 3)."""
        return self.normals_of(self.shed.rays.points)

    @cached_property
    def leaves(self) -> BoolArray:
        """Whether a shed ray misses the body on its way out (s,)."""
        return free_ways(self.body, self.shed.rays)

    def normals_of(self, points: FloatArray) -> FloatArray:
        """Normals (s, 3) at points (s, 3), L."""
        return normal(self.body, points)


def coarse_times(flow: Flow, length: float) -> FloatArray:
    """Times of the fan, from 0: steps that the flow takes at once, about those that resolve the body."""
    natural = natural_horizon(flow.body)
    count = max(1, int(np.ceil(length / natural - 1e-9)))
    if flow.error is not None and flow.horizon < length:
        leaps = max(1, round(natural / flow.horizon))
        if abs(length / flow.horizon - round(length / flow.horizon)) < 1e-9:
            whole = round(length / flow.horizon)
            while whole % leaps:
                leaps -= 1
            count = whole // leaps
    return np.asarray(np.linspace(0.0, length, count + 1))


def fold_error(
    body: Surface, mesh: Triangulation, direction: FloatArray, observers: FloatArray, wavenumber: float
) -> FloatArray:
    """Error of isolated specular points for the caustic's sake (m,), L, in unit directions r (m, 3) for d (m, 3).

    Examples
    --------
    >>> import scatterers as sc
    >>> from creeping.geometry.triangulation import triangulate
    >>> body, d = sc.Sphere(), np.array([[0.0, 0.0, 1.0]])
    >>> mesh = triangulate(body)
    >>> fold_error(body, mesh, d, -d, 30.0).tolist()                                 # a sphere has none
    [0.0]
    """
    found = parabolic_points(body, mesh)
    out = np.zeros(len(observers))
    difference = observers - direction
    length = np.linalg.norm(difference, axis=1)
    rows = np.flatnonzero(length > 1e-9)
    if not len(found.points) or not len(rows):
        return out
    wanted, c = difference[rows] / length[rows, None], 0.5 * length[rows]
    tree = memo(body, "normals of parabolic points", lambda: cKDTree(found.normals))
    near = tree.query(wanted, k=min(12, len(found.points)))[1].reshape(len(rows), -1)
    amplitude = _amplitude(found, near, wanted, c[:, None], wavenumber, size(body))
    # the wave must come to the ground, and leave it
    worth = np.nonzero(amplitude > 1e-6 * size(body))
    x = found.points[near[worth]]
    hidden = occluded(body, x, direction[rows[worth[0]]]) | occluded(body, x, -observers[rows[worth[0]]])
    amplitude[worth[0][hidden], worth[1][hidden]] = 0.0
    out[rows] = np.max(amplitude, axis=1)
    return out


def _amplitude(
    found: ParabolicPoints, near: FloatArray, wanted: FloatArray, c: FloatArray, k: float, extent: float
) -> FloatArray:
    """|f| of the error (m, neighbours), L."""
    # where the curvature does not change the fold is as wide as the body
    a = np.minimum(np.cbrt(1 / (k * c * np.maximum(found.bend[near], 1e-300))), extent)
    X = 2 * k * c * a * np.einsum("mnc,mnc->mn", wanted[:, None] - found.normals[near], found.axes[near])
    with np.errstate(divide="ignore"):
        # as far as the largest value of Ai
        bright = np.minimum(0.5357, 0.15 * np.maximum(X, 0.0) ** -1.75)
    wave = np.where(X < 0, airy(np.maximum(-X, 0.0))[0], bright)
    flattest = 1 / extent
    spread = np.sqrt(np.pi / (k * c * np.maximum(np.abs(found.across[near]), flattest)))
    facing = np.sum(found.normals[near] * wanted[:, None], axis=2) > 0.5
    return np.where(facing, k * c * spread * a * wave, 0.0)
