"""Lengths and states of shadow lines against closed forms, published digits and a second method."""

import numpy as np
import pytest
import shared_bodies as sc
from scipy.special import ellipe
from tolerances import FRACTION, LINE_LENGTH

import creeping as cr

TORUS, TWISTED, ELLIPSOID = sc.Torus(), sc.TwistedEllipsoid(), sc.Ellipsoid(1.2, 0.8, 0.8)
"""What all lines of a body need of it is made once."""
ROWS = [
    (TWISTED, (1, 1, 1), [5.1675274372]),
    (TWISTED, (0, 1, 0), [5.1946874492]),
    (ELLIPSOID, (1, 1, 1), [6.1340508514]),
    (TORUS, (0, 0, 1), [3 * np.pi, np.pi]),
]


C, B = 0.8, 0.9
# Cassini oval of revolution about x
PEANUT = f"(x**2 + y**2 + z**2 + {C}**2)**2 - 4*{C}**2*x**2 - {B}**4"


@pytest.mark.parametrize("body, direction, lengths", ROWS)
def test_published_lengths(body, direction, lengths):
    line = cr.shadow_line(body, direction)
    np.testing.assert_allclose([curve.length for curve in line.curves], lengths, atol=LINE_LENGTH)
    assert line.fractions["attached"] == 1.0


@pytest.mark.parametrize(
    "body, direction, lengths, shares",
    [
        (lambda: sc.Implicit(PEANUT), (1, 0.5, 0.2), [6.3744816923], (0.78261705, 0.05494849, 0.16243446)),
        (sc.Torus, (1, 1, 1), [8.9274357171, 4.6171835804], (0.55740772, 0.15522848, 0.28736380)),
    ],
)
def test_published_fractions(body, direction, lengths, shares):
    line = cr.shadow_line(body(), direction)
    np.testing.assert_allclose([curve.length for curve in line.curves], lengths, atol=LINE_LENGTH)
    np.testing.assert_allclose(list(line.curves[-1].fractions.values()), shares, atol=FRACTION)
    assert all(curve.fractions["attached"] == 1.0 for curve in line.curves[:-1])


def test_three_curves_on_a_body_without_handles():
    line = cr.shadow_line(sc.Implicit(PEANUT), (1, 0, 0))
    # circles about the axis where the profile y(x) has y' = 0: the waist, and x^2 = c^2 - b^4/(4 c^2) twice
    waist, x2 = np.sqrt(B**2 - C**2), C**2 - B**4 / (4 * C**2)
    bulge = np.sqrt(np.sqrt(B**4 + 4 * C**2 * x2) - C**2 - x2)
    lengths = 2 * np.pi * np.array([bulge, bulge, waist])
    np.testing.assert_allclose([curve.length for curve in line.curves], lengths, atol=LINE_LENGTH)
    assert line.curves[2].fractions["concave"] == pytest.approx(1)


def test_ellipse_of_an_ellipsoid(rng):
    # n.d = 0 is the plane x.A d = 0, A = diag(1/a^2): an ellipse with semi-axes from the plane section
    axes = 1e-3 * np.array([1.3, 0.9, 0.6])
    body = sc.Ellipsoid(*axes)
    for d in rng.normal(size=(5, 3)):
        normal = d / axes**2
        u = np.linalg.svd(normal[None])[2][1:]
        section = np.linalg.eigvalsh(u @ np.diag(1 / axes**2) @ u.T) ** -0.5
        long, short = section.max(), section.min()
        (curve,) = cr.shadow_line(body, d).curves
        assert curve.length == pytest.approx(4 * long * ellipe(1 - (short / long) ** 2), rel=1e-9)


@pytest.mark.parametrize("direction", [(1, 0, 1e-4), (0.2, 1, -0.02)])
def test_torus_near_its_singular_directions(direction):
    # n.d = 0 in closed form: tan(theta) = -(d_x cos psi + d_y sin psi)/d_z, two curves half a turn apart
    d = np.array(direction, dtype=float)
    tilt, turn = np.hypot(d[0], d[1]) / d[2], np.arctan2(d[1], d[0])

    def speed(psi, half):
        lean = -tilt * np.cos(psi - turn)
        theta = np.arctan(lean) + half * np.pi
        slope = tilt * np.sin(psi - turn) / (1 + lean**2)
        return np.hypot(0.5 * slope, 1 + 0.5 * np.cos(theta))

    # the curve turns within d_z of psi - turn = +-pi/2: graded panels of Gauss points
    edges = np.concatenate([[0.0], np.geomspace(1e-9, np.pi / 2, 80)])
    nodes, weights = np.polynomial.legendre.leggauss(20)
    middle, half_width = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    offsets = (middle[:, None] + half_width[:, None] * nodes).ravel()
    w = (half_width[:, None] * weights).ravel()
    at = [turn + centre + side * offsets for centre in (-np.pi / 2, np.pi / 2) for side in (-1, 1)]
    expected = [sum(float(w @ speed(psi, half)) for psi in at) for half in (0, 1)]
    line = cr.shadow_line(TORUS, direction)
    np.testing.assert_allclose(sorted(c.length for c in line.curves), sorted(expected), atol=LINE_LENGTH)


@pytest.mark.parametrize(
    "body, direction, points",
    [
        (TORUS, (1, 0, 0), [(0, 1, 0.5), (0, 1, -0.5), (0, -1, 0.5), (0, -1, -0.5)]),
        (TWISTED, (0, 0, 1), [(0.483694, 0.073349, 0), (-0.483694, 0.073349, 0)]),
    ],
)
def test_singular_incidences_name_their_crossings(body, direction, points):
    with pytest.raises(cr.CreepingError, match="crosses itself") as caught:
        cr.shadow_line(body, direction)
    assert caught.value.distance < 1e-6
    for point in points:
        assert np.linalg.norm(caught.value.points - point, axis=1).min() < 1e-5
    assert "perturb" in str(caught.value)


def test_points_lie_on_the_line_and_are_evenly_spaced():
    body = TWISTED
    (curve,) = cr.shadow_line(body, (0.2, -0.4, 0.9), n_points=333).curves
    assert curve.points.shape == (333, 3)
    assert np.abs(body.level(curve.points)).max() < 1e-12
    assert np.abs(curve.normals @ [0.2, -0.4, 0.9]).max() < 1e-12
    np.testing.assert_allclose(np.diff(curve.arclength), curve.length / 333)
    # a chord is shorter than its arc by (kappa s)^2/24 of it
    chord = np.linalg.norm(np.roll(curve.points, -1, axis=0) - curve.points, axis=1)
    np.testing.assert_allclose(chord, curve.length / 333, rtol=5e-3)
    np.testing.assert_allclose(curve.at(curve.arclength + curve.length), curve.points, atol=1e-12)
    # states of points are those of the arcs
    inner = cr.shadow_line(TORUS, (1, 1, 1)).curves[1]
    assert sum(end - start for start, end, _ in inner.arcs) == pytest.approx(inner.length)
    for start, end, status in inner.arcs:
        s = np.linspace(start, end, 9)[1:-1]
        inside = np.abs((inner.arclength[:, None] - s + 0.5 * inner.length) % inner.length - 0.5 * inner.length)
        assert set(inner.status[inside.argmin(axis=0)]) == {status} or (end - start) < 0.05


def test_bad_input_is_named():
    for n_points in (15, 64.0, True, "64"):
        with pytest.raises(cr.CreepingError, match="n_points"):
            cr.shadow_line(sc.Sphere(), (1, 0, 0), n_points=n_points)
    bad = [((0, 0, 0), "zero vector"), ((np.nan, 0, 1), "not finite"), ([[1, 0, 0]], "shape")]
    for direction, match in [*bad, ("north", "not three numbers"), (None, "shape|not finite|three numbers")]:
        with pytest.raises(cr.CreepingError, match=match):
            cr.shadow_line(sc.Sphere(), direction)


def test_directions_of_any_length():
    for direction, unit in [((3e-300, 0, 0), (1, 0, 0)), ((1e200, 1e200, 0), (1, 1, 0))]:
        expected = cr.shadow_line(ELLIPSOID, unit).length
        assert cr.shadow_line(ELLIPSOID, direction).length == pytest.approx(expected, abs=1e-10)
