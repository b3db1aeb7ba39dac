"""Cubics between states of rays: those of a cubic curve are the curve."""

import numpy as np

from creeping.geodesics.pieces import cubic_at
from creeping.geodesics.states import P, X


def test_a_cubic_curve_is_its_own(rng):
    c = rng.normal(size=(4, 3))
    long, share = np.array([0.7]), np.array([[0.0, 0.2, 0.5, 0.9, 1.0]])

    def curve(u, slope=False):
        powers = [0 * u, 1 + 0 * u, 2 * u, 3 * u**2] if slope else [1 + 0 * u, u, u**2, u**3]
        return np.stack(powers, axis=-1) @ c

    ends = np.zeros((2, 1, max(X.stop, P.stop)))
    for state, u in zip(ends, (0.0, 1.0), strict=True):
        state[:, X], state[:, P] = curve(np.array([u])), curve(np.array([u]), slope=True) / long
    np.testing.assert_allclose(cubic_at(*ends, long, share)[0], curve(share[0]), atol=1e-12)
