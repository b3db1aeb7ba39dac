"""Field on a hard triaxial ellipsoid, k = 40, in decibels: light, penumbra, and the shadow with its caustics."""

from pathlib import Path

import numpy as np

import creeping as cr
from creeping._typing import Any
from creeping.plotting import surface_field_picture
from studies.field_bodies import fan_of, surface_errors

K = {False: 40.0, True: 20.0}


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    fan = fan_of("triaxial", 0)
    drawn_by = surface_field_picture(
        path, fan, wavenumber=K[quick], boundary="hard", cells=48 if quick else None, dpi=100 if quick else 300
    )
    thirds, share = surface_errors("triaxial", "hard", K[quick], 0, 2)
    return {
        "parameters": {
            "body": repr(fan.body),
            "direction": np.asarray(fan.line.direction).tolist(),
            "wavenumber": K[quick],
            "boundary": "hard",
            "rays": len(fan.points),
            "drawn_by": drawn_by,
            "version": cr.__version__,
        },
        "error": {"field": {"median_relative_by_arclength": thirds, "median_over_largest": share}},
        "headline": "in the shadow against fundamental solutions, s = 0.3 to 0.9: median "
        f"{np.median(thirds):.1f} %, or {share:.1f} % of the largest value",
    }
