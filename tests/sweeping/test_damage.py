"""Stores with files damaged at random: one clear error or the very same dataset; resuming mends what it can."""

import shutil

import fake_sweeps as fake
import numpy as np
import pytest
import xarray

import creeping as cr
from creeping.sweeping.run import fill, open_store
from creeping.sweeping.store import SweepStore

PLAN = fake.plan(6, 2)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    store = SweepStore.create(tmp_path_factory.mktemp("whole") / "s.zarr", PLAN)
    fill(PLAN, store)
    return store.folder, store.dataset().load()


def files_of(folder, pattern):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob(pattern) if p.is_file())


def flipped(raw, rng):
    raw = bytearray(raw)
    raw[rng.integers(len(raw))] ^= 1 << int(rng.integers(8))
    return bytes(raw)


def harm(file, kind, rng):
    """Flip a bit, cut, empty or remove a file."""
    raw = file.read_bytes()
    if kind == "gone":
        file.unlink()
        return
    file.write_bytes({"flip": flipped(raw, rng), "cut": raw[: rng.integers(1, len(raw))], "empty": b""}[kind])


def same(dataset, expected):
    """Values, coordinates and attributes, of incidences that are not said to be missing."""
    missing = dataset.attrs["incidences_missing"]
    if missing:
        dataset = dataset.assign_attrs(incidences_missing=0, incidences_ok=dataset.attrs["incidences_ok"] + missing)
    xarray.testing.assert_identical(dataset.load(), expected)


def attack(whole, folder, name, kind, rng):
    """Whether opening told of the damage, and what resuming came to; all else is a failure."""
    shutil.copytree(whole[0], folder)
    harm(folder / name, kind, rng)
    told = False
    try:
        same(SweepStore.open(folder).dataset(), whole[1])
    except cr.CreepingError as error:
        told = True
        assert str(folder) in str(error)
    try:
        store = open_store(PLAN, folder, resume=True)
        store.verify(repair=True)
        fill(PLAN, store)
        same(store.dataset(), whole[1])
        mended = True
    except cr.CreepingError as error:
        assert "anew" in str(error), error
        mended = False
    shutil.rmtree(folder)
    return told, mended


def attacks(whole, tmp_path, names, kinds, count, seed):
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        name = names[rng.integers(len(names))]
        found.append((name, *attack(whole, tmp_path / "s.zarr", name, kinds[rng.integers(len(kinds))], rng)))
    return found


@pytest.mark.parametrize("count", [4, pytest.param(400, marks=pytest.mark.slow)])
def test_flips_in_descriptions(whole, tmp_path, count):
    names = files_of(whole[0], "zarr.json")
    assert {"zarr.json", "study/zarr.json", "creeping/zarr.json", "task_status/zarr.json"} < set(names)
    found = attacks(whole, tmp_path, names, ["flip"], count, 12)
    # what is not told changed nothing, as in what the folder itself says; only the study cannot be written anew
    assert all(told for name, told, _ in found if "/" in name and name != "study/zarr.json")
    assert all(mended for name, _, mended in found if name != "study/zarr.json")


@pytest.mark.slow
def test_harm_to_chunks_and_descriptions(whole, tmp_path):
    names = [name for name in files_of(whole[0], "*") if not name.startswith("study")]
    kinds = ["flip", "cut", "empty", "gone"]
    assert all(mended for _, _, mended in attacks(whole, tmp_path, names, kinds, 400, 7))


@pytest.mark.parametrize("kind", ["flip", "gone"])
def test_descriptions_are_written_anew(whole, tmp_path, kind, rng):
    folder = tmp_path / "s.zarr"
    shutil.copytree(whole[0], folder)
    before = {name: (folder / name).read_bytes() for name in files_of(folder, "*")}
    for name in ("creeping/zarr.json", "theta/zarr.json", "theta/c/0", "task_status/zarr.json"):
        harm(folder / name, kind, rng)
    with pytest.raises(cr.CreepingError, match=r"holds coordinates in .*s\.zarr is damaged or missing"):
        SweepStore.open(folder).dataset()
    notes = []
    store = open_store(PLAN, folder, resume=True, note=notes.append)
    assert len(notes) == 1 and fill(PLAN, store)
    assert {name: (folder / name).read_bytes() for name in files_of(folder, "*")} == before
    assert open_store(PLAN, folder, resume=True, note=notes.append).missing() == [] and len(notes) == 1


def test_a_chunk_lost_after_opening_is_told(whole, tmp_path):
    folder = tmp_path / "s.zarr"
    shutil.copytree(whole[0], folder)
    dataset = SweepStore.open(folder).dataset()
    (folder / "creeping/c/2/0/0").unlink()
    np.testing.assert_array_equal(dataset["creeping"][:4], whole[1]["creeping"][:4])
    with pytest.raises(cr.CreepingError, match=r"creeping of task 2 \(incidences 4 to 5\).*chunk is missing"):
        dataset["creeping"].load()
    store = open_store(PLAN, folder, resume=True)
    assert store.missing() == [2]


@pytest.mark.filterwarnings("ignore:Object at")
def test_what_others_leave_in_a_store_is_no_damage(whole, tmp_path):
    shutil.copytree(whole[0], tmp_path / "s")
    for name in (".DS_Store", "direction/c/.nfs0001", "direction/.sync"):
        (tmp_path / "s" / name).write_text("of a viewer")
    xarray.Dataset({"mine": ("x", [1.0, 2.0])}).to_zarr(tmp_path / "s", mode="a", consolidated=False)
    same(SweepStore.open(tmp_path / "s").dataset(), whole[1])
