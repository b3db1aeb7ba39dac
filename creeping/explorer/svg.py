"""The two plane pictures of the page as SVG: (theta, phi) of the body's points, and the far-field cut.

Written as text, since they follow the incidence: a picture of matplotlib takes a quarter of a second.
"""

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.explorer.preview import Preview, requested_curves
from creeping.explorer.refined import Refined
from creeping.explorer.request import ViewRequest, far_levels, far_name
from creeping.explorer.wave import LEVEL_COLOURS
from creeping.field.comparison import shown_range
from creeping.field.far_result import FarField
from creeping.plotting._strokes import RAY_COLOUR, STATUS_COLOURS, line_pieces
from creeping.plotting.far_cuts import component_name
from creeping.plotting.line_plots import is_torus
from creeping.plotting.pages import COLOURS, EXACT
from creeping.rays.fan import RayFan
from creeping.rays.isophase import split_at_seam

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 360.0, 40.0, 13.0, 8.0, 34.0
"""Of a picture and its margins, in units of the drawing."""
DRAWN = 48
"""Rays drawn at most."""
PARTS = ("creeping", "reflected", "dark", "lit")
"""Curves of a cut that are parts of another."""
DASHES = ("", "5,2", "1.5,1.5")
STATUS_DASHES = {"attached": "", "occluded": "6,2", "concave": "2,2"}
SPAN = 60.0
"""Of the far-field cut, dB."""


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
        text = 'font-size="11" font-family="sans-serif" fill="#333"'
        for value in x_ticks:
            x, _ = self.place(np.array([[value, self.y[0]]]))[0]
            out.append(f'<path d="M{x:.1f},{high}v-3" stroke="#555"/>')
            out.append(f'<text x="{x:.1f}" y="{high + 13}" text-anchor="middle" {text}>{value:g}</text>')
        for value in y_ticks:
            _, y = self.place(np.array([[self.x[0], value]]))[0]
            out.append(f'<path d="M{LEFT},{y:.1f}h3" stroke="#555"/>')
            out.append(f'<text x="{LEFT - 3}" y="{y + 4:.1f}" text-anchor="end" {text}>{value:g}</text>')
        middle = (low + high) / 2
        out.append(f'<text x="{WIDTH / 2}" y="{self.height - 6}" text-anchor="middle" {text}>{x_name}</text>')
        turned = f'transform="rotate(-90 10 {middle:.1f})"'
        out.append(f'<text x="10" y="{middle:.1f}" text-anchor="middle" {turned} {text}>{y_name}</text>')
        return "".join(out)


def plane_svg(found: Refined) -> str:
    """Shadow line, rays and iso-phase curves over (phi, theta), degrees."""
    lines = {status: line_pieces(found.line, status) for status in STATUS_COLOURS}
    body, fan = found.fan.body, found.fan
    rays = _flat(body.parameters(fan.points[k]) for k in _some(fan, DRAWN))
    curves = [
        (curve.level / fan.length, [np.degrees(piece[:, ::-1]) for piece in curve.parameter_pieces])
        for curve in requested_curves(found.request, fan)
    ]
    flat = {status: _flat(body.parameters(piece) for piece in pieces) for status, pieces in lines.items()}
    return _plane(is_torus(found.line), rays, curves, flat)


def preview_plane_svg(frame: Preview) -> str:
    """The same while the hand moves: fewer rays and points, of the line what is attached, gaps at the seam."""
    body, fan = frame.fan.body, frame.fan
    chosen = _some(fan, DRAWN // 2)
    rays = _broken(body.parameters(fan.points[chosen, ::2])) if len(chosen) else []
    curves = []
    for curve in frame.curves:
        points = curve.parameters[:: 1 + len(curve.parameters) // 100]
        if curve.closed:
            points = np.concatenate([points, points[:1]])
        curves.append((curve.level / fan.length, _broken(points[None])))
    line = [piece for arc in frame.launch_arcs for piece in _broken(body.parameters(arc)[None])]
    return _plane(is_torus(fan.line), rays, curves, {"attached": line})


Pieces = list[FloatArray]


def _plane(torus: bool, rays: Pieces, curves: list[tuple[float, Pieces]], lines: dict[str, Pieces]) -> str:
    """Pieces (k, 2) of rays, of curves by the share of their level, and of lines by status: phi and theta, degrees."""
    axes = _Axes((-180, 180), (-180, 180) if torus else (180, 0), WIDTH if torus else 0.56 * WIDTH)
    parts = [axes.lines(rays, RAY_COLOUR, 0.5, 0.6)]
    parts += [axes.lines(pieces, LEVEL_COLOURS.hexadecimal(share), 0.9) for share, pieces in curves]
    parts += [axes.lines(p, STATUS_COLOURS[s], 1.8, dashes=STATUS_DASHES[s]) for s, p in lines.items()]
    return _picture("plane", axes.height, [*parts, _plane_frame(torus)])


@cache
def _plane_frame(torus: bool) -> str:
    axes = _Axes((-180, 180), (-180, 180) if torus else (180, 0), WIDTH if torus else 0.56 * WIDTH)
    ticks = range(-180, 181, 90) if torus else range(0, 181, 45)
    return axes.frame(range(-180, 181, 60), ticks, ("psi" if torus else "phi") + " (degrees)", "theta (degrees)")


def _some(fan: RayFan, most: int) -> IntArray:
    """Numbers of rays, evenly spread."""
    return np.unique(np.linspace(0, len(fan.points) - 1, min(most, len(fan.points))).astype(np.intp))


def cut_svg(request: ViewRequest, angles: FloatArray, far: FarField | None) -> str:
    """Far field in dB over theta (m,), degrees, unresolved directions as circles; empty for a weighted body."""
    if far is None:
        return ""
    curves = _cut_curves(far)
    levels = {name: far_levels(request, values) for name, values in curves.items()}
    whole = [levels[name] for name in levels if name not in PARTS]
    low, high = shown_range(whole, SPAN, step=10.0)
    axes = _Axes((-180, 180), (low, high), 0.56 * WIDTH)
    doubt = far.unresolved
    runs = np.split(np.arange(len(doubt)), np.flatnonzero(np.diff(doubt)) + 1)
    parts, across = [], LEFT + 8.0
    for number, name in reversed(list(enumerate(levels))):
        inside = np.stack([angles, np.clip(np.nan_to_num(levels[name], nan=low), low, high)], axis=1)
        colour, dashes = (EXACT if number == 0 else COLOURS[number - 1]), DASHES[number]
        if name in PARTS:
            parts.append(axes.lines([inside], colour, 0.8, dashes=dashes))
            continue
        # what is not resolved is no curve
        parts.append(axes.lines([inside[run] for run in runs if not doubt[run[0]]], colour, 1.2, dashes=dashes))
        parts += [
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.5" fill="none" stroke="#888"/>'
            for x, y in axes.place(inside[doubt])
        ]
    for number, name in enumerate(levels):
        colour = EXACT if number == 0 else COLOURS[number - 1]
        dash = f' stroke-dasharray="{DASHES[number]}"' if DASHES[number] else ""
        parts.append(f'<path d="M{across:.0f},{TOP + 8}h16" stroke="{colour}" stroke-width="1.2"{dash}/>')
        label = f'x="{across + 19:.0f}" y="{TOP + 11}" font-size="11" font-family="sans-serif"'
        parts.append(f'<text {label} fill="#333">{name}</text>')
        across += 80
    ticks = np.arange(low, high + 1, 20.0 if high - low > 40 else 10.0)
    frame = axes.frame(
        range(-180, 181, 60), ticks.tolist(), f"theta (degrees), phi = {request.cut:g}", far_name(request)
    )
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


def _flat(curves: Iterable[FloatArray]) -> list[FloatArray]:
    """Pieces (phi, theta) in degrees of curves of parameters, cut at the seam."""
    return [np.degrees(p[:, ::-1]) for curve in curves for p in split_at_seam(curve, closed=False)]


def _picture(name: str, height: float, parts: Iterable[str]) -> str:
    box = f'viewBox="0 0 {WIDTH:g} {height:g}" width="100%"'
    return f'<svg id="{name}" xmlns="http://www.w3.org/2000/svg" {box}>{"".join(parts)}</svg>'
