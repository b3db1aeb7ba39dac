"""Compiled shadow lines: against the panels of `shadow_line`, closed forms, and themselves on the finest mesh."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions, unit
from tolerances import FRACTION, LINE_LENGTH

import creeping as cr
from creeping.geometry.incident import rows_of
from creeping.shadow.arcs import finished
from creeping.shadow.curves import Curves
from creeping.shadow.line import shadow_lines
from creeping.shadow.meshes import LineMeshes, neighbours_of, prepared
from creeping.shadow.refinement import followed
from creeping.shadow.status import NO_RAY, LineStatus

BODIES = {
    "triaxial": lambda: sc.Ellipsoid(1.2, 0.8, 0.6),
    "torus": sc.Torus,
    "twisted": sc.TwistedEllipsoid,
    "peanut": lambda: sc.Implicit("(x**2 + y**2 + z**2 + 0.64)**2 - 2.56*x**2 - 0.6561"),
    "bumpy": lambda: sc.Implicit("x**2 + y**2 + z**2 - 1 - 0.3*sin(3*x)*sin(3*y)*sin(3*z)"),
}
STATUSES = ("attached", "occluded", "concave")


@pytest.mark.parametrize("name", ["torus", pytest.param("bumpy", marks=pytest.mark.slow)])
def test_is_the_shadow_line_of_each_and_that_of_panels(name, rng):
    body = BODIES[name]()
    d = directions(rng, 12)
    lines = shadow_lines(body, d, 64)
    for row in np.flatnonzero(lines.status == LineStatus.OK):
        line = cr.shadow_line(body, d[row])
        assert lines.curves[row] == len(line.curves)
        assert lines.length[row] == pytest.approx(line.length, rel=1e-14)
        for status in STATUSES:
            assert getattr(lines, status)[row] == pytest.approx(line.fractions[status], abs=1e-14)
        np.testing.assert_array_equal(line.launch_points(64).points[0], lines.launch.points[row])
        nodes, panels, distance = followed(body, line.direction, prepared(body).coarsest)
        assert line.length == pytest.approx(sum(curve.length for curve in panels), rel=1e-10)
        shares = finished(body, Curves.of(rows_of(line.wave)[None], [nodes]), 0).shares[0]
        assert list(line.fractions.values()) == pytest.approx(list(shares), abs=1e-8)
        assert lines.singular_distance[row] == pytest.approx(distance, abs=2e-3)
    assert np.mean(lines.status == LineStatus.OK) > 0.8


@pytest.mark.parametrize(
    ("name", "direction", "length", "shares"),
    [
        ("torus", (1, 1, 1), 8.9274357171 + 4.6171835804, None),
        ("twisted", (1, 1, 1), 5.1675274372, (1, 0, 0)),
        ("twisted", (1, 0, 0), 5.1661620318, (1, 0, 0)),
        ("bumpy", (1, 1, 1), 6.5103415915, (1, 0, 0)),
        ("peanut", (1, 0.5, 0.2), 6.3744816923, (0.78261705, 0.05494849, 0.16243446)),
    ],
)
def test_published_lines(name, direction, length, shares):
    lines = shadow_lines(BODIES[name](), unit([direction]), 32)
    assert lines.status[0] == LineStatus.OK
    assert lines.length[0] == pytest.approx(length, rel=LINE_LENGTH)
    if shares:
        assert [getattr(lines, s)[0] for s in STATUSES] == pytest.approx(shares, abs=FRACTION)


def test_rays_start_on_the_attached_line(rng):
    body = BODIES["torus"]()
    lines = shadow_lines(body, directions(rng, 20), 96)
    there = lines.launch.curve_index != NO_RAY
    assert there.all()
    x = lines.launch.points
    assert np.max(np.abs(body.level(x))) < 1e-9
    assert np.max(np.abs(np.einsum("nri,ni->nr", unit(body.gradient(x)), lines.directions))) < 1e-9
    kappa = np.einsum("nri,nrij,nj->nr", lines.directions[:, None] + 0 * x, body.hessian(x), lines.directions)
    assert np.all(kappa > 0)
    np.testing.assert_allclose(np.einsum("nri,ni->nr", x, lines.directions), lines.launch.phase, atol=1e-14)
    # every arc's rays stand for its length
    attached = lines.attached * lines.length
    np.testing.assert_allclose(np.sum(lines.launch.spacing, axis=1), attached, rtol=1e-12)
    assert np.all(lines.launch.curve_index[:, 0] == 0)


@pytest.mark.parametrize("tilt", [1e-4, 1e-3, 5e-3])
def test_lobes_behind_each_other_hide_what_they_hide(tilt):
    # next to the axis of two congruent lobes the pictures of their curves nearly touch
    body, d = BODIES["peanut"](), unit([1, tilt, 0])
    line, away = cr.shadow_line(body, d), np.linspace(1e-3, 4, 4000)[:, None]
    hidden = []
    for curve in line.curves:
        convex = curve.curvature > 0
        blocked = [np.any(body.level(x - away * d) < -1e-9) for x in curve.points]
        hidden.append(np.mean(convex & blocked) * curve.length)
    assert line.fractions["occluded"] == pytest.approx(sum(hidden) / line.length, abs=5e-3)
    assert line.fractions["occluded"] > 0.15
    found = shadow_lines(body, d[None], 40)
    assert found.occluded[0] == pytest.approx(line.fractions["occluded"], abs=1e-12)


def test_singular_incidences_are_refused_and_those_near_reported():
    body = BODIES["torus"]()
    near = [unit([1, 0, v]) for v in (1e-8, 1e-5, 1e-3, 0.3)]
    lines = shadow_lines(body, np.array(near), 32)
    assert lines.status[0] == LineStatus.SINGULAR
    assert np.isnan(lines.length[0]) and np.all(lines.launch.curve_index[0] == NO_RAY)
    assert lines.status[1] in (LineStatus.SINGULAR, LineStatus.NEAR_SINGULAR, LineStatus.FOLLOWED)
    assert lines.status[3] == LineStatus.OK
    np.testing.assert_allclose(lines.singular_distance[2:], [1e-3, near[3][2]], rtol=1e-3)


def test_what_the_meshes_do_not_resolve_is_followed():
    # a loop of length 0.2 next to a singular direction of the bumpy sphere
    body = BODIES["bumpy"]()
    i = np.array([760])
    z, turn = 1 - (2 * i + 1) / 1000, i * np.pi * (3 - np.sqrt(5))
    d = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    lines, line = shadow_lines(body, d, 128), cr.shadow_line(body, d[0])
    assert lines.status[0] in (LineStatus.FOLLOWED, LineStatus.NEAR_SINGULAR)
    assert lines.curves[0] == len(line.curves) == 2
    assert lines.length[0] == pytest.approx(line.length, rel=1e-6)
    assert np.sum(lines.launch.spacing[0]) == pytest.approx(line.length * line.fractions["attached"], rel=1e-6)


def test_an_incidence_does_not_depend_on_its_company(rng):
    body = BODIES["peanut"]()
    d = directions(rng, 40)
    whole, one = shadow_lines(body, d, 64), shadow_lines(body, d[17:18], 64)
    np.testing.assert_array_equal(whole.launch.points[17], one.launch.points[0])
    assert whole.length[17] == one.length[0]


def test_singular_directions_of_the_torus():
    # K = 0 on its top and bottom circles, where the null direction is along them: all d across the axis
    segments = prepared(BODIES["torus"]()).critical
    n, b = segments[..., :3].reshape(-1, 3), segments[..., 3:6].reshape(-1, 3)
    assert np.max(np.abs(np.abs(n[:, 2]) - 1)) < 1e-12
    assert np.max(np.abs(b[:, 2])) < 1e-6
    assert len(prepared(BODIES["triaxial"]()).critical) == 0


def test_meshes_are_closed_and_turn_less_and_less():
    body = BODIES["twisted"]()
    meshes = LineMeshes(body)
    assert np.all(np.diff([meshes.turn(tier) for tier in range(meshes.count)]) < 0)
    for vertices, _, triangles, neighbours, *_ in map(meshes.packed, range(meshes.count)):
        assert vertices.shape[1] - len(triangles) // 2 == 2
        t = np.arange(len(triangles))
        for edge in range(3):
            across = neighbours[:, edge]
            assert np.all(np.any(neighbours[across] == t[:, None], axis=1))
    np.testing.assert_array_equal(
        neighbours_of(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])),
        [[2, 3, 1], [0, 3, 2], [1, 3, 0], [2, 1, 0]],
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["torus", "bumpy"])
def test_thousand_directions_against_the_finest_mesh(name, monkeypatch):
    body = BODIES[name]()
    d = cr.fibonacci_directions(1000)
    found = shadow_lines(body, d, 32)
    meshes = prepared(body)
    monkeypatch.setattr(meshes, "_packed", {tier: meshes.packed(2) for tier in range(meshes.count)})
    exact = shadow_lines(body, d, 32)
    certain = (found.status == LineStatus.OK) & (exact.status == LineStatus.OK)
    assert np.mean(certain) > 0.98
    np.testing.assert_array_equal(found.curves[certain], exact.curves[certain])
    assert np.max(np.abs(found.length / exact.length - 1)[certain]) < 3e-8
    for status in STATUSES:
        assert np.max(np.abs(getattr(found, status) - getattr(exact, status))[certain]) < 1e-6
