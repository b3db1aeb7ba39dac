"""Far field of a hard sphere, ka = 30: creeping rays, reflection and forward lobe on the exact curve."""

from pathlib import Path

import numpy as np

import creeping as cr
from creeping._typing import Any
from creeping.plotting import far_cut_picture
from studies.field_sphere import sphere_fan
from tests.reference import sphere

KA = 30.0


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    step = 1.0 if quick else 0.25
    theta = np.radians(np.arange(0, 180 + step / 2, step))
    fan = sphere_fan(6.6)
    directions = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    field = cr.far_field(fan, directions, wavenumber=KA, boundary="hard")
    exact = sphere.far_field(KA, 1.0, np.cos(theta), "hard")
    error = np.abs(field.total - exact)
    share = {
        "largest_over_largest": float(error.max() / np.abs(exact).max()),
        "median_relative": float(np.median(error / np.abs(exact))),
    }
    far_cut_picture(
        path,
        theta,
        {"asymptotic": field},
        exact=exact,
        parts=True,
        angle_name="angle from the forward direction",
        title="Hard sphere, ka = 30",
        dpi=100 if quick else 300,
    )
    return {
        "parameters": {"body": "Sphere()", "ka": KA, "boundary": "hard", "rays": len(fan.points), "step_degrees": step},
        "error": {"field": share},
        "headline": f"against partial waves: median {100 * share['median_relative']:.2f} %, largest "
        f"{100 * share['largest_over_largest']:.2f} % of the largest value",
    }
