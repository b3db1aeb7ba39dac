"""Rings of sources, against partial waves on the sphere and identities on bodies with joints and tips."""

import numpy as np
import pytest
from body_checks import directions

from tests.reference import sphere
from tests.reference.revolution import Profile, capsule_profile, cone_sphere_profile, scatter_by_rings

K = 8.0
POLAR = np.radians([20.0, 75.0])


def ball(s):
    n = np.stack([np.sin(s), np.cos(s)], axis=-1)
    return n, n


@pytest.mark.parametrize("boundary", ["soft", "hard", 0.5 - 0.3j])
def test_sphere(boundary, rng):
    found = scatter_by_rings(Profile(ball, np.pi, (), (), 1.0), K, POLAR, boundary)
    assert np.max(found.residual) < 1e-5
    r = directions(rng, 50)
    for i, d in enumerate(found.directions):
        np.testing.assert_allclose(
            found.far_field(r)[:, i], sphere.far_field(K, 1.0, np.clip(r @ d, -1, 1), boundary), atol=1e-6
        )
        np.testing.assert_allclose(
            found.total(1.4 * r)[:, i], sphere.total_field(K, 1.0, 1.4 * r, d, boundary), atol=1e-5
        )
        slope = sphere.surface_derivative(K, 1.0, np.clip(r @ d, -1, 1), boundary)
        np.testing.assert_allclose(found.normal_derivative(r, r)[:, i], slope, atol=2e-4 * K)


PROFILES = {"capsule": capsule_profile(0.8, 3.0), "cone": cone_sphere_profile(0.8, 3.0)}


@pytest.mark.slow
@pytest.mark.parametrize("boundary, profile, k", [("soft", "cone", 4.0), ("hard", "cone", K), ("hard", "capsule", K)])
def test_reciprocity_and_energy(profile, boundary, k):
    """f(r; d) = f(-d; -r), and forward scattering is all that is scattered."""
    polar = np.radians([20.0, 75.0, 105.0, 160.0])
    found = scatter_by_rings(PROFILES[profile], k, polar, boundary)
    # next to the tip, where a hundredth of a wavelength radiates nothing
    assert np.max(found.residual) < 0.05
    d = found.directions
    f = found.far_field(-d)
    np.testing.assert_allclose(f, f.T, atol=1e-4)
    z, w = np.polynomial.legendre.leggauss(60)
    phi = np.pi * np.arange(120) / 60
    r = np.stack(
        [np.outer(np.sqrt(1 - z**2), np.cos(phi)), np.outer(np.sqrt(1 - z**2), np.sin(phi)), np.outer(z, 0 * phi + 1)],
        -1,
    )
    scattered = (np.repeat(w, 120) * np.pi / 60) @ np.abs(found.far_field(r.reshape(-1, 3))) ** 2
    forward = np.array([found.far_field(d[[i]])[0, i] for i in range(4)])
    np.testing.assert_allclose(4 * np.pi / k * forward.imag, scattered, rtol=2e-4)


def test_profiles_are_what_they_say():
    for profile, last in ((PROFILES["capsule"], -1.5), (PROFILES["cone"], -0.8)):
        s = np.linspace(0, profile.length, 4001)
        x, n = profile.at(s)
        np.testing.assert_allclose(x[[0, -1], 0], 0, atol=1e-12)
        assert x[-1, 1] == pytest.approx(last)
        # arc length, and normals across it
        step = np.diff(x, axis=0)
        np.testing.assert_allclose(np.linalg.norm(step, axis=1), np.diff(s), rtol=1e-5)
        assert np.max(np.abs(np.sum(step * (n[1:] + n[:-1]), axis=1))) < 1e-6
