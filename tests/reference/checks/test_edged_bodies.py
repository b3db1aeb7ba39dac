"""References of bodies with edges: against series of the sphere, each other, and by what must hold of any body."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.reference import sphere
from tests.reference.dipoles import frames
from tests.reference.generatrix import Panels, lagrange, pieces_profile
from tests.reference.mirrored_box import scatter_box
from tests.reference.modal_conductor import scatter_conductor
from tests.reference.modal_equation import scatter_by_modes
from tests.reference.revolution import scatter_by_rings

BALL = pieces_profile([(0, 1), (0, -1)], {0: (0, 0)})
CONE = pieces_profile([(0, 2), (1, 0), (0, 0)])
OGIVE = pieces_profile([(0, 1.5), (0, -1.5)], {0: (-2.0, 0)})
POLAR = np.radians([35.0, 145.0, 80.0])
ETA = 0.5 + 0.2j


@pytest.fixture
def directions(rng):
    r = rng.normal(size=(40, 3))
    return r / np.linalg.norm(r, axis=1, keepdims=True)


def largest(found):
    return np.abs(found.far_field(found.directions)).max()


def test_profiles_are_what_they_say():
    assert CONE.joints == (5**0.5,) and CONE.tips == (0.0,) and pytest.approx(5**0.5 + 1) == CONE.length
    assert len(OGIVE.tips) == 2 and OGIVE.joints == () and pytest.approx(2.5) == OGIVE.radius and BALL.tips == ()
    for profile, area in ((CONE, np.pi * (1 + 5**0.5)), (BALL, 4 * np.pi)):
        panels = Panels(profile, 4.0, 6)
        assert_allclose(2 * np.pi * panels.w.sum(), area, rtol=1e-12)
        s = np.mean(panels.breaks, axis=1)
        step = (profile.at(s + 1e-6)[0] - profile.at(s - 1e-6)[0]) / 2e-6
        assert_allclose(np.stack([-step[:, 1], step[:, 0]], axis=-1), profile.at(s)[1], atol=1e-7)
    t, nodes = np.array([-1.0, 0.3, 0.7]), np.array([-0.5, 0.3, 0.9, 1.0])
    assert_allclose(lagrange(t, nodes) @ nodes**3, t**3, atol=1e-14)


@pytest.mark.parametrize("boundary", ["soft", "hard", ETA])
def test_sphere_against_partial_waves(boundary, directions):
    found = scatter_by_modes(BALL, 5.0, [0.0, 1.1], boundary)
    for number, d in enumerate(found.directions):
        exact = sphere.far_field(5.0, 1.0, np.clip(directions @ d, -1, 1), boundary)
        assert_allclose(found.far_field(directions)[:, number], exact, atol=1e-6 * np.abs(exact).max())
    assert np.max(found.inside) < 1e-5


def test_conducting_sphere_against_mie(directions):
    found = scatter_conductor(BALL, 5.0, [0.0, 1.1])
    f, own = found.far_field(directions), frames(directions)
    for number, d in enumerate(found.directions):
        across, along = sphere.pec_far_field(5.0, 1.0, np.clip(directions @ d, -1, 1))
        s = np.cross(d, directions)
        s /= np.linalg.norm(s, axis=1, keepdims=True)
        exact = 0
        for value, sent, received in ((across, s, s), (along, np.cross(s, directions), np.cross(s, d))):
            into = received @ frames(d[None])[0].T
            exact = exact + value[:, None, None] * np.einsum("moc,mc->mo", own, sent)[:, :, None] * into[:, None]
        assert_allclose(f[:, number], exact, atol=1e-6 * np.abs(exact).max())
    assert np.max(found.inside) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_an_ogive_against_rings_of_sources(boundary, directions):
    found = scatter_by_modes(OGIVE, 3.0, [0.0, 0.9], boundary)
    rings = scatter_by_rings(OGIVE, 3.0, [0.0, 0.9], boundary)
    assert_allclose(found.far_field(directions), rings.far_field(directions), atol=1e-5 * largest(found))


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard", ETA])
def test_reciprocity_and_finer_panels_of_a_cone(boundary, directions):
    found, finer = (scatter_by_modes(CONE, 4.0, POLAR, boundary, cuts=cuts) for cuts in (7, 9))
    back, size = found.far_field(-found.directions), largest(found)
    assert_allclose(back, back.T, atol=1e-5 * size)
    assert_allclose(found.far_field(directions), finer.far_field(directions), atol=4e-5 * size)
    assert np.max(found.inside) < 1e-4


@pytest.mark.slow
def test_reciprocity_of_a_conducting_cone():
    found = scatter_conductor(CONE, 4.0, POLAR)
    # theta at -d is theta at d, phi the other way
    back = found.far_field(-found.directions) * np.array([1, -1])[:, None]
    assert_allclose(back, np.transpose(back, (1, 0, 3, 2)), atol=2e-5 * largest(found))
    assert np.max(found.inside) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard", ETA])
def test_a_box_by_reciprocity_energy_and_finer_panels(boundary, directions):
    d = np.array([[0.3, 0.5, -0.81], [1.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    found, finer = (scatter_box((0.5, 0.8, 0.6), 3.0, d, boundary, order=5, cuts=cuts) for cuts in (2, 3))
    back, size = found.far_field(-d), largest(found)
    assert_allclose(back, back.T, atol=1e-4 * size)
    assert_allclose(found.far_field(directions), finer.far_field(directions), atol=2e-4 * size)
    assert np.max(found.inside) < 1e-3
    if boundary != ETA:
        u, w = np.polynomial.legendre.leggauss(16)
        phi = np.arange(32) * np.pi / 16
        s = np.sqrt(1 - u**2)[:, None]
        r = np.stack([s * np.cos(phi), s * np.sin(phi), np.repeat(u[:, None], 32, 1)], axis=-1).reshape(-1, 3)
        power = np.repeat(w * np.pi / 16, 32) @ np.abs(finer.far_field(r)) ** 2
        assert_allclose(4 * np.pi / 3.0 * np.diagonal(finer.far_field(d)).imag, power, rtol=2e-4)
