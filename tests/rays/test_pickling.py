"""Flows, lines, fans and results on bodies given by an expression go to other processes and are copied."""

import copy
import pickle

import numpy as np
import pytest

import creeping as cr
import scatterers as sc

another = pytest.mark.parametrize(
    "again", [lambda one: pickle.loads(pickle.dumps(one)), copy.copy, copy.deepcopy], ids=["pickled", "copied", "deep"]
)
START = (1.0, 0.0, 0.0), (0.0, 0.6, 0.8), [0.3, 0.8]


@pytest.fixture(scope="module")
def body():
    return sc.Implicit("x**2 + y**2/1.21 + z**2 - 1", speed="1 + z/5")


@pytest.fixture(scope="module")
def phase_map():
    found = cr.build_phase_map(sc.Sphere(speed="1 + z/5"), horizon=0.5, grid=(12, 12), degree=3, cache=False)
    found.flow(*START)
    return found


@pytest.fixture(scope="module")
def fan(body):
    line = cr.shadow_line(body, (0.2, 0.3, 1.0), n_points=32)
    return cr.launch(cr.DirectFlow(body, rtol=1e-7), line, length=1.0, n_rays=8, n_steps=2)


@another
@pytest.mark.slow
def test_a_phase_map_composes_the_same_rays(phase_map, again):
    same = again(phase_map)
    np.testing.assert_array_equal(same.flow(*START), phase_map.flow(*START))
    assert same.digest == phase_map.digest


@another
def test_a_fan_and_its_line_keep_their_points_and_are_launched_again(fan, again):
    same = again(fan)
    np.testing.assert_array_equal(same.points, fan.points)
    np.testing.assert_array_equal(again(fan.line).curves[0].points, fan.line.curves[0].points)
    anew = cr.launch(same.flow, same.line, length=1.0, n_rays=8, n_steps=2)
    np.testing.assert_array_equal(anew.points, fan.points)


@pytest.fixture(scope="module")
def solution():
    return cr.solve(sc.Implicit("x**2 + y**2/1.21 + z**2 - 1"), (0.2, 0.3, 1.0), wavenumber=1.0, boundary="soft")


@another
def test_a_solution_gives_the_same_field(solution, again):
    along = [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]
    np.testing.assert_array_equal(again(solution).far_field(along).total, solution.far_field(along).total)
