"""Creeping rays and wave fronts of point sources above the twisted ellipsoid and a torus.

    n.(x - x_s) = 0,   p = (x - x_s)/R,   eikonal R + t

Rays start on the shadow line of the source along the direction from it; an iso-phase curve joins points of one eikonal,
the distance R from the source to the line and the arclength t from there. Parts of the line that lie behind the body
(occluded) or on hollow ground (concave) send no rays, and rays are drawn faint where they are detached.

Two lines have closed forms. From R_s off the centre of a sphere of radius a the line is the circle at the angle
arccos(a/R_s) from the source, and the front of eikonal sqrt(R_s^2 - a^2) + t the circle t/a behind it. From the height
h on the axis of a torus both curves are circles: h sin theta - R cos theta = r.
"""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any
from studies._curves import add_level_bar
from studies._fans import add_legend, in_parameters, on_body
from studies._measured import error_card, fans_error, map_card

CASES: tuple[tuple[str, Any, tuple[float, float, float]], ...] = (
    ("twisted ellipsoid", sc.TwistedEllipsoid(a=0.5, b=0.5, c=1.0, d=0.2), (0.9, 0.5, 0.9)),
    ("torus", sc.Torus(R=1.0, r=0.5), (1.5, 0.6, 0.9)),
)
LENGTH = 1.5
SPACING = 0.25
DISTANCES = (1.05, 1.5, 3.0, 30.0)
"""Of sources from the centre of a sphere, in its radii."""
HEIGHTS = (0.0, 0.7, 3.0)
"""Of sources on the axis of the torus, in its R."""


def fan_of(flow: cr.PhaseMap, source: tuple[float, float, float], rays: int) -> cr.RayFan:
    """Rays of a source."""
    return cr.launch(flow, cr.shadow_line(flow.body, source=cr.PointSource(source)), length=LENGTH, n_rays=rays)


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
    body = CASES[1][1]
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


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.2, 6.4), facecolor="white")
    drawings, fans, cards, errors = [], [], {}, {}
    for row, (name, body, source) in enumerate(CASES):
        flow = cr.build_phase_map(body, tolerance=1e-4 if quick else 1e-6)
        fan = fan_of(flow, source, 64 if quick else 512)
        fronts = fronts_of(fan)
        bottom = 0.55 - 0.46 * row
        drawings.append(on_body(figure.add_axes((0.0, bottom, 0.40, 0.42), projection="3d"), fan, fronts))
        in_parameters(figure.add_axes((0.47, bottom + 0.08, 0.40, 0.31)), fan, fronts)
        at = f"$x_s$ = ({', '.join(map(str, source))})"
        figure.text(0.01, bottom + 0.425, rf"$\bf{{{'ac'[row]}}}$  {name}, {at}", fontsize=9)
        figure.text(0.42, bottom + 0.425, rf"$\bf{{{'bd'[row]}}}$  the same over the angles", fontsize=9)
        levels = np.unique([curve.level for curve in fronts])
        place = figure.add_axes((0.905, bottom + 0.08, 0.014, 0.31))
        add_level_bar(figure, drawings[-1].colours, levels, "iso-phase curves: $R + t$", cax=place)
        points = np.concatenate([curve.points for curve in fan.line.curves])
        away = points - np.array(source)
        steep = body.gradient(points)
        sine = np.sum(steep * away, axis=1) / np.linalg.norm(steep, axis=1) / np.linalg.norm(away, axis=1)
        cards[name] = {"source": source, "rays": len(fan.points), "shadow_line": fan.line.fractions} | map_card(flow)
        errors[name] = error_card(flow, fan.error) | {"largest_grazing_angle": float(np.degrees(np.abs(sine).max()))}
        fans.append(fan)
    add_legend(figure, drawings)
    figure.savefig(path, dpi=100 if quick else 300)
    sphere, torus, rays = sphere_errors(), torus_errors(), fans_error(fans)
    return {
        "parameters": {
            "bodies": [repr(body) for _, body, _ in CASES],
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
