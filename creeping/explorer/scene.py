"""The scene of the page: what of a frame is drawn where, by viser's handles.

The body stays and lines move: only their positions and colours are sent. Numbers go to the page in single precision;
none of them is NaN. The drawn body is a little smaller than the true one, so that lines on it are not cut by triangles.

Colours of the wave move with its phase:

    colour = h Re(u e^{-i omega t})/|u|,   h = (20 log10 |u| - low)/(high - low), within 0..1

so that waves are seen through the whole range of the colours, deep in the shadow too.

Sources: Derivations, F3.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.explorer.frames import NOTHING, Preview, Refined, joined, outline, segments
from creeping.field.on_rays import creeps
from creeping.field.results.comparison import shown_range
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, size
from creeping.geometry.triangulation import Triangulation
from creeping.plotting._drawing import shadow_view
from creeping.plotting._strokes import ARROW_COLOUR, BODY_COLOUR, RAY_COLOUR, STATUS_COLOURS, line_pieces
from creeping.plotting.coloured_body import LEAST_SAMPLES, at_phase, samples_a_wave

CELLS = 44
"""Of the drawn body along each side of its box."""


Bytes = NDArray[np.uint8]
Span = tuple[float, float]
ENDED = (150, 156, 162)
"""Colour where a ray has ended or no ray passes."""
LINEAR: Bytes = np.array(
    [round(255 * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)) for c in np.arange(256) / 255], np.uint8
)
"""Bytes of colours as the page takes them at vertices, where it has light and no sRGB."""
FIELD_COLOURS, WAVE_COLOURS, LEVEL_COLOURS = (
    np.asarray(colormaps[name](np.linspace(0.0, high, 256), bytes=True)[:, :3], dtype=np.uint8)
    for name, high in (("magma", 1.0), ("RdBu_r", 1.0), ("viridis", 0.9))
)
"""Tables of colours as bytes (256, 3), made once: a frame has ten thousand of them."""


def coloured(table: Bytes, share: FloatArray) -> Bytes:
    """Colours of numbers in 0..1, clipped to it: (...) -> (..., 3)."""
    return table[np.clip(255 * np.asarray(share), 0, 255).astype(np.intp)]


def _share(levels: FloatArray, span: Span) -> FloatArray:
    low, high = span
    return np.asarray((np.nan_to_num(levels, nan=low, posinf=high, neginf=low) - low) / (high - low))


def strengths(values: ComplexArray, levels: FloatArray, span: Span) -> ComplexArray:
    """h u/|u| of fields (...) and their levels, dB: NaN where there is none, of modulus 1 at most."""
    share, size = np.clip(_share(levels, span), 0.0, 1.0), np.abs(values)
    known = np.isfinite(size) & (size > 0)
    unit = np.where(known, values, 1.0) / np.where(known, size, 1.0)
    return np.where(levels > -np.inf, share * unit, np.nan)


def wave_colours(strength: ComplexArray, phase: float) -> Bytes:
    """Colours of `strengths` (...) when omega t = phase, radians: (..., 3); ENDED where there is no field."""
    height = at_phase(strength, phase)
    out = coloured(WAVE_COLOURS, 0.5 + 0.5 * np.nan_to_num(height))
    out[np.isnan(height)] = ENDED
    return out


def fitted_span(levels: FloatArray | None, before: Span | None = None) -> Span:
    """Range of colours, 10 to 60 dB, that fits decibels (...) of the incident wave; the one before while that fits too.

    Neither the few points beside a caustic nor those in the deepest shadow stretch it.
    """
    finite = np.zeros(0) if levels is None else levels[np.isfinite(levels)]
    if not len(finite):
        return before or (-50.0, 5.0)
    least, most = np.percentile(finite, [1.0, 99.0])
    # by so much data may leave their range or fall short of it: it does not flicker
    if before and abs(most - before[1]) < 7.5 and abs(max(least, most - 60.0) - before[0]) < 7.5:
        return before
    low, high = shown_range([np.array([least, most])], span=60.0)
    return min(low, high - 10.0), high


def field_colours(levels: FloatArray, span: Span) -> Bytes:
    """Colours of decibels (...): ENDED where they are -inf or NaN, the highest on caustics (inf)."""
    out = coloured(FIELD_COLOURS, _share(levels, span))
    out[~(levels > -np.inf)] = ENDED
    return out


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """A body as it is drawn.

    Attributes
    ----------
    body : Surface
    mesh : Triangulation
    normals : (n, 3)
    radius : float, L
        Of a ball about ``centre`` that holds the body's box.
    centre : (3,), L
    """

    body: Surface
    mesh: Triangulation
    normals: FloatArray
    radius: float
    centre: FloatArray

    @classmethod
    def of(cls, body: Surface) -> "DrawnBody":
        """Triangulate a body."""
        mesh, normals = drawn_mesh(body, CELLS)
        box = np.asarray(body.bounds, dtype=float)
        return cls(body, mesh, normals, size(body), box.mean(axis=0))

    @cached_property
    def samples(self) -> float:
        """Edges of the mesh a wavelength, times the wavenumber."""
        return samples_a_wave(self.mesh, 1.0)

    @property
    def inset(self) -> FloatArray:
        """Vertices as drawn (n, 3), a little inside of the body."""
        return np.asarray(self.mesh.vertices - 0.004 * size(self.body) * self.normals)


@dataclass(frozen=True, eq=False)
class Paint:
    """The body in colours.

    Attributes
    ----------
    mesh : trimesh.Trimesh
    strength : (n,) complex or None
        Of the wave at its vertices, as of `strengths`; None where colours are those of levels.
    """

    mesh: Any
    strength: ComplexArray | None = None


class Scene:
    """The scene of one server.

    Parameters
    ----------
    server : viser.ViserServer
    model : DrawnBody
    still : bool
        Whether there is nobody to turn the incidence.
    """

    def __init__(self, server: Any, model: DrawnBody, *, still: bool = False) -> None:
        self.server, self.model, self.scene = server, model, server.scene
        self.scene.set_up_direction("+z")
        self.scene.configure_default_lights(enabled=True, cast_shadow=False)
        self.plain = self.scene.add_mesh_simple(
            "/body", model.inset, model.mesh.triangles, color=rgb(BODY_COLOUR), cast_shadow=False, receive_shadow=False
        )
        self.painted: Any = None
        self._paint: Paint | None = None
        self._strength: ComplexArray | None = None
        self._lines: dict[str, Any] = {}
        if still:
            self.incidence: Any = self.scene.add_frame("/incidence", show_axes=False, position=model.centre)
        else:
            arcs = {"scale": 1.1 * model.radius, "disable_axes": True, "disable_sliders": True, "depth_test": True}
            self.incidence = self.scene.add_transform_controls("/incidence", position=model.centre, **arcs)
        # along +z, and turned with the controls on the page itself; before and behind the body, which hides one of them
        shaft = np.array([[[0, 0, -1.55], [0, 0, -1.1]], [[0, 0, 1.1], [0, 0, 1.55]]]) * model.radius
        thick = 0.015 * model.radius
        look = {"shaft_radius": thick, "head_radius": 3 * thick, "head_length": 8 * thick}
        self.scene.add_arrows("/incidence/arrow", shaft, rgb(ARROW_COLOUR), **look)

    def look(self, direction: FloatArray) -> None:
        """Start the camera on the shadow side."""
        toward = shadow_view(direction).toward
        self.server.initial_camera.look_at = self.model.centre
        self.server.initial_camera.position = self.model.centre + 3.9 * self.model.radius * toward
        self.server.initial_camera.fov = float(np.radians(40))

    def turn(self, direction: FloatArray) -> None:
        """Turn the arrow of the incidence."""
        self.incidence.wxyz = quaternion(direction)

    def show(self, frame: Preview, span: Span, phase: float | None = None) -> None:
        """Draw what follows at once; the field on the body is hidden until it is known again.

        With a phase, radians, rays have the colours of the wave, if the frame has one.
        """
        levels, wave, rays = frame.levels, None if phase is None else frame.wave, frame.ray_segments
        self._paint = self._strength = None
        if wave is not None and phase is not None:
            self._strength, rays = strengths(wave.values, wave.levels, span), wave.segments
            colours = wave_colours(self._strength, phase)
        elif levels is None:
            alive = creeps(frame.fan)[..., None]
            colours = np.where(alive, np.array(rgb(RAY_COLOUR)), np.array(ENDED)).astype(np.uint8)
        else:
            colours = field_colours(levels, span)
        curves, of = frame.level_segments
        shades = np.repeat(coloured(LEVEL_COLOURS, of / frame.fan.length)[:, None], 2, axis=1)
        with self.server.atomic():
            if self.painted is not None:
                self.painted.visible = False
            self.plain.visible = True
            self._line("rays", rays, _paired(colours))
            self._line("levels", curves, shades)
            self._line("outline", outline(self.model.mesh, self.model.normals, frame.request.direction), RAY_COLOUR)
            self._line("line/attached", frame.launch_segments, STATUS_COLOURS["attached"])
            for status in ("occluded", "concave"):
                self._line(f"line/{status}", NOTHING, STATUS_COLOURS[status])

    def recolour(self, phase: float) -> None:
        """Turn the wave that is shown to a phase, radians: only colours are made anew."""
        rays = None if self._strength is None else LINEAR[_paired(wave_colours(self._strength, phase))]
        paint, body = self._paint, None
        if paint is not None and paint.strength is not None:
            body = self._coloured(wave_colours(paint.strength, phase)).export(file_type="glb")
        with self.server.atomic():
            if rays is not None and len(rays):
                self._lines["rays"].colors = rays
            if body is not None:
                self.painted.glb_data = body

    def shows_wave_on_body(self, wavenumber: float) -> bool:
        """Whether the body's mesh is fine enough for the wave."""
        return self.model.samples / wavenumber >= LEAST_SAMPLES

    def painted_mesh(self, found: Refined, span: Span, phase: float | None = None) -> Paint | None:
        """The body in the colours of the field on it, of its wave with a phase; None without such."""
        if found.body_levels is None:
            return None
        if phase is None:
            return Paint(self._coloured(field_colours(found.body_levels, span)))
        if found.body_wave is None or not self.shows_wave_on_body(found.request.wavenumber):
            return None
        strength = strengths(found.body_wave, found.body_levels, span)
        return Paint(self._coloured(wave_colours(strength, phase)), strength)

    def _coloured(self, colours: Bytes) -> Any:
        """The mesh of the body with colours (n, 3) at its vertices."""
        import trimesh

        at_vertices = {"vertex_normals": self.model.normals, "vertex_colors": LINEAR[colours]}
        return trimesh.Trimesh(self.model.inset, self.model.mesh.triangles, process=False, **at_vertices)

    def refine(self, found: Refined, paint: Paint | None) -> None:
        """Draw what takes longer, with what `painted_mesh` has made."""
        with self.server.atomic():
            for status, colour in STATUS_COLOURS.items():
                pieces = line_pieces(found.line, status)
                self._line(f"line/{status}", joined([segments(p[None]) for p in pieces]), colour)
            self._line("outline", NOTHING, RAY_COLOUR)
            self._paint = paint
            if paint is not None:
                unlit = {"cast_shadow": False, "receive_shadow": False}
                self.painted = self.scene.add_mesh_trimesh("/field", paint.mesh, **unlit)
                self.plain.visible = False

    def _line(self, name: str, points: FloatArray, colours: Any) -> None:
        """Set the segments (m, 2, 3) of a line and their colours, one or (m, 2, 3)."""
        handle = self._lines.get(name)
        if not len(points):
            # nothing to draw is not an empty array, which the page could not bound
            if handle is not None:
                handle.visible = False
            return
        paint = np.array(rgb(colours), dtype=np.uint8) if isinstance(colours, str) else LINEAR[colours]
        if handle is None:
            width = {"rays": 1.5, "levels": 2.0, "line": 4.0, "outline": 1.5}[name.split("/")[0]]
            look = {"thickness": width, "thickness_units": "screen"}
            self._lines[name] = self.scene.add_line_segments(f"/{name}", points, paint, **look)
            return
        handle.points, handle.colors, handle.visible = points, paint, True


def _paired(colours: Bytes) -> Bytes:
    """Colours of the points of rays (rays, points, 3) as those of the ends of their segments (m, 2, 3)."""
    return np.stack([colours[:, :-1], colours[:, 1:]], axis=2).reshape(-1, 2, 3)


def rgb(colour: str) -> tuple[int, int, int]:
    """Bytes of a hexadecimal colour."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def quaternion(direction: FloatArray) -> FloatArray:
    """Unit quaternion (w, x, y, z) of the shortest turn from +z to a unit vector (3,)."""
    x, y, z = (float(c) for c in direction)
    if z < -1 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1 + z, -y, x, 0.0])
    return np.asarray(turn / np.linalg.norm(turn))


def turned(wxyz: FloatArray) -> FloatArray:
    """Where a unit quaternion turns +z: (4,) -> (3,)."""
    w, x, y, z = (float(c) for c in wxyz)
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
