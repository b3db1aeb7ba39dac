"""T-matrices over wavenumbers and averages over orientations: against rings of sources, a store, a cluster, kills."""

from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc
from ended import ending_at, killed, stamps

import creeping as cr
from creeping.field.tmatrix import solved_waves
from creeping.storage import folder as folders
from tests.reference.revolution import scatter_by_rings, spheroid_profile, wave_directions

ASKED = {"wavenumbers": [1.0, 2.0, 1.5], "boundary": "soft"}


def averaged_by_rings(k):
    """Mean target strength, dB, of the hard spheroid 0.25 x 0.25 x 1: Gauss's rule over the polar angle."""
    u, w = np.polynomial.legendre.leggauss(2 * int(np.ceil(2 * k + 12)))
    theta, w = np.arccos(u[u > 0]), w[u > 0]
    solution = scatter_by_rings(spheroid_profile(0.25, 1.0), k, theta, "hard")
    assert solution.residual.max() < 1e-5
    f = np.diagonal(solution.far_field(-wave_directions(theta)))
    return 10 * np.log10(w @ np.abs(f) ** 2)


@pytest.mark.slow
def test_the_average_of_a_long_spheroid_is_that_by_rings():
    k = [1.0, 5.0, 10.0, 20.0]
    found = cr.orientation_averages(sc.Ellipsoid(0.25, 0.25, 1.0), wavenumbers=k, boundary="hard")
    off = np.abs(found.target_strength.values - [averaged_by_rings(one) for one in k])
    assert off.max() < 1e-3 and np.all(off < found.target_strength_error.values)
    assert np.abs(found.scattering / found.extinction - 1).max() < 1e-5


@pytest.mark.slow
def test_averages_stand_with_their_units_and_errors():
    found = cr.orientation_averages(sc.Sphere(), **ASKED)
    assert found.wavenumber.values.tolist() == ASKED["wavenumbers"] and found.backscattering.units == "L^2"
    for row, T in enumerate(cr.t_matrices(sc.Sphere(), **ASKED)):
        # a sphere has the same in each direction
        one = 20 * np.log10(np.abs(T.backscatter((0.3, 0.4, 0.5)).total[0]))
        assert abs(found.target_strength.values[row] - one) < found.target_strength_error.values[row] < 0.01
        assert found.scattering.values[row] == T.orientation_average().scattering


@pytest.mark.parametrize("boundary", ["hard", "pec"])
def test_the_stated_error_covers_a_matrix_that_is_off(boundary):
    T = next(cr.t_matrices(sc.Ellipsoid(0.5, 0.4, 0.3), wavenumbers=3.0, boundary=boundary))
    one, other = np.random.default_rng(3).normal(size=(2, *T.matrix.shape))
    off = replace(T, matrix=T.matrix + 1e-3 * np.linalg.norm(T.matrix) / len(T.matrix) * (one + 1j * other))
    exact, found = T.orientation_average(), off.orientation_average()
    assert abs(found.backscattering - exact.backscattering) < found.error < 0.05 * exact.backscattering


def test_what_cannot_be_is_refused_before_the_first():
    with pytest.raises(cr.InvalidInputError, match="give seconds="):
        cr.t_matrices(sc.Sphere(), wavenumbers=[1.0, 30.0], boundary="soft", seconds=0.5)
    for bad in ([], [[1.0]], [1.0, np.nan], "10 GHz"):
        with pytest.raises(cr.InvalidInputError, match="wavenumber"):
            cr.t_matrices(sc.Sphere(), wavenumbers=bad, boundary="soft")


@pytest.mark.slow
def test_interrupted_it_goes_on_to_the_same_bits(tmp_path, monkeypatch):
    monkeypatch.setattr(solved_waves, "COLUMNS", 8)
    body, told, asked = sc.Ellipsoid(0.5, 0.6, 1.0), [], ASKED | {"order": 2}
    expected = [T.matrix.tobytes() for T in cr.t_matrices(body, **asked)]
    with ending_at(folders, "_digest", 0) as calls:
        list(cr.t_matrices(body, store=tmp_path / "whole", **asked))
    for end in (calls[0] // 3 + 2, calls[0] - 1):
        folder = tmp_path / str(end)
        with ending_at(folders, "_digest", end):
            list(cr.t_matrices(body, store=folder, **asked))
        before = stamps(folder, "*/matrix/manifest.json")
        assert 0 < len(before) < 3
        found = cr.t_matrices(body, store=folder, progress=lambda *numbers: told.append(numbers[:2]), **asked)
        assert [T.matrix.tobytes() for T in found] == expected
        assert before.items() <= stamps(folder, "*/matrix/manifest.json").items()
    assert told[:3] == [(1, 3), (2, 3), (3, 3)]


CODE = """
import creeping as cr, scatterers as sc
cr.orientation_averages(sc.Ellipsoid(0.5, 0.6, 1.0), wavenumbers=[2, 3, 4, 5], boundary="pec", store={folder!r})
"""


@pytest.mark.slow
def test_killed_20_times_whole_matrices_remain(tmp_path):
    body, rng, kills, begun = sc.Ellipsoid(0.5, 0.6, 1.0), np.random.default_rng(7), 0, 0
    asked = {"wavenumbers": [2.0, 3.0, 4.0, 5.0], "boundary": "pec"}
    expected = cr.orientation_averages(body, **asked)
    while kills < 20:
        folder, done = tmp_path / str(begun), False
        begun += 1
        while not done and kills < 20:
            before = stamps(folder, "*/matrix/manifest.json")
            done = killed(CODE.format(folder=str(folder)), rng.uniform(0.0, 1.5), lambda: any(folder.glob("*/*")))  # noqa: B023
            kills += not done
            assert before.items() <= stamps(folder, "*/matrix/manifest.json").items()
        assert cr.orientation_averages(body, store=folder, **asked).identical(expected)


@pytest.mark.slow
def test_a_cluster_gives_the_same_bits():
    pytest.importorskip("distributed")
    from creeping.sweeping.cluster import local_client

    body = sc.Ellipsoid(0.5, 0.6, 1.0)
    expected = [T.matrix.tobytes() for T in cr.t_matrices(body, **ASKED)]
    with local_client(2) as client:
        assert [T.matrix.tobytes() for T in cr.t_matrices(body, client=client, **ASKED)] == expected
        with pytest.raises(cr.InvalidInputError, match="order"):
            list(cr.t_matrices(body, client=client, order=-1, **ASKED))
