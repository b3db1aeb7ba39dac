"""The 3-D picture with pyvista: a true depth buffer hides what is behind the body."""

import os
import sys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from creeping._typing import Any, FloatArray
from creeping.errors import CreepingError
from creeping.plotting._drawing import Drawing, compose
from creeping.plotting._strokes import ARROW_COLOUR, BODY_COLOUR, HIDDEN, Stroke
from creeping.plotting._view import View
from creeping.plotting.display import gl_available
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine

DEPTH_UNITS = 40.0  # of 1/65000 of the depth of the scene


def plot_rays_3d(
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    plotter: Any = None,
    view: View | None = None,
    rays: int = 48,
    until: float | None = None,
    legend: bool = True,
) -> Any:
    """Draw the body, its shadow line, creeping rays and iso-phase curves with pyvista.

    Parameters
    ----------
    line : ShadowLine
    fan : RayFan, optional
    curves : sequence of IsoPhaseCurve
    plotter : pyvista.Plotter, optional
        Plotter to draw on; by default a new one.
    view : View, optional
        Camera; by default on the shadow side.
    rays : int
        Rays drawn at most.
    until : float, optional
        Travel time up to which rays are drawn; by default to their end.
    legend : bool
        Whether to add a legend, the colour bar of the levels and the axes.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    CreepingError
        If there is no OpenGL on this machine.
    """
    require_gl()
    import pyvista

    drawing = compose(line, fan, curves, view=view, rays=rays, until=until)
    if plotter is None:
        plotter = pyvista.Plotter(window_size=(1200, 1000))
    draw(plotter, drawing)
    _add_incidence(plotter, drawing)
    if legend:
        _add_legend(plotter, drawing)
    return plotter


def require_gl() -> None:
    """Raise a CreepingError with the remedy where pyvista cannot draw; to be called before pyvista is imported."""
    probe = gl_available()
    if not probe.ok:
        raise CreepingError(f"pyvista cannot draw here: {probe.reason}; or draw with matplotlib")
    _prefer_egl()


def draw(plotter: Any, drawing: Drawing, *, scale: float = 2.0) -> None:
    """Draw a composed picture without arrow and legend; ``scale`` is the number of pixels per point of line width."""
    plotter.set_background("white")
    _add_body(plotter, drawing)
    for number, stroke in enumerate(drawing.strokes):
        _add_stroke(plotter, stroke, scale, f"stroke {number}")
    _aim(plotter, drawing)


def render(drawing: Drawing, pixels: tuple[int, int], *, scale: float) -> NDArray[np.float32]:
    """Image (height, width, 3) in 0..1 in which lines behind the body keep a share of their ink.

    Two renderings, with the body and without it, multiplied like inks: a translucent body would need its layers
    sorted, which software renderers do badly, and would mix its own far side in.
    """
    require_gl()
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=pixels)
    try:
        draw(plotter, drawing, scale=scale)
        with_body = _image(plotter)
        plotter.actors["body"].visibility = False
        for number, stroke in enumerate(drawing.strokes):
            plotter.actors[f"stroke {number}"].visibility = stroke.through
        without = _image(plotter)
    finally:
        plotter.close()
    # where a line is in front both images agree, and it must not be inked twice
    behind = np.any(np.abs(with_body - without) > 1.5 / 255, axis=-1, keepdims=True)
    return np.where(behind, with_body * (1 - np.float32(HIDDEN) * (1 - without)), with_body)


def _image(plotter: Any) -> NDArray[np.float32]:
    # the plotter keeps its last image unless told to draw again
    plotter.render()
    # single precision: a picture for print has ten million pixels
    return np.asarray(plotter.screenshot(return_img=True), dtype=np.float32)[..., :3] / np.float32(255)


def _prefer_egl() -> None:
    """Without an X server VTK tries one first and complains before it takes EGL; tell it what it will find."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def _add_body(plotter: Any, drawing: Drawing) -> None:
    import pyvista

    mesh = drawing.mesh
    surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.triangles)
    surface.point_data["Normals"] = drawing.normals
    surface.point_data.active_normals_name = "Normals"
    if drawing.paint is None:
        look = {"color": BODY_COLOUR, "ambient": 0.60, "diffuse": 0.42}
    else:
        # little shade: colours are read off a bar
        surface.point_data["paint"] = np.round(255 * drawing.paint).astype(np.uint8)
        look = {"scalars": "paint", "rgb": True, "ambient": 0.82, "diffuse": 0.18}
    # lit from the camera: dark at the rim, so that the outline shows on white
    plotter.remove_all_lights()
    plotter.add_light(pyvista.Light(light_type="headlight"))
    plotter.add_mesh(surface, smooth_shading=True, specular=0.0, culling="back", name="body", **look)


def _add_stroke(plotter: Any, stroke: Stroke, scale: float, name: str) -> None:
    actor = plotter.add_mesh(
        polylines(stroke.lines),
        color=stroke.colour,
        line_width=stroke.width * scale,
        opacity=stroke.alpha,
        lighting=False,
        name=name,
    )
    # the mesh and the polylines both sag by about the square of their spacing, so lines are drawn a little nearer
    # to the camera, by rank; in depth only: lifting them off the body would bulge its outline
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -DEPTH_UNITS * (3 + stroke.rank))


def polylines(lines: Sequence[FloatArray]) -> Any:
    """One ``pyvista.PolyData`` of several polylines (k, 3)."""
    import pyvista

    lengths = np.array([len(points) for points in lines])
    starts = np.cumsum(lengths) - lengths
    cells = [np.concatenate([[n], np.arange(k, k + n)]) for n, k in zip(lengths, starts, strict=True)]
    return pyvista.PolyData(np.concatenate(lines), lines=np.concatenate(cells))


def _add_incidence(plotter: Any, drawing: Drawing) -> None:
    import pyvista

    tail, head = drawing.incidence.foot, drawing.incidence.tip
    shape = pyvista.Arrow(
        start=tail,
        direction=head - tail,
        scale=float(np.linalg.norm(head - tail)),
        tip_length=0.25,
        tip_radius=0.05,
        shaft_radius=0.011,
        tip_resolution=48,
        shaft_resolution=24,
    )
    plotter.add_mesh(shape, color=ARROW_COLOUR, lighting=False, name="incidence")


def _aim(plotter: Any, drawing: Drawing) -> None:
    """Parallel projection, everything in the picture."""
    low, high = drawing.frame
    half, centre = 0.5 * (high - low), drawing.centre
    width, height = plotter.window_size
    camera = plotter.camera
    camera.focal_point = tuple(centre)
    camera.position = tuple(centre + 10 * float(np.max(half)) * drawing.view.toward)
    camera.up = tuple(drawing.view.up)
    camera.parallel_projection = True
    camera.parallel_scale = max(half[1], half[0] * height / width)
    plotter.renderer.reset_camera_clipping_range()


def _add_legend(plotter: Any, drawing: Drawing) -> None:
    import pyvista

    entries = [(stroke.label, stroke.colour) for stroke in reversed(drawing.strokes) if stroke.label]
    # not add_legend: its box does not grow with the text, which is then cut off at the window's edge
    for k, (label, colour) in enumerate(entries):
        place = (16, plotter.window_size[1] - 28 * (k + 1))
        plotter.add_text(f"- {label}", position=place, font_size=9, color=colour, name=f"legend {k}")
    plotter.add_axes(line_width=3)
    colours = drawing.colours
    if colours.high > colours.low:
        mapper = pyvista.DataSetMapper()
        mapper.lookup_table = pyvista.LookupTable(colours.mappable.cmap, scalar_range=(colours.low, colours.high))
        bar = {"vertical": True, "position_x": 0.88, "position_y": 0.3, "width": 0.06, "height": 0.4}
        plotter.add_scalar_bar(mapper=mapper, title=colours.name, n_labels=5, color="black", **bar)
