"""Currents of whole conductors: far fields against Mie and dipoles, extinction, units."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.results.far_result import dyads
from tests.reference import clouds, dipoles, sphere

OBLIQUE = np.array([0.36, 0.48, 0.8])


def directions(rng, n):
    r = rng.normal(size=(n, 3))
    return r / np.linalg.norm(r, axis=1, keepdims=True)


def fan_of(body, d):
    line = cr.shadow_line(body, direction=d)
    return cr.launch(cr.DirectFlow(body, rtol=1e-9), line, length=4.0 * body.bounds[1].max(), n_rays=48)


def rms(values):
    return np.sqrt(np.mean(np.abs(values) ** 2))


def of_the_sphere(k, r):
    """Mie (m, 2, 2), theta and phi scattered by theta and phi incident."""
    d = np.broadcast_to(OBLIQUE, r.shape)
    across = np.cross(r, d)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    pair = dyads(_pair(across, d), _pair(across, r), d, r)
    perpendicular, parallel = sphere.pec_far_field(k, 1.0, r @ OBLIQUE)
    return perpendicular[:, None, None] * pair[:, 0] + parallel[:, None, None] * pair[:, 1]


def _pair(across, travel):
    return np.stack([across, np.cross(across, travel)], axis=1)


@pytest.mark.parametrize("k, limit", [(8.0, 0.02), (24.0, 3e-3)])
def test_sphere(k, limit, rng):
    r = directions(rng, 300)
    currents = cr.surface_currents(fan_of(sc.Ellipsoid(1.0, 1.0, 1.0), OBLIQUE), wavenumber=k, boundary="pec")
    exact = of_the_sphere(k, r)
    off = np.abs(currents.far(r) - exact)
    assert off.max() < limit * np.abs(exact).max()
    assert 0.4 < rms(off) / rms(exact) / currents.extinction < 2.5
    assert np.mean(off <= currents.error(r)) > 0.95


@pytest.mark.slow
def test_triaxial(rng):
    # isolated rays are off by 12 to 19 % of the largest value here, and say nothing
    k, r, d = 8.0, directions(rng, 200), directions(rng, 1)
    solution = dipoles.scatter(clouds.ellipsoid(1.0, 0.8, 0.6), k, d, depth=0.2)
    exact = solution.far_field(r)[:, 0]
    fan = fan_of(sc.Ellipsoid(1.0, 0.8, 0.6), d[0])
    currents = cr.surface_currents(fan, wavenumber=k, boundary="pec", solve=False)
    off, stated = np.abs(currents.far(r) - exact), currents.error(r)
    assert solution.residual.max() < 1e-2
    assert off.max() < 0.06 * np.abs(exact).max()
    assert np.mean(off <= stated) > 0.95
    assert np.median(stated / off) < 5


@pytest.mark.slow
def test_near_the_far_zone_and_inside(rng):
    k, r = 10.0, directions(rng, 5)
    currents = cr.surface_currents(fan_of(sc.Ellipsoid(1.0, 0.8, 0.6), OBLIQUE), wavenumber=k, boundary="pec")
    assert currents.scattered(2 * r).shape == (5, 3, 2)
    # H ~ r x f e^{ikR}/R
    from creeping.field.results.far_result import spherical_frame

    R = 1e5
    f = np.einsum("moc,moi->mci", spherical_frame(r), currents.far(r))
    found = currents.scattered(R * r) * R * np.exp(-1j * k * R)
    np.testing.assert_allclose(found, np.cross(r[:, :, None], f, axis=1), atol=1e-3 * np.abs(f).max())
    wave = np.multiply.outer(
        np.exp(1j * k * 0.3 * r @ currents.direction),
        np.cross(currents.direction, currents.incident_electric, axisb=0).T,
    )
    assert rms(currents.scattered(0.3 * r) + wave) < 0.05
