"""The magnitude along rays is that of `surface_field` in first order, which traces them again."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.on_rays import creeps, ray_envelope


@pytest.mark.parametrize("boundary", ["soft", "hard", cr.ImpedanceBoundary(0.3 - 0.1j)])
@pytest.mark.parametrize("body", [sc.Ellipsoid(1.2, 0.8, 0.6), sc.TwistedEllipsoid()], ids=["ellipsoid", "twisted"])
def test_it_is_the_field_on_the_surface(body, boundary):
    line = cr.shadow_line(body, (1, 1, 1))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-11), line, length=3.0, n_rays=48, n_steps=64, max_gap=np.inf)
    field = cr.surface_field(fan, wavenumber=30.0, boundary=boundary, order=1).values
    exact = np.abs(field)
    envelope = ray_envelope(fan, wavenumber=30.0, boundary=boundary)
    found = np.abs(envelope) * (30.0 if boundary == "soft" else 1.0)
    sound = creeps(fan) & (np.abs(fan.spreading) > 1e-3)
    # the last step before a ray detaches has no curvature left to divide by
    np.testing.assert_allclose(found[sound], exact[sound], rtol=2e-4)
    assert np.all(found[~creeps(fan)] == 0)
    assert np.any(sound[:, -1])
    turned = envelope * np.exp(30j * fan.eikonal)
    assert np.max(np.abs(np.angle(turned[sound] / field[sound]))) < 2e-4
    assert np.any(fan.caustic_index[sound])


def test_a_weighted_body_has_none():
    body = sc.Sphere(speed="1 + 0.3*x")
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0, 0, 1)), length=1.0, n_rays=4)
    with pytest.raises(cr.InvalidInputError, match="speed"):
        ray_envelope(fan, wavenumber=10.0, boundary="soft")
