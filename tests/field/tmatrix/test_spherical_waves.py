"""Spherical waves: derivatives, plane waves of them, and the phases of treams."""

import numpy as np
import pytest

from creeping.field.results.far_result import spherical_frame
from creeping.field.tmatrix.spherical_waves import (
    combined,
    degrees,
    far_vectors,
    gradients,
    harmonics,
    regular,
    vector_degrees,
    vector_parts,
)

RNG = np.random.default_rng(1)
X, K, ORDER = RNG.normal(size=(5, 3)), 1.7, 7
TREAMS = {
    # treams 0.4.7: vsw_rM and vsw_rN at (0.3, -0.7, 0.5), k = 2.5, Cartesian components
    (1, -1): (
        (0.057883953409 + 0j, -0.057883953409j, -0.034730372046 - 0.081037534773j),
        (-0.014511621921 + 0.041478133922j, 0.069119318534 - 0.014511621921j, -0.024186036536 + 0.01036544423j),
    ),
    (3, -2): (
        (-0.004701075858 + 0.002285245209j, 0.007312784667 - 0.008814517233j, 0.013058544049 - 0.013711471251j),
        (-0.032804476057 + 0.01155595979j, 0.017511614791 + 0.035019864632j, -0.021616115663 - 0.020586776822j),
    ),
    (5, 4): (
        (0.000367691746 - 0.000340299945j, 0.00010940269 + 0.000841249103j, -6.7451282e-05 + 0.001381928711j),
        (-0.001518641878 - 0.003812189308j, 0.004046218352 - 0.001404533918j, -0.001715681448 - 8.3741594e-05j),
    ),
}


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_gradients_are_those_of_differences(axis):
    step = 1e-5 * np.eye(3)[axis]
    want = (regular(X + step, K, ORDER) - regular(X - step, K, ORDER)) / (2e-5 * K)
    found = combined(regular(X, K, ORDER + 1), gradients(ORDER), np.broadcast_to(np.eye(3)[axis], X.shape))
    assert np.abs(found - want).max() < 1e-9


def test_a_plane_wave_is_a_sum_of_scalar_waves():
    d = X / np.linalg.norm(X, axis=1, keepdims=True)
    y = 0.5 * RNG.normal(size=(4, 3))
    deg, _ = degrees(20)
    found = (4 * np.pi * 1j**deg * harmonics(d, 20).conj()) @ regular(y, K, 20).T
    assert np.abs(found - np.exp(1j * K * (d @ y.T))).max() < 1e-12


def test_a_plane_wave_is_a_sum_of_vector_waves():
    d = X / np.linalg.norm(X, axis=1, keepdims=True)
    y = 0.3 * RNG.normal(size=(4, 3))
    deg, _, _ = vector_degrees(16)
    waves = np.stack([(part.T @ regular(y, K, 17).T).T for part in vector_parts(16)], axis=1)
    found = np.einsum("yxw,ncw->nycx", 4 * np.pi * 1j**deg * waves, far_vectors(d, 16).conj())
    want = np.exp(1j * K * (d @ y.T))[:, :, None, None] * spherical_frame(d)[:, None]
    assert np.abs(found - want).max() < 1e-12


@pytest.mark.parametrize("wave", list(TREAMS))
def test_phases_are_those_of_treams(wave):
    deg, m = wave
    number = 2 * (deg * (deg + 1) + m - 1)
    table = regular(np.array([[0.3, -0.7, 0.5]]), 2.5, 6)
    found = np.concatenate([(part.T @ table.T).T for part in vector_parts(5)])
    M, N = TREAMS[wave]
    assert np.abs(found[:, number] - N).max() < 1e-11 and np.abs(found[:, number + 1] - M).max() < 1e-11


def test_at_the_centre_and_on_the_axis():
    at = regular(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -2.0]]), K, 4)
    _, m = degrees(4)
    assert np.all(np.isfinite(at)) and at[0, 0] == pytest.approx(1 / np.sqrt(4 * np.pi))
    assert np.abs(at[0, 1:]).max() == 0 and np.abs(at[1, m != 0]).max() < 1e-15
