"""What cannot be meant is refused at once, with its size and a remedy: counts, lengths, times, wavenumbers."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.storage.memory import budget, within_budget

BODY = sc.Ellipsoid(1.0, 0.8, 0.6)
FLOW = cr.DirectFlow(BODY)


@pytest.fixture(scope="module")
def line():
    return cr.shadow_line(BODY, (1, 1, 1))


@pytest.fixture(scope="module")
def small_map():
    return cr.build_phase_map(BODY, horizon=0.5, grid=(16, 16), degree=3, cache=False)


ASKED = {
    "rays": (lambda line: cr.launch(FLOW, line, length=1.0, n_rays=10**10), "GB of memory"),
    "steps": (lambda line: cr.launch(FLOW, line, length=1.0, n_steps=10**10), "GB of memory"),
    "length": (lambda line: cr.launch(FLOW, line, length=1e12), "more than 100000 sizes of the body"),
    "length of couplings": (
        lambda line: cr.coupling(BODY, [(0, 0, 0.6), (1.0, 0, 0)], wavenumber=20.0, length=1e12),
        r"GB of memory.*give a shorter length \(up to [0-9.e+]+\)",
    ),
    "points": (lambda line: cr.shadow_line(BODY, (1, 0, 0), n_points=10**10), "GB of memory"),
    "grid": (
        lambda line: cr.build_phase_map(BODY, horizon=0.5, grid=(10**6, 10**6), cache=False),
        "give a coarser one",
    ),
    "tuned": (lambda line: cr.build_phase_map(BODY, tolerance=1e-4, length=1e9, cache=False), "give a shorter one"),
}


@pytest.mark.parametrize("what", ASKED)
def test_too_much_is_refused(line, what):
    ask, words = ASKED[what]
    with pytest.raises(InvalidInputError, match=words):
        ask(line)


def test_too_long_a_time_of_a_map_is_refused(small_map, line):
    fan = cr.launch(FLOW, line, length=0.5, n_rays=4)
    with pytest.raises(InvalidInputError, match=r"take 2e\+09 leaps"):
        small_map.flow(fan.points[:, 0], fan.directions[:, 0], 1e9)


def test_too_many_levels_and_nodes_are_refused(line):
    fan = cr.launch(FLOW, line, length=1.0, n_rays=16)
    with pytest.raises(InvalidInputError, match="10000000 levels are more than"):
        cr.iso_phase_curves(fan, np.linspace(0, 1, 10**7))
    with pytest.raises(InvalidInputError, match="GB of memory"):
        cr.far_field(fan, [(1, 1, 1)], wavenumber=1e12)


def test_the_budget(monkeypatch):
    for text, size in (("2G", 2e9), ("500MB", 5e8), ("1e6", 1e6)):
        monkeypatch.setenv("CREEPING_MEMORY", text)
        assert budget() == size
    within_budget(9e5, "a little", "-")
    monkeypatch.setenv("CREEPING_MEMORY", "100M")
    with pytest.raises(InvalidInputError, match=r"would take 0\.2 GB of memory, more than 0\.1 GB; take less"):
        within_budget(2e8, "this", "take less")
    monkeypatch.setenv("CREEPING_MEMORY", "lots")
    with pytest.raises(InvalidInputError, match="is not a size"):
        budget()
