"""The compiled curvatures along and across tangents against numpy's."""

import numpy as np
import pytest
import shared_bodies as sc

from creeping.geometry.curvature import normal_curvature
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import normal, project
from creeping.kernels.nearest import normal_sections


@pytest.mark.parametrize("body", [sc.Ellipsoid(1.3, 0.7, 0.9), sc.Torus(), sc.TwistedEllipsoid()], ids=repr)
@pytest.mark.parametrize("n", [1, 64, 150])
def test_curvatures_are_those_of_numpy(body, n):
    rng = np.random.default_rng(n)
    x = project(
        body, 0.1 * rng.normal(size=(n, 3)) + 0.5 * np.eye(3)[rng.integers(0, 3, n)] + np.array([0.6, 0.1, 0.1])
    )
    p = np.cross(normal(body, x), rng.normal(size=(n, 3)))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    along, across = np.empty(n), np.empty(n)
    with evaluators(body) as parts:
        normal_sections(*parts[:2], np.ascontiguousarray(x), p, along, across)
    np.testing.assert_allclose(along, normal_curvature(body, x, p), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(across, normal_curvature(body, x, np.cross(normal(body, x), p)), rtol=1e-11, atol=1e-11)
