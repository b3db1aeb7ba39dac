"""Two spheres: the condition on both, one alone where the other is nothing, reciprocity, energy, other methods."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.reference import clouds, dipoles, fundamental, sphere
from tests.reference.two_spheres import scatter_spheres

KINDS = ("soft", "hard", 0.5 + 0.2j, "pec")
AXIS = np.array([0.48, 0.6, 0.64])
RADII = (1.0, 0.7)


def centres(k):
    """A wavelength apart, the origin halfway."""
    return np.stack([-(1.0 + np.pi / k) * AXIS, (0.7 + np.pi / k) * AXIS])


def unit(rng, count):
    r = rng.normal(size=(count, 3))
    return r / np.linalg.norm(r, axis=1, keepdims=True)


def alone(k, d, r, boundary):
    """The unit sphere about the origin: (m,), of a conductor (m, 2, 2)."""
    cosine = np.clip(r @ d, -1, 1)
    if boundary != "pec":
        return sphere.far_field(k, 1.0, cosine, boundary)
    s = np.cross(d, r)
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    f, pairs = sphere.pec_far_field(k, 1.0, cosine), ((s, s), (np.cross(s, r), np.cross(s, d)))
    sent = [np.einsum("moc,mc->mo", dipoles.frames(r), out) for out, _ in pairs]
    received = [into @ dipoles.frames(d[None])[0].T for _, into in pairs]
    return sum(v[:, None, None] * o[:, :, None] * i[:, None] for v, o, i in zip(f, sent, received, strict=True))


@pytest.mark.parametrize("boundary", KINDS)
def test_the_condition_holds_and_back_and_forth_are_the_same(boundary, rng):
    d = unit(rng, 3)
    found = scatter_spheres(centres(6.0), RADII, 6.0, d, boundary)
    assert found.residual.max() < 1e-11
    back = found.far_field(-d)
    if boundary == "pec":
        # theta at -d is theta at d, phi the other way
        back = np.transpose(back * np.array([1, -1])[:, None], (0, 2, 1, 3)).reshape(6, 6)
    assert_allclose(back, back.T, atol=1e-11)


@pytest.mark.parametrize("boundary", KINDS)
def test_one_sphere_where_the_other_is_next_to_nothing(boundary, rng):
    d, r, at = unit(rng, 2), unit(rng, 20), centres(4.0)
    # along the line of centres, too, and at the poles of theta and phi
    r[:4] = [AXIS, -AXIS, [0, 0, 1], [0, 0, -1]]
    found = scatter_spheres(at, (1.0, 1e-6), 4.0, d, boundary, extra=16).far_field(r)
    for number, wave in enumerate(d):
        phase = np.exp(4j * (wave - r) @ at[0])
        exact = alone(4.0, wave, r, boundary)
        # a small soft sphere scatters its radius
        off = found[:, number] - phase.reshape(-1, *(1,) * (exact.ndim - 1)) * exact
        assert np.abs(off).max() < (1e-5 if boundary == "soft" else 1e-9)


@pytest.mark.parametrize("boundary", ["soft", "hard", "pec"])
def test_what_is_scattered_is_what_is_taken(boundary, rng):
    d = unit(rng, 1)
    found = scatter_spheres(centres(2.0), RADII, 2.0, d, boundary, extra=20)
    u, w = np.polynomial.legendre.leggauss(24)
    phi, across = np.arange(48) * np.pi / 24, np.sqrt(1 - u**2)[:, None]
    r = np.stack([across * np.cos(phi), across * np.sin(phi), np.repeat(u[:, None], 48, 1)], axis=-1).reshape(-1, 3)
    f, ahead = (found.far_field(where)[:, 0].reshape(len(where), -1, 2 if boundary == "pec" else 1) for where in (r, d))
    power = np.einsum("m,moi,moj->ij", np.repeat(w * np.pi / 24, 48), f.conj(), f)
    assert_allclose(2 * np.pi / 2.0 / 1j * (ahead[0] - ahead[0].conj().T), power, atol=1e-10)


def test_narrow_gaps_need_more_orders():
    at, d = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.75]]), np.array([[0.6, 0.0, 0.8]])
    few, many = (scatter_spheres(at, RADII, 2.0, d, "hard", extra=extra).residual[0] for extra in (10, 35))
    assert few > 1e-3 and many < 1e-2 * few
    with pytest.raises(ValueError, match="gap"):
        scatter_spheres(at, (1.0, 0.75), 2.0, d, "hard")


class Pair:
    """Both spheres as points."""

    mirrors = ()

    def __init__(self, at):
        self.at = at

    def area(self):
        return 4 * np.pi * sum(a**2 for a in RADII)

    def spread(self, spacing):
        ball = clouds.Body(lambda x: x, lambda x: x)
        n = [ball.spread(spacing / a).points for a in RADII]
        points = [c + a * part for c, a, part in zip(self.at, RADII, n, strict=True)]
        return clouds.Cloud(np.concatenate(points), np.concatenate(n))


@pytest.mark.slow
def test_against_sources_inside(rng):
    at, d, r = centres(3.0), unit(rng, 2), unit(rng, 20)
    for boundary in ("soft", "hard"):
        other = fundamental.scatter(Pair(at), 3.0, d, boundary, depth=0.25, least=1500)
        assert_allclose(scatter_spheres(at, RADII, 3.0, d, boundary).far_field(r), other.far_field(r), atol=1e-6)
    other = dipoles.scatter(Pair(at), 3.0, d, depth=0.25, least=1500)
    assert_allclose(scatter_spheres(at, RADII, 3.0, d, "pec").far_field(r), other.far_field(r), atol=2e-5)
