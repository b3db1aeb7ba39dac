"""Fans with open arcs, arcs of one ray, detached and occluded rays, few steps: finite fields, and no warnings."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr

DIRECTIONS = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 1], [0.3, 0.5, 0.812], [-1, -1, -1]])
FANS = {
    "open arcs": {"n_rays": 64},
    "arcs of one ray": {"n_rays": 3, "max_gap": np.inf},
    "every point launches": {"n_rays": 48, "launch_from": "all"},
    "five steps": {"n_rays": 40, "n_steps": 5},
}


@pytest.mark.slow
@pytest.mark.parametrize("fan", FANS)
@pytest.mark.parametrize("body", [sc.Torus(), sc.TwistedEllipsoid()], ids=lambda body: type(body).__name__)
def test_fields_are_finite(body, fan):
    line = cr.shadow_line(body, (1, 1, 1))
    rays = cr.launch(cr.DirectFlow(body), line, length=3.0, **FANS[fan])
    for boundary in ("soft", cr.ImpedanceBoundary(0.5 + 0.2j)):
        assert np.all(np.isfinite(cr.far_field(rays, DIRECTIONS, wavenumber=20.0, boundary=boundary).total))
        assert np.all(
            np.isfinite(cr.near_field(rays, 3 * DIRECTIONS, wavenumber=20.0, boundary=boundary, method="rays"))
        )
        assert not np.any(np.isnan(cr.surface_field(rays, wavenumber=20.0, boundary=boundary)))
