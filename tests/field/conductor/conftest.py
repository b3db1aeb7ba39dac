"""A sphere and an ellipsoid with their exact fields, shared by the tests of conductors."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from tests.reference import clouds, dipoles, sphere

OBLIQUE = np.array([0.36, 0.48, 0.8])


@pytest.fixture(scope="session")
def ball():
    """A fan on the unit sphere."""
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=OBLIQUE), length=5.5, n_rays=128)


@pytest.fixture(scope="session")
def mie():
    """Mie's E and H (n, 3, 2), theta and phi incident: mie(k, points)."""

    def fields(k, points):
        each = [sphere.pec_total_field(k, 1.0, points, OBLIQUE, e) for e in dipoles.frames(OBLIQUE[None])[0]]
        return tuple(np.stack(parts, axis=-1) for parts in zip(*each, strict=True))

    return fields


@pytest.fixture(scope="session")
def triaxial():
    """A fan on an ellipsoid, its wavenumber, and the solution by dipoles."""
    body, k = sc.Ellipsoid(1.0, 0.8, 0.6), 8.0
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=OBLIQUE), length=4.0, n_rays=96)
    return fan, k, dipoles.scatter(clouds.ellipsoid(1.0, 0.8, 0.6), k, OBLIQUE[None], depth=0.2)
