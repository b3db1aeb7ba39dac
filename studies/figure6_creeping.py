"""Figure 6: creeping rays and iso-phase curves on the twisted ellipsoid, d = (1, 1, 1) and (1, 0, 0).

    F = x^2/a^2 + (y - d cos(pi z))^2/b^2 + z^2/c^2 - 1,   a = b = 0.5, c = 1, d = 0.2

Rays start on the shadow line n.d = 0 with p = d, and are carried by the phase map; an iso-phase curve joins the points
of equal travel time [YC06b]. (theta, phi) are the spherical angles of (x/a, (y - d cos(pi z))/b, z/c). Where the
body is not convex along a ray (kappa_n <= 0), the ray is detached: it goes on as a geodesic, drawn faint. A pole
of the angles is the whole edge theta = 0 or 180 degrees: the shadow line of (1, 0, 0) passes through both.
"""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any
from studies._curves import equal_times
from studies._fans import add_keys, in_parameters, on_body
from studies._measured import error_card, fans_error, headline, map_card

BODY = sc.TwistedEllipsoid(a=0.5, b=0.5, c=1.0, d=0.2)
DIRECTIONS = ((1, 1, 1), (1, 0, 0))
LENGTH = 1.5
SPACING = 0.25


def fans(flow: cr.PhaseMap, rays: int) -> list[cr.RayFan]:
    """Rays of both incidences."""
    return [cr.launch(flow, cr.shadow_line(BODY, d), length=LENGTH, n_rays=rays) for d in DIRECTIONS]


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    from matplotlib.figure import Figure

    flow = cr.build_phase_map(BODY, tolerance=1e-4 if quick else 1e-6)
    found = fans(flow, 64 if quick else 512)
    levels = equal_times(SPACING, LENGTH)[1:]
    figure = Figure(figsize=(7.8, 6.0), facecolor="white")
    drawings = []
    for row, (fan, d) in enumerate(zip(found, DIRECTIONS, strict=True)):
        curves = cr.iso_phase_curves(fan, levels)
        bottom = 0.525 - 0.46 * row
        body = figure.add_axes((0.0, bottom, 0.36, 0.41), projection="3d")
        drawings.append(on_body(body, fan, curves))
        in_parameters(figure.add_axes((0.425, bottom + 0.075, 0.455, 0.32)), fan, curves)
        name = f"$d$ = ({', '.join(map(str, d))})"
        figure.text(0.01, bottom + 0.425, rf"$\bf{{{'ac'[row]}}}$  {name}, on the body", fontsize=9)
        figure.text(0.38, bottom + 0.425, rf"$\bf{{{'bd'[row]}}}$  {name}, over the angles", fontsize=9)
    add_keys(figure, drawings, levels, (0.905, 0.31, 0.016, 0.42))
    figure.savefig(path, dpi=100 if quick else 300)
    error = fans_error(found)
    return {
        "parameters": {
            "body": repr(BODY),
            "directions": DIRECTIONS,
            "launched": "attached",
            "rays": [len(fan.points) for fan in found],
            "time": LENGTH,
            "levels": levels.tolist(),
            "earliest_detachment": [
                float(fan.detachment.min()) if np.isfinite(fan.detachment).any() else None for fan in found
            ],
        }
        | map_card(flow),
        "error": error_card(flow, error),
        "headline": headline(flow, error, LENGTH),
    }
