"""A fan as a page to turn in a notebook, or to keep as a file: the scene, plane pictures and numbers, no server."""

import html
import os
from dataclasses import dataclass
from pathlib import Path

from creeping._presenting import brief
from creeping.errors import CreepingError
from creeping.explorer.door import with_title
from creeping.explorer.frames import Refined, preview_of, refined_view, step_of
from creeping.explorer.panel import cut_svg, legend, plane_svg, refined_text, validity_text
from creeping.explorer.request import RAYS, ViewRequest, angles
from creeping.explorer.scene import DrawnBody, Scene, fitted_span
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.files import write_text
from creeping.rays.fan import RayFan
from creeping.rays.transport import Flow

STYLE = """
#creeping{position:fixed;top:0;right:0;width:380px;max-height:100vh;overflow:auto;box-sizing:border-box;padding:10px;
background:rgba(255,255,255,.92);font:12px/1.4 sans-serif;color:#222;z-index:10}
#creeping h1{font-size:14px;margin:0 0 6px}#creeping p{margin:0 0 6px}
"""


@dataclass(frozen=True, repr=False)
class Page:
    """A page of one incidence; a notebook shows it as the last value of a cell.

    Attributes
    ----------
    text : str
        The page, with all that it needs.
    title : str
    """

    text: str
    title: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as an HTML file.

        Raises
        ------
        CreepingError
            If the file cannot be written.
        """
        write_text(Path(path), self.text)

    def _repr_html_(self) -> str:
        """A frame that holds the page and may run its own scripts, of the notebook nothing."""
        look = 'width="100%" height="640" style="border:0" sandbox="allow-scripts"'
        return f'<iframe {look} srcdoc="{html.escape(self.text, quote=True)}"></iframe>'

    def __repr__(self) -> str:
        return f"Page({self.title!r}, {len(self.text) / 1e6:.1f} MB)"


def page(
    fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "hard", spacing: float | None = None, cut: float = 0.0
) -> Page:
    """The page that ``creeping explore --export`` writes, for the incidence and the length of a fan.

    Parameters
    ----------
    fan : RayFan
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    spacing : float, optional
        Between iso-phase curves; an eighth of the length, 0 for none.
    cut : float, degrees
        Azimuth of the cut of the far field.

    Raises
    ------
    CreepingError
        If viser is not installed.
    InvalidInputError
        On bad numbers.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Sphere(), direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere()), line, length=2.0, n_rays=32)
    >>> page(fan, wavenumber=20.0, boundary="pec").title            # the page itself: .save("page.html")
    'Sphere(radius=1.0, speed=None)'
    """
    rays = min(max(len(fan.points), RAYS[0]), RAYS[1])
    gap = fan.length / 8 if spacing is None else spacing
    kind = boundary_name(boundary)
    request = ViewRequest(*angles(fan.line.direction), rays, fan.length, gap, wavenumber, kind, cut)
    title = brief(fan.body)
    return Page(page_of(fan.flow, request, title)[0], title)


def page_of(flow: Flow, request: ViewRequest, name: str) -> tuple[str, Refined]:
    """Text of a page of one incidence, and what it shows; ``name`` is that of the body, its title.

    Raises
    ------
    CreepingError
        If viser is not installed.
    SingularIncidenceError
        If the shadow line crosses itself.
    """
    try:
        from creeping.explorer.page import LocalServer
    except ImportError as error:
        raise CreepingError(f"the page needs viser ({error}); pip install 'creeping[web]'") from error
    model = DrawnBody.of(flow.body)
    frame = preview_of(flow, request, step_of(flow.body))
    found = refined_view(flow, frame, model.mesh.vertices)
    assert found is not None
    server = LocalServer(8400)
    try:
        scene = Scene(server, model, still=True)
        scene.look(request.direction)
        scene.turn(request.direction)
        span = fitted_span(frame.levels if found.body_levels is None else found.body_levels)
        scene.show(frame, span)
        scene.refine(found, scene.painted_mesh(found, span))
        page = server.scene.as_html()
    finally:
        server.stop()
    words = refined_text(found)
    if frame.validity is not None:
        words = f"{validity_text(frame.validity).replace('**', '')}\n\n{words}"
    text = "".join(f"<p>{html.escape(part)}</p>" for part in words.split("\n\n"))
    angles = f"theta {request.theta:.1f}, phi {request.phi:.1f} degrees"
    # the numbers and plane pictures beside the scene
    panel = (
        f'<style>{STYLE}</style><aside id="creeping"><h1>{html.escape(name)}</h1><p>{angles}</p>{text}'
        f"{legend(frame, span, still=True)}{plane_svg(found)}{cut_svg(request, found.cut_angles, found.far)}</aside>"
    )
    page = with_title(page, name)
    end = page.rindex("</body>")
    return page[:end] + panel + page[end:], found
