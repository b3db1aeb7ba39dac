"""What an incidence has does not depend on its company, with an impedance neither: by direct rays to rounding."""

import numpy as np
import shared_bodies as sc

import creeping as cr


def test_impedances_know_nothing_of_their_company():
    flow = cr.DirectFlow(sc.TwistedEllipsoid(), rtol=1e-8)
    d = np.random.default_rng(3).normal(size=(8, 3))
    options = {
        "quantity": "bistatic",
        "observation": [[0, 0, 1], [0.6, 0, 0.8]],
        "wavenumbers": [15.0, 30.0],
        "boundary": [cr.ImpedanceBoundary(0.5 - 0.2j), "hard"],
        "n_rays": 48,
    }
    together = cr.sweep_directions(flow, d, **options)
    for some in (slice(7, 8), slice(None, None, 3)):
        alone = cr.sweep_directions(flow, d[some], **options)
        for name in ("total", "creeping", "reflected", "forward", "error"):
            one, other = together[name].isel(incidence=some).values, alone[name].values
            np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-14)
