"""Far fields of bodies with edges and tips, against stored ones of equations of other kinds (`studies.edges`)."""

import numpy as np
import pytest

from studies import edges

LIMITS = {("cylinder", "hard"): 0.001, ("cylinder", "soft"): 0.001, ("cylinder", "pec"): 0.0015}
"""Root mean square of the error over the largest |f|; of other cases `OTHERS`."""
OTHERS, COVERED = 0.005, 0.95
EVERY = edges.names()


def test_every_far_field_that_is_stored_is_asked_for():
    assert len(EVERY) == 12 and set(LIMITS) <= set(EVERY)


@pytest.mark.parametrize("case", [("ogive", "hard"), ("cylinder", "hard")], ids="-".join)
def test_far_field_of_the_cheapest_bodies(case):
    found = edges.row(*case, incidences=1)
    assert found.rms < LIMITS.get(case, OTHERS) and found.covered >= COVERED


@pytest.mark.slow
def test_far_fields_and_their_stated_errors():
    found = {case: edges.row(*case) for case in EVERY}
    off = {case: row.rms for case, row in found.items() if row.rms > LIMITS.get(case, OTHERS)}
    assert not off
    covered = np.concatenate([row.true <= row.stated for row in found.values()])
    assert np.mean(covered) >= COVERED
