"""What follows while the incidence moves, and what follows when it rests.

While it moves: rays coloured by their field, iso-phase curves, the outline n.d = 0, handed over as line segments
(m, 2, 3) in single precision, without NaN, as a graphics card takes them. When it rests: the line to rounding, a fan
with its error, the field on the body and afar; each step asks before it starts whether the request still stands, so
that a newer one does not wait for long.

The wave along rays: between two steps the eikonal is linear, as it is along any ray, and the rest of the wave, which is
slow to vary, is taken as linear; the quarter of a turn of a caustic is spread over the step that passes it.

Sources: Derivations, F3.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.explorer.request import ViewRequest
from creeping.field.body_currents import cached_currents, has_expansions
from creeping.field.far import far_field
from creeping.field.on_rays import ray_envelope
from creeping.field.results.comparison import decibels
from creeping.field.results.far_result import FarField
from creeping.field.routes import affordable
from creeping.field.tmatrix.computing import expected, kept_t_matrix, known_t_matrix
from creeping.field.validity_range import Validity, validity
from creeping.geodesics.equations import natural_horizon
from creeping.geometry.directions import directions_from_angles
from creeping.geometry.evaluators import speed_of
from creeping.geometry.surface import Surface
from creeping.geometry.triangulation import Triangulation
from creeping.plotting.coloured_body import LEAST_SAMPLES, current_levels, levels_of, surface_values
from creeping.rays.fan import RayFan, end_error, launch
from creeping.rays.isophase import IsoPhaseCurve, iso_phase_curves
from creeping.rays.transport import Flow
from creeping.shadow.line import ShadowLine, shadow_line
from creeping.storage.memory import budget

NOTHING: FloatArray = np.zeros((0, 2, 3), dtype=np.float32)
"""No segments, in the precision of the page."""


@dataclass(frozen=True, eq=False)
class RayWave:
    """The field along rays, fine enough to show its phase.

    Attributes
    ----------
    segments : (rays (points - 1), 2, 3) of float32
    values : (rays, points) complex
        Of modulus 1: e^{i arg u}.
    levels : (rays, points), dB
        -inf where a ray has ended.
    """

    segments: FloatArray
    values: ComplexArray
    levels: FloatArray


def ray_wave(fan: RayFan, envelope: ComplexArray, levels: FloatArray, wavenumber: float) -> RayWave | None:
    """The wave of rays from its envelope and levels at their steps (rays, steps); None if too short to be drawn."""
    rays, steps = levels.shape
    if not rays:
        return None
    waves = wavenumber * float(fan.travel_time[1] - fan.travel_time[0]) / (2 * np.pi)
    # six points a wavelength, unless rays have too many segments
    parts = max(1, min(int(np.ceil(6.0 * waves)), 60_000 // (rays * (steps - 1))))
    if parts < LEAST_SAMPLES * waves:
        return None
    slow = np.unwrap(np.angle(np.where(np.isfinite(envelope), envelope, 1.0)), axis=1)
    ended = _between(np.isneginf(levels).astype(float), parts) > 0
    fine = _between(np.clip(levels, -1e3, 1e3), parts)
    return RayWave(
        segments(_between(fan.points, parts)),
        np.exp(1j * _between(wavenumber * fan.eikonal + slow, parts)),
        np.where(ended, -np.inf, fine),
    )


def segments(points: FloatArray, *, closed: bool = False) -> FloatArray:
    """Segments of lines (n, m, 3): (k, 2, 3) of float32."""
    if closed:
        points = np.concatenate([points, points[:, :1]], axis=1)
    pairs = np.stack([points[:, :-1], points[:, 1:]], axis=2)
    return np.ascontiguousarray(pairs.reshape(-1, 2, 3), dtype=np.float32)


def _between(values: FloatArray, parts: int) -> FloatArray:
    """Values (rays, steps, ...) with each step cut into equal parts, linear: (rays, (steps - 1) parts + 1, ...)."""
    share = (np.arange(parts) / parts).reshape(-1, *[1] * (values.ndim - 2))
    first, last = values[:, :-1, None], values[:, 1:, None]
    cut = (first + share * (last - first)).reshape(len(values), -1, *values.shape[2:])
    return np.concatenate([cut, values[:, -1:]], axis=1)


@dataclass(frozen=True, eq=False)
class Preview:
    """The fan of a request and what is drawn of it at once.

    Attributes
    ----------
    request : ViewRequest
    fan : RayFan
        Its error is not measured.
    """

    request: ViewRequest
    fan: RayFan

    @cached_property
    def levels(self) -> FloatArray | None:
        """20 log10 of |u|, |du/dn|/k of a soft body or |n x H| of a conductor along the rays (rays, steps).

        -inf where a ray has ended, inf on caustics; None on a weighted body.
        """
        return None if self.envelope is None else decibels(np.abs(self.envelope))

    @cached_property
    def envelope(self) -> ComplexArray | None:
        """The field along the rays without e^{ik eikonal} (rays, steps); None on a weighted body."""
        if speed_of(self.fan.body) is not None:
            return None
        return ray_envelope(self.fan, wavenumber=self.request.wavenumber, boundary=self.request.on_rays)

    @cached_property
    def wave(self) -> RayWave | None:
        """The field along the rays, where it is one number a point and can be told from step to step."""
        if self.envelope is None or self.levels is None or self.request.boundary == "pec":
            return None
        return ray_wave(self.fan, self.envelope, self.levels, self.request.wavenumber)

    @cached_property
    def ray_segments(self) -> FloatArray:
        """Segments of all rays (rays (steps - 1), 2, 3)."""
        return segments(self.fan.points)

    @cached_property
    def curves(self) -> list[IsoPhaseCurve]:
        """Iso-phase curves."""
        return requested_curves(self.request, self.fan)

    @cached_property
    def level_segments(self) -> tuple[FloatArray, FloatArray]:
        """Segments of the iso-phase curves (m, 2, 3), and the level of each (m,)."""
        pieces = [segments(c.points[None], closed=c.closed) for c in self.curves]
        levels = np.array([c.level for c in self.curves])
        return joined(pieces), np.repeat(levels, [len(piece) for piece in pieces])

    @cached_property
    def launch_arcs(self) -> list[FloatArray]:
        """The attached part of the shadow line through the launch points, closed where it is: each (n, 3)."""
        start, fan = self.fan.points[:, 0], self.fan
        arcs = [start[fan.arc_index == k] for k in range(len(fan.closed_arcs))]
        return [np.concatenate([a, a[: int(c)]]) for a, c in zip(arcs, fan.closed_arcs, strict=True)]

    @cached_property
    def launch_segments(self) -> FloatArray:
        """The same as segments (m, 2, 3)."""
        return joined([segments(arc[None]) for arc in self.launch_arcs])

    @cached_property
    def validity(self) -> Validity | None:
        """How far the wave is from the limit of short waves; None on a weighted body."""
        return None if self.levels is None else validity(self.fan, wavenumber=self.request.wavenumber)


def preview_of(flow: Flow, request: ViewRequest, step: float) -> Preview:
    """The fan of a request, its length rounded to whole steps.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : ViewRequest
    step : float, L
        Travel time between the points of a ray: one that the flow takes at once.

    Raises
    ------
    SingularIncidenceError
        If the shadow line crosses itself.
    """
    count, step = steps_of(request.length, step)
    line = shadow_line(flow.body, request.direction, n_points=16)
    fan = launch(flow, line, length=count * step, n_rays=request.rays, n_steps=count, max_gap=np.inf, measured=False)
    return Preview(request, fan)


def steps_of(length: float, step: float) -> tuple[int, float]:
    """Number and length of the steps of rays: so many steps as the flow takes at once that 192 suffice for a ray."""
    step *= max(1, int(np.ceil(length / (192 * step) - 1e-9)))
    return max(2, round(length / step)), step


def step_of(body: Surface) -> float:
    """Travel time between the points of a ray on the page: a quarter of the natural horizon."""
    return natural_horizon(body) / 4


def requested_curves(request: ViewRequest, fan: RayFan) -> list[IsoPhaseCurve]:
    """Iso-phase curves of a fan at the levels that its rays reach."""
    return iso_phase_curves(fan, request.levels[request.levels <= fan.length])


def joined(pieces: list[FloatArray]) -> FloatArray:
    """All segments of several lines (m, 2, 3)."""
    return np.concatenate([NOTHING, *pieces])


def outline(mesh: Triangulation, normals: FloatArray, direction: FloatArray) -> FloatArray:
    """Where n.d = 0 on the mesh, n linear on each triangle: (m, 2, 3), to the square of an edge."""
    height = normals @ direction
    lit = height < 0
    bright = np.sum(lit[mesh.triangles], axis=1)
    corners: IntArray = mesh.triangles[(bright > 0) & (bright < 3)]
    ends = []
    for one, other in ((0, 1), (1, 2), (2, 0)):
        a, b = corners[:, one], corners[:, other]
        crossed = lit[a] != lit[b]
        share = np.where(crossed, height[a] / np.where(crossed, height[a] - height[b], 1.0), np.nan)[:, None]
        ends.append((1 - share) * mesh.vertices[a] + share * mesh.vertices[b])
    # two of the three edges are crossed
    three = np.stack(ends, axis=1)
    order = np.argsort(np.isnan(three[..., 0]), axis=1, kind="stable")[:, :2]
    return np.take_along_axis(three, order[..., None], axis=1).astype(np.float32)


CUT_STEP = 2.0
"""Of the far-field cut, degrees."""
PATIENCE = 20.0
"""Seconds at most of a T-matrix that is made while the hand rests."""
IsStale = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class Refined:
    """Everything that takes seconds.

    Attributes
    ----------
    request : ViewRequest
    drawn : RayFan
        The fan on the page, its error now measured.
    line : ShadowLine
    fan : RayFan
        With rays inserted where neighbours part: that of the fields.
    body_levels : (n,) or None
        20 log10 of the total field on the vertices of the mesh, of a conductor of |n x H|, the root mean square of both
        polarisations; NaN where no ray passes, None on a weighted body, one with edges, and where it costs too much.
    cut_angles : (m,), degrees
        Theta of the cut, from -180 to 180 through the directions of azimuth ``request.cut`` and its opposite.
    far : FarField or None
    body_wave : (n,) complex or None
        The field that ``body_levels`` are of, u, or du/dn/k of the soft boundary; None of a conductor as well.
    """

    request: ViewRequest
    drawn: RayFan
    line: ShadowLine
    fan: RayFan
    body_levels: FloatArray | None
    cut_angles: FloatArray
    far: FarField | None
    body_wave: ComplexArray | None = None


def refined_view(flow: Flow, frame: Preview, vertices: FloatArray, stale: IsStale = lambda: False) -> Refined | None:
    """Follow up a preview; None as soon as ``stale()`` says that nobody waits for it any more.

    Raises
    ------
    SingularIncidenceError
        If the shadow line crosses itself.
    """
    request, body = frame.request, flow.body
    line, drawn = shadow_line(body, request.direction), replace(frame.fan, error=end_error(frame.fan))
    if stale():
        return None
    steps = len(frame.fan.travel_time) - 1
    fan = launch(flow, line, length=frame.fan.length, n_rays=request.rays, n_steps=steps)
    if stale():
        return None
    angles = np.arange(-180.0, 181.0, CUT_STEP)
    if speed_of(body) is not None:
        return Refined(request, drawn, line, fan, None, angles, None)
    levels, wave = _on_body(fan, request, vertices, stale)
    if stale():
        return None
    far, exact = far_cut(fan, request, angles), matrix_cut(body, request, angles)
    # creeping and reflected parts are those of rays
    far = far if exact is None else replace(exact, parts=far.parts)
    return Refined(request, drawn, line, fan, levels, angles, far, wave)


def far_cut(fan: RayFan, request: ViewRequest, angles: FloatArray, method: str = "auto") -> FarField:
    """Far field of the cut at theta (m,), degrees."""
    directions = cut_directions(angles, request.cut)
    return far_field(fan, directions, wavenumber=request.wavenumber, boundary=request.kind, method=method)


def matrix_cut(body: Surface, request: ViewRequest, angles: FloatArray) -> FarField | None:
    """The same by the T-matrix, of any incidence in milliseconds; None where none was made of this wave."""
    T = known_t_matrix(body, request.wavenumber, request.kind)
    return None if T is None else T.far_field(request.direction, cut_directions(angles, request.cut))


def made_matrix(body: Surface, request: ViewRequest) -> bool:
    """Make the T-matrix of a wave that has none, if it takes no more than `PATIENCE`; whether it was made."""
    if speed_of(body) is not None or known_t_matrix(body, request.wavenumber, request.kind) is not None:
        return False
    plan = expected(body, request.wavenumber, request.kind)
    if plan.seconds > PATIENCE or plan.memory > budget():
        return False
    kept_t_matrix(body, request.wavenumber, request.kind)
    return True


def _on_body(
    fan: RayFan, request: ViewRequest, vertices: FloatArray, stale: IsStale
) -> tuple[FloatArray | None, ComplexArray | None]:
    """Levels of the total field at points of the body (n, 3), and its values, which a conductor does not have here.

    Nothing where currents cost too much, or the equation of a body that has no others.
    """
    k = request.wavenumber
    alone = not has_expansions(fan.body, request.kind)
    if request.boundary == "pec" or alone:
        # the far-field cut takes the same currents
        if not alone and not affordable(fan, 2 * round(360 / CUT_STEP), k, distant=True):
            return None, None
        try:
            currents = cached_currents(fan, k, request.kind)
        except InvalidInputError:
            return None, None
        if request.boundary == "pec":
            return current_levels(currents, vertices), None
    values, block = np.empty(len(vertices), dtype=complex), 512
    for first in range(0, len(vertices), block):
        # a newer request waits for no more points
        part = slice(first, first + block)
        values[part] = surface_values(fan, vertices[part], wavenumber=k, boundary=request.kind)
        if stale():
            return None, None
    return levels_of(values), values


def cut_directions(angles: FloatArray, azimuth: float) -> FloatArray:
    """Directions of a cut: theta (m,) in degrees, negative on the opposite half plane: (m, 3)."""
    return directions_from_angles(np.radians(angles), np.radians(azimuth))
