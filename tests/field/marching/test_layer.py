"""Marched waves on circles and spheres against series; what cannot be marched says so."""

import numpy as np
import pytest

from creeping.errors import InvalidInputError
from creeping.field.boundary import ELECTRIC_SOFT, HARD, SOFT, Boundary
from creeping.field.marching.layer import march_rays
from creeping.field.marching.plan import MarchStatus
from tests.field.marching.section_waves import plane_rays
from tests.reference import section

S = np.concatenate([np.linspace(-1.55, 0, 40), np.linspace(0, 3.6, 91)[1:]])


def circle(rays=1, **more):
    s = np.tile(S, (rays, 1))
    return plane_rays(s, np.ones_like(s), **more)


def both_senses(marched, s):
    """Sum of the waves of both senses at s, and of their sizes."""
    k = marched.wavenumber
    first = marched.at(0, s) * np.exp(1j * k * s)
    other = np.pi - s
    second = np.where(other < S[-1], marched.at(0, np.minimum(other, S[-1])), 0) * np.exp(1j * k * other)
    return first + second, np.abs(first) + np.abs(second)


@pytest.mark.parametrize(
    ("boundary", "eta", "limits"),
    [
        (SOFT, "soft", (0.05, 0.05, 0.6)),
        (HARD, "hard", (0.45, 0.15, 0.1)),
        (Boundary("impedance", 0.5), 0.5, (0.4, 0.15, 0.25)),
        (Boundary("impedance", 0.3 - 0.4j), 0.3 - 0.4j, (0.6, 0.2, 0.2)),
    ],
    ids=["soft", "hard", "passive", "reactive"],
)
def test_circle(boundary, eta, limits):
    """Per cent of the sum of waves in the light, the penumbra and the shadow, medians."""
    marched = march_rays(circle(), wavenumber=20.0, boundary=boundary)
    s = np.linspace(-0.8, 1.5, 231)
    exact = section.surface_derivative if eta == "soft" else section.surface_field
    found, size = both_senses(marched, s)
    error = 100 * np.abs(found - exact(20.0, 1.0, np.pi / 2 - s, eta)) / size
    regions = (s < -0.46, (s > -0.46) & (s < 0.46), s > 0.6)
    assert all(np.median(error[q]) < limit for q, limit in zip(regions, limits, strict=True))
    covered = error * size / 100 < np.interp(s, marched.s[0], marched.error[0])
    assert np.mean(covered) > 0.95
    assert marched.status[0] == MarchStatus.OK


def test_a_ray_does_not_depend_on_its_company():
    s = np.tile(S, (11, 1))
    kappa = np.linspace(0.8, 1.3, 11)[:, None] * (1 + 0.1 * np.cos(s))
    eta = 0.3 + 0.2 * np.cos(2 * s) + 0j
    together = march_rays(plane_rays(s, kappa, admittance=eta), wavenumber=20.0, boundary=Boundary("impedance"))
    for ray in (0, 7):
        part = slice(ray, ray + 1)
        alone = march_rays(
            plane_rays(s[part], kappa[part], admittance=eta[part]),
            wavenumber=20.0,
            boundary=Boundary("impedance"),
        )
        count = alone.counts[0]
        assert count == together.counts[ray]
        np.testing.assert_allclose(alone.values[0], together.values[ray, :count], rtol=1e-10)


def test_constant_admittance_is_the_same_along_the_ray():
    eta = np.full((1, len(S)), 0.4 + 0.1j)
    varying = march_rays(circle(admittance=eta), wavenumber=20.0, boundary=Boundary("impedance"))
    constant = march_rays(circle(), wavenumber=20.0, boundary=Boundary("impedance", 0.4 + 0.1j))
    np.testing.assert_allclose(varying.values, constant.values, rtol=1e-12)
    with_none = march_rays(circle(admittance=eta), wavenumber=20.0, boundary=HARD)
    np.testing.assert_allclose(with_none.values, march_rays(circle(), wavenumber=20.0, boundary=HARD).values)


def test_lengths_scale_with_the_wavelength():
    one = march_rays(circle(), wavenumber=40.0, boundary=HARD)
    large = plane_rays(4 * S[None], np.full((1, len(S)), 0.25))
    other = march_rays(large, wavenumber=10.0, boundary=HARD)
    s = np.linspace(-0.5, 3, 20)
    np.testing.assert_allclose(other.at(0, 4 * s), one.at(0, s), atol=2e-3)


def test_nothing_where_there_is_no_light():
    s = np.linspace(-0.2, 3, 60)
    s[np.argmin(np.abs(s))] = 0
    marched = march_rays(plane_rays(s[None], np.ones((1, 60))), wavenumber=20.0, boundary=HARD)
    assert marched.status[0] == MarchStatus.UNLIT
    assert np.all(marched.at(0, s) == 0) and np.all(marched.values == 0) and np.all(np.isinf(marched.error))


def test_edges_and_deep_dips_are_told():
    sharp = np.where(np.abs(S - 1.5) < 0.2, 12.0, 1.0)
    deep = 1 - 6 * np.exp(-(((S - 1.0) / 0.2) ** 2))
    s = np.stack([S, S, S])
    rays = plane_rays(s, np.stack([sharp, deep, np.ones_like(S)]))
    marched = march_rays(rays, wavenumber=20.0, boundary=HARD)
    assert [MarchStatus(code).name for code in marched.status] == ["SHARP", "DEEP", "OK"]
    assert 1.2 < marched.reliable[0] < 1.35 and 0 <= marched.reliable[1] < 0.9
    assert marched.reliable[2] == pytest.approx(S[-1])
    assert np.all(np.isfinite(marched.values))


def test_bad_profiles_are_refused():
    with pytest.raises(InvalidInputError, match="curvature is not finite on 1 of 1"):
        plane_rays(S[None], np.full((1, len(S)), np.nan))
    with pytest.raises(InvalidInputError, match="wavenumber"):
        march_rays(circle(), wavenumber=-1.0, boundary=HARD)
    with pytest.raises(InvalidInputError, match="not marched"):
        march_rays(circle(), wavenumber=20.0, boundary=ELECTRIC_SOFT)
