"""What cannot be meant is refused at once, with its size and a remedy: counts, lengths, times, wavenumbers."""

from functools import cache

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.storage import memory
from creeping.storage.memory import blocks, budget, within_budget

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
    with pytest.raises(InvalidInputError, match="more than any field"):
        cr.far_field(fan, [(1, 1, 1)], wavenumber=1e12)


@cache
def small_fan():
    return cr.launch(FLOW, cr.shadow_line(BODY, (1, 1, 1), n_points=32), length=1.0, n_rays=8, n_steps=8)


SMALL = {
    "traced": lambda: cr.trace(BODY, np.tile((1.0, 0, 0), (9999, 1)), np.tile((0, 1.0, 0), (9999, 1)), np.arange(999)),
    "a band": lambda: cr.impulse_response(np.ones(10**5), np.linspace(1.0, 2.0, 10**5)),
    "directions": lambda: cr.far_field(small_fan(), np.ones((10**5, 3)), wavenumber=9.0, method="rays"),
    "swept": lambda: cr.sweep_directions(
        FLOW, np.ones((2000, 3)), wavenumbers=9.0, quantity="bistatic", observation=np.ones((300, 3)), length=1.0
    ),
}


@pytest.mark.parametrize("what", SMALL)
def test_less_is_refused_where_memory_is_small_and_what_fits_is_said(what, monkeypatch):
    monkeypatch.setenv("CREEPING_MEMORY", "65M")
    with pytest.raises(InvalidInputError, match=r"GB of memory, more than 0\.1 GB; .* \(up to [1-9][0-9.e+]*\)"):
        SMALL[what]()


def test_profiles_of_too_many_points():
    with pytest.raises(ValueError, match="1000000 points of the profile are more than 200000"):
        sc.Revolution(np.ones((10**6, 2)))


def test_directions_go_in_blocks(monkeypatch):
    r = cr.fibonacci_directions(60)
    whole = cr.far_field(small_fan(), r, wavenumber=9.0, method="rays")
    monkeypatch.setattr("creeping.field.far.blocks", lambda count, _: [slice(0, 25), slice(25, count)])
    parts = cr.far_field(small_fan(), r, wavenumber=9.0, method="rays")
    np.testing.assert_array_equal(parts.total, whole.total)
    np.testing.assert_array_equal(parts.error, whole.error)


def test_blocks_fit_the_budget(monkeypatch):
    monkeypatch.setenv("CREEPING_MEMORY", "100M")
    assert blocks(0, 1e9) == [slice(0, 0)] and blocks(9, 1.0) == [slice(0, 9)]
    assert blocks(25, 1e7) == [slice(0, 10), slice(10, 20), slice(20, 25)]


@pytest.mark.parametrize("version", [1, 2])
def test_containers_and_processes_have_limits(version, tmp_path, monkeypatch):
    groups = tmp_path / "cgroup"
    groups.write_text("4:cpu,memory:/box/in\n" if version == 1 else "0::/box/in\n")
    top = tmp_path / "memory" if version == 1 else tmp_path
    words = ("limit_in_bytes", "usage_in_bytes", "total_") if version == 1 else ("max", "current", "")
    for place, given in {"box": ("5000", "4000"), "box/in": ("9000", "10"), "": ("max", "1")}.items():
        (top / place).mkdir(parents=True, exist_ok=True)
        for word, value in zip(words[:2], given, strict=True):
            (top / place / f"memory.{word}").write_text(f"{value}\n")
        (top / place / "memory.stat").write_text(f"anon 7\n{words[2]}inactive_file 300\n")
    assert sorted(memory._left_to_containers(groups, tmp_path)) == [1300, 9290]
    assert list(memory._left_to_containers(tmp_path / "none", tmp_path)) == []
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (10**15, 10**15))
    assert 0 < 10**15 - next(memory._left_to_the_process()) < 10**14
    monkeypatch.setattr(memory, "_left_to_containers", lambda: iter([6e5]))
    monkeypatch.delenv("CREEPING_MEMORY", raising=False)
    assert budget() == 3e5


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
