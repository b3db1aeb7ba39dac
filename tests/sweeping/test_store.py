"""Stores of sweeps: what is marked is whole, what is damaged is found, and what belongs elsewhere is refused."""

import errno

import fake_sweeps as fake
import numpy as np
import pytest
import shared_bodies as sc
import xarray
from filelock import FileLock

import creeping as cr
from creeping.shadow.status import LineStatus
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.request import sweep_request
from creeping.sweeping.results import as_dataset, without_complex
from creeping.sweeping.run import fill, in_memory, open_store
from creeping.sweeping.store import SweepStore


def filled(folder, **options):
    plan = fake.plan(18, 4, **options)
    store = SweepStore.create(folder, plan)
    fill(plan, store)
    return plan, store


def test_a_store_holds_what_memory_holds(tmp_path):
    plan, store = filled(tmp_path / "s.zarr")
    ds, memory = store.dataset(), in_memory(plan)
    assert ds["creeping"].chunks[0] == (4, 4, 4, 4, 2)
    assert ds.attrs["incidences_ok"] == 18 and ds.attrs["incidences_missing"] == 0
    timed = {"study"}
    assert {k: v for k, v in ds.attrs.items() if k not in timed} == {
        k: v for k, v in memory.attrs.items() if k not in timed
    }
    xarray.testing.assert_identical(ds.load().drop_attrs(), memory.drop_attrs())
    assert np.array_equal(ds["creeping"].values, fake.creeping_of(18))
    # also without this package
    with xarray.open_zarr(store.folder, consolidated=False) as plain:
        assert plain["creeping"].dims == ("incidence", "boundary", "wavenumber") and "theta" in plain.coords


METRIC = cr.DirectFlow(sc.Metric(), rtol=1e-6)


@pytest.mark.parametrize("quantity", ["rays", "monostatic", "bistatic"])
def test_coordinates_and_units_are_those_of_memory(tmp_path, quantity):
    asked = {"rays": {}, "monostatic": {"wavenumbers": 3.0, "boundary": ["hard", "pec"]}}
    asked["bistatic"] = {"observation": cr.fibonacci_directions(5), **asked["monostatic"]}
    request = sweep_request(quantity, length=1.0, n_steps=3, **asked[quantity])
    plan = SweepPlan(METRIC, request, cr.fibonacci_directions(7), 4)
    ds = SweepStore.create(tmp_path / "s.zarr", plan).dataset()
    memory = as_dataset(plan, request.empty(7), [])
    assert list(ds.data_vars) == list(memory.data_vars) and set(ds.coords) == set(memory.coords)
    for name, values in memory.variables.items():
        assert ds[name].dims == values.dims and ds[name].attrs == values.attrs
        assert name in memory.data_vars or np.array_equal(ds[name].values, values.values)
    # by hand: what is a length, its inverse, or has none
    expected = {"line_length": "m", "theta": "rad", "direction": "1", "incidence_status": "1"}
    expected |= {"travel_time": "m", "attenuation": "m^(1/3)"} if quantity == "rays" else {"wavenumber": "m-1"}
    expected |= {} if quantity == "rays" else {"creeping": "m", "error_pec": "m", "unresolved": "1"}
    assert "lengths in m, wavenumbers in m-1" in ds.attrs["conventions"] and ds.attrs["conventions"].endswith("f in m")
    # others read the same
    with xarray.open_zarr(tmp_path / "s.zarr", consolidated=False) as plain:
        assert {name: plain[name].attrs["units"] for name in expected} == expected
        without_complex(plain.load()).to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as plain:
        assert plain.line_length.attrs["units"] == "m"
        assert quantity == "rays" or plain.field.unit == "m"


def test_the_flow_is_kept(tmp_path):
    request = sweep_request("rays", length=1.0, n_rays=4)
    built = cr.build_phase_map(sc.Torus(), horizon=0.25, grid=(16, 24), degree=3, cache=False)
    for name, flow in (("map", built), ("direct", cr.DirectFlow(sc.Torus(), 1e-7, 0.5, 0.01))):
        plan = SweepPlan(flow, request, cr.fibonacci_directions(2), 1)
        store = SweepStore.create(tmp_path / name, plan)
        assert SweepPlan(store.flow(sc.Torus()), request, plan.incidences, 1).key == plan.key
        with pytest.raises(cr.CreepingError, match="map of torus|Torus" if name == "map" else "another study.*body"):
            store.require_same(SweepPlan(store.flow(sc.Torus(R=1.5)), request, plan.incidences, 1))


def test_resuming_does_what_is_missing_and_nothing_else(tmp_path, monkeypatch):
    plan = fake.plan(18, 4)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    assert not fill(plan, store, most=2) and store.missing() == [2, 3, 4]
    partial = store.dataset()
    assert partial.attrs["incidences_missing"] == 10 and np.isnan(partial["creeping"][8:]).all()
    # where nothing is given nothing is resolved
    assert partial.unresolved[8:].all() and not partial.unresolved[:8].any()
    diary = tmp_path / "diary"
    diary.mkdir()
    monkeypatch.setenv("FAKE_DIARY", str(diary))
    seen = []
    assert fill(plan, open_store(plan, store.folder, resume=True), progress=lambda *a: seen.append(a[:2]))
    assert len(list(diary.iterdir())) == 3 and seen == [(12, 18), (16, 18), (18, 18)]
    assert fill(plan, store) and len(list(diary.iterdir())) == 3
    filled(tmp_path / "whole.zarr")
    assert fake.bytes_of(store.folder) == fake.bytes_of(tmp_path / "whole.zarr")


def test_another_study_is_refused_with_what_differs(tmp_path):
    _, store = filled(tmp_path / "s.zarr")
    with pytest.raises(cr.InvalidInputError, match="exists; give resume=True"):
        open_store(fake.plan(18, 4), store.folder, resume=False)
    other = fake.plan(17, 5, asked={"tolerance": 1e-3})
    with pytest.raises(cr.InvalidInputError, match="another study") as caught:
        open_store(other, store.folder, resume=True)
    names = [text.split()[0] for text in caught.value.differing]
    assert names == ["asked.tolerance", "chunk", "incidences.count", "incidences.digest"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(cr.CreepingError, match="holds no sweep"):
        SweepStore.open(tmp_path / "empty")


def test_two_drivers_do_not_fill_one_store(tmp_path):
    plan, store = filled(tmp_path / "s.zarr")
    with FileLock(store.folder / "study" / ".lock"):
        with pytest.raises(cr.CreepingError, match="another process is filling"):
            fill(plan, store)
        assert store.verify() == []
        with pytest.raises(cr.CreepingError, match="another process is filling"):
            store.verify(repair=True)
    # who holds it may ask again, and holds it until the end
    with store.locked():
        fill(plan, store)
        with pytest.raises(cr.CreepingError, match="another process is filling"):
            fill(plan, SweepStore.open(store.folder))
    assert fill(plan, SweepStore.open(store.folder))


@pytest.mark.parametrize("chunk", [1, 4])
def test_a_sweep_whose_first_task_fails_as_one_ends(tmp_path, monkeypatch, chunk):
    bad = cr.fibonacci_directions(18)[:4, 2]
    monkeypatch.setenv("FAKE_RAISES", " ".join(map(str, bad)))
    plan = fake.plan(18, chunk)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    words = f"the first {max(chunk, 2)} incidences failed, all with ArithmeticError: a poison.* nothing would come"
    with pytest.raises(cr.CreepingError, match=words):
        fill(plan, store)
    with pytest.raises(cr.CreepingError, match=words):
        in_memory(plan)
    assert store.dataset().attrs["incidences_failed"] == max(chunk, 2)
    if chunk == 4:
        # what has failed before does not keep the rest from being tried
        assert fill(plan, store) and store.missing() == [0]
        assert fill(plan, store) and store.missing() == [0]


def test_a_full_disk_is_one_clear_error_and_loses_nothing(tmp_path, monkeypatch):
    plan = fake.plan(18, 4)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    writes = []

    def put(path, value, exclusive=False):
        writes.append(path)
        if len(writes) > 40:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(path, value, exclusive)

    from zarr.storage import _local

    real = _local._put
    monkeypatch.setattr(_local, "_put", put)
    with pytest.raises(cr.CreepingError, match=r"No space left on device .*MB are free.*resume"):
        fill(plan, store)
    monkeypatch.undo()
    kept = 5 - len(store.missing())
    assert kept == 40 // (len(store.variables) + 1)
    assert np.array_equal(store.dataset()["creeping"][: 4 * kept], fake.creeping_of(18)[: 4 * kept])
    assert fill(plan, store)
    filled(tmp_path / "whole.zarr")
    assert fake.bytes_of(store.folder) == fake.bytes_of(tmp_path / "whole.zarr")


@pytest.mark.parametrize("harm", ["bit", "gone"])
def test_damage_is_found_named_and_repaired(tmp_path, harm):
    plan, store = filled(tmp_path / "s.zarr")
    whole = fake.bytes_of(store.folder)
    # the last task is shorter than the others
    for task in (1, 4):
        victim = store.folder / f"creeping/c/{task}/0/0"
        raw = bytearray(victim.read_bytes())
        raw[len(raw) // 2] ^= 4
        victim.unlink() if harm == "gone" else victim.write_bytes(raw)
    found = store.verify()
    assert [task for task, _ in found] == [1, 4] and "creeping" in found[0][1]
    if harm != "gone":
        assert "incidences 4 to 7" in found[0][1]
        with pytest.raises(cr.CreepingError, match=r"creeping of task [14] .* is damaged"):
            store.dataset()["creeping"].load()
    else:
        with pytest.raises(cr.CreepingError, match=r"creeping of task 1 .* is missing .*2 such tasks.*resume"):
            store.dataset()
    assert len(store.verify(repair=True)) == 2 and store.missing() == [1, 4]
    assert fill(plan, store) and store.verify() == []
    assert fake.bytes_of(store.folder) == whole


def test_poison_costs_one_incidence_and_is_tried_again(tmp_path, monkeypatch):
    bad = cr.fibonacci_directions(18)[[5, 17], 2]
    monkeypatch.setenv("FAKE_RAISES", " ".join(map(str, bad)))
    plan, store = filled(tmp_path / "s.zarr")
    ds = store.dataset()
    assert np.flatnonzero(ds.incidence_status == LineStatus.FAILED).tolist() == [5, 17]
    assert np.flatnonzero(np.isnan(ds["creeping"][:, 0, 0])).tolist() == [5, 17]
    assert store.failures() == [
        (5, "ArithmeticError: a poisonous incidence"),
        (17, "ArithmeticError: a poisonous incidence"),
    ]
    assert ds.attrs["incidences_failed"] == 2 and "incidence 17: Arith" in ds.attrs["errors"]
    memory = in_memory(plan)
    xarray.testing.assert_equal(memory, ds.load())
    assert memory.attrs["errors"] == ds.attrs["errors"]
    assert store.missing() == [1, 4]
    monkeypatch.undo()
    assert fill(plan, store) and store.failures() == []
    ds = store.dataset()
    assert "errors" not in ds.attrs and np.array_equal(ds["creeping"], fake.creeping_of(18))


def test_a_long_message_is_cut_and_a_wrong_shape_is_told(tmp_path):
    plan = fake.plan(4, 4)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    arrays = plan.request.empty(4)
    store.write_task(0, arrays, {2: 300 * "ä"})
    store.commit(0, failures=True)
    assert dict(store.failures())[2].rstrip("\ufffd") == 128 * "ä"
    with pytest.raises(cr.CreepingError, match=r"curves of shape \(3,\), not \(4,\)"):
        store.write_task(0, arrays | {"curves": arrays["curves"][:3]}, {})
