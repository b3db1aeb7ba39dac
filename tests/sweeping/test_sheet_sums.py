"""The sums over sheets against the plain formulas."""

import numpy as np
import pytest

from creeping.sweeping.between import sheet_sums


@pytest.mark.parametrize("columns", [1, 5, 16])
def test_sums_are_those_of_the_plain_formulas_in_any_company(columns):
    nodes = 6
    rng = np.random.default_rng(columns)
    a = rng.normal(size=(4, nodes, columns)) + 1j * rng.normal(size=(4, nodes, columns))
    paths, label = rng.normal(size=(4, nodes)), np.array([0, 1, 1, 3])
    six, errors = rng.normal(size=(7, nodes)), rng.normal(size=(3, 7, nodes))
    k = rng.uniform(5, 50, columns)
    sums = sheet_sums(a, paths, label, six, errors, k, 4)
    between, length = np.einsum("ij,sjk->isk", six, a), six @ paths.T
    waves = between * np.exp(1j * k * length[..., None])
    turn = k * np.abs(between) * np.abs(np.einsum("eij,sj->eis", errors, paths))[..., None]
    off = np.max(np.abs(np.einsum("eij,sjk->eisk", errors, a)) + turn, axis=0)
    for found, each in zip(sums, (waves, off, off**2, np.abs(between) ** 2), strict=True):
        total = np.zeros((7, 4, columns), dtype=each.dtype)
        for sheet in range(4):
            total[:, label[sheet]] += each[:, sheet]
        np.testing.assert_allclose(found, total, rtol=1e-9, atol=1e-9)
    alone = sheet_sums(a, paths, label, six[3:4], errors[:, 3:4], k, 4)
    for one, found in zip(alone, sums, strict=True):
        np.testing.assert_array_equal(one[0], found[3])
