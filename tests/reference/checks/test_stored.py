"""Stored references: a file for each case and none besides; computed anew they are the same."""

import numpy as np
import pytest

from tests.reference import stored


def test_every_case_has_its_file_and_every_file_its_case():
    files = {path.stem: path.stat().st_size for path in stored.FOLDER.iterdir()}
    assert set(files) == set(stored.cases())
    assert max(files.values()) < 200_000 and sum(files.values()) < 2_000_000
    assert all(np.all(np.isfinite(array)) for name in files for array in stored.read(name).values())


@pytest.mark.slow
@pytest.mark.parametrize("name", stored.cases())
def test_computed_anew_they_are_the_same(name):
    now, then = stored.cases()[name](), stored.read(name)
    assert set(now) == set(then)
    # the limit of sources at some heights, which multiplies what another LAPACK differs by
    spread = then.pop("spread", None)
    for key, values in now.items():
        if key == "spread":
            assert 0.5 < np.median(values) / np.median(spread) < 2
            continue
        # least squares of ill-conditioned sources: another LAPACK differs by more than rounding
        off, most = np.abs(then[key] - values), 1e-6 * np.abs(values).max()
        if spread is not None and key == "values":
            most = 1e3 * most + 3 * spread.reshape(*spread.shape, *(1,) * (values.ndim - 2))
        assert np.all(off <= most), np.max(off - most)
