"""Second order of a conductor's reflection: the circular cylinder, which is exact, and the ellipsoid by dipoles."""

import numpy as np
import pytest
import shared_bodies as sc
from scipy.special import h1vp, hankel1, jv, jvp

import creeping as cr
from tests.reference import stored


def unit(*v):
    return np.array(v) / np.linalg.norm(v)


def reflected(body, d, r, k):
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=0.3, n_rays=8, measured=False, max_gap=np.inf)
    return cr.far_field(fan, np.atleast_2d(r), wavenumber=k, boundary="pec", method="rays").reflected[0]


def cylinder_ratio(ka):
    """Backscatter of a circular cylinder, H along it over E along it, by its series."""
    n = np.arange(-int(ka + 40), int(ka + 41))
    soft = np.sum((-1.0) ** n * jv(n, ka) / hankel1(n, ka))
    hard = np.sum((-1.0) ** n * jvp(n, ka) / h1vp(n, ka))
    return hard / soft


@pytest.mark.slow
def test_both_polarisations_of_a_long_spheroid_at_broadside_are_those_of_the_cylinder():
    # the spheroid's own curvature along is 1/900 of that across; components are along theta (E along z) and phi
    k = 150.0
    f = reflected(sc.Ellipsoid(1.0, 1.0, 30.0), unit(0, -1, 0), unit(0, 1, 0), k)
    exact = cylinder_ratio(k)
    assert abs(exact + 1) > 0.006
    assert abs(f[1, 1] / f[0, 0] - exact) < 3e-4
    assert abs(f[0, 1]) + abs(f[1, 0]) < 1e-9


@pytest.mark.parametrize("azimuth, tilt", [(-0.9, 0.5), pytest.param(0.02, 0.7, marks=pytest.mark.slow)])
def test_a_cylinder_met_obliquely_keeps_its_polarisations(azimuth, tilt):
    """E_z is soft and H_z hard whatever the angle, though the plane of incidence leans against the axis."""
    d = unit(-np.cos(azimuth) * np.cos(tilt), -np.sin(azimuth) * np.cos(tilt), np.sin(tilt))
    # mirrored at the generator y = 0
    r = d * [-1, 1, 1]
    k = 200.0
    f = reflected(sc.Ellipsoid(1.0, 1.0, 30.0), d, r, k)
    # in the plane across the axis: k cos(tilt), and the angle of incidence is the azimuth
    term = 1j / (k * np.cos(tilt) * np.cos(azimuth) ** 3)
    size = abs(f[0, 0])
    assert abs(f[0, 1]) + abs(f[1, 0]) < 10 * abs(term) ** 2 * size
    assert abs(f[1, 1] + (1 - term) * f[0, 0]) < 3 * abs(term) ** 2 * size


def test_reflection_does_not_depend_on_the_frame_of_normal_incidence():
    body, d = sc.Ellipsoid(1.0, 0.7, 0.5), unit(0.3, -0.6, 0.5)
    straight = reflected(body, d, -d, 40.0)
    for aside in ([1, 0, 0], [0, 1, 0], [0, 0.4, 1]):
        near = unit(*(-d + 1e-6 * np.cross(d, aside)))
        np.testing.assert_allclose(reflected(body, d, near, 40.0), straight, atol=2e-4 * np.abs(straight).max())
    # reciprocity of backscatter: E0.f.E0' is symmetric, with frames of either way
    np.testing.assert_allclose(abs(straight[0, 1]), abs(straight[1, 0]), rtol=1e-9)
    assert abs(straight[0, 1]) > 0.003 * np.abs(straight).max()


def test_echoes_of_an_ellipsoid_against_dipoles():
    """Both polarisations and what passes from one to the other, near backscatter, within the error that is stated."""
    k, body, kept, off, stated = 20.0, sc.Ellipsoid(1.0, 0.7, 0.5), stored.read("ellipsoid_echoes"), [], []
    for direction, r, exact in zip(kept["incident"], kept["directions"], kept["values"], strict=True):
        fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction), wavenumber=k, n_rays=48)
        field = cr.far_field(fan, r, wavenumber=k, boundary="pec", method="rays")
        off.append(np.abs(field.total - exact) / np.abs(exact).max())
        stated.append(field.error / np.abs(exact).max())
    off, stated = np.array(off), np.array(stated)
    # without the terms of both polarisations 0.02 and 0.8
    assert np.median(np.diagonal(off, axis1=2, axis2=3)) < 0.006
    assert np.mean(off <= stated) > 0.95


def test_a_rim_too_sharp_for_the_second_order_of_polarisations_is_unresolved():
    body, d = sc.Ellipsoid(1.0, 0.5, 0.16), unit(0, -1, 0)
    for k, sharp in ((30.0, True), (150.0, False)):
        fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), wavenumber=k, n_rays=24, max_gap=np.inf)
        field = cr.far_field(fan, -d[None], wavenumber=k, boundary="pec", method="rays")
        # k rho of the rim is 1.5 and 7.7
        assert field.unresolved[0] == sharp
        assert not sharp or np.all(field.error[0].diagonal() > 0.5 * np.abs(field.total[0].diagonal()))
