"""What is asked of a T-matrix: far fields, cross sections, averages, turned and moved bodies."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.results.far_result import spherical_frame

RNG = np.random.default_rng(4)
D, R = RNG.normal(size=(2, 6, 3))
POLES = np.array([[0, 0, 1.0], [0, 0, -1.0], [0.1, 0.2, 0.3], [1, 0, 0]])
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@pytest.fixture(name="T", scope="module", params=["hard", pytest.param("pec", marks=pytest.mark.slow)])
def of_an_ellipsoid(request):
    # any matrix will do, a reciprocal and lossless one tells more
    return cr.t_matrix(sc.Ellipsoid(0.5, 0.4, 0.3), wavenumber=3.0, boundary=request.param, center=(0.1, 0.0, 0.05))


def unit(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def vectors(values, d, r):
    """Far fields (m, n, ...) as vectors or numbers that do not depend on frames."""
    if values.ndim == 2:
        return values
    return np.einsum("nox,mnoi,miy->mnxy", spherical_frame(unit(r)), values, spherical_frame(unit(d)))


def test_pairs_are_those_of_all_with_all(T):
    every, pairs = T.bistatic(D, R), T.bistatic(D, R, pairs=True)
    rows = np.arange(len(D))
    assert np.allclose(every.values[rows, rows], pairs.values, atol=1e-12)
    assert np.allclose(every.error[rows, rows], pairs.error)
    assert every.values.shape == (6, 6, *(2, 2)[: 2 * T.vector]) == every.error.shape


def test_the_far_field_of_one_incidence(T):
    far = T.far_field(D[0], R)
    assert isinstance(far, cr.FarField) and set(far.method) == {"t-matrix"} and far.parts == {}
    assert np.allclose(far.total, T.bistatic(D[:1], R).values[0]) and "t-matrix" in repr(far)
    assert far.error.shape == far.total.shape and not far.unresolved.any()
    assert far.to_xarray()["total"].shape == far.total.shape and np.all(np.isfinite(far.dbsm))


def test_backscatter_is_a_series(T):
    d = np.concatenate([D, POLES, cr.fibonacci_directions(2 * T.order)])
    found, want = T.backscatter(d), T.bistatic(d, -d, pairs=True)
    assert np.abs(found.total - want.values).max() < 1e-7 * np.abs(want.values).max()
    assert np.allclose(found.directions, -unit(d)) and found.error.shape == found.total.shape
    few = T.backscatter(d[:9])
    assert np.abs(few.total - found.total[:9]).max() < 1e-7 * np.abs(want.values).max()
    assert np.allclose(few.error, found.error[:9], rtol=1e-3)


def test_cross_sections(T):
    sections = T.cross_sections(D)
    assert np.abs(sections.absorption).max() < 1e-4 * sections.extinction.max()
    # scattering is what all directions have together
    r = cr.fibonacci_directions(4000)
    size = np.abs(T.bistatic(D, r).values) ** 2
    mean = np.mean(size if size.ndim == 2 else size.sum(axis=2), axis=1)
    assert np.allclose(sections.scattering, 4 * np.pi * mean, rtol=1e-4)


def test_averages_are_means_over_directions(T):
    averages = T.orientation_average()
    d = cr.fibonacci_directions(4000)
    sections, back = T.cross_sections(d), T.backscatter(d).total.reshape(len(d), -1)
    share = 2 if T.vector else 1
    assert averages.scattering == pytest.approx(sections.scattering.mean(), rel=1e-4)
    assert averages.extinction == pytest.approx(sections.extinction.mean(), rel=1e-4)
    backscattering = 4 * np.pi * np.mean(np.sum(np.abs(back) ** 2, axis=1)) / share
    assert averages.backscattering == pytest.approx(backscattering, rel=1e-4)
    assert averages.target_strength == pytest.approx(10 * np.log10(backscattering / (4 * np.pi)), abs=1e-3)
    turned = T.rotate(TURN).orientation_average()
    assert np.allclose(averages, turned, rtol=1e-9)


def test_a_turned_body_scatters_turned_waves(T):
    turned = T.rotate(TURN)
    want = vectors(T.bistatic(D, R).values, D, R)
    found = vectors(turned.bistatic(D @ TURN.T, R @ TURN.T).values, D @ TURN.T, R @ TURN.T)
    if T.vector:
        want = np.einsum("ax,mnxy,by->mnab", TURN, want, TURN)
    assert np.abs(found - want).max() < 1e-11 and np.allclose(turned.center, TURN @ T.center)
    assert np.abs(turned.rotate(TURN.T).matrix - T.matrix).max() < 1e-12
    assert turned.reciprocity == pytest.approx(T.reciprocity, rel=1e-4)


def test_a_moved_body_has_phases(T):
    v = np.array([0.3, -0.2, 0.5])
    phase = np.exp(1j * T.wavenumber * ((unit(D) @ v)[:, None] - unit(R) @ v))
    want = T.bistatic(D, R).values * phase.reshape(6, 6, *(1, 1)[: 2 * T.vector])
    assert np.abs(T.translate(v).bistatic(D, R).values - want).max() < 1e-12


def test_another_centre_is_the_same_field(T):
    moved = T.about((0.2, -0.3, 0.1), T.order + 6)
    assert np.abs(moved.bistatic(D, R).values - T.bistatic(D, R).values).max() < 1e-5
    assert np.abs(moved.about(T.center, T.order).matrix - T.matrix).max() < 1e-5
    assert T.about((0.2, -0.3, 0.1)).order == T.order + 1


def test_reciprocity_sees_what_is_not_reciprocal(T):
    assert T.reciprocity < 1e-4 and T.unitarity < 1e-4
    noise = RNG.normal(size=T.matrix.shape) * 1e-3
    other = replace(T, matrix=T.matrix + noise)
    share = np.linalg.norm(noise) / np.linalg.norm(T.matrix)
    assert other.reciprocity == pytest.approx(np.sqrt(2) * share, rel=0.2) and other.unitarity > share
    assert other.error > 10 * T.error
    assert np.isnan(replace(T, absorbing=True).unitarity) and np.isfinite(replace(T, absorbing=True).error)


def test_it_tells_what_it_is(T):
    text = repr(T)
    assert f"order {T.order}" in text and "Ellipsoid" in text and "reciprocity" in text
    data = T.to_xarray()
    assert data["T"].shape == T.matrix.shape and data.attrs["wavenumber"] == 3.0
    assert ("polarisation_incoming" in data.coords) == T.vector


def test_bad_questions_are_refused(T):
    with pytest.raises(cr.InvalidInputError, match="one incidence"):
        T.far_field(D, R)
    with pytest.raises(cr.InvalidInputError, match="no pairs"):
        T.bistatic(D, R[:2], pairs=True)
    with pytest.raises(cr.InvalidInputError, match="is zero"):
        T.backscatter([(0, 0, 0)])
    with pytest.raises(cr.InvalidInputError, match="no rotation"):
        T.rotate(-np.eye(3))
    for call in (T.translate, T.about):
        with pytest.raises(cr.InvalidInputError, match="three numbers"):
            call((0, 0))
    with pytest.raises(cr.InvalidInputError, match="not finite"):
        replace(T, matrix=T.matrix * np.nan)
    with pytest.raises(cr.InvalidInputError, match="shape"):
        replace(T, matrix=T.matrix[:-1, :-1])
