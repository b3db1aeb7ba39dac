"""Interpolated sweeps against the same sweeps computed, on bodies and cuts of every kind that they meet."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.sweeping.plan import task_size
from creeping.sweeping.request import sweep_request, with_lattice

BODY = sc.Ellipsoid(1.2, 0.85, 0.7)
FLOW = cr.DirectFlow(BODY, rtol=1e-9)
FIELD = {"wavenumbers": [18.0, 30.0], "n_rays": 96, "length": 4.0}


def arc(first, last, step, height=0.2):
    u = np.radians(np.arange(first, last, step))[:, None]
    axis, e1, e2 = np.eye(3)[[2, 0, 1]]
    return height * axis + np.sqrt(1 - height**2) * (np.cos(u) * e1 + np.sin(u) * e2)


def both(directions, accuracy, flow=FLOW, **asked):
    computed = cr.sweep_directions(flow, directions, **asked)
    between = cr.sweep_directions(flow, directions, accuracy=accuracy, **asked)
    return computed, between


@pytest.fixture(scope="module")
def cut():
    return both(arc(10, 34, 0.4), 1e-3, boundary=["soft", "hard", "pec", "impedance:0.5"], **FIELD)


@pytest.mark.parametrize("suffix", ["", "_pec"])
def test_fields_agree_within_the_accuracy_and_the_stated_error(cut, suffix):
    computed, between = cut
    total = [ds["total" + suffix] for ds in cut]
    off = np.abs(total[0] - total[1]).values
    stated = between["interpolation_error" + suffix].values
    size = np.median(np.abs(total[0]), axis=0)
    assert np.all(off <= 1e-3 * np.max(size)) and np.mean(off <= stated + 1e-14) > 0.97
    creeping = np.abs(computed["creeping" + suffix] - between["creeping" + suffix]).values
    assert np.quantile(creeping / np.median(np.abs(computed["creeping" + suffix]), axis=0).max(), 0.99) < 1e-2
    assert np.all(between["error" + suffix] >= stated)


def test_lines_and_flags_agree(cut):
    computed, between = cut
    assert between.interpolated.mean() == 1
    np.testing.assert_allclose(between.line_length, computed.line_length, rtol=1e-5)
    for name in ("incidence_status", "curves", "unresolved", "singular_distance"):
        assert np.mean(between[name].values == computed[name].values) > 0.97, name
    # what it is taken of are some samples of the rays
    assert np.all(between.least_k_rho <= computed.least_k_rho * 1.1)


@pytest.mark.parametrize(
    "asked",
    [
        {"boundary": ["hard", "pec"], **FIELD},
        {"quantity": "bistatic", "observation": [(0, 0, 1), (-1, 0.2, 0)], "boundary": "soft", **FIELD},
    ],
    ids=["monostatic", "bistatic"],
)
def test_results_do_not_depend_on_tasks_or_order(asked):
    directions = arc(0, 18, 0.3)
    whole = cr.sweep_directions(FLOW, directions, accuracy=1e-3, **asked)
    order = np.random.default_rng(0).permutation(len(directions))
    parts = cr.sweep_directions(FLOW, directions, accuracy=1e-3, chunk=7, **asked)
    mixed = cr.sweep_directions(FLOW, directions[order], accuracy=1e-3, chunk=40, **asked)
    for name in whole.data_vars:
        assert whole[name].values.tobytes() == parts[name].values.tobytes(), name
        assert whole[name].values[order].tobytes() == mixed[name].values.tobytes(), name


@pytest.mark.slow
def test_a_cut_through_a_singular_direction_says_what_it_is():
    body = sc.Torus(1.0, 0.4)
    directions = arc(-3, 3, 0.1, height=0.0)[:, [2, 0, 1]]
    computed, between = both(
        directions, 1e-3, cr.DirectFlow(body, rtol=1e-7), boundary="hard", wavenumbers=18.0, n_rays=32
    )
    singular = computed.incidence_status.values == 2
    assert np.array_equal(between.incidence_status.values == 2, singular)
    assert not np.any(between.interpolated.values & singular)


@pytest.mark.parametrize("kind", ["a sparse cut", "all over the sphere"])
def test_sparse_incidences_and_those_of_no_cut_are_computed(kind):
    seen = arc(0, 300, 12.0) if kind == "a sparse cut" else cr.fibonacci_directions(40)
    computed, between = both(seen, 1e-3, boundary="hard", **FIELD)
    assert not between.interpolated.any() and np.all(between.interpolation_error == 0)
    assert computed.total.values.tobytes() == between.total.values.tobytes()


@pytest.mark.parametrize("accuracy", [0.0, 1.0, True, "fine", np.nan])
def test_an_accuracy_is_a_number_between_0_and_1_of_fields_by_rays(accuracy):
    with pytest.raises(cr.CreepingError, match="accuracy"):
        cr.sweep_directions(FLOW, arc(0, 3, 1.0), accuracy=accuracy, boundary="hard", **FIELD)
    with pytest.raises(cr.CreepingError, match="accuracy is of interpolated fields"):
        cr.sweep_directions(FLOW, arc(0, 3, 1.0), quantity="rays", n_rays=4, length=1.0, accuracy=1e-3)
    with pytest.raises(cr.CreepingError, match="accuracy goes with rays"):
        cr.sweep_directions(FLOW, arc(0, 3, 1.0), accuracy=1e-3, method="currents", boundary="hard", **FIELD)


def test_a_cut_comes_in_large_tasks_whose_incidences_share_nodes():
    asked = sweep_request("monostatic", length=1.0, n_rays=32, wavenumbers=(20.0,), boundary=["soft"], accuracy=1e-3)
    request = with_lattice(asked, arc(0.0, 360.0, 0.025))
    assert request.lattice is not None
    assert task_size(request, 14_400, shared=False) == 4096 > 8 * task_size(asked, 14_400, shared=False)
