"""The field on bodies with no series, against fundamental solutions, and reciprocity: slow tests."""

import numpy as np
import pytest

from studies import field_bodies as bodies

pytestmark = pytest.mark.slow
FACTOR = 1.5
SURFACE = {("soft", 20.0): 7.0, ("soft", 40.0): 6.0, ("hard", 20.0): 7.0, ("hard", 40.0): 3.0}
"""Largest of the prototype's medians on the surface at second order, per cent."""
NEAR = {("soft", 20.0): 9.0, ("soft", 40.0): 6.0, ("hard", 20.0): 3.5, ("hard", 40.0): 3.0}
"""The prototype's medians near the body, all reaches, per cent."""
LARGEST = {("soft", 20.0): 1.0, ("soft", 40.0): 1.0, ("hard", 20.0): 1.3, ("hard", 40.0): 1.0}
"""Largest error of the far field, share of |f| ahead; 1 is the aim, hard at k = 20 reaches 1.2."""

BEHIND = {("hard", 20.0): 6}
"""Unresolved directions of 600 at most, 2 if nothing is said: where soft waves and short ones have died out."""

CASES = [(*which, incidence) for which in bodies.PROTOTYPE for incidence in range(3)]


@pytest.mark.parametrize(("boundary", "k", "incidence"), CASES)
def test_far_field_of_the_triaxial_ellipsoid(boundary, k, incidence):
    assert bodies.reference("triaxial", boundary, k).residual.max() < 4e-5
    far = bodies.far_errors("triaxial", boundary, k, incidence)
    assert np.all(np.array(far["medians"]) <= FACTOR * np.array(bodies.PROTOTYPE[boundary, k]))
    assert far["largest"] <= LARGEST[boundary, k]
    # on ground with K > 0 a ray turns by 90 deg before it meets another fold than its launch point's, which the forward
    # lobe serves; turned back, a wave may err by all of itself while it merges, and its direction says so
    assert far["unresolved_ahead"] == 0 and far["covered"]
    assert far["unresolved"] <= BEHIND.get((boundary, k), 2)


@pytest.mark.parametrize(("boundary", "k", "incidence"), CASES)
def test_no_jumps_along_a_scan(boundary, k, incidence):
    assert bodies.scan_jump("triaxial", boundary, k, incidence, 0.4) <= 0.5


@pytest.mark.parametrize(("boundary", "k", "incidence"), CASES)
def test_surface_field_of_the_triaxial_ellipsoid(boundary, k, incidence):
    second, _ = bodies.surface_errors("triaxial", boundary, k, incidence, 2)
    first, _ = bodies.surface_errors("triaxial", boundary, k, incidence, 1)
    assert np.median(second) <= FACTOR * SURFACE[boundary, k]
    assert np.all(np.array(second) < 0.5 * np.array(first))


@pytest.mark.parametrize(
    ("boundary", "k", "incidence"),
    [case for case in CASES if case[2] == 0],
)
def test_near_field_of_the_triaxial_ellipsoid(boundary, k, incidence):
    _, (every, _, tube) = bodies.near_errors("triaxial", boundary, k, incidence)
    assert every <= FACTOR * NEAR[boundary, k]
    assert tube < 1.0


@pytest.mark.parametrize("name", ["triaxial", "twisted"])
@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_reciprocity(name, boundary):
    """Within the error of the field itself: 1 per cent, 2 on the body that is not convex."""
    assert bodies.reciprocity(name, boundary, 20.0) < (1.0 if name == "triaxial" else 2.0)
