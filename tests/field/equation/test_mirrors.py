"""Symmetries of nodes are found, and equations in their parities are the equation of the whole body."""

import numpy as np
import pytest
import trimesh

import creeping as cr
import scatterers as sc
from creeping.field.boundary import scalar_boundaries
from creeping.field.equation import mirrors
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.columns import COARSE_TOLERANCE
from creeping.field.equation.effort import Effort, equation_boundary
from creeping.field.equation.matrix import Matrix
from creeping.field.equation.mirrors import mirrors_of
from creeping.field.equation.solving import _solved

DIRECTIONS = np.array([[1.0, 0.2, 0.3], [0.0, 0.0, 1.0]])


def symmetries(body, k, boundary, center=None):
    kind = equation_boundary(boundary)
    matrix = Matrix(body_tiles(body, k, kind), k, kind)
    return mirrors_of(matrix.tiles, kind, center), matrix


def sheared(*shears):
    """A box whose x goes with y, and whose other coordinates go with others: ``shears`` (row, column, share)."""
    turn = np.eye(3)
    for row, column, share in shears or ((0, 1, 0.3),):
        turn[row, column] = share
    box = trimesh.creation.box((1.0, 0.8, 0.6))
    box.vertices = box.vertices @ turn.T
    return sc.Facets(box)


@pytest.mark.parametrize(
    "boundary", ["soft", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("hard", "pec"))]
)
@pytest.mark.parametrize(
    ("name", "flips"), [("cylinder", ((0,), (1,), (2,))), ("cone", ((0,), (1,))), ("sheared", ((2,), (0, 1)))]
)
def test_parities_are_those_of_the_whole(name, flips, boundary, monkeypatch):
    """A sheared box has half a turn about z and a mirror; tiles of the others have nodes on their planes."""
    k, make = 3.0, {"cylinder": lambda: sc.Cylinder(0.5, 1.0), "cone": lambda: sc.Cone(0.5, 1.0)}.get(name, sheared)
    body = make()
    found, matrix = symmetries(body, k, boundary)
    assert found.flips == flips and set(found.images.ravel()) == set(range(len(matrix.root)))
    assert np.sum(len(found.images) / found.times) == len(matrix.root)
    r = cr.fibonacci_directions(50)
    fields = []
    for none in (False, True):
        if none:
            monkeypatch.setattr(mirrors, "FLIPS", ())
            body = make()
            assert symmetries(body, k, boundary)[0].flips == ()
        solution = cr.solve(body, DIRECTIONS, wavenumber=k, boundary=boundary)
        assert solution.left.max() < 3.1e-5
        fields.append([solution.far_field(r, number).total for number in range(2)])
    assert np.abs(fields[0] - np.asarray(fields[1])).max() < 1e-4 * np.abs(fields[1]).max()


@pytest.mark.parametrize("boundary", ["hard", "pec"])
def test_a_wave_along_the_axis_has_no_odd_fields(boundary):
    """Optics, from which coarse solutions begin, has faces along the wave lit here and dark there."""
    solution = _solved(sc.Cylinder(0.5, 1.0), -np.eye(3)[[2, 0]], 4.0, boundary, Effort(True, 15))
    assert solution.left.max() <= COARSE_TOLERANCE and solution.steps < 15


def test_fields_are_the_sum_of_their_parities(rng):
    found, matrix = symmetries(sc.Cylinder(0.5, 1.0), 3.0, "pec")
    v = rng.normal(size=(2 * len(matrix.root), 3)) + 1j * rng.normal(size=(2 * len(matrix.root), 3))
    shares = found.shares(v)
    assert np.allclose(found.whole(shares), v)
    assert np.sum(np.abs(shares) ** 2) * len(found.images) == pytest.approx(np.sum(np.abs(v) ** 2))


def test_nodes_of_a_tip_may_be_next_to_a_plane():
    found, matrix = symmetries(sc.Almond(1.0), 20.0, "hard")
    assert np.abs(matrix.nodes.points[:, 2]).min() < 1e-5 and found.flips == ((1,), (2,))
    assert sorted(found.images.ravel()) == list(range(len(matrix.root)))


def test_a_centre_off_the_planes_and_an_admittance_that_varies_have_none():
    body = sc.Sphere(0.4)
    assert symmetries(body, 2.0, "hard", np.array([0.0, 0.0, 0.1]))[0].flips == ((0,), (1,))
    varying = cr.ImpedanceBoundary(lambda x: 0.5 + 0.1 * x[:, 0])
    assert scalar_boundaries(varying)[0].varies and symmetries(body, 2.0, varying)[0].flips == ()
