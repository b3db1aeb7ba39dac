"""What stands beside the picture in space: two plane pictures as SVG, the legend, and the numbers as short Markdown.

The plane pictures, (theta, phi) of the body's points and the far-field cut, are written as text, since they follow the
incidence: a picture of matplotlib takes a quarter of a second.
"""

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping._version import __version__
from creeping.explorer.frames import Preview, Refined, requested_curves
from creeping.explorer.request import ViewRequest, far_levels, far_name, wave_text
from creeping.explorer.scene import ENDED, FIELD_COLOURS, LEVEL_COLOURS, WAVE_COLOURS, Bytes, Span, coloured
from creeping.field.results.comparison import shown_range
from creeping.field.results.far_result import FarField
from creeping.field.tmatrix.result import METHOD
from creeping.field.validity_range import WITHIN, Validity, validity_words
from creeping.geometry.checks import unit_of
from creeping.plotting._strokes import RAY_COLOUR, STATUS_COLOURS, line_pieces
from creeping.plotting.far_cuts import component_name
from creeping.plotting.line_plots import is_torus
from creeping.plotting.pages import COLOURS, EXACT
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve

_TEXT = 'font-size="11" font-family="sans-serif" fill="#333"'
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 360.0, 40.0, 13.0, 8.0, 34.0
"""Of a picture and its margins, in units of the drawing."""
PARTS = ("creeping", "reflected", "dark", "lit")
"""Curves of a cut that are parts of another."""
DASHES = ("", "5,2", "1.5,1.5")


class _Axes:
    """Linear axes: data to drawing."""

    def __init__(self, x: tuple[float, float], y: tuple[float, float], height: float) -> None:
        self.x, self.y, self.height = x, y, height

    def place(self, points: FloatArray) -> FloatArray:
        """Data (m, 2) to the drawing (m, 2)."""
        across = LEFT + (points[:, 0] - self.x[0]) / (self.x[1] - self.x[0]) * (WIDTH - LEFT - RIGHT)
        tall = self.height - TOP - BOTTOM
        return np.stack([across, TOP + (self.y[1] - points[:, 1]) / (self.y[1] - self.y[0]) * tall], axis=1)

    def lines(
        self, pieces: Iterable[FloatArray], colour: str, width: float, opacity: float = 1.0, dashes: str = ""
    ) -> str:
        """All pieces as one element, nothing if there are none."""
        kept = [piece for piece in pieces if len(piece) > 1]
        if not kept:
            return ""
        # all at once: each small array costs as much as a hundred points
        places = np.round(self.place(np.concatenate(kept)), 1).tolist()
        texts, path, first = [f"{x:.5g},{y:.5g}" for x, y in places], "", 0
        for piece in kept:
            path += "M" + "L".join(texts[first : first + len(piece)])
            first += len(piece)
        style = f'fill="none" stroke="{colour}" stroke-width="{width}" stroke-opacity="{opacity}"'
        if dashes:
            style += f' stroke-dasharray="{dashes}"'
        return f'<path d="{path}" {style} stroke-linejoin="round"/>'

    def frame(self, x_ticks: Sequence[float], y_ticks: Sequence[float], x_name: str, y_name: str) -> str:
        """Box, ticks and names."""
        low, high = TOP, self.height - BOTTOM
        size = f'width="{WIDTH - LEFT - RIGHT}" height="{high - low}"'
        out = [f'<rect x="{LEFT}" y="{TOP}" {size} fill="none" stroke="#555"/>']
        for value in x_ticks:
            x, _ = self.place(np.array([[value, self.y[0]]]))[0]
            out.append(f'<path d="M{x:.1f},{high}v-3" stroke="#555"/>')
            out.append(f'<text x="{x:.1f}" y="{high + 13}" text-anchor="middle" {_TEXT}>{value:g}</text>')
        for value in y_ticks:
            _, y = self.place(np.array([[self.x[0], value]]))[0]
            out.append(f'<path d="M{LEFT},{y:.1f}h3" stroke="#555"/>')
            out.append(f'<text x="{LEFT - 3}" y="{y + 4:.1f}" text-anchor="end" {_TEXT}>{value:g}</text>')
        middle = (low + high) / 2
        out.append(f'<text x="{WIDTH / 2}" y="{self.height - 6}" text-anchor="middle" {_TEXT}>{x_name}</text>')
        turned = f'transform="rotate(-90 10 {middle:.1f})"'
        out.append(f'<text x="10" y="{middle:.1f}" text-anchor="middle" {turned} {_TEXT}>{y_name}</text>')
        return "".join(out)


def plane_svg(found: Refined) -> str:
    """Shadow line, rays and iso-phase curves over (phi, theta), degrees, with gaps of a step at the seam."""
    lines = {status: line_pieces(found.line, status) for status in STATUS_COLOURS}
    return _plane(found.fan, requested_curves(found.request, found.fan), lines, rays=48)


def preview_plane_svg(frame: Preview) -> str:
    """The same while the hand moves: fewer rays and points, of the line what is attached."""
    return _plane(frame.fan, frame.curves, {"attached": frame.launch_arcs}, rays=24, most=100)


def _plane(
    fan: RayFan, curves: Sequence[IsoPhaseCurve], lines: dict[str, list[FloatArray]], rays: int, most: int | None = None
) -> str:
    """So many rays, curves of ``most`` points, and lines by status (n, 3) over the parameters."""
    body, torus = fan.body, is_torus(fan.line)
    axes = _Axes((-180, 180), (-180, 180) if torus else (180, 0), WIDTH if torus else 0.56 * WIDTH)
    count = len(fan.points)
    chosen = np.unique(np.linspace(0, count - 1, min(rays, count)).astype(int))
    drawn = _broken(body.parameters(fan.points[chosen, :: 2 if most else 1])) if count else []
    parts = [axes.lines(drawn, RAY_COLOUR, 0.5, 0.6)]
    for curve in curves:
        points = curve.parameters[:: 1 + len(curve.parameters) // (most or len(curve.parameters) + 1)]
        if curve.closed:
            points = np.concatenate([points, points[:1]])
        parts.append(axes.lines(_broken(points[None]), _hex(LEVEL_COLOURS, curve.level / fan.length), 0.9))
    dashes = {"attached": "", "occluded": "6,2", "concave": "2,2"}
    for status, arcs in lines.items():
        pieces = [piece for arc in arcs for piece in _broken(body.parameters(arc)[None])]
        parts.append(axes.lines(pieces, STATUS_COLOURS[status], 1.8, dashes=dashes[status]))
    return _picture("plane", axes.height, [*parts, _plane_frame(torus)])


@cache
def _plane_frame(torus: bool) -> str:
    axes = _Axes((-180, 180), (-180, 180) if torus else (180, 0), WIDTH if torus else 0.56 * WIDTH)
    ticks = range(-180, 181, 90) if torus else range(0, 181, 45)
    return axes.frame(range(-180, 181, 60), ticks, ("psi" if torus else "phi") + " (degrees)", "theta (degrees)")


def cut_svg(request: ViewRequest, angles: FloatArray, far: FarField | None) -> str:
    """Far field in dB over theta (m,), degrees, unresolved directions as circles; empty for a weighted body."""
    if far is None:
        return ""
    curves = _cut_curves(far)
    levels = {name: far_levels(request, values) for name, values in curves.items()}
    whole = [levels[name] for name in levels if name not in PARTS]
    low, high = shown_range(whole, 60.0, step=10.0)
    axes = _Axes((-180, 180), (low, high), 0.56 * WIDTH)
    doubt = far.unresolved
    runs = np.split(np.arange(len(doubt)), np.flatnonzero(np.diff(doubt)) + 1)
    parts, across = [], LEFT + 8.0
    colours = dict(zip(levels, (EXACT, *COLOURS), strict=False))
    for number, name in reversed(list(enumerate(levels))):
        inside = np.stack([angles, np.clip(np.nan_to_num(levels[name], nan=low), low, high)], axis=1)
        colour, dashes = colours[name], DASHES[number]
        if name in PARTS:
            parts.append(axes.lines([inside], colour, 0.8, dashes=dashes))
            continue
        # what is not resolved is no curve
        parts.append(axes.lines([inside[run] for run in runs if not doubt[run[0]]], colour, 1.2, dashes=dashes))
        circle = '<circle cx="{:.1f}" cy="{:.1f}" r="1.5" fill="none" stroke="#888"/>'
        parts += [circle.format(x, y) for x, y in axes.place(inside[doubt])]
    for number, name in enumerate(levels):
        dash = f' stroke-dasharray="{DASHES[number]}"' if DASHES[number] else ""
        parts.append(f'<path d="M{across:.0f},{TOP + 8}h16" stroke="{colours[name]}" stroke-width="1.2"{dash}/>')
        parts.append(f'<text x="{across + 19:.0f}" y="{TOP + 11}" {_TEXT}>{name}</text>')
        across += 80
    ticks = np.arange(low, high + 1, 20.0 if high - low > 40 else 10.0)
    by = ", by the T-matrix" * (far.method.tolist()[:1] == [METHOD])
    across_name = f"theta (degrees), phi = {request.cut:g}{by}"
    frame = axes.frame(range(-180, 181, 60), ticks.tolist(), across_name, far_name(request))
    return _picture("cut", axes.height, [*parts, frame])


def _cut_curves(far: FarField) -> dict[str, ComplexArray]:
    """What a cut draws: of a conductor both copolarised components."""
    if far.total.ndim > 1:
        return {component_name("tt"): far.total[:, 0, 0], component_name("pp"): far.total[:, 1, 1]}
    return {"total": far.total} | {name: far.parts[name] for name in PARTS if name in far.parts}


def _broken(parameters: FloatArray) -> list[FloatArray]:
    """The same of curves of n points each (m, n, 2), with a gap where an angle jumps from one end to the other."""
    flat = np.degrees(parameters[..., ::-1])
    jumps = np.any(np.abs(np.diff(flat, axis=1)) > 180, axis=2)
    # what is not finite is left out
    jumps |= ~np.all(np.isfinite(flat[:, 1:]), axis=2)
    whole = np.flatnonzero(~jumps.any(axis=1))
    pieces = list(flat[whole])
    for k in np.flatnonzero(jumps.any(axis=1)):
        ends = [0, *(np.flatnonzero(jumps[k]) + 1).tolist(), flat.shape[1]]
        pieces += [flat[k, a:b] for a, b in pairwise(ends) if b - a > 1]
    return [piece for piece in pieces if np.isfinite(piece[0, 0])]


def _picture(name: str, height: float, parts: Iterable[str]) -> str:
    box = f'viewBox="0 0 {WIDTH:g} {height:g}" width="100%"'
    return f'<svg id="{name}" xmlns="http://www.w3.org/2000/svg" {box}>{"".join(parts)}</svg>'


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
    rows.append(_keys(line | {"outline": RAY_COLOUR, "no ray": f"#{bytes(ENDED).hex()}"}))
    if not still:
        # handles, in the colours that they have on the page
        rows.append(_keys({"arc: tilts d": "#ff2060", "tilts d": "#20df80", "turns d about itself": "#2080ff"}))
    placed = (f'<g transform="translate(0 {24 * number})">{row}</g>' for number, row in enumerate(rows))
    return _picture("bar", 24 * len(rows), placed)


def _bar(name: str, colours: Bytes, words: tuple[str, str, str]) -> str:
    """A bar of colours with words below its lower end, middle and upper end."""
    shares = np.linspace(0, 1, 9)
    stops = "".join(f'<stop offset="{share:.2f}" stop-color="{_hex(colours, share)}"/>' for share in shares)
    ends = zip(words, (8, 180, 352), ("start", "middle", "end"), strict=True)
    text = "".join(f'<text x="{x}" y="20" text-anchor="{anchor}" {_TEXT}>{word}</text>' for word, x, anchor in ends)
    fill = f'<defs><linearGradient id="{name}">{stops}</linearGradient></defs>'
    return f'{fill}<rect x="8" y="2" width="344" height="8" fill="url(#{name})"/>{text}'


def _hex(table: Bytes, share: float) -> str:
    """One colour as text."""
    return f"#{coloured(table, np.array(share)).tobytes().hex()}"


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
