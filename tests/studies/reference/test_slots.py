"""References of slots: convergence, the plane, the static field, and dipoles inside against the series."""

import numpy as np
import pytest

from studies.reference.clouds import ellipsoid
from studies.reference.slots import TERMS, coupled_slots, plane_slots, sphere_slots


@pytest.mark.parametrize("ka", [10.0, 100.0])
def test_more_terms_change_nothing(ka):
    angles = np.radians([5.0, 20.0, 90.0, 175.0])
    some, more = (np.array(sphere_slots(ka, 1.0, angles, terms=terms)) for terms in (TERMS, 2 * TERMS))
    assert np.all(np.abs(some - more) < 1e-6 * np.max(np.abs(more), axis=0))


def test_close_to_the_slot_the_sphere_is_a_plane():
    """What the curvature changes is of the order of s/a, and of (ks)^(1/2) s/a."""
    k, s = 10.0, np.array([0.02, 0.04])
    sphere, plane = np.array(sphere_slots(k, 1.0, s, terms=30_000)), np.array(plane_slots(k, s))
    off = np.max(np.abs(sphere / plane - 1), axis=0)
    assert np.all(off < 1.5 * s)
    assert off[0] < 0.7 * off[1]


def test_plane_is_twice_the_dipole():
    """ik (1 + grad grad/k^2) e^{ikr}/(2 pi r) by differences."""
    k, s, h = 7.0, 0.4, 1e-4

    def wave(x, y):
        r = np.hypot(x, y)
        return np.exp(1j * k * r) / (2 * np.pi * r)

    def second(dx, dy):
        return (wave(s + dx, dy) - 2 * wave(s, 0.0) + wave(s - dx, -dy)) / h**2

    across, along = plane_slots(k, np.array([s]))
    assert np.isclose(across[0], 1j * k * (wave(s, 0.0) + second(0.0, h) / k**2), rtol=1e-5)
    assert np.isclose(along[0], 1j * k * (wave(s, 0.0) + second(h, 0.0) / k**2), rtol=1e-5)


def test_small_sphere_has_the_static_field_of_a_pair_of_charges():
    """-grad of Neumann's function of the outside, (1/S - log(1 + 1/S))/(4 pi a), between two charges close together."""
    k, s, h = 1e-4, np.array([0.5, 1.2, 2.5]), 1e-4

    def potential(angle):
        S = np.sin(0.5 * angle)
        return (1 / S - np.log(1 + 1 / S)) / (4 * np.pi)

    across, along = sphere_slots(k, 1.0, s, terms=4_000)
    slope = (potential(s + h) - potential(s - h)) / (2 * h)
    second = (potential(s + h) - 2 * potential(s) + potential(s - h)) / h**2
    # H is i/k times grad of the derivative of the potential towards the source
    assert np.allclose(across, 1j / k * slope / np.sin(s), rtol=1e-4)
    assert np.allclose(along, 1j / k * second, rtol=1e-4)


def test_dipoles_inside_a_sphere():
    k, angles = 8.0, np.radians([30.0, 60.0, 110.0, 150.0])
    source = np.array([0.5, 0.6, np.sqrt(1 - 0.61)])
    side = np.cross(source, (0, 0, 1.0))
    side /= np.linalg.norm(side)
    points = np.cos(angles)[:, None] * source + np.sin(angles)[:, None] * side
    there = np.cos(angles)[:, None] * side - np.sin(angles)[:, None] * source
    found = coupled_slots(
        ellipsoid(1.0, 1.0, 1.0), k, [source], points, depth=0.3, heights=(0.06, 0.09, 0.12, 0.16), per_wavelength=8.0
    )
    across, along = sphere_slots(k, 1.0, angles)
    b = np.cross(source, side)
    for n in range(len(angles)):
        H = found.tangents[0].T @ found.values[n, 0]
        most = max(abs(across[n]), abs(along[n]))
        assert abs(b @ H @ b - across[n]) < 0.005 * most
        assert abs(side @ H @ there[n] - along[n]) < 0.015 * most
        assert abs(b @ H @ there[n]) + abs(side @ H @ b) < 0.005 * most
