"""T-matrices against the series of spheres and against solutions of one incidence at a time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import spherical_jn, spherical_yn

import creeping as cr
import scatterers as sc
from creeping.field.boundary import scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.currents import inside_points
from creeping.field.equation.effort import equation_boundary
from creeping.field.equation.matrix import Matrix
from creeping.field.equation.mirrors import mirrors_of, no_mirrors
from creeping.field.tmatrix import computing
from creeping.field.tmatrix.solved_waves import SolvedWaves
from creeping.field.tmatrix.spherical_waves import degrees, vector_degrees
from tests.field.equation.test_mirrors import sheared

RNG = np.random.default_rng(2)
D, R = RNG.normal(size=(2, 6, 3))
BOUNDARIES = ["soft", "hard", cr.ImpedanceBoundary(0.6), "pec"]


def series(ka, order, boundary):
    """Diagonal of a sphere's T-matrix."""
    deg = np.arange(order + 1)
    j, dj = spherical_jn(deg, ka), spherical_jn(deg, ka, True)
    h, dh = j + 1j * spherical_yn(deg, ka), dj + 1j * spherical_yn(deg, ka, True)
    if boundary == "pec":
        deg, _, electric = vector_degrees(order)
        return np.where(electric == 1, -((j + ka * dj) / (h + ka * dh))[deg], -(j / h)[deg])
    deg, _ = degrees(order)
    if boundary == "soft":
        return -(j / h)[deg]
    eta = 0.0 if boundary == "hard" else 0.6
    # du/dn = -ik eta u
    return -((dj + 1j * eta * j) / (dh + 1j * eta * h))[deg]


@pytest.mark.parametrize(
    ("ka", "boundary"),
    [(3.0, b) for b in BOUNDARIES]
    + [pytest.param(ka, b, marks=pytest.mark.slow) for ka in (5.0, 10.0, 20.0) for b in BOUNDARIES]
    + [pytest.param(30.0, b, marks=pytest.mark.slow) for b in BOUNDARIES[:3]],
)
def test_entries_of_a_sphere_are_those_of_its_series(ka, boundary):
    T = cr.t_matrix(sc.Sphere(), wavenumber=ka, boundary=boundary, seconds=1e4)
    want = series(ka, T.order, boundary)
    # off the diagonal 4e-5 at ka = 10, 6e-5 at 20 and 30
    assert np.abs(T.matrix - np.diag(want)).max() < (2e-5 if ka < 10 else 1e-4) * np.abs(want).max()
    assert T.vector == (boundary == "pec") and T.absorbing == isinstance(boundary, cr.ImpedanceBoundary)
    assert T.reciprocity < 3e-4 and (T.absorbing or T.unitarity < 3e-4) and T.extinction < 1e-4
    # what is left out by the order is less than the error
    assert np.linalg.norm(T.matrix - np.diag(want)) / ka < T.error


@pytest.mark.parametrize(
    ("body", "boundary"),
    [
        (sc.Ellipsoid(0.5, 0.5, 1.0), "hard"),
        pytest.param(sc.Cylinder(0.5, 1.0), "hard", marks=pytest.mark.slow),
        pytest.param(sc.Cylinder(0.5, 1.0), "soft", marks=pytest.mark.slow),
        pytest.param(sc.Cone(0.5, 0.8), cr.ImpedanceBoundary(0.6), marks=pytest.mark.slow),
    ],
)
def test_far_fields_are_those_of_solutions(body, boundary):
    k = 5.0
    T = cr.t_matrix(body, wavenumber=k, boundary=boundary)
    solution = cr.solve(body, D, wavenumber=k, boundary=boundary)
    want = np.array([solution.far_field(R, number).total for number in range(len(D))])
    found = T.bistatic(D, R)
    largest = np.abs(T.bistatic(D, D, pairs=True).values).max()
    assert np.abs(found.values - want).max() < 1e-4 * largest
    assert found.error.shape == found.values.shape and not T.unitarity > 3e-3


@pytest.mark.slow
@pytest.mark.parametrize("body", [sc.Almond(1.5), sc.Ellipsoid(0.7, 0.5, 0.4)])
def test_far_fields_of_conductors_are_those_of_solutions(body):
    T = cr.t_matrix(body, wavenumber=6.0, boundary="pec")
    solution = cr.solve(body, D[:2], wavenumber=6.0, boundary="pec")
    want = np.array([solution.far_field(R, number).total for number in range(2)])
    found = T.bistatic(D[:2], R).values
    assert np.abs(found - want).max() < 2e-4 * np.abs(T.bistatic(D, D, pairs=True).values).max()


@pytest.mark.parametrize(
    ("body", "times", "boundary"),
    [
        (sc.Ellipsoid(0.5, 0.4, 0.3), {1}, "soft"),
        pytest.param(sc.Ellipsoid(0.5, 0.4, 0.3), {1}, "pec", marks=pytest.mark.slow),
        # of tiles with nodes on the planes
        (sc.Cylinder(0.5, 1.0), {1, 2}, "hard"),
        pytest.param(sc.Cylinder(0.5, 1.0), {1, 2}, "soft", marks=pytest.mark.slow),
        pytest.param(sc.Cylinder(0.5, 1.0), {1, 2}, "pec", marks=pytest.mark.slow),
    ],
)
def test_mirrors_change_nothing(body, times, boundary):
    k = 2.0
    kinds = scalar_boundaries(boundary)
    kind = computing.CONDUCTOR if len(kinds) == 2 else kinds[0]
    tiles = body_tiles(body, k, kind)
    matrix = Matrix(tiles, k, kind)
    planes = mirrors_of(tiles, kind, np.zeros(3))
    assert planes.flips == ((0,), (1,), (2,)) and len(planes.images) == 8 and set(planes.times) == times
    assert set(planes.images.ravel()) == set(range(len(tiles.points)))
    assert np.sum(8 / planes.times) == len(tiles.points)
    none = no_mirrors(len(matrix.root), matrix.columns)
    both = [SolvedWaves(matrix, np.zeros(3), 4, some, print, direct=True) for some in (planes, none)]
    assert np.abs(both[0].T - both[1].T).max() < 2e-6
    x = inside_points(body, tiles, 2 * np.pi / k)
    left = [one.extinction(x) for one in both]
    # rounding is single, and at the edge of a conductor more is left
    assert left[0] == pytest.approx(left[1], rel=1e-2, abs=2e-5) and left[0] < 3e-3


@pytest.mark.parametrize("boundary", ["hard", pytest.param("pec", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("shears", "flips"), [(((0, 1, 0.3),), ((2,), (0, 1))), (((0, 1, 0.3), (1, 2, 0.2), (2, 0, 0.1)), ((0, 1, 2),))]
)
def test_half_turns_and_the_inversion_change_nothing(shears, flips, boundary):
    k, kind, body = 2.0, equation_boundary(boundary), sheared(*shears)
    tiles = body_tiles(body, k, kind)
    matrix, found = Matrix(tiles, k, kind), mirrors_of(tiles, kind, np.zeros(3))
    assert found.flips == flips
    none = no_mirrors(len(matrix.root), matrix.columns)
    both = [SolvedWaves(matrix, np.zeros(3), 4, some, print, direct=True).T for some in (found, none)]
    assert np.abs(both[0] - both[1]).max() < 2e-6


def test_gmres_serves_where_the_matrix_is_too_large(monkeypatch):
    body = sc.Sphere(0.5)
    want = cr.t_matrix(body, wavenumber=2.0, boundary="hard")
    monkeypatch.setattr(computing, "DENSE", 0.0)
    found = cr.t_matrix(body, wavenumber=2.0, boundary="hard", order=want.order)
    assert np.abs(found.matrix - want.matrix).max() < 1e-4


def test_another_centre_is_the_same_body():
    body = sc.Sphere(0.5)
    one = cr.t_matrix(body, wavenumber=2.0, boundary="soft")
    other = cr.t_matrix(body, wavenumber=2.0, boundary="soft", center=(0.1, 0.0, 0.3), order=8)
    assert np.abs(one.bistatic(D, R).values - other.bistatic(D, R).values).max() < 1e-4
    assert np.abs(other.about((0, 0, 0), one.order).matrix - one.matrix).max() < 1e-5


def test_progress_is_told():
    told = []
    cr.t_matrix(sc.Sphere(0.3), wavenumber=1.0, boundary="hard", progress=told.append)
    assert "nodes" in told[0] and "GB" in told[0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"wavenumber": np.nan}, "wavenumber"),
        ({"wavenumber": [1.0, 2.0]}, "one number"),
        ({"boundary": "stiff"}, "stiff"),
        ({"center": (0, 0)}, "three numbers"),
        ({"center": (0, 0, np.nan)}, "center"),
        ({"order": 0}, "order"),
        ({"order": 2.5}, "order"),
        ({"seconds": 0.0}, "give seconds="),
    ],
)
def test_bad_arguments_are_refused(arguments, words):
    with pytest.raises(cr.InvalidInputError, match=words):
        cr.t_matrix(sc.Sphere(), **({"wavenumber": 1.0, "boundary": "hard"} | arguments))


def test_too_much_memory_is_refused(monkeypatch):
    monkeypatch.setenv("CREEPING_MEMORY", "70M")
    with pytest.raises(cr.InvalidInputError, match=r"lower the wavenumber.*creeping\.solve"):
        cr.t_matrix(sc.Sphere(), wavenumber=30.0, boundary="hard", seconds=1e9)


def test_an_order_too_low_shows_in_the_error():
    body = sc.Sphere()
    T = cr.t_matrix(body, wavenumber=3.0, boundary="hard")
    short = replace(T, matrix=T.matrix[:9, :9])
    assert short.order == 2 and short.unitarity < 1e-3
