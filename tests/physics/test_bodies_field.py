"""The field on bodies with no series, against fundamental solutions, and reciprocity: slow tests."""

import numpy as np
import pytest

import creeping as cr
from creeping.field.waves.far_geometry import fan_strips
from creeping.rays.shedding import shed_near
from creeping.shadow.attachment import occluded
from studies.accuracy import field as bodies

pytestmark = pytest.mark.slow
FACTOR = 1.5
PROTOTYPE = {
    ("soft", 20.0): (1.9, 7, 2.2, 1.8, 1.0, 0.9, 1.1),
    ("soft", 40.0): (4, 1.7, 1.3, 0.9, 0.5, 0.5, 0.6),
    ("hard", 20.0): (5, 11, 4.5, 2.5, 1.6, 1.1, 1.6),
    ("hard", 40.0): (4, 2.6, 1.9, 1.0, 0.6, 0.6, 0.7),
}
"""Medians of a prototype of the far field in the sectors of `studies.accuracy.field`, per cent."""
SURFACE = {("soft", 20.0): 7.0, ("soft", 40.0): 6.0, ("hard", 20.0): 7.0, ("hard", 40.0): 3.0}
"""Largest of the prototype's medians on the surface at second order, per cent."""
NEAR = {("soft", 20.0): 9.0, ("soft", 40.0): 6.0, ("hard", 20.0): 3.5, ("hard", 40.0): 3.0}
"""The prototype's medians near the body, all reaches, per cent."""
LARGEST = {("soft", 20.0): 1.0, ("soft", 40.0): 1.0, ("hard", 20.0): 1.3, ("hard", 40.0): 1.0}
"""Largest error of the far field, share of |f| ahead; 1 is the aim, hard at k = 20 reaches 1.2."""

BEHIND = {("hard", 20.0): 6}
"""Unresolved directions of 600 at most, 2 if nothing is said: where soft waves and short ones have died out."""

REACHES = (0.05, 0.2, 0.5, 1.0, 2.0)

CASES = [(*which, incidence) for which in PROTOTYPE for incidence in range(3)]


def scan_jump(name, boundary, k, incidence, azimuth):
    """Largest change of the error between neighbours of a scan, 0 to 180 deg by 1.25, as a share of |f| ahead."""
    fan = bodies.fan_of(name, incidence)
    d = fan.line.direction
    e = np.cross(d, [0, 0, 1.0])
    e /= np.linalg.norm(e)
    side = np.cos(azimuth) * e + np.sin(azimuth) * np.cross(d, e)
    theta = np.radians(np.arange(0, 180.1, 1.25))[:, None]
    r = np.cos(theta) * d + np.sin(theta) * side
    found = cr.far_field(fan, r, wavenumber=k, boundary=boundary, method="rays").total
    error = found - bodies.reference(name, boundary, k).far_field(r)[:, incidence]
    return float(100 * np.max(np.abs(np.diff(error))) / bodies.largest(name, boundary, k, incidence))


def near_errors(name, boundary, k, incidence):
    """Total field off the body in the shadow by rays, launched at s = 0.15 to 1.1: medians by reach, and at all.

    Points on caustics in space, |J + l J'| < 0.25 on a ray through them, are left out. The second list holds the median
    over all points, the largest error as a share of the largest value, and the least |J + l J'| at that point.
    """
    solution, fan = bodies.reference(name, boundary, k), bodies.fan_of(name, incidence)
    strip = fan_strips(fan)[0]
    rng = np.random.default_rng(0)
    medians, shares, errors, tubes, sizes = [], [], [], [], []
    for reach in REACHES:
        start = strip.at(rng.uniform(*strip.span, 150), rng.uniform(0.15, 1.1, 150))
        y = start.points + reach * start.directions
        y = y[occluded(fan.body, y, fan.line.direction)]
        shed = shed_near(fan_strips(fan), fan.body, y)
        tube = np.full(len(y), np.inf)
        np.minimum.at(tube, shed.observer, np.abs(shed.rays.spreading + shed.reach * shed.rays.spreading_rate))
        y, tube = y[tube > 0.25], tube[tube > 0.25]
        found = cr.near_field(fan, y, wavenumber=k, boundary=boundary, method="rays")
        exact = solution.total(y)[:, incidence]
        errors.append(np.abs(found - exact))
        sizes.append(np.abs(exact))
        shares.append(100 * errors[-1] / sizes[-1])
        tubes.append(tube)
        medians.append(float(np.median(shares[-1])))
    error, size, tube = np.concatenate(errors), np.concatenate(sizes), np.concatenate(tubes)
    at = int(np.argmax(error))
    return medians, [float(np.median(np.concatenate(shares))), float(100 * error[at] / size.max()), float(tube[at])]


def reciprocity(name, boundary, k):
    """Largest |f(d -> r) - f(-r -> -d)| over pairs 8 to 150 deg apart, share of the largest |f| ahead, per cent."""
    body = bodies.BODIES[name][0]
    flow = cr.build_phase_map(body, tolerance=1e-6)
    rng = np.random.default_rng(1)
    worst, ahead = 0.0, 0.0
    for theta in np.radians([8.0, 15, 22, 30, 40, 60, 90, 120, 150]):
        d, side = rng.normal(size=(2, 3))
        d = d / np.linalg.norm(d)
        side = np.cross(d, side)
        r = np.cos(theta) * d + np.sin(theta) * side / np.linalg.norm(side)
        both = []
        for incident, observer in ((d, r), (-r, -d)):
            fan = cr.launch(flow, cr.shadow_line(body, incident), length=5.0, n_rays=256)
            found = cr.far_field(fan, [observer, incident], wavenumber=k, boundary=boundary, method="rays").total
            both.append(found[0])
            ahead = max(ahead, abs(found[1]))
        worst = max(worst, abs(both[0] - both[1]))
    return 100 * worst / ahead


@pytest.mark.parametrize(("boundary", "k", "incidence"), CASES)
def test_far_field_of_the_triaxial_ellipsoid(boundary, k, incidence):
    assert bodies.reference("triaxial", boundary, k).residual.max() < 4e-5
    far = bodies.far_errors("triaxial", boundary, k, incidence)
    assert np.all(np.array(far["medians"]) <= FACTOR * np.array(PROTOTYPE[boundary, k]))
    assert far["largest"] <= LARGEST[boundary, k]
    # on ground with K > 0 a ray turns by 90 deg before it meets another fold than its launch point's, which the forward
    # lobe serves; turned back, a wave may err by all of itself while it merges, and its direction says so
    assert far["unresolved_ahead"] == 0 and far["covered"]
    assert far["unresolved"] <= BEHIND.get((boundary, k), 2)


@pytest.mark.parametrize(("boundary", "k", "incidence"), CASES)
def test_no_jumps_along_a_scan(boundary, k, incidence):
    assert scan_jump("triaxial", boundary, k, incidence, 0.4) <= 0.5


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
    _, (every, _, tube) = near_errors("triaxial", boundary, k, incidence)
    assert every <= FACTOR * NEAR[boundary, k]
    assert tube < 1.0


@pytest.mark.parametrize("name", ["triaxial", "twisted"])
@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_reciprocity(name, boundary):
    """Within the error of the field itself: 1 per cent, 2 on the body that is not convex."""
    assert reciprocity(name, boundary, 20.0) < (1.0 if name == "triaxial" else 2.0)
