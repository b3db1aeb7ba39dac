"""A page of one incidence that opens without a server: the scene, the plane pictures and the numbers in one file."""

import html
import os
from pathlib import Path

from creeping.explorer.door import with_title
from creeping.explorer.frames import Refined, preview_of, refined_view, step_of
from creeping.explorer.page import LocalServer
from creeping.explorer.panel import cut_svg, legend, plane_svg, refined_text, validity_text
from creeping.explorer.request import ViewRequest
from creeping.explorer.scene import DrawnBody, Scene
from creeping.explorer.wave import fitted_span
from creeping.files import write_text
from creeping.rays.transport import Flow

STYLE = """
#creeping{position:fixed;top:0;right:0;width:380px;max-height:100vh;overflow:auto;box-sizing:border-box;padding:10px;
background:rgba(255,255,255,.92);font:12px/1.4 sans-serif;color:#222;z-index:10}
#creeping h1{font-size:14px;margin:0 0 6px}#creeping p{margin:0 0 6px}
"""


def export_page(path: str | os.PathLike[str], flow: Flow, request: ViewRequest, *, name: str | None = None) -> Refined:
    """Write a self-contained page of one incidence.

    Parameters
    ----------
    path : str or path
        HTML file to write.
    flow : PhaseMap or DirectFlow
    request : ViewRequest
    name : str, optional
        Of the body, the page's title; by default what the body says of itself.

    Returns
    -------
    Refined
        What the page shows.

    Raises
    ------
    SingularIncidenceError
        If the shadow line crosses itself.
    CreepingError
        If the file cannot be written.
    """
    page, found = page_of(flow, request, name)
    write_text(Path(path), page)
    return found


def page_of(flow: Flow, request: ViewRequest, name: str | None = None) -> tuple[str, Refined]:
    """Text of the page, and what it shows; arguments as of `export_page`."""
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
    title, words = name or repr(flow.body), refined_text(found)
    if frame.validity is not None:
        words = f"{validity_text(frame.validity).replace('**', '')}\n\n{words}"
    text = "".join(f"<p>{html.escape(part)}</p>" for part in words.split("\n\n"))
    angles = f"theta {request.theta:.1f}, phi {request.phi:.1f} degrees"
    # the numbers and plane pictures beside the scene
    panel = (
        f'<style>{STYLE}</style><aside id="creeping"><h1>{html.escape(title)}</h1><p>{angles}</p>{text}'
        f"{legend(frame, span, still=True)}{plane_svg(found)}{cut_svg(request, found.cut_angles, found.far)}</aside>"
    )
    page = with_title(page, title)
    end = page.rindex("</body>")
    return page[:end] + panel + page[end:], found
