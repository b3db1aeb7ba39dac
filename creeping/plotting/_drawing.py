"""One 3-D picture before any library draws it: camera, body, polylines, and the arrows beside the body.

A point source within two body sizes is the foot of its arrow, which points to the body; of one farther away the arrow
stands beside the body, as that of a plane wave does.

Also here: the camera of the 3-D pictures: parallel projection, from the shadow side, and what it can see.

toward = (cos e cos a, cos e sin a, sin e) points from the body to the camera (azimuth a, elevation e), and
(right, up, toward) is a right-handed frame, up the picture of z.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Unpack

import numpy as np

from creeping._presenting import brief
from creeping._typing import Any, ArrayLike, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import boundary_name
from creeping.geometry.checks import unit_of
from creeping.geometry.directions import unit_direction
from creeping.geometry.evaluators import speed_of
from creeping.geometry.incident import Incident, PointSource, incident_words
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, normal, size
from creeping.geometry.triangulation import Triangulation
from creeping.plotting._strokes import LevelColours, RayLook, RayOptions, Stroke, drawn_curves, drawn_ends, strokes
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine

INCIDENT = ("d", "S")
"""Names of the arrow of the wave."""


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes
    ----------
    azimuth, elevation : float
        Where the camera stands, radians; |elevation| < pi/2.
    """

    azimuth: float
    elevation: float

    @cached_property
    def toward(self) -> FloatArray:
        """Unit vector (3,) from the body to the camera."""
        a, e = self.azimuth, self.elevation
        return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])

    @cached_property
    def right(self) -> FloatArray:
        """Unit vector (3,) to the right of the picture."""
        return np.array([-np.sin(self.azimuth), np.cos(self.azimuth), 0.0])

    @cached_property
    def up(self) -> FloatArray:
        """Unit vector (3,) to the top of the picture."""
        return np.cross(self.toward, self.right)

    def project(self, points: FloatArray) -> FloatArray:
        """Coordinates (right, up) of points: (..., 3) -> (..., 2), L."""
        return np.asarray(points @ np.stack([self.right, self.up], axis=-1))

    def frame(self, points: FloatArray, *, margin: float = 0.04) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) of the picture of points (n, 3), with a margin, L."""
        flat = self.project(points)
        low, high = flat.min(axis=0), flat.max(axis=0)
        pad = margin * float(np.max(high - low))
        return low - pad, high + pad

    def visible(self, body: Surface, points: FloatArray) -> BoolArray:
        """Whether nothing of the body stands between points of it and the camera: (..., 3) -> (...)."""
        seen = np.zeros(points.shape[:-1], dtype=bool)
        finite = np.all(np.isfinite(points), axis=-1)
        seen[finite] = normal(body, points[finite]) @ self.toward > 0
        front = points[seen]
        # the first step clears the sag of curves drawn as polylines
        reach = size(body) * np.linspace(0.01, 2.0, 100)
        box = np.asarray(body.bounds)
        clear = np.ones(len(front), dtype=bool)
        for distance in reach:
            at = front + distance * self.toward
            inside = clear & np.all((at >= box[0]) & (at <= box[1]), axis=-1)
            if inside.any():
                clear[inside] = ~(body.level(at[inside]) < 0)
        seen[seen] = clear
        return seen


def shadow_view(direction: ArrayLike, turned: float = np.radians(35.0)) -> View:
    """View of the shadow side: along the direction of the wave, turned and raised so that the shadow line shows."""
    d = unit_direction(direction)
    # straight up or down every azimuth is as good; this one is the custom of 3-D plots
    azimuth = np.radians(-60.0) if np.hypot(d[0], d[1]) < 1e-6 else np.arctan2(d[1], d[0]) + turned
    # pulled to the horizon, so that z stays up: -42 to 66 degrees
    elevation = 0.6 * np.arcsin(np.clip(d[2], -1, 1)) + np.radians(12.0)
    return View(float(azimuth), float(elevation))


@dataclass(frozen=True)
class Mark:
    """An arrow beside the body: the incidence "d", a point source "S", or an axis "x", "y", "z".

    Attributes
    ----------
    name : str
    foot, tip : (3,), L
    shift : (3,) or float, L
        Moves the name out of another's way.
    """

    name: str
    foot: FloatArray
    tip: FloatArray
    shift: FloatArray | float = 0.0

    @property
    def text(self) -> dict[str, Any]:
        """How matplotlib writes the name."""
        style = {"fontsize": 9, "weight": "bold"} if self.name in INCIDENT else {"fontsize": 7, "style": "italic"}
        return {"ha": "center", "va": "center", **style}

    def label(self, view: View) -> FloatArray:
        """Where to write the name (3,): behind the incidence's foot, before an axis' tip."""
        along = self.tip - self.foot
        flat = float(np.linalg.norm(view.project(along))) or 1.0
        # a fixed distance in the picture, however foreshortened the arrow is
        if self.name in INCIDENT:
            return np.asarray(self.foot - 0.1 * float(np.linalg.norm(along)) / flat * along)
        return np.asarray(self.tip + 0.22 * float(np.linalg.norm(along)) / flat * along + self.shift)

    def outline(self, view: View) -> FloatArray:
        """Flat arrow (7, 3) that faces the camera: a thin shaft and a filled head."""
        along = self.tip - self.foot
        flat = view.project(along)
        length = float(np.linalg.norm(flat)) or 1.0
        across = (-flat[1] * view.right + flat[0] * view.up) / length
        thick = float(np.linalg.norm(along)) * (0.008 if self.name in INCIDENT else 0.011)
        head = min(14 * thick, 0.6 * length)
        neck = self.tip - head / length * along
        sides = [self.foot - thick * across, neck - thick * across, neck - 0.32 * head * across, self.tip]
        return np.stack([*sides, neck + 0.32 * head * across, neck + thick * across, self.foot + thick * across])


def _apart(marks: list[Mark], view: View, least: float) -> list[Mark]:
    """The same arrows with names that stand at least so far from each other in the picture."""
    for first, second in ((0, 1), (0, 2), (1, 2)):
        one, other = marks[first], marks[second]
        gap = view.project(other.label(view) - one.label(view))
        distance = float(np.linalg.norm(gap))
        if distance < least:
            way = gap / distance if distance > 0 else np.array([1.0, 0.0])
            step = 0.5 * (least - distance) * (way[0] * view.right + way[1] * view.up)
            marks[first] = replace(one, shift=one.shift - step)
            marks[second] = replace(other, shift=other.shift + step)
    return marks


@dataclass(frozen=True)
class Drawing:
    """Everything that is drawn.

    Attributes
    ----------
    body : Surface
    direction : (3,) or None
        Incidence, of a point source that at the middle of the body; None where no wave falls in.
    view : View
    mesh : Triangulation
    normals : (n, 3)
        Of the body at the vertices of the mesh.
    strokes : list of Stroke
    colours : LevelColours
    paint : (n, 3), optional
        Red, green, blue in 0..1 at the vertices of the mesh; by default the body has one colour.
    source : (3,), optional, L
        The point source of the wave.
    title : str
        Body, wave and error, as `caption` has them.
    """

    body: Surface
    direction: FloatArray | None
    view: View
    mesh: Triangulation
    normals: FloatArray
    strokes: list[Stroke]
    colours: LevelColours
    paint: FloatArray | None = None
    source: FloatArray | None = None
    title: str = ""

    @cached_property
    def incidence(self) -> Mark:
        """Arrow along the direction of the wave, from its source where that is near.

        Else in space it stands where the wave comes from; in the picture that is behind the body, so it is moved across
        the direction, to the left, until it is clear of the body's outline.
        """
        if self.direction is None:
            raise InvalidInputError("this picture has no incidence; it is of a source on the body")
        low, high = self.view.frame(self.mesh.vertices, margin=0.0)
        extent = float(np.max(high - low))
        if self.source is not None:
            away = np.linalg.norm(self.mesh.vertices - self.source, axis=1)
            # farther away it is not in the picture
            if np.max(away) < 2.5 * size(self.body):
                long = min(0.38 * extent, 0.8 * float(np.min(away)))
                return Mark("S", self.source, self.source + long * self.direction)
        along = 0.38 * extent * self.direction
        left = low[0] - 0.08 * extent - 0.5 * abs(along @ self.view.right)
        middle = self._at(left, 0.5 * (low[1] + high[1]))
        return Mark("d" if self.source is None else "S", middle - 0.5 * along, middle + 0.5 * along)

    @cached_property
    def triad(self) -> list[Mark]:
        """Coordinate axes at the lower left of the body."""
        low, high = self.view.frame(self.mesh.vertices, margin=0.0)
        extent = float(np.max(high - low))
        length = 0.13 * extent
        flat = self.view.project(length * np.eye(3))
        # the foot where the tips stay clear of the outline's box
        foot = self._at(
            low[0] - 0.10 * extent - max(0.0, float(flat[:, 0].max())),
            low[1] + 0.03 * extent - min(0.0, float(flat[:, 1].min())),
        )
        marks = [Mark(name, foot, foot + length * unit) for name, unit in zip("xyz", np.eye(3), strict=True)]
        # names of two axes stand half an axis apart at least
        return _apart(marks, self.view, 0.5 * length)

    @property
    def marks(self) -> list[Mark]:
        """All arrows."""
        return self.triad if self.direction is None else [self.incidence, *self.triad]

    @cached_property
    def frame(self) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) of the picture, L."""
        ends = [point for mark in self.marks for point in (mark.foot, mark.tip)]
        return self.view.frame(np.concatenate([self.mesh.vertices, np.stack(ends)]))

    @property
    def centre(self) -> FloatArray:
        """Point (3,) in the middle of the frame, at the depth of the body."""
        low, high = self.frame
        return self._at(*(0.5 * (low + high)))

    def add_legend(self, figure: Any, *more: Any, columns: int = 3) -> None:
        """Add a legend under a matplotlib figure, the shadow line first, ``more`` handles last."""
        from matplotlib.lines import Line2D

        named = sorted((stroke for stroke in self.strokes if stroke.label), key=lambda stroke: -stroke.rank)
        handles = [
            Line2D([], [], color=stroke.colour, lw=max(stroke.width, 0.9), alpha=stroke.alpha, label=stroke.label)
            for stroke in named
        ]
        handles += more
        figure.legend(handles=handles, loc="lower center", ncols=min(columns, len(handles)), frameon=False, fontsize=8)

    def _at(self, right: float, up: float) -> FloatArray:
        """Point (3,) with the given place in the picture, at the depth of the body's middle."""
        depth = float(np.mean(self.mesh.vertices @ self.view.toward))
        return np.asarray(right * self.view.right + up * self.view.up + depth * self.view.toward)


def _source_view(body: Surface, source: FloatArray, towards: FloatArray) -> View:
    """Camera aside of the wave of a point source, raised or lowered where the body would hide the source."""
    # so far aside that the source and its shadow both show
    first = shadow_view(towards, turned=np.radians(75.0))
    tried = [first, *(View(first.azimuth, np.radians(e)) for e in (55.0, -55.0))]
    return next((view for view in tried if view.visible(body, source[None])[0]), first)


def caption(body: Any, source: Incident, error: str = "", more: str = "", *, name: str = "") -> str:
    """Body, wave and error as a title, with a second line; ``name`` is that of the body, its repr if not given."""
    first = f"{name or brief(body, 60)}, {incident_words(source)}"
    return "\n".join(filter(None, ["; ".join(filter(None, [first, error])), more]))


def rays_caption(line: ShadowLine, fan: RayFan | None, look: RayLook, name: str = "") -> str:
    """Body, wave and error of rays, and up to where they are drawn; for the arguments see `picture`."""
    if fan is None:
        return caption(line.body, line.source, name=name)
    wave = "k ρ = 10" if look.wavenumber is None else f"k = {look.wavenumber:g}/{unit_of(line.body)}"
    faded = f"rays: paler every 10 dB ({boundary_name(look.boundary)}, {wave}), to 30 dB or their second caustic"
    if look.until is not None or speed_of(line.body) is not None:
        faded = ""
    error = f"error of the rays' ends {fan.error.rms:.1e} rms" if fan.error.samples else ""
    return caption(line.body, line.source, error, faded, name=name)


def compose(
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    view: View | None = None,
    name: str = "",
    cells: int = 80,
    **shown: Unpack[RayOptions],
) -> Drawing:
    """Compose the picture of a shadow line, its rays and iso-phase curves; for the arguments see `picture`.

    Parameters
    ----------
    cells : int
        Fineness of the body, cells along each side of its box.
    """
    body, source, look = line.body, None, RayLook(**shown)
    ends = drawn_ends(fan, look.until, look.wavenumber, look.boundary)
    curves = drawn_curves(curves, fan, ends)
    mesh, normals = drawn_mesh(body, cells)
    if isinstance(line.source, PointSource):
        source = np.array(line.source.position)
        # towards the nearest point of the body: the middle of a ring may be the source
        nearest = mesh.vertices[np.argmin(np.linalg.norm(mesh.vertices - source, axis=1))] - source
        direction, camera = unit_direction(nearest), _source_view(body, source, nearest)
    else:
        direction = np.asarray(line.direction, dtype=float)
        camera = shadow_view(direction)
    drawn = strokes(line, fan, curves, rays=look.rays, ends=ends)
    told: dict[str, Any] = {"source": source, "title": rays_caption(line, fan, look, name)}
    return Drawing(body, direction, view or camera, mesh, normals, drawn, LevelColours.of(curves), **told)
