"""Each shed ray counts once, whatever cells of the fan find it."""

import numpy as np
import shared_bodies as sc

import creeping as cr


def test_rays_on_flat_ground_that_two_cells_find_are_one():
    # residuals of 4e-5 leave 3e-4 of time where kappa_n is 0.15: more than a hundredth of a cell
    body = sc.Ellipsoid(2.0, 0.5, 0.4)
    turn = np.radians(np.arange(0.0, 8.0))[:, None]
    directions = 0.1 * np.eye(3)[2] + np.sqrt(0.99) * (np.cos(turn) * np.eye(3)[0] + np.sin(turn) * np.eye(3)[1])
    flow = cr.DirectFlow(body, rtol=1e-9)
    asked = {"wavenumbers": [18.0], "boundary": "hard", "length": 6.0}
    few, many = (cr.sweep_directions(flow, directions, n_rays=n, **asked).creeping.values for n in (96, 400))
    np.testing.assert_allclose(few, many, atol=1e-3 * np.abs(many).max())
