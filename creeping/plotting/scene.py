"""The 3-D picture with pyvista: a body that lets the lines behind it through faintly, by a true depth buffer."""

from collections.abc import Sequence

import numpy as np

from creeping._errors import CreepingError
from creeping._typing import Any, FloatArray
from creeping.plotting._inputs import IsoPhaseCurveLike, RayFanLike, ShadowLineLike
from creeping.plotting._strokes import ARROW_COLOUR, BODY_COLOUR, LevelColours, Stroke, strokes
from creeping.plotting._view import View, arrow, shadow_view
from creeping.plotting.display import gl_available
from creeping.surface import Surface, normal, size
from creeping.triangulation import Triangulation, triangulate

OPACITY = 0.8  # of the body: what is behind it keeps a fifth of its strength


def plot_rays_3d(
    line: ShadowLineLike,
    fan: RayFanLike | None = None,
    curves: Sequence[IsoPhaseCurveLike] = (),
    *,
    plotter: Any = None,
    view: View | None = None,
    rays: int = 64,
    until: float | None = None,
    cells: int = 96,
    legend: bool = True,
    scale: float = 2.0,
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
    cells : int
        Fineness of the body's picture, cells along each side of its box.
    legend : bool
        Whether to add a legend, the colour bar of the levels and the axes.
    scale : float
        Pixels per point of line width.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    CreepingError
        If there is no OpenGL on this machine.
    """
    probe = gl_available()
    if not probe.ok:
        raise CreepingError(f"pyvista cannot draw here: {probe.reason}; or draw with creeping.plotting.axes3d")
    import pyvista

    view = shadow_view(line.direction) if view is None else view
    mesh = triangulate(line.body.level, line.body.gradient, line.body.bounds, cells=cells)
    everything = strokes(line, fan, curves, rays=rays, until=until)
    if plotter is None:
        plotter = pyvista.Plotter(window_size=(1200, 1000))
    plotter.set_background("white")
    _add_body(plotter, line.body, mesh)
    for stroke in everything:
        _add_stroke(plotter, line.body, stroke, scale)
    ends = arrow(view, np.asarray(line.direction), mesh.vertices)
    _add_arrow(plotter, ends)
    _aim(plotter, view, np.concatenate([mesh.vertices, np.stack(ends)]))
    if legend:
        _add_legend(plotter, everything, LevelColours.of(curves))
    return plotter


def _add_body(plotter: Any, body: Surface, mesh: Triangulation) -> None:
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.triangles)
    surface.point_data["Normals"] = normal(body, mesh.vertices)
    surface.point_data.active_normals_name = "Normals"
    # lit from the camera: dark at the rim, so that the outline shows on white
    plotter.remove_all_lights()
    plotter.add_light(pyvista.Light(light_type="headlight"))
    plotter.add_mesh(
        surface,
        color=BODY_COLOUR,
        opacity=OPACITY,
        smooth_shading=True,
        ambient=0.60,
        diffuse=0.42,
        specular=0.0,
        culling="back",
        name="body",
    )
    plotter.enable_depth_peeling(8)


def _add_stroke(plotter: Any, body: Surface, stroke: Stroke, scale: float) -> None:
    # a little off the body, by rank: the mesh and the polylines both sag by about the square of their spacing
    lift = size(body) * (0.004 + 0.001 * stroke.rank)
    plotter.add_mesh(
        polylines([points + lift * normal(body, points) for points in stroke.lines]),
        color=stroke.colour,
        line_width=stroke.width * scale,
        opacity=stroke.alpha,
        lighting=False,
    )


def polylines(lines: Sequence[FloatArray]) -> Any:
    """One ``pyvista.PolyData`` of several polylines (k, 3)."""
    import pyvista

    lengths = np.array([len(points) for points in lines])
    starts = np.cumsum(lengths) - lengths
    cells = [np.concatenate([[n], np.arange(k, k + n)]) for n, k in zip(lengths, starts, strict=True)]
    return pyvista.PolyData(np.concatenate(lines), lines=np.concatenate(cells))


def _add_arrow(plotter: Any, ends: tuple[FloatArray, FloatArray]) -> None:
    import pyvista

    tail, head = ends
    length = float(np.linalg.norm(head - tail))
    shape = pyvista.Arrow(
        start=tail,
        direction=head - tail,
        scale=length,
        tip_length=0.25,
        tip_radius=0.06,
        shaft_radius=0.015,
        tip_resolution=48,
        shaft_resolution=24,
    )
    plotter.add_mesh(shape, color=ARROW_COLOUR, lighting=False, name="incidence")


def _aim(plotter: Any, view: View, points: FloatArray) -> None:
    """Parallel projection, everything in the picture."""
    flat = view.project(points)
    middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    centre = middle[0] * view.right + middle[1] * view.up + np.mean(points @ view.toward) * view.toward
    half = 0.5 * np.ptp(flat, axis=0)
    width, height = plotter.window_size
    camera = plotter.camera
    camera.focal_point = tuple(centre)
    camera.position = tuple(centre + 10 * float(np.max(half)) * view.toward)
    camera.up = tuple(view.up)
    camera.parallel_projection = True
    camera.parallel_scale = 1.04 * max(half[1], half[0] * height / width)
    plotter.renderer.reset_camera_clipping_range()


def _add_legend(plotter: Any, everything: Sequence[Stroke], colours: LevelColours) -> None:
    from matplotlib.colors import ListedColormap

    entries = [(stroke.label, stroke.colour) for stroke in reversed(everything) if stroke.label]
    plotter.add_legend(entries, face="line", bcolor=None, size=(0.28, 0.045 * len(entries)), loc="lower right")
    plotter.add_axes(line_width=3)
    if colours.high > colours.low:
        import pyvista

        # the bar belongs to a mesh with the levels as scalars; a point on the arrow's tail will do
        table = pyvista.LookupTable(ListedColormap(colours.mappable.cmap.colors), scalar_range=(colours.low, colours.high))
        plotter.add_scalar_bar(mapper=_mapper(table), title=colours.name, vertical=True, n_labels=5, color="black")


def _mapper(table: Any) -> Any:
    import pyvista

    mapper = pyvista.DataSetMapper()
    mapper.lookup_table = table
    return mapper
