"""References of monopoles: convergence, the plane, the static field, and dipoles inside against the series."""

import numpy as np
import pytest

from studies.reference.clouds import ellipsoid
from studies.reference.monopoles import coupled_monopoles, plane_monopoles, sphere_monopoles
from studies.reference.slots import TERMS


@pytest.mark.parametrize("ka", [10.0, 100.0])
def test_more_terms_change_nothing(ka):
    angles = np.radians([5.0, 20.0, 90.0, 175.0])
    some, more = (sphere_monopoles(ka, 1.0, angles, terms=terms) for terms in (TERMS, 2 * TERMS))
    assert np.all(np.abs(some - more) < 1e-6 * np.abs(more))


def test_close_to_the_monopole_the_sphere_is_a_plane():
    """What the curvature changes is of the order of s/a, and of (ks)^(1/2) s/a."""
    k, s = 10.0, np.array([0.02, 0.04])
    off = np.abs(sphere_monopoles(k, 1.0, s, terms=30_000) / plane_monopoles(k, s) - 1)
    assert np.all(off < 1.5 * s)
    assert off[0] < 0.7 * off[1]


def test_plane_is_twice_the_dipole():
    """ik (1 + d²/dz²/k²) e^{ikr}/(2 pi r) by differences."""
    k, s, h = 7.0, 0.4, 1e-4
    r = np.hypot(s, np.array([-h, 0.0, h]))
    wave = np.exp(1j * k * r) / (2 * np.pi * r)
    second = (wave[0] - 2 * wave[1] + wave[2]) / h**2
    assert np.isclose(plane_monopoles(k, [s])[0], 1j * k * (wave[1] + second / k**2), rtol=1e-5)


def test_small_sphere_has_the_static_field_of_a_dipole():
    """Of the charge that two opposite charges close to an uncharged sphere, one above the other, bring there."""
    k, s = 1e-4, np.array([0.5, 1.2, 2.5])
    charge = -2 / (2 * np.sin(s / 2)) ** 3 - 1
    assert np.allclose(sphere_monopoles(k, 1.0, s, terms=4_000), 1j / k * charge / (4 * np.pi), rtol=1e-4)


@pytest.mark.slow
def test_dipoles_inside_a_sphere():
    k, angles = 8.0, np.radians([60.0, 110.0, 150.0])
    source = np.array([0.5, 0.6, np.sqrt(1 - 0.61)])
    side = np.cross(source, (0, 0, 1.0))
    points = np.cos(angles)[:, None] * source + np.sin(angles)[:, None] * side / np.linalg.norm(side)
    found = coupled_monopoles(
        ellipsoid(1.0, 1.0, 1.0),
        k,
        [source],
        points,
        depth=0.25,
        heights=(0.04, 0.06, 0.09, 0.12, 0.16),
        per_wavelength=9.0,
    )
    exact = sphere_monopoles(k, 1.0, angles)
    assert np.all(np.abs(found.values[:, 0] - exact) < 0.01 * np.abs(exact))
