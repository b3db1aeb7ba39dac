"""Interpolated sweeps against the same sweeps computed, on bodies and cuts of every kind that they meet."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geodesics.states import pack
from creeping.shadow.panels import onto_line
from creeping.sweeping.lattice import lattice_of

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
        {"quantity": "rays", "n_rays": 64, "length": 3.0, "n_steps": 2},
        {"boundary": ["hard", "pec"], **FIELD},
        {"quantity": "bistatic", "observation": [(0, 0, 1), (-1, 0.2, 0)], "boundary": "soft", **FIELD},
    ],
    ids=["rays", "monostatic", "bistatic"],
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


def test_a_cut_through_a_singular_direction_says_what_it_is():
    body = sc.Torus(1.0, 0.4)
    directions = arc(-6, 6, 0.1, height=0.0)[:, [2, 0, 1]]
    computed, between = both(directions, 1e-3, cr.DirectFlow(body, rtol=1e-7), quantity="rays", n_rays=32, length=1.0)
    singular = computed.incidence_status.values == 2
    assert np.array_equal(between.incidence_status.values == 2, singular)
    assert not np.any(between.interpolated.values & singular)


def test_sparse_incidences_are_computed():
    computed, between = both(arc(0, 300, 12.0), 1e-3, quantity="rays", n_rays=32, length=1.0)
    assert not between.interpolated.any() and np.all(between.interpolation_error == 0)
    assert computed.points.values.tobytes() == between.points.values.tobytes()


@pytest.mark.slow
def test_a_patch_of_the_sphere():
    rng = np.random.default_rng(5)
    near = np.array([0.6, 0.5, 0.62]) + 0.06 * rng.uniform(-1, 1, (1200, 3))
    computed, between = both(near / np.linalg.norm(near, axis=1, keepdims=True), 1e-3, boundary="hard", **FIELD)
    assert between.interpolated.mean() > 0.9
    total = [ds["total"].values for ds in (computed, between)]
    assert np.abs(total[0] - total[1]).max() < 1e-3 * np.median(np.abs(total[0]))


@pytest.fixture(scope="module", params=[BODY, sc.TwistedEllipsoid()], ids=["closed lines", "lines with ends"])
def rays(request):
    flow = cr.DirectFlow(request.param, rtol=1e-9)
    directions = arc(20, 32, 0.1)
    asked = {"quantity": "rays", "n_rays": 64, "length": 3.0, "n_steps": 2, "accuracy": 1e-4}
    return request.param, directions, cr.sweep_directions(flow, directions, **asked)


def test_rays_are_those_that_their_launch_points_have(rays):
    body, directions, found = rays
    ends = found.detachment.values
    assert np.array_equal((found.curve_index.values >= 0) & (ends <= 3.0), found.ray_status.values == 1)
    exact, differ = cr.DirectFlow(body, rtol=1e-11), []
    assert found.interpolated.mean() > 0.5
    for row in np.flatnonzero(found.interpolated)[::23]:
        there = found.curve_index.values[row] >= 0
        x, p = found.points.values[row, there], found.directions.values[row, there]
        # back along the ray, onto the line, and forth again
        start, _ = exact.flow(x[:, 1], -p[:, 1], 3.0)
        d = np.broadcast_to(directions[row], start.shape)
        start = onto_line(body, d, start, reach=0.1, iterations=6)
        assert np.abs(np.sum(start * d, axis=1) - found.launch_phase.values[row, there]).max() < 1e-3
        states = exact.transport(pack(start, d, lanes=12), np.array([1.5, 3.0]))
        J = found.spreading.values[row, there]
        off = np.concatenate(
            [
                np.abs(states[..., :3] - x).reshape(len(x), -1),
                np.abs(states[..., 3:6] - p).reshape(len(x), -1),
                np.abs(states[..., 6] - J) / (1 + np.abs(J)),
                np.abs(states[..., 10] - found.attenuation.values[row, there]),
            ],
            axis=1,
        )
        differ.append(off.max(axis=1))
    differ = np.concatenate(differ)
    assert np.sqrt(np.mean(differ**2)) < 1e-4 and np.quantile(differ, 0.99) < 3e-4


@pytest.mark.parametrize("accuracy", [0.0, 1.0, True, "fine", np.nan])
def test_an_accuracy_is_a_number_between_0_and_1_and_goes_with_rays(accuracy):
    with pytest.raises(cr.CreepingError, match="accuracy"):
        cr.sweep_directions(FLOW, arc(0, 3, 1.0), quantity="rays", n_rays=4, length=1.0, accuracy=accuracy)
    with pytest.raises(cr.CreepingError, match="accuracy goes with rays"):
        cr.sweep_directions(FLOW, arc(0, 3, 1.0), accuracy=1e-3, method="currents", boundary="hard", **FIELD)


def test_a_patch_of_the_sphere_comes_back_in_its_own_order(tmp_path):
    """In memory and in a folder, whose tasks are patches."""
    directions = cr.fibonacci_directions(40_000)
    directions = directions[directions @ np.array([0.6, 0.48, 0.64]) > 0.99]
    asked = {"quantity": "rays", "n_rays": 16, "length": 1.0, "accuracy": 1e-3}
    flow = cr.DirectFlow(sc.Ellipsoid(1.0, 0.8, 0.6), rtol=1e-8)
    here = cr.sweep_directions(flow, directions, **asked)
    kept = cr.sweep_directions(flow, directions, store=tmp_path / "store", **asked)
    order = lattice_of(directions).order(directions)
    assert not np.array_equal(order, np.arange(len(directions)))
    for ds in (here, kept):
        np.testing.assert_array_equal(ds.direction, directions)
    np.testing.assert_array_equal(here.points, kept.points)
    np.testing.assert_array_equal(here.interpolated, kept.interpolated)


def test_rays_that_are_carried_start_on_the_line():
    """Launch points that are moved far are not where the interpolation has them."""
    body, asked = sc.Ellipsoid(2, 0.5, 0.4), {"quantity": "rays", "n_rays": 50, "length": 1.0, "accuracy": 1e-2}
    directions = arc(-20, 40, 0.2, height=0.1)
    found = cr.sweep_directions(cr.DirectFlow(body, rtol=1e-8), directions, **asked)
    row, ray = np.nonzero(found.interpolated.values[:, None] & (found.interpolation_error.values == 0))
    assert len(row) > 100
    x, p = (found[name].values[row, ray, 0] for name in ("points", "directions"))
    start, back = cr.DirectFlow(body, rtol=1e-10).flow(x, -p, 1.0)
    d = directions[row]
    assert np.abs(np.sum(start * d, axis=1) - found.launch_phase.values[row, ray]).max() < 1e-6
    assert np.abs(-back - d).max() < 1e-6
    assert np.abs(np.linalg.norm(onto_line(body, d, start, reach=0.1) - start, axis=1)).max() < 1e-6
