"""Creeping rays and iso-phase curves, on the body and over its angles: Figure 6 and point sources."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.plotting._drawing import Drawing
from creeping.plotting.pages import new_figure
from studies.figures.drawing import (
    add_legend,
    add_level_bar,
    equal_times,
    fans_error,
    in_parameters,
    map_card,
    on_body,
    panel,
    rays_card,
)

TWISTED, TORUS = sc.TwistedEllipsoid(a=0.5, b=0.5, c=1.0, d=0.2), sc.Torus(R=1.0, r=0.5)
LENGTH, SPACING = 1.5, 0.25
"""Of rays, and between iso-phase curves."""
LEVELS = equal_times(SPACING, LENGTH)[1:]
DISTANCES = (1.05, 1.5, 3.0, 30.0)
"""Of sources from the centre of a sphere, in its radii."""
HEIGHTS = (0.0, 0.7, 3.0)
"""Of sources on the axis of the torus, in its R."""


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
        panel(figure, "ac"[row], f"{name}, on the body", (0.01, bottom + 0.425))
        panel(figure, "bd"[row], f"{name}, over the angles", (0.38, bottom + 0.425))
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
        panel(figure, "ab"[column], text, (left + 0.01, 0.965))
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
    drawing = on_body(figure.add_axes(body, projection="3d"), fan, curves, until)
    in_parameters(figure.add_axes(angles), fan, curves, until)
    return drawing


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
    add_legend(figure, drawings)
    label = f"iso-phase curves: {drawings[0].colours.name} $t$"
    add_level_bar(figure, drawings[0].colours, levels, label, cax=figure.add_axes(bar))
    figure.savefig(path, dpi=100 if quick else 300)
    told |= {"rays": [len(fan.points) for fan in fans], "levels": levels.tolist()}
    return rays_card(flow, fans_error(fans), LENGTH, **told)


def sources(path: Path, quick: bool) -> dict[str, Any]:
    """Creeping rays and wave fronts of point sources above the twisted ellipsoid and a torus.

        n.(x - x_s) = 0,   p = (x - x_s)/R,   eikonal R + t

    Rays start on the shadow line of the source along the direction from it; an iso-phase curve joins points of one
    eikonal, the distance R from the source to the line and the arclength t from there. Parts of the line that lie
    behind the body (occluded) or on hollow ground (concave) send no rays, and rays are drawn faint where they are
    detached.

    Two lines have closed forms. From R_s off the centre of a sphere of radius a the line is the circle at the angle
    arccos(a/R_s) from the source, and the front of eikonal sqrt(R_s^2 - a^2) + t the circle t/a behind it. From the
    height h on the axis of a torus both curves are circles: h sin theta - R cos theta = r.
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
        panel(figure, "ac"[row], f"{name}, {at}", (0.01, bottom + 0.425))
        panel(figure, "bd"[row], "the same over the angles", (0.42, bottom + 0.425))
        levels = np.unique([curve.level for curve in fronts])
        place = figure.add_axes((0.905, bottom + 0.08, 0.014, 0.31))
        add_level_bar(figure, drawings[-1].colours, levels, "iso-phase curves: $R + t$", cax=place)
        points = np.concatenate([curve.points for curve in fan.line.curves])
        away = points - np.array(source)
        steep = body.gradient(points)
        sine = np.sum(steep * away, axis=1) / np.linalg.norm(steep, axis=1) / np.linalg.norm(away, axis=1)
        cards[name] = {"source": source, "rays": len(fan.points), "shadow_line": fan.line.fractions} | map_card(flow)
        errors[name] = rays_card(flow, fan.error, LENGTH)["error"]
        errors[name]["largest_grazing_angle"] = float(np.degrees(np.abs(sine).max()))
        fans.append(fan)
    add_legend(figure, drawings)
    figure.savefig(path, dpi=100 if quick else 300)
    sphere, torus, rays = sphere_errors(), torus_errors(), fans_error(fans)
    return {
        "parameters": {
            "bodies": [repr(body) for body, _ in cases.values()],
            "cases": cards,
            "time": LENGTH,
            "levels_apart": SPACING,
            "sphere_distances": DISTANCES,
            "torus_heights": HEIGHTS,
        },
        "error": errors | {"sphere": sphere, "torus_axis": torus},
        "headline": (
            f"shadow circles of spheres within {max(sphere['off']):.1e} degrees of arccos(a/R), fronts within "
            f"{max(sphere['front_off']):.1e}; of a torus within {max(torus['off']):.1e}; rays at t = {LENGTH:g}: rms "
            f"{rays.rms:.1e}, max {rays.max:.1e} ({rays.samples} traced)"
        ),
    }


def fronts_of(fan: cr.RayFan) -> list[cr.IsoPhaseCurve]:
    """Iso-phase curves at multiples of the spacing, as far as all of the line's distances have been passed."""
    first = fan.eikonal[:, 0]
    levels = SPACING * np.arange(np.ceil(first.min() / SPACING), np.floor((first.max() + LENGTH) / SPACING) + 1)
    return cr.iso_phase_curves(fan, levels, of="eikonal")


def sphere_errors() -> dict[str, list[float]]:
    """Shadow circles and fronts of sources over the unit sphere against their angles, degrees."""
    axis = np.array([2.0, 3.0, 6.0]) / 7
    found: dict[str, list[float]] = {"angle": [], "off": [], "front_off": []}
    for distance in DISTANCES:
        line = cr.shadow_line(sc.Sphere(), source=cr.PointSource(distance * axis))
        fan = cr.launch(cr.DirectFlow(line.body, rtol=1e-9), line, length=LENGTH, n_rays=16)
        exact = np.arccos(1 / distance)
        (front,) = cr.iso_phase_curves(fan, np.sqrt(distance**2 - 1) + 1.0, of="eikonal")
        points = np.concatenate([curve.points for curve in line.curves])
        found["angle"].append(float(np.degrees(exact)))
        for name, of, angle in (("off", points, exact), ("front_off", front.points, exact + 1.0)):
            # the sine and the cosine: arccos alone loses half the digits next to the source
            across = np.linalg.norm(np.cross(of, axis), axis=1)
            found[name].append(float(np.degrees(np.abs(np.arctan2(across, of @ axis) - angle).max())))
    return found


def torus_errors() -> dict[str, list[float]]:
    """Shadow circles of sources on the axis of the torus against their angles theta, degrees."""
    body = TORUS
    found: dict[str, list[float]] = {"inner": [], "outer": [], "off": []}
    for height in HEIGHTS:
        line = cr.shadow_line(body, source=cr.PointSource((0.0, 0.0, height * body.R)))
        h = height * body.R
        turn, part = np.arctan2(body.R, h), np.arcsin(body.r / np.hypot(body.R, h))
        exact = np.array([turn + part, turn + np.pi - part])
        off = []
        for curve in line.curves:
            x, y, z = curve.points.T
            theta = np.arctan2(z, np.hypot(x, y) - body.R)
            gap = np.abs(np.mod(theta[:, None] - exact + np.pi, 2 * np.pi) - np.pi)
            # each curve is one of the circles all the way round
            off.append(gap.max(axis=0).min())
        inner, outer = sorted(exact, key=np.cos)
        found["inner"].append(float(np.degrees(inner)))
        found["outer"].append(float(np.degrees(outer)))
        found["off"].append(float(np.degrees(max(off))))
    return found
