"""The study of stated errors: its references against series, its table's rows, torus included."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions

from studies.accuracy import bodies
from studies.accuracy import field_coverage as coverage
from tests.reference import clouds, dipoles


def test_the_frames_of_the_conducting_ball(rng):
    d, r = directions(rng, 1)[0], directions(rng, 20)
    solution = dipoles.scatter(clouds.ellipsoid(1, 1, 1), 3.0, d, depth=0.3)
    assert solution.residual.max() < 1e-3
    np.testing.assert_allclose(bodies.conducting_ball(3.0, d, r), solution.far_field(r)[:, 0], atol=2e-3)


@pytest.mark.parametrize(
    "name, boundary",
    [("sphere", "soft"), *(pytest.param("triaxial", kind, marks=pytest.mark.slow) for kind in ("soft", "pec"))],
)
def test_row_of_the_table(name, boundary, monkeypatch):
    if name == "sphere":
        # the other bodies take seconds to examine
        monkeypatch.setattr(coverage, "bodies", lambda: {"sphere": (sc.Sphere(), clouds.ellipsoid(1, 1, 1), 0.2)})
        monkeypatch.setattr(coverage, "INCIDENCES", 1)
    rows = coverage.rows(name, 8.0, boundary, 108)
    assert len(rows) == coverage.INCIDENCES
    for row in rows:
        assert row["true"] / row["ext"] < 2.5 and row["ext"] / row["true"] < 2.5
        assert row["cover"] > 90
        # off, and neither flagged nor covered, per cent: of a conductor 3 of its 2400 amplitudes
        assert row["silent"] < 0.2
        assert row["false"] == 0
