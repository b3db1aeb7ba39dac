"""The reflected field: mirrors at high frequency, the sphere, grazing incidence, flat and concave regions."""

import numpy as np
import pytest
import shared_bodies as sc
from scipy.special import spherical_jn, spherical_yn

import creeping as cr
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT, HARD, SOFT, Boundary, scalar_boundaries
from creeping.field.waves.reflected import plane_reflection, reflected_amplitude, reflected_error, reflection
from creeping.rays.specular import specular_points
from tests.reference import sphere

D = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])
WALL = Boundary("impedance", 0.4 + 0.3j)
COSINE = np.array([0.3, 0.6, 1.0])


def turned(theta):
    e = np.cross(D, [1.0, 0, 0])
    e /= np.linalg.norm(e)
    return np.cos(theta)[:, None] * D + np.sin(theta)[:, None] * e


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("boundary", [SOFT, HARD, ELECTRIC_SOFT, ELECTRIC_HARD, WALL], ids=lambda b: b.kind)
def test_a_curved_mirror_tends_to_a_plane_one(boundary, order):
    expected = {
        "soft": -1,
        "electric soft": -1,
        "hard": 1,
        "electric hard": 1,
        "impedance": (COSINE - WALL.admittance) / (COSINE + WALL.admittance),
    }[boundary.kind]
    ones = np.ones(3)
    np.testing.assert_allclose(plane_reflection(COSINE, boundary), expected * ones, rtol=1e-13)
    gaps = []
    for k in (1e3, 1e4):
        gap = np.abs(reflection(COSINE, ones, 0.7 * ones, k, boundary, order) - expected)
        gaps.append(gap)
        # the next order is i/(2 k a cos³θ), times some factor of order 1
        assert np.all(gap < 3 / (k * COSINE**3))
    # and falls like 1/k, or faster
    assert np.all(gaps[1] < 0.15 * gaps[0] + 1e-9)


@pytest.mark.parametrize("kind, sign", [("soft", -1), ("hard", 1)])
@pytest.mark.parametrize("order", [1, 2])
def test_sphere_at_large_ka(kind, sign, order):
    theta = np.array([1.2, 2.0, 3.0])
    r = turned(theta)
    found = specular_points(sc.Sphere(1.5), D, r)
    assert len(found.observer) == 3
    theta = theta[found.observer]
    for k in (200.0, 2000.0):
        f = reflected_amplitude(found, r, D, k, Boundary(kind), order)
        expected = sign * 0.75 * np.exp(-2j * k * 1.5 * np.sin(theta / 2))
        assert np.max(np.abs(f / expected - 1)) < 8 / (k * 1.5)


@pytest.mark.parametrize("kind, coefficient", [("soft", 1.0), ("hard", 3.0)])
def test_backscatter_of_the_sphere_to_its_next_order(kind, coefficient):
    # soft: f = -(a/2) e^{-2ika} (1 + i/(2ka) + ...); hard: -i 3/(2 ka); the partial waves settle the numbers
    k = 150.0
    found = specular_points(sc.Sphere(), D, -D[None])
    f = reflected_amplitude(found, -D[None], D, k, Boundary(kind), 2)[0]
    assert abs(f - sphere_series(k, kind)) < 8 / k**2
    assert abs(reflected_amplitude(found, -D[None], D, k, Boundary(kind), 1)[0] - f) < coefficient / k


def sphere_series(ka, kind):
    """Backscatter f of the unit sphere by partial waves; at ka = 150 what creeps round is below 1e-4 of it."""
    n = np.arange(int(ka + 6 * np.cbrt(ka) + 12))
    slope = kind == "hard"
    j, y = spherical_jn(n, ka, slope), spherical_yn(n, ka, slope)
    return np.sum(1j / ka * (2 * n + 1) * (-1.0) ** n * j / (j + 1j * y))


def test_reflection_is_smooth_towards_grazing():
    # down to ξ = -0.6; nearer to grazing P has the pole of the shadow boundary, and the forward lobe serves
    cosine = np.geomspace(0.1, 1, 500)
    ones = np.ones_like(cosine)
    for boundary in (SOFT, HARD, ELECTRIC_HARD, WALL):
        R = reflection(cosine, ones, ones, 50.0, boundary, 2)
        assert np.all(np.isfinite(R))
        assert np.max(np.abs(np.diff(R, n=2))) < 2e-3


def test_flat_and_concave_ground_reflects_like_a_plane():
    cosine = np.array([0.2, 0.9])
    for curvature in (0.0, -1.0):
        for boundary in (SOFT, ELECTRIC_HARD, WALL):
            R = reflection(cosine, np.full(2, curvature), np.zeros(2), 30.0, boundary, 1)
            np.testing.assert_allclose(R, plane_reflection(cosine, boundary))


def test_saddles_turn_the_phase_by_a_quarter():
    body = sc.Torus()
    d = np.array([0.0, 0.6, -0.8])
    r = np.array([[0.1, 0.2, 0.97]]) / np.linalg.norm([0.1, 0.2, 0.97])
    found = specular_points(body, d, r)
    assert sorted(np.sum(found.principal < 0, axis=1)) == [0, 1]
    k = 500.0
    f = reflected_amplitude(found, r, d, k, SOFT, 1)
    K = np.prod(found.principal, axis=1)
    path = found.points @ (d - r[0])
    expected = -0.5 / np.sqrt(np.abs(K)) * np.exp(1j * k * path) * np.where(K < 0, -1j, 1)
    np.testing.assert_allclose(f, expected, rtol=0.05)


def test_no_specular_points_give_no_field():
    found = specular_points(sc.Sphere(), D, D[None])
    assert reflected_amplitude(found, D[None], D, 10.0, SOFT, 2).shape == (0,)


def test_impedance_between_hard_and_soft_in_the_far_field():
    # η -> 0 hard, η -> ∞ soft
    ones = np.ones(3)
    for eta, limit in ((1e-6, HARD), (1e6, SOFT)):
        (wall,) = scalar_boundaries(cr.ImpedanceBoundary(eta))
        got = reflection(COSINE, ones, ones, 40.0, wall, 1)
        np.testing.assert_allclose(got, reflection(COSINE, ones, ones, 40.0, limit, 1), rtol=1e-4)


@pytest.mark.parametrize("eta", [0.2, 0.7, 1.5, 0.4 + 0.3j])
def test_impedance_to_its_next_order(eta):
    # oblique and normal incidence against the partial waves; at first order the same misses by 100 times as much
    theta = np.array([2.0, 2.4, 2.8, np.pi])
    r = turned(theta)
    found = specular_points(sc.Sphere(), D, r)
    (wall,) = scalar_boundaries(cr.ImpedanceBoundary(eta))
    for k, most in ((63.0, 1e-3), (250.0, 5e-5)):
        exact = sphere.far_field(k, 1.0, np.cos(theta), complex(eta))
        off = [np.abs(reflected_amplitude(found, r, D, k, wall, order) / exact - 1) for order in (1, 2)]
        assert np.all(off[1] < most)
        assert np.max(off[1]) < 0.4 * np.max(off[0])


@pytest.mark.parametrize("boundary", [SOFT, HARD, ELECTRIC_SOFT, ELECTRIC_HARD, WALL], ids=lambda b: b.kind)
def test_the_series_of_flat_and_concave_ground_is_that_of_pekeris(boundary):
    # one is a series in the curvatures, of either sign, and the other uniform: they meet far from grazing
    k = 4000.0
    along, across = np.full(3, 1.0), np.full(3, 0.6)
    uniform = reflection(COSINE, along, across, k, boundary, 2)
    bent = [reflection(COSINE, s * along, s * across, k, boundary, 2) for s in (-1, 0)]
    # the part that is odd in the curvatures
    assert np.all(np.abs(2 * bent[1] - bent[0] - uniform) < 30 / (k * COSINE**3) ** 2)
    assert np.all(np.abs(uniform - bent[1]) > 1e-5)


@pytest.mark.parametrize("kind, factor", [("soft", 1), ("hard", 2), ("impedance", 3)])
def test_stated_error_of_reflection_on_the_sphere(kind, factor):
    theta = np.linspace(1.6, np.pi, 60)
    r = turned(theta)
    found = specular_points(sc.Sphere(), D, r)
    boundary = Boundary(kind, 0.7 if kind == "impedance" else 0j)
    # at lower ka what creeps round is more than that
    for k in (200.0, 800.0):
        wave = reflected_amplitude(found, r, D, k, boundary, 2)
        stated = reflected_error(found, wave, k, 2, 3.0)
        exact = sphere.far_field(k, 1.0, np.cos(theta), 0.7 + 0j if kind == "impedance" else kind)
        off = np.abs(wave - exact)
        assert np.mean(off[theta > 2] <= stated[theta > 2]) > 0.9
        assert np.median(stated / off) < 8 * factor
