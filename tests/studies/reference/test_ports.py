"""Point sources on a hard body: partial waves against fundamental solutions, and the static limit."""

import numpy as np

from studies.reference.clouds import ellipsoid
from studies.reference.ports import coupled, sphere_coupling


def test_series_and_fundamental_solutions_agree():
    source = np.array([[0.3, 0.4, np.sqrt(0.75)]])
    aside = np.array([0.8, -0.6, 0.0])
    angles = np.radians([20.0, 60.0, 120.0])
    points = np.cos(angles)[:, None] * source + np.sin(angles)[:, None] * aside
    found = coupled(ellipsoid(1.0, 1.0, 1.0), 8.0, source, points, depth=0.3, heights=(0.06, 0.1, 0.14, 0.18))
    exact = sphere_coupling(8.0, 1.0, angles)
    assert np.all(np.abs(found.values[:, 0] - exact) < 0.01 * np.abs(exact))


def test_static_limit():
    """Neumann's function of the sphere's outside: k -> 0."""
    s = np.sin(np.radians([15.0, 45.0, 85.0]))
    static = (1 / s - np.log(1 + 1 / s)) / (4 * np.pi)
    assert np.allclose(sphere_coupling(1e-4, 1.0, 2 * np.radians([15.0, 45.0, 85.0])), static, rtol=1e-3)
