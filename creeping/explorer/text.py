"""The numbers beside the picture, as short Markdown.

Also here: the title of the page: that of the body instead of the library's.
"""

import html
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from websockets.asyncio import server as websocket_server
from websockets.http11 import Request, Response

from creeping._typing import Any
from creeping._version import __version__
from creeping.explorer.preview import Preview
from creeping.explorer.refined import Refined
from creeping.explorer.request import wave_text
from creeping.explorer.wave import ENDED, FIELD_COLOURS, LEVEL_COLOURS, WAVE_COLOURS, ColourTable, Span
from creeping.field.validity_range import WITHIN, Validity, validity_words
from creeping.geometry.checks import unit_of
from creeping.plotting._strokes import RAY_COLOUR, STATUS_COLOURS
from creeping.rays.fan import RayFan

PLAIN = "<title>Viser</title>"
ARCS = {"arc: tilts d": "#ff2060", "tilts d": "#20df80", "turns d about itself": "#2080ff"}
"""Of the handles on the page, in the colours that they have there."""
_TEXT = 'font-size="11" font-family="sans-serif" fill="#333"'


def preview_text(frame: Preview, seconds: float, span: tuple[float, float]) -> str:
    """The fan in a few words, with the range of its colours in dB."""
    request, fan = frame.request, frame.fan
    at = f"theta {request.theta:.1f}, phi {request.phi:.1f} degrees"
    kind = "" if frame.levels is None else f"; colours: {span[0]:g} to {span[1]:g} dB, {field_name(request.boundary)}"
    wave = "" if frame.validity is None else f"\n\n{wave_text(request)}; {validity_text(frame.validity)}"
    return (
        f"d = ({', '.join(f'{c:.4f}' for c in request.direction)}), {at}\n\n"
        f"{_counts(fan)}; length {fan.length:.3g}; {1e3 * seconds:.0f} ms{kind}{wave}"
    )


def validity_text(found: Validity) -> str:
    """How far the wave is from the limit of short waves, bold beyond the range of the expansions."""
    if np.isnan(found.least_k_rho):
        return "no ray to judge the wave by"
    inside = found.least_k_rho >= WITHIN[0] and found.largest_transverse <= WITHIN[1]
    words = validity_words(found)
    return words if inside else f"**{words}**"


def refined_text(found: Refined) -> str:
    """Line, errors and what the far field leaves open."""
    line, drawn = found.line, found.drawn
    # lengths of an expression are metres once a frequency was given
    unit = "m" if found.request.metres else unit_of(line.body)
    shares = ", ".join(f"{share:.3g} {name}" for name, share in line.fractions.items() if share)
    lines = [
        f"shadow line: {len(line.curves)} {'curve' if len(line.curves) == 1 else 'curves'}, "
        f"length {line.length:.8g} {unit}; {shares}",
        f"rays drawn: {_counts(drawn)}, length {drawn.length:.4g} {unit}; error at their ends "
        f"rms {drawn.error.rms:.1e}, max {drawn.error.max:.1e} ({drawn.error.samples} traced)",
    ]
    if found.far is not None:
        doubt, fan, request = int(np.sum(found.far.unresolved)), found.fan, found.request
        lines.append(
            f"fields of {len(fan.points)} rays, rms {fan.error.rms:.1e}: {wave_text(request)}, "
            f"{request.boundary}; {doubt} of {len(found.cut_angles)} directions of the cut unresolved"
        )
    else:
        lines.append("a weighted body has no field here: only its rays")
    return "\n\n".join([*lines, f"creeping {__version__}"])


def field_name(boundary: str) -> str:
    """What the colours show."""
    return {"soft": "|du/dn|/k", "pec": "|n × H|"}.get(boundary, "|u|")


def wave_note(frame: Preview, on_body: bool) -> str:
    """What is left out where the wave is asked for, in words; ``on_body`` says if the mesh is fine enough for it."""
    if frame.levels is None:
        return "a weighted body has no field, and no wave to show"
    if frame.request.boundary == "pec":
        return "n × H of a conductor is a vector of two polarisations: its level is shown, not a wave"
    if frame.wave is None:
        return "the wave is too short for so many steps and rays: levels are shown; ask for shorter or fewer rays"
    return "" if on_body else "the wave is too short for the mesh of the body, which stays without"


def legend(frame: Preview, span: Span, *, still: bool = False, wave: bool = False) -> str:
    """What the colours in space stand for, as SVG; with the arcs that turn the incidence unless ``still``."""
    rows = []
    if wave:
        name = {"soft": "du/dn/k"}.get(frame.request.boundary, "u")
        of = f"Re {name}: pale at {span[0]:g} dB, full at {span[1]:g} dB"
        rows.append(_bar("wave", WAVE_COLOURS, ("trough", of, "crest")))
    elif frame.levels is not None:
        field = f"20 log10 {field_name(frame.request.boundary)}, rays and body"
        rows.append(_bar("field", FIELD_COLOURS, (f"{span[0]:g} dB", field, f"{span[1]:g} dB")))
    if frame.request.spacing:
        rows.append(_bar("levels", LEVEL_COLOURS, ("0", "iso-phase curves: travel time", f"{frame.fan.length:.3g}")))
    line = dict(zip(("shadow line", "occluded", "concave"), STATUS_COLOURS.values(), strict=True))
    rows.append(_keys(line | {"outline": RAY_COLOUR, "no ray": "#{:02x}{:02x}{:02x}".format(*ENDED)}))
    if not still:
        rows.append(_keys(ARCS))
    placed = "".join(f'<g transform="translate(0 {24 * number})">{row}</g>' for number, row in enumerate(rows))
    box = f'viewBox="0 0 360 {24 * len(rows)}" width="100%"'
    return f'<svg id="bar" xmlns="http://www.w3.org/2000/svg" {box}>{placed}</svg>'


def _bar(name: str, colours: ColourTable, words: tuple[str, str, str]) -> str:
    """A bar of colours with words below its lower end, middle and upper end."""
    stops = "".join(
        f'<stop offset="{share:.2f}" stop-color="{colours.hexadecimal(share)}"/>' for share in np.linspace(0, 1, 9)
    )
    ends = zip(words, (8, 180, 352), ("start", "middle", "end"), strict=True)
    text = "".join(f'<text x="{x}" y="20" text-anchor="{anchor}" {_TEXT}>{word}</text>' for word, x, anchor in ends)
    fill = f'<defs><linearGradient id="{name}">{stops}</linearGradient></defs>'
    return f'{fill}<rect x="8" y="2" width="344" height="8" fill="url(#{name})"/>{text}'


def _keys(colours: dict[str, str]) -> str:
    """Short lines of colours with their names in a row."""
    # room by the length of the name, and as much again as five letters for the line
    letters = np.cumsum([0, *(len(name) + 5 for name in colours)])
    starts = 8 + 352 * letters / letters[-1]
    return "".join(
        f'<path d="M{x:.0f},12h12" stroke="{colour}" stroke-width="3"/>'
        f'<text x="{x + 15:.0f}" y="15" {_TEXT}>{name}</text>'
        for x, (name, colour) in zip(starts[:-1], colours.items(), strict=True)
    )


def _counts(fan: RayFan) -> str:
    counts = ", ".join(f"{count} {name}" for name, count in fan.status_counts.items())
    return f"{len(fan.points)} rays" + (f" ({counts})" if counts else ": no part of the line launches any")


def with_title(page: str, title: str) -> str:
    """A page of viser with another title."""
    return page.replace(PLAIN, f"<title>{html.escape(title)}</title>", 1)


@contextmanager
def titled(title: str) -> Iterator[None]:
    """Name the page of the server that is started inside; behind the door, which looks at requests first."""
    serve: Callable[..., Any] = websocket_server.serve

    def renamed(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        def answer(connection: Any, request: Request) -> Response | None:
            index = request.path.partition("?")[0] in ("/", "/index.html")
            if index and "Accept-Encoding" in request.headers:
                # to be changed it must come uncompressed
                del request.headers["Accept-Encoding"]
            found: Response | None = process_request(connection, request)
            if index and found is not None and found.body and found.headers.get("Content-Type", "").startswith("text/"):
                found.body = with_title(bytes(found.body).decode(), title).encode()
                del found.headers["Content-Length"]
                found.headers["Content-Length"] = str(len(found.body))
            return found

        return serve(*arguments, process_request=answer, **options)

    websocket_server.serve = renamed  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websocket_server.serve = serve  # type: ignore[misc, assignment]
