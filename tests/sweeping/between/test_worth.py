"""Whether interpolation on the sphere pays: known before it begins, and the same for every task of a study."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.sweeping.between.worth import first_level, with_paying_lattice
from creeping.sweeping.lattice import Lattice
from creeping.sweeping.request import sweep_request

FLOW = cr.DirectFlow(sc.Ellipsoid(1.2, 0.85, 0.7), rtol=1e-8)


def patch(count):
    near = np.array([0.6, 0.5, 0.62]) + 0.06 * np.random.default_rng(5).uniform(-1, 1, (count, 3))
    return near / np.linalg.norm(near, axis=1, keepdims=True)


def asked(accuracy):
    more = {"n_steps": 1, "observation": None, "order": 2, "method": "rays"}
    more |= {"wavenumbers": [18.0], "boundary": ["hard"]}
    return sweep_request("monostatic", length=4.0, n_rays=64, accuracy=accuracy, **more)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-13])
def test_what_is_found_does_not_depend_on_the_order_of_incidences(accuracy):
    directions = patch(1500)
    order = np.random.default_rng(1).permutation(len(directions))
    one, other = (with_paying_lattice(FLOW, asked(accuracy), some) for some in (directions, directions[order]))
    assert one == other
    assert (one.lattice is not None) == (accuracy > 1e-3)


def test_a_level_that_serves_nothing_or_leaves_much_is_left_out():
    lattice = Lattice((), 0.0, 3, 1600.0)
    left = np.array([[1.0, 1.0, 0.0]] * 3 + [[1.0, 0.0, 0.0]])
    assert first_level(lattice, left) in (1, 2)
    assert first_level(lattice, np.zeros((1, 3))) == 0
    assert first_level(Lattice((), 0.0, 1, 1.5), np.zeros((4, 1))) is None
    assert first_level(Lattice((), 0.0, 2, 1e4), np.ones((4, 2))) is None
