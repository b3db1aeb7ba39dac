"""The two plane pictures of the page as SVG: (theta, phi) of the body's points, and the far-field cut.

Written as text, since they follow the incidence: a picture of matplotlib takes a quarter of a second.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from creeping._typing import FloatArray
from creeping.explorer.colours import LEVEL_COLOURS
from creeping.explorer.preview import requested_curves
from creeping.explorer.refined import Refined
from creeping.field.decibels import cross_section_decibels, shown_range
from creeping.plotting._strokes import RAY_COLOUR, STATUS_COLOURS, status_pieces
from creeping.plotting.palette import COLOURS
from creeping.plotting.parameter_plane import is_torus
from creeping.rays.angle_seams import split_at_seam

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 360.0, 34.0, 8.0, 8.0, 30.0
"""Of a picture and its margins, in units of the drawing."""
DRAWN = 48
"""Rays drawn at most."""
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

    def line(self, points: FloatArray) -> str:
        """Path of a polyline of data (m, 2)."""
        return "M" + "L".join(f"{x:.1f},{y:.1f}" for x, y in self.place(points))

    def lines(self, pieces: Iterable[FloatArray], colour: str, width: float, opacity: float = 1.0) -> str:
        """All pieces as one element, nothing if there are none."""
        path = "".join(self.line(piece) for piece in pieces if len(piece) > 1)
        style = f'fill="none" stroke="{colour}" stroke-width="{width}" stroke-opacity="{opacity}"'
        return f'<path d="{path}" {style} stroke-linejoin="round"/>' if path else ""

    def frame(self, x_ticks: Sequence[float], y_ticks: Sequence[float], x_name: str, y_name: str) -> str:
        """Box, ticks and names."""
        low, high = TOP, self.height - BOTTOM
        size = f'width="{WIDTH - LEFT - RIGHT}" height="{high - low}"'
        out = [f'<rect x="{LEFT}" y="{TOP}" {size} fill="none" stroke="#555"/>']
        text = 'font-size="9" font-family="sans-serif" fill="#333"'
        for value in x_ticks:
            x, _ = self.place(np.array([[value, self.y[0]]]))[0]
            out.append(f'<path d="M{x:.1f},{high}v-3" stroke="#555"/>')
            out.append(f'<text x="{x:.1f}" y="{high + 11}" text-anchor="middle" {text}>{value:g}</text>')
        for value in y_ticks:
            _, y = self.place(np.array([[self.x[0], value]]))[0]
            out.append(f'<path d="M{LEFT},{y:.1f}h3" stroke="#555"/>')
            out.append(f'<text x="{LEFT - 3}" y="{y + 3:.1f}" text-anchor="end" {text}>{value:g}</text>')
        middle = (low + high) / 2
        out.append(f'<text x="{WIDTH / 2}" y="{self.height - 6}" text-anchor="middle" {text}>{x_name}</text>')
        turned = f'transform="rotate(-90 9 {middle:.1f})"'
        out.append(f'<text x="9" y="{middle:.1f}" text-anchor="middle" {turned} {text}>{y_name}</text>')
        return "".join(out)


def plane_svg(found: Refined) -> str:
    """Shadow line, rays and iso-phase curves over (phi, theta), degrees."""
    line, fan, body = found.line, found.fan, found.line.body
    torus = is_torus(line)
    axes = _Axes((-180, 180), (-180, 180) if torus else (180, 0), WIDTH if torus else 0.56 * WIDTH)
    chosen = np.unique(np.linspace(0, len(fan.points) - 1, min(DRAWN, len(fan.points))).astype(int))
    parts = [axes.lines(_flat(body.parameters(fan.points[k]) for k in chosen), RAY_COLOUR, 0.5, 0.6)]
    for curve in requested_curves(found.request, fan):
        pieces = [np.degrees(piece[:, ::-1]) for piece in curve.parameter_pieces]
        parts.append(axes.lines(pieces, LEVEL_COLOURS.hexadecimal(curve.level / fan.length), 0.9))
    for status, colour in STATUS_COLOURS.items():
        drawn = [piece for c in line.curves for piece in status_pieces(c.points, c.status, status)]
        parts.append(axes.lines(_flat(body.parameters(piece) for piece in drawn), colour, 1.8))
    ticks = range(-180, 181, 90) if torus else range(0, 181, 45)
    frame = axes.frame(range(-180, 181, 60), ticks, ("psi" if torus else "phi") + " (degrees)", "theta (degrees)")
    return _picture("plane", axes.height, [*parts, frame])


def cut_svg(found: Refined) -> str:
    """Far field in dB over theta, unresolved directions as circles; empty for a weighted body."""
    if found.far is None:
        return ""
    curves = {
        "total": found.far.total,
        "creeping": found.far.creeping,
        "reflected": found.far.reflected,
    }
    levels = {name: cross_section_decibels(values) for name, values in curves.items()}
    low, high = shown_range([levels["total"]], SPAN, step=10.0)
    axes = _Axes((-180, 180), (low, high), 0.56 * WIDTH)
    parts = []
    for number, name in reversed(list(enumerate(levels))):
        inside = np.stack([found.cut_angles, np.clip(levels[name], low, high)], axis=1)
        colour = "#111111" if name == "total" else COLOURS[number - 1]
        if name == "total":
            # what is not resolved is no curve
            doubt = found.far.unresolved
            runs = np.split(np.arange(len(doubt)), np.flatnonzero(np.diff(doubt)) + 1)
            parts.append(axes.lines([inside[run] for run in runs if not doubt[run[0]]], colour, 1.2))
            parts += [
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.5" fill="none" stroke="#888"/>'
                for x, y in axes.place(inside[doubt])
            ]
        else:
            parts.append(axes.lines([inside], colour, 0.8))
        label = f'x="{LEFT + 8 + 60 * number}" y="{TOP + 11}" font-size="9" font-family="sans-serif"'
        parts.append(f'<text {label} fill="{colour}">{name}</text>')
    ticks = np.arange(low, high + 1, 20.0 if high - low > 40 else 10.0)
    frame = axes.frame(
        range(-180, 181, 60), ticks.tolist(), f"theta (degrees), phi = {found.request.cut:g}", "dB of 4π|f|²"
    )
    return _picture("cut", axes.height, [*parts, frame])


def _flat(curves: Iterable[FloatArray]) -> list[FloatArray]:
    """Pieces (phi, theta) in degrees of curves of parameters, cut at the seam."""
    return [np.degrees(p[:, ::-1]) for curve in curves for p in split_at_seam(curve, closed=False)]


def _picture(name: str, height: float, parts: Iterable[str]) -> str:
    box = f'viewBox="0 0 {WIDTH:g} {height:g}" width="100%"'
    return f'<svg id="{name}" xmlns="http://www.w3.org/2000/svg" {box}>{"".join(parts)}</svg>'
