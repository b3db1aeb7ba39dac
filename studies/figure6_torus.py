"""Figure 6, torus: creeping rays and iso-phase curves for d = (1, 1, 1), from all or part of the shadow line.

The torus R = 1, r = 0.5 has two shadow curves for this incidence. [YC06b] launches from every point of both. Where the
inner curve lies behind the body (occluded) or on a part that is hollow along d (kappa_n(d) <= 0) no incident ray grazes
the body, so no creeping ray starts: on the right only attached points launch. Rays are drawn faint where they are
detached. (theta, psi) as in x = ((R + r cos theta) cos psi, (R + r cos theta) sin psi, r sin theta).
"""

from pathlib import Path

import creeping as cr
import scatterers as sc
from creeping._typing import Any
from studies._curves import equal_times
from studies._fans import add_keys, in_parameters, on_body
from studies._measured import error_card, fans_error, headline, map_card

BODY = sc.Torus(R=1.0, r=0.5)
DIRECTION = (1, 1, 1)
LENGTH = 1.5
SPACING = 0.25
LAUNCHED = {"all": "all of the shadow line launches", "attached": "attached points launch"}


def fans(flow: cr.PhaseMap, rays: int) -> list[cr.RayFan]:
    """Rays of both kinds of launch."""
    line = cr.shadow_line(BODY, DIRECTION)
    return [cr.launch(flow, line, length=LENGTH, n_rays=rays, launch_from=status) for status in LAUNCHED]


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    from matplotlib.figure import Figure

    flow = cr.build_phase_map(BODY, tolerance=1e-4 if quick else 1e-6)
    found = fans(flow, 64 if quick else 768)
    levels = equal_times(SPACING, LENGTH)[1:]
    figure = Figure(figsize=(8.4, 6.2), facecolor="white")
    drawings = []
    for column, (fan, text) in enumerate(zip(found, LAUNCHED.values(), strict=True)):
        curves = cr.iso_phase_curves(fan, levels)
        left = 0.45 * column
        body = figure.add_axes((left, 0.575, 0.44, 0.385), projection="3d")
        drawings.append(on_body(body, fan, curves))
        in_parameters(figure.add_axes((left + 0.085, 0.115, 0.34, 0.45)), fan, curves)
        figure.text(left + 0.01, 0.965, rf"$\bf{{{'ab'[column]}}}$  {text}", fontsize=9)
    add_keys(figure, drawings, levels, (0.915, 0.25, 0.016, 0.5))
    figure.savefig(path, dpi=100 if quick else 300)
    error = fans_error(found)
    return {
        "parameters": {
            "body": repr(BODY),
            "direction": DIRECTION,
            "launched": list(LAUNCHED),
            "rays": [len(fan.points) for fan in found],
            "time": LENGTH,
            "levels": levels.tolist(),
            "shadow_line": found[0].line.fractions,
        }
        | map_card(flow),
        "error": error_card(flow, error),
        "headline": headline(flow, error, LENGTH),
    }
