"""Far fields of sources by reciprocity: against the series of a sphere, fundamental solutions, and limits."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from studies.accuracy.bodies import bodies
from tests.reference import fundamental, sphere

K = 25.0
TOWARDS = cr.fibonacci_directions(3)


@pytest.fixture(scope="module")
def flow():
    return cr.DirectFlow(sc.Sphere(), rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_sphere_at_all_distances(flow, boundary):
    place = np.array([0.36, -0.48, 0.8])
    distances = np.array([1.0, 1.3, 3.0, 50.0])[1 if boundary == "soft" else 0 :]
    found = cr.source_pattern(flow, distances[:, None] * place, TOWARDS, wavenumber=K, boundary=boundary)
    exact = np.stack(
        [sphere.total_field(K, 1.0, distances[:, None] * place * (1 + 1e-12), -r, boundary) for r in TOWARDS]
    )
    off = np.abs(found.values - exact)
    assert np.max(off) < 0.02 * np.max(np.abs(exact))
    assert np.mean(off <= found.error) > 0.9
    assert np.all(found.ok)


@pytest.mark.slow
def test_twisted_ellipsoid_against_fundamental_solutions():
    body, cloud, depth = bodies()["twisted"]
    points = [(0.0, 0.9, 0.3), (1.5, -0.2, 0.4)]
    found = cr.source_pattern(cr.DirectFlow(body, rtol=1e-7), points, TOWARDS, wavenumber=12.0)
    solution = fundamental.scatter(cloud, 12.0, -TOWARDS, "hard", depth=depth, per_wavelength=8.0)
    off = np.abs(found.values - solution.total(np.array(points)).T)
    assert np.mean(off <= found.error) > 0.9
    assert np.median(off) < 0.05


@pytest.mark.slow
def test_far_from_the_body_the_source_is_alone(flow):
    source = np.array([0.0, 3e3, 4e3])
    found = cr.source_pattern(flow, source, TOWARDS[:2], wavenumber=K)
    ahead = np.abs(found.values[:, 0] - np.exp(-1j * K * (TOWARDS[:2] @ source)))
    assert np.max(ahead) < 2e-3


def test_labels_and_words(flow):
    found = cr.source_pattern(flow, [(0, 0, 1), (0, 0, 2)], TOWARDS[:3], wavenumber=K)
    table = found.to_xarray()
    assert table["pattern"].dims == ("direction", "source")
    assert np.array_equal(table["pattern"].values, found.values)
    assert len(found.to_dataframe()) == 6
    assert "3 directions x 2 sources" in repr(found)
    assert np.allclose(found.decibels, 20 * np.log10(np.abs(found.values)))


def test_bad_sources_are_named(flow):
    with pytest.raises(cr.InvalidInputError, match="inside the body"):
        cr.source_pattern(flow, (0, 0, 0.5), TOWARDS, wavenumber=K)
    with pytest.raises(cr.InvalidInputError, match="no sources"):
        cr.source_pattern(flow, np.zeros((0, 3)), TOWARDS, wavenumber=K)
