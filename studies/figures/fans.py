"""Creeping rays and iso-phase curves, on the body and over its angles: Figure 6 and point sources."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.plotting._drawing import Drawing
from creeping.plotting.pages import new_figure
from studies.figures import drawing

TWISTED, TORUS = sc.TwistedEllipsoid(a=0.5, b=0.5, c=1.0, d=0.2), sc.Torus(R=1.0, r=0.5)
LENGTH, SPACING = 1.5, 0.25
"""Of rays, and between iso-phase curves."""
LEVELS = drawing.equal_times(SPACING, LENGTH)[1:]


def creeping(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 6: creeping rays and iso-phase curves on the twisted ellipsoid, d = (1, 1, 1) and (1, 0, 0).

        F = x^2/a^2 + (y - d cos(pi z))^2/b^2 + z^2/c^2 - 1,   a = b = 0.5, c = 1, d = 0.2

    Rays start on the shadow line n.d = 0 with p = d, and are carried by the phase map; an iso-phase curve joins the
    points of equal travel time [YC06b]. (theta, phi) are the spherical angles of (x/a, (y - d cos(pi z))/b, z/c). Where
    the body is not convex along a ray (kappa_n <= 0), the ray is detached: it goes on as a geodesic, drawn faint. Rays
    get paler every 10 dB (hard, k rho = 10) and end at 30 dB or their second caustic. A
    pole of the angles is the whole edge theta = 0 or 180 degrees: the shadow line of (1, 0, 0) passes through both.
    """
    incidences = ((1, 1, 1), (1, 0, 0))
    flow = cr.build_phase_map(TWISTED, tolerance=1e-4 if quick else 1e-6)
    lines = [cr.shadow_line(TWISTED, d) for d in incidences]
    fans = [cr.launch(flow, line, length=LENGTH, n_rays=64 if quick else 512) for line in lines]
    figure = new_figure((7.8, 6.0))
    # levels that rays meet before they have faded by 30 dB at k rho = 10
    drawings, early = [], LEVELS[:-1]
    for row, (fan, d) in enumerate(zip(fans, incidences, strict=True)):
        bottom = 0.525 - 0.46 * row
        places = (0.0, bottom, 0.36, 0.41), (0.425, bottom + 0.075, 0.455, 0.32)
        drawings.append(_pair(figure, fan, cr.iso_phase_curves(fan, early), *places, until=None))
        name = f"$d$ = ({', '.join(map(str, d))})"
        drawing.panel(figure, "ac"[row], f"{name}, on the body", (0.01, bottom + 0.425))
        drawing.panel(figure, "bd"[row], f"{name}, over the angles", (0.38, bottom + 0.425))
    first = [float(fan.detachment.min()) if np.isfinite(fan.detachment).any() else None for fan in fans]
    told = {"directions": incidences, "launched": "attached", "earliest_detachment": first}
    return _finished(path, quick, figure, drawings, fans, flow, (0.905, 0.31, 0.016, 0.42), told, early)


def torus(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 6, torus: creeping rays and iso-phase curves for d = (1, 1, 1), from all or part of the shadow line.

    The torus R = 1, r = 0.5 has two shadow curves for this incidence. [YC06b] launches from every point of both. Where
    the inner curve lies behind the body (occluded) or on a part that is hollow along d (kappa_n(d) <= 0) no incident
    ray grazes the body, so no creeping ray starts: on the right only attached points launch. Rays are drawn faint where
    they are detached. (theta, psi) as in x = ((R + r cos theta) cos psi, (R + r cos theta) sin psi, r sin theta).
    """
    launched = {"all": "all of the shadow line launches", "attached": "attached points launch"}
    flow = cr.build_phase_map(TORUS, tolerance=1e-4 if quick else 1e-6)
    line = cr.shadow_line(TORUS, (1, 1, 1))
    asked: dict[str, Any] = {"length": LENGTH, "n_rays": 64 if quick else 768}
    fans = [cr.launch(flow, line, launch_from=status, **asked) for status in launched]
    figure = new_figure((8.4, 6.2))
    drawings = []
    for column, (fan, text) in enumerate(zip(fans, launched.values(), strict=True)):
        left = 0.45 * column
        places = (left, 0.575, 0.44, 0.385), (left + 0.085, 0.115, 0.34, 0.45)
        drawings.append(_pair(figure, fan, cr.iso_phase_curves(fan, LEVELS), *places))
        drawing.panel(figure, "ab"[column], text, (left + 0.01, 0.965))
    told = {"direction": (1, 1, 1), "launched": list(launched), "shadow_line": line.fractions}
    return _finished(path, quick, figure, drawings, fans, flow, (0.915, 0.25, 0.016, 0.5), told)


Place = tuple[float, float, float, float]
"""Of axes in a figure."""


def _pair(
    figure: Any,
    fan: cr.RayFan,
    curves: Sequence[cr.IsoPhaseCurve],
    body: Place,
    angles: Place,
    until: float | None = np.inf,
) -> Drawing:
    """Draw a fan on the body and over its angles."""
    drawn = drawing.on_body(figure.add_axes(body, projection="3d"), fan, curves, until)
    drawing.in_parameters(figure.add_axes(angles), fan, curves, until)
    return drawn


def _finished(
    path: Path,
    quick: bool,
    figure: Any,
    drawings: Sequence[Drawing],
    fans: Sequence[cr.RayFan],
    flow: cr.PhaseMap,
    bar: Place,
    told: dict[str, Any],
    levels: FloatArray = LEVELS,
) -> dict[str, Any]:
    """Add the keys of all panels, write the figure and return its card."""
    drawing.add_legend(figure, drawings)
    label = f"iso-phase curves: {drawings[0].colours.name} $t$"
    drawing.add_level_bar(figure, drawings[0].colours, levels, label, cax=figure.add_axes(bar))
    figure.savefig(path, dpi=100 if quick else 300)
    told |= {"rays": [len(fan.points) for fan in fans], "levels": levels.tolist()}
    return drawing.rays_card(flow, drawing.fans_error(fans), LENGTH, **told)


def sources(path: Path, quick: bool) -> dict[str, Any]:
    """Creeping rays and wave fronts of point sources above the twisted ellipsoid and a torus.

        n.(x - x_s) = 0,   p = (x - x_s)/R,   eikonal R + t

    Rays start on the shadow line of the source along the direction from it; an iso-phase curve joins points of one
    eikonal, the distance R from the source to the line and the arclength t from there. Parts of the line that lie
    behind the body (occluded) or on hollow ground (concave) send no rays, and rays are drawn faint where they are
    detached.
    """
    figure = new_figure((8.2, 6.4))
    drawings, fans, cards, errors = [], [], {}, {}
    cases: dict[str, tuple[Any, tuple[float, float, float]]] = {
        "twisted ellipsoid": (TWISTED, (0.9, 0.5, 0.9)),
        "torus": (TORUS, (1.5, 0.6, 0.9)),
    }
    for row, (name, (body, source)) in enumerate(cases.items()):
        flow = cr.build_phase_map(body, tolerance=1e-4 if quick else 1e-6)
        line = cr.shadow_line(body, source=cr.PointSource(source))
        fan = cr.launch(flow, line, length=LENGTH, n_rays=64 if quick else 512)
        fronts = fronts_of(fan)
        bottom = 0.55 - 0.46 * row
        drawings.append(_pair(figure, fan, fronts, (0.0, bottom, 0.40, 0.42), (0.47, bottom + 0.08, 0.40, 0.31)))
        at = f"$x_s$ = ({', '.join(map(str, source))})"
        drawing.panel(figure, "ac"[row], f"{name}, {at}", (0.01, bottom + 0.425))
        drawing.panel(figure, "bd"[row], "the same over the angles", (0.42, bottom + 0.425))
        levels = np.unique([curve.level for curve in fronts])
        place = figure.add_axes((0.905, bottom + 0.08, 0.014, 0.31))
        drawing.add_level_bar(figure, drawings[-1].colours, levels, "iso-phase curves: $R + t$", cax=place)
        points = np.concatenate([curve.points for curve in fan.line.curves])
        away = points - np.array(source)
        steep = body.gradient(points)
        sine = np.sum(steep * away, axis=1) / np.linalg.norm(steep, axis=1) / np.linalg.norm(away, axis=1)
        told = {"source": source, "rays": len(fan.points), "shadow_line": fan.line.fractions}
        cards[name] = told | drawing.map_card(flow)
        errors[name] = drawing.rays_card(flow, fan.error, LENGTH)["error"]
        errors[name]["largest_grazing_angle"] = float(np.degrees(np.abs(sine).max()))
        fans.append(fan)
    drawing.add_legend(figure, drawings)
    figure.savefig(path, dpi=100 if quick else 300)
    rays, bodies = drawing.fans_error(fans), [repr(body) for body, _ in cases.values()]
    return {
        "parameters": {"bodies": bodies, "cases": cards, "time": LENGTH, "levels_apart": SPACING},
        "error": errors,
        "headline": f"rays at t = {LENGTH:g}: rms {rays.rms:.1e}, max {rays.max:.1e} ({rays.samples} traced)",
    }


def fronts_of(fan: cr.RayFan) -> list[cr.IsoPhaseCurve]:
    """Iso-phase curves at multiples of the spacing, as far as all of the line's distances have been passed."""
    first = fan.eikonal[:, 0]
    levels = SPACING * np.arange(np.ceil(first.min() / SPACING), np.floor((first.max() + LENGTH) / SPACING) + 1)
    return cr.iso_phase_curves(fan, levels, of="eikonal")
