"""Decay along creeping rays of a hard triaxial ellipsoid, k = 40, with the caustics that each ray passes."""

from pathlib import Path

import numpy as np

import creeping as cr
from creeping._typing import Any
from creeping.plotting import decay_picture
from studies.field_bodies import fan_of

K = 40.0


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    line = fan_of("triaxial", 0).line
    flow = cr.build_phase_map(line.body, tolerance=1e-6)
    fan = cr.launch(flow, line, length=4.0, n_rays=384, n_steps=400)
    decay_picture(path, fan, wavenumber=K, boundary="hard", dpi=100 if quick else 300)
    both = [np.abs(cr.surface_field(fan, wavenumber=K, boundary="hard", order=order)) for order in (1, 2)]
    shadow = (fan.travel_time > 0.3) & (fan.travel_time < 0.9)
    change = float(np.median(np.abs(both[1][:, shadow] / both[0][:, shadow] - 1)))
    return {
        "parameters": {
            "body": repr(fan.body),
            "direction": np.asarray(fan.line.direction).tolist(),
            "wavenumber": K,
            "boundary": "hard",
            "rays": len(fan.points),
        },
        "error": {"field": {"second_order_changes_by": change}},
        "headline": f"second order changes the amplitude by {100 * change:.0f} % (median, s = 0.3 to 0.9)",
    }
