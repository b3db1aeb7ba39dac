"""What a 3-D picture is made of: polylines on the body with their colours, the same for every drawing library.

Rays are drawn until their waves have fallen by 30 dB, exp{-ξ Im τ} = 10^(-30/20) with ξ and τ as of
`creeping.rays.reach`, or until J has its second zero: they have crossed their neighbours twice. What comes later is
weak, and covers the picture.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike, fock_scale, scalar_boundaries, slowest_decay
from creeping.geometry.checks import UNKNOWN
from creeping.geometry.evaluators import speed_of
from creeping.geometry.surface import size
from creeping.plotting.pages import add_bar
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.rays.reach import IN_RANGE
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import STATUSES

BODY_COLOUR = "#dfe5ea"
RAY_COLOUR = "#55606b"
ARROW_COLOUR = "#1b1b1b"
FADED, FADED_WIDTH = 0.4, 0.5
"""Opacity and width, points, of iso-phase curves where rays have detached."""
HIDDEN = 0.22  # share of its ink that a line behind the body keeps
# apart in lightness as well as in hue, and apart from the map of the iso-phase levels
STATUS_COLOURS = {"attached": "#111111", "occluded": "#e8890c", "concave": "#d6409f"}
FADES = (10.0, 20.0, 30.0)
"""Decibels by which the wave of a ray has fallen where it is drawn paler and at last no more."""
LEVEL_NAMES = {"travel_time": "travel time", "eikonal": "eikonal"}


class RayOptions(TypedDict, total=False):
    """Options of all pictures of rays; see `picture`."""

    rays: int
    until: float | None
    wavenumber: float | None
    boundary: BoundaryLike


@dataclass(frozen=True)
class RayLook:
    """What `RayOptions` are by default."""

    rays: int = 48
    until: float | None = None
    wavenumber: float | None = None
    boundary: BoundaryLike = "hard"


@dataclass(frozen=True)
class Stroke:
    """Polylines drawn alike.

    Attributes
    ----------
    lines : list of (k, 3), L
    colour : str
        Hexadecimal.
    width : float
        Points of 1/72 inch.
    alpha : float
        Opacity where the line is visible.
    label : str
        Entry of the legend, empty for none.
    rank : int
        Strokes of higher rank are drawn over those of lower.
    through : bool
        Whether it shows faintly where the body hides it.
    """

    lines: list[FloatArray] = field(repr=False)
    colour: str
    width: float
    alpha: float = 1.0
    label: str = ""
    rank: int = 0
    through: bool = True


def strokes(
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    rays: int = 0,
    ends: FloatArray | None = None,
) -> list[Stroke]:
    """Everything to be drawn on the body, lowest rank first.

    Parameters
    ----------
    line, fan, curves
        Shadow line, fan of rays or None, iso-phase curves.
    rays : int
        Rays drawn at most, evenly chosen; all of them would cover the body.
    ends : (3, rays)
        Travel times at which the rays of the fan get paler, twice, and end, with the iso-phase curves.
    """
    found: list[Stroke] = []
    if fan is not None and ends is not None:
        found += ray_strokes(fan, rays, ends)
    colours = LevelColours.of(curves)
    for curve in curves:
        bound, free = curve_pieces(curve, fan, curve.points, ends)
        colour, label = colours(curve.level), colours.label(curve is curves[0])
        found += [Stroke(bound, colour, 0.9, label=label, rank=1)] if bound else []
        found += [Stroke(free, colour, FADED_WIDTH, alpha=FADED, rank=1)] if free else []
    for status in STATUSES:
        pieces = line_pieces(line, status)
        if pieces:
            found.append(Stroke(pieces, STATUS_COLOURS[status], 1.8, label=f"shadow line, {status}", rank=2))
    return found


def drawn_ends(
    fan: RayFan | None, until: float | None, wavenumber: float | None = None, boundary: BoundaryLike = "hard"
) -> FloatArray:
    """Travel times (3, rays) at which rays get paler and end; for the arguments see `picture`."""
    if fan is None:
        return np.zeros((len(FADES), 0))
    if until is not None:
        return np.full((len(FADES), len(fan.points)), float(until))
    # a ray ends where J has its second zero
    crossed = np.asarray(fan.caustic_index) >= 2
    times = np.asarray(fan.travel_time)
    ends = np.where(crossed.any(axis=1), times[np.argmax(crossed, axis=1)], np.inf)
    if speed_of(fan.body) is not None or not len(ends):
        return np.tile(ends, (len(FADES), 1))
    # as of reach: the typical ray stands for all
    typical = max(float(np.median(np.nan_to_num(fan.curvature[:, 0]))), 0.0) or 1 / size(fan.body)
    k = IN_RANGE * typical if wavenumber is None else wavenumber
    scale = fock_scale(k, np.array([typical]))
    decay = min(slowest_decay(kind, scale, fan.points[:, 0]) for kind in scalar_boundaries(boundary))
    wanted = np.array(FADES) * np.log(10) / 20 / (np.cbrt(k / 2) * decay)
    faded = np.stack([np.interp(wanted, ray, times, right=np.inf) for ray in np.nan_to_num(fan.attenuation)], axis=1)
    # of one that detaches before nothing is left on the body; what follows is as long as the longest other
    longest = np.max(faded[-1], where=np.isfinite(faded[-1]), initial=0.0) or np.inf
    return np.asarray(np.minimum(np.minimum(faded, longest), ends))


def drawn_curves(curves: Sequence[IsoPhaseCurve], fan: RayFan | None, ends: FloatArray) -> list[IsoPhaseCurve]:
    """Curves of which something is drawn."""
    return [curve for curve in curves if any(curve_pieces(curve, fan, curve.points, ends))]


def curve_pieces(
    curve: IsoPhaseCurve, fan: RayFan | None, points: FloatArray, ends: FloatArray | None = None
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Pieces of an iso-phase curve where its rays creep, and where they have detached: (k, d) each.

    ``points`` (m, d) are its points, or their parameters, ``ends`` as of `strokes`, none by default. Without the
    curve's fan nothing counts as detached, and all is drawn.
    """
    points = np.asarray(points)
    detached, drawn = np.zeros(len(points), dtype=bool), np.ones(len(points), dtype=bool)
    rays = getattr(curve, "rays", np.zeros(0, dtype=int))
    if fan is not None and len(rays) == len(points) and np.max(rays, initial=-1) < len(fan.points):
        start = fan.eikonal[:, 0] - fan.travel_time[0] if curve.of == "eikonal" else np.zeros(len(fan.points))
        times = curve.level - start[rays]
        detached = times > fan.detachment[rays]
        if ends is not None:
            drawn = times <= ends[-1, rays]
    if curve.closed:
        points, detached, drawn = closed(points), np.append(detached, detached[:1]), np.append(drawn, drawn[:1])
    # one point more at either end, so that the parts join
    free = detached.copy()
    free[1:] |= detached[:-1]
    free[:-1] |= detached[1:]
    return list(runs(points, ~detached & drawn)), list(runs(points, free & drawn)) if detached.any() else []


def chosen_rays(fan: RayFan, rays: int) -> list[int]:
    """Numbers of at most ``rays`` rays, evenly spread along the shadow line.

    Not evenly by number: a fan has more rays where they part fast.
    """
    if rays < 1:
        raise InvalidInputError(f"rays = {rays}: draw at least one ray")
    total = len(fan.points)
    if total <= rays:
        return list(range(total))
    gap = np.linalg.norm(np.diff(np.asarray(fan.points[:, 0]), axis=0), axis=-1)
    # from one curve to the next there is no shadow line
    gap[np.diff(fan.curve_index) != 0] = 0.0
    along = np.concatenate([[0.0], np.cumsum(np.nan_to_num(gap))])
    wanted = along[-1] * np.arange(rays) / rays
    after = np.searchsorted(along, wanted).clip(1, total - 1)
    nearer_before = wanted - along[after - 1] < along[after] - wanted
    return sorted({int(k) for k in after - nearer_before})


def ray_strokes(fan: RayFan, rays: int, ends: FloatArray, *, spacing: float = 0.015) -> list[Stroke]:
    """Chosen rays up to detachment, and faint beyond it, where they are geodesics but no creeping rays.

    ``ends`` as of `strokes`; ``spacing`` of the points is relative to the size of the body.
    """
    free: list[FloatArray] = []
    bound: tuple[list[FloatArray], ...] = tuple([] for _ in FADES)
    times = np.asarray(fan.travel_time)
    for k in chosen_rays(fan, rays):
        points, detachment = np.asarray(fan.points[k]), float(fan.detachment[k])
        fine, fine_times = refined(points, np.asarray(fan.directions[k]), times, spacing * size(fan.body))
        ok = np.all(np.isfinite(fine), axis=-1)
        # one point more, so that parts join
        more = np.max(np.diff(fine_times), initial=0.0)
        last = ends[-1, k]
        free += list(runs(fine, ok & (fine_times <= last) & (fine_times >= detachment - more)))
        begin = -np.inf
        for part, end in zip(bound, np.minimum(ends[:, k], detachment), strict=True):
            part += runs(fine, ok & (fine_times >= begin - more) & (fine_times <= end))
            begin = end
    found = [Stroke(free, RAY_COLOUR, 0.5, alpha=0.5, label="ray after detachment")] if free else []
    # the strongest part stands in the legend
    for part, alpha in reversed([pair for pair in zip(bound, (1.0, 0.6, 0.35), strict=True) if pair[0]]):
        found.append(Stroke(part, RAY_COLOUR, 0.6, alpha=alpha, label="creeping ray" if alpha == 1 else ""))
    return found


def refined(
    points: FloatArray, tangents: FloatArray, times: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Cubic Hermite points between those of one ray, so that a coarse ray is drawn round: (steps, 3) -> (k, 3)."""
    chord = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    longest = np.max(chord[np.isfinite(chord)], initial=0.0)
    parts = int(np.clip(np.ceil(longest / spacing), 1, 16))
    if parts == 1:
        return points, times
    s = (np.arange(parts) / parts)[:, None]
    p0, p1 = points[:-1, None], points[1:, None]
    # the unit tangent times the chord stands for dx/ds whatever the speed along the ray
    m0, m1 = chord[:, None, None] * tangents[:-1, None], chord[:, None, None] * tangents[1:, None]
    # the Hermite basis in Horner form
    fine = p0 + s * (m0 + s * (3 * (p1 - p0) - 2 * m0 - m1 + s * (2 * (p0 - p1) + m0 + m1)))
    fine_times = times[:-1, None] + s[:, 0] * np.diff(times)[:, None]
    return np.concatenate([fine.reshape(-1, 3), points[-1:]]), np.append(fine_times.ravel(), times[-1])


def runs(points: FloatArray, mask: BoolArray) -> Iterator[FloatArray]:
    """Polylines of the consecutive points where ``mask`` holds, two points at least."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if stop - start > 1:
            yield points[start:stop]


def closed(points: FloatArray) -> FloatArray:
    """Repeat the first point at the end."""
    return np.concatenate([points, points[:1]])


def line_pieces(line: ShadowLine, wanted: str) -> list[FloatArray]:
    """Pieces (k, 3) of all curves of a shadow line with one status."""
    parts = [status_pieces(curve.points, curve.status, wanted, ring=curve.closed) for curve in line.curves]
    return [piece for part in parts for piece in part]


def status_pieces(points: FloatArray, status: Any, wanted: str, *, ring: bool = True) -> Iterator[FloatArray]:
    """Pieces of a curve, closed if a ``ring``, with one status; each runs on to the next point: no gap is left."""
    mask = np.asarray(status) == wanted
    if mask.all():
        yield closed(points) if ring else points
        return
    if not ring:
        mask[1:] |= mask[:-1].copy()
        yield from runs(points, mask)
        return
    # start where the status changes, so that no piece is cut at the curve's first point
    start = int(np.argmax(mask & ~np.roll(mask, 1)))
    mask, points = np.roll(mask, -start), np.roll(points, -start, axis=0)
    mask, points = np.append(mask, False), closed(points)
    mask[1:] |= mask[:-1].copy()
    yield from runs(points, mask)


@dataclass(frozen=True)
class LevelColours:
    """Colours of the iso-phase levels.

    Attributes
    ----------
    low, high : float
        Range of the levels.
    name : str
        What they are levels of.
    unit : str
        Of the levels, which are lengths: "m" where the body knows it, else "L".
    """

    low: float
    high: float
    name: str
    unit: str = UNKNOWN

    @classmethod
    def of(cls, curves: Sequence[IsoPhaseCurve]) -> "LevelColours":
        """Colours for these curves."""
        levels = [float(curve.level) for curve in curves] or [0.0]
        names = {curve.of for curve in curves}
        if len(names) > 1:
            raise InvalidInputError(f"the curves mix levels of {' and '.join(sorted(names))}; draw them apart")
        units = {curve.unit for curve in curves}
        unit = units.pop() if len(units) == 1 else UNKNOWN
        return cls(min(levels), max(levels), LEVEL_NAMES.get("".join(names), "".join(names)), unit)

    def label(self, first: bool) -> str:
        """What the legend calls a curve: levels are read off the colour bar, a single one, which has none, is told."""
        unit = f" {self.unit}" * (self.unit != UNKNOWN)
        return f"{self.name} = {self.low:g}{unit}" if first and self.high <= self.low else ""

    @property
    def mappable(self) -> Any:
        """A matplotlib ``ScalarMappable`` for a colour bar; the palest tenth of the map is left out."""
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import ListedColormap, Normalize

        high = self.high if self.high > self.low else self.low + 1.0
        part = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.9, 256)))
        return ScalarMappable(Normalize(self.low, high), part)

    def __call__(self, level: float) -> str:
        """Hexadecimal colour of a level."""
        from matplotlib.colors import to_hex

        return str(to_hex(self.mappable.to_rgba(level)))

    def add_bar(self, figure: Any, **place: Any) -> None:
        """Colour bar, where there are two levels at least; ``place`` as for ``Figure.colorbar``."""
        if self.high > self.low:
            unit = f" ({self.unit})" * (self.unit != UNKNOWN)
            add_bar(figure, self.mappable, f"iso-phase curves: {self.name}{unit}", fontsize=8, **place)
