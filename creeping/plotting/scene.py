"""The 3-D picture with pyvista: a true depth buffer hides what is behind the body.

Also here: can this machine draw with OpenGL? Asked once, in a process of its own.

A missing libX11, libEGL or Mesa vendor file does not raise in VTK, it ends the process with a segmentation fault.
Hence the question is put to a subprocess, and VTK is imported here only after it has come back with a picture.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from creeping._typing import Any, FloatArray
from creeping.errors import CreepingError
from creeping.plotting._drawing import Drawing
from creeping.plotting._strokes import BODY_COLOUR, HIDDEN, Stroke

REMEDY = "on Debian or Ubuntu install libegl1 libgl1-mesa-dri libx11-6"
_SCRIPT = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(16, 16))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
plotter.close()
raise SystemExit(0 if image.max() > image.min() else 3)
"""


def render(drawing: Drawing, pixels: tuple[int, int], *, scale: float) -> NDArray[np.float32]:
    """Image (height, width, 3) in 0..1, without arrows, in which lines behind the body keep a share of their ink.

    ``scale`` is the number of pixels per point of line width.

    Two renderings, with the body and without it, multiplied like inks: a translucent body would need its layers
    sorted, which software renderers do badly, and would mix its own far side in.
    """
    # raise a CreepingError with the remedy where pyvista cannot draw; to be called before pyvista is imported
    probe = gl_available()
    if not probe.ok:
        raise CreepingError(f"pyvista cannot draw here: {probe.reason}; or draw with matplotlib")
    # without an X server VTK tries one first and complains before it takes EGL: it is told what it will find
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=pixels)
    try:
        plotter.set_background("white")
        _add_body(plotter, drawing)
        for number, stroke in enumerate(drawing.strokes):
            _add_stroke(plotter, stroke, scale, f"stroke {number}")
        _aim(plotter, drawing)
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
    look = {"color": stroke.colour, "line_width": stroke.width * scale, "opacity": stroke.alpha, "lighting": False}
    actor = plotter.add_mesh(polylines(stroke.lines), name=name, **look)
    # the mesh and the polylines both sag by about the square of their spacing, so lines are drawn a little nearer
    # to the camera, by rank, in units of 1/65000 of the depth of the scene; in depth only: lifting them off the body
    # would bulge its outline
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -40.0 * (3 + stroke.rank))


def polylines(lines: Sequence[FloatArray]) -> Any:
    """One ``pyvista.PolyData`` of several polylines (k, 3)."""
    import pyvista

    lengths = np.array([len(points) for points in lines])
    starts = np.cumsum(lengths) - lengths
    cells = [np.concatenate([[n], np.arange(k, k + n)]) for n, k in zip(lengths, starts, strict=True)]
    return pyvista.PolyData(np.concatenate(lines), lines=np.concatenate(cells))


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


@dataclass(frozen=True)
class GLProbe:
    """Verdict on off-screen OpenGL.

    Attributes
    ----------
    ok : bool
        Whether pyvista can render here.
    reason : str
        Why not, and what would help; "rendered" if it can.
    """

    ok: bool
    reason: str


def gl_available() -> GLProbe:
    """Whether pyvista can render on this machine, without risking this process.

    The process asks once. ``CREEPING_NO_GL=1`` in the environment says no without asking.

    Returns
    -------
    GLProbe
    """
    if os.environ.get("CREEPING_NO_GL", "") not in ("", "0"):
        return GLProbe(False, "CREEPING_NO_GL is set; unset it to draw with pyvista")
    return _probe()


@cache
def _probe() -> GLProbe:
    """Render in a subprocess."""
    try:
        # no terminal, and its messages kept: VTK warns about a missing X server even where EGL then succeeds
        asked: dict[str, Any] = {"capture_output": True, "stdin": subprocess.DEVNULL, "timeout": 60, "check": False}
        done = subprocess.run([sys.executable, "-c", _SCRIPT], **asked)
    except subprocess.TimeoutExpired:
        return GLProbe(False, "the trial rendering took more than 60 s")
    except OSError as error:
        return GLProbe(False, f"the trial rendering could not start ({error})")
    if done.returncode == 0:
        return GLProbe(True, "rendered")
    if done.returncode == 3:
        return GLProbe(False, f"the trial rendering was blank; {REMEDY}")
    if done.returncode < 0:
        return GLProbe(False, f"the trial rendering ended with signal {-done.returncode}; {REMEDY}")
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
    return GLProbe(False, f"the trial rendering failed ({last[0][:200]}); {REMEDY}")
