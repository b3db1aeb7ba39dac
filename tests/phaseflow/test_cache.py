"""Stored maps: a round trip, and no damage that goes unnoticed."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.surface import fingerprint
from creeping.storage.folder import MANIFEST, content_digest
from tests.patience import HANGS

BODY = sc.Ellipsoid(1.0, 0.8, 0.6)
OPTIONS = {"horizon": 0.25, "grid": (10, 12), "degree": 3}


@pytest.fixture(scope="module")
def original():
    return cr.build_phase_map(BODY, cache=False, **OPTIONS)


@pytest.fixture
def folder(original, tmp_path):
    return original.save(tmp_path / "map")


def test_round_trip(original, folder):
    loaded = cr.load_phase_map(folder, BODY)
    assert loaded.grid == original.grid
    assert loaded.error == original.error
    assert loaded.parameters == original.parameters
    x, p = [0, 0, 0.6], [1.0, 1.0, 0]
    for a, b in zip(loaded.flow(x, p, 1.3), original.flow(x, p, 1.3), strict=True):
        np.testing.assert_array_equal(a, b)
    tables = ["curvature-0.npy", "flagged-0.npy", "jacobi-0.npy", MANIFEST, "state-0.npy"]
    assert sorted(f.name for f in folder.iterdir()) == tables
    assert not list(folder.parent.glob(".map-*"))


def flip(path, position):
    data = bytearray(path.read_bytes())
    data[position] ^= 1
    path.write_bytes(bytes(data))


def edit(folder, change, *, sign=True):
    document = json.loads((folder / MANIFEST).read_text())
    change(document["content"])
    if sign:
        document["blake2b"] = content_digest(document["content"])
    (folder / MANIFEST).write_text(json.dumps(document))


DAMAGES = {
    "flipped bit of an array": lambda f: flip(f / "state-0.npy", 5000),
    "flipped bit of the manifest": lambda f: flip(f / MANIFEST, 60),
    "truncated array": lambda f: (f / "state-0.npy").write_bytes((f / "state-0.npy").read_bytes()[:-8]),
    "missing array": lambda f: (f / "jacobi-0.npy").unlink(),
    "empty manifest": lambda f: (f / MANIFEST).write_text(""),
    "manifest of another kind": lambda f: (f / MANIFEST).write_text("[1, 2]"),
    "manifest too deep": lambda f: (f / MANIFEST).write_text("[" * 100_000),
    "huge manifest": lambda f: (f / MANIFEST).write_text(" " * 2_000_000),
    "unsigned edit": lambda f: edit(f, lambda c: c.update(degree=5), sign=False),
    "signed shape of another grid": lambda f: edit(f, lambda c: c.update(nodes=[11, 10, 12])),
    "signed unknown degree": lambda f: edit(f, lambda c: c.update(degree=4)),
    "schema of the future": lambda f: edit(f, lambda c: c.update(schema=99)),
    "pickle": lambda f: np.save(f / "state-0.npy", np.array([print], dtype=object), allow_pickle=True),
    "shape bomb": lambda f: edit(f, lambda c: c["files"]["state-0.npy"].update(shape=[2**40, 2**40, 1, 1, 8])),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_a_clear_error(damage, folder):
    DAMAGES[damage](folder)
    with pytest.raises(cr.CreepingError, match="rebuild"):
        cr.load_phase_map(folder, BODY)


def test_map_of_another_body_is_refused(folder):
    with pytest.raises(cr.CreepingError, match="is a map of"):
        cr.load_phase_map(folder, sc.Ellipsoid(1.0, 0.8, 0.61))


def test_save_overwrites_nothing_and_a_file_is_no_folder(original, folder, tmp_path):
    with pytest.raises(cr.CreepingError, match="exists"):
        original.save(folder)
    (tmp_path / "file").write_text("")
    with pytest.raises(cr.CreepingError, match="cannot write"):
        original.save(tmp_path / "file" / "map")


def test_cache_hit_rebuild_and_miss(tmp_path):
    said = []
    options = {**OPTIONS, "cache": tmp_path, "progress": said.append}
    first = cr.build_phase_map(BODY, **options)
    assert any("tracing" in line for line in said)
    said.clear()
    again = cr.build_phase_map(BODY, **options)
    assert said == []
    np.testing.assert_array_equal(again.leaps[0].state, first.leaps[0].state)
    (stored,) = [p for p in tmp_path.iterdir() if p.is_dir()]
    flip(stored / "state-0.npy", 4000)
    repaired = cr.build_phase_map(BODY, **options)
    assert any("rebuilding" in line for line in said)
    np.testing.assert_array_equal(repaired.leaps[0].state, first.leaps[0].state)
    cr.build_phase_map(BODY, **{**options, "degree": 5})
    assert len([p for p in tmp_path.iterdir() if p.is_dir()]) == 2


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no such permissions here")
def test_a_map_that_others_could_write_is_not_taken(tmp_path):
    said = []
    options = {**OPTIONS, "cache": tmp_path, "progress": said.append}
    first = cr.build_phase_map(BODY, **options)
    (stored,) = [p for p in tmp_path.iterdir() if p.is_dir()]
    edit(stored, lambda content: content.update(error=[0.5, 0.5, 3]))
    assert cr.build_phase_map(BODY, **options).error.rms == 0.5, "it would be taken"
    stored.chmod(0o777)
    assert cr.build_phase_map(BODY, **options).error == first.error
    assert any(f"rebuilding: {stored} can be written by other users" in line for line in said)


def test_cache_that_cannot_be_written_is_said_and_done_without(tmp_path):
    (tmp_path / "file").write_text("")
    said = []
    flow = cr.build_phase_map(BODY, cache=tmp_path / "file", progress=said.append, **OPTIONS)
    assert flow.error.rms < 1
    assert any("without" in line for line in said)


def test_full_disk_leaves_nothing_behind(original, tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "save", full)
    with pytest.raises(cr.CreepingError, match="No space left"):
        original.save(tmp_path / "map")
    assert [p.name for p in tmp_path.iterdir() if p.name != "map.lock"] == []


def test_fingerprint_of_a_body_that_has_none():
    def plain(semi_axis):
        inner = sc.Ellipsoid(semi_axis, 0.8, 0.6)
        names = ("level", "gradient", "hessian", "atlas", "bounds", "parameters")
        return type("Plain", (), {name: getattr(inner, name) for name in names})()

    assert fingerprint(plain(1.0)) == fingerprint(plain(1.0))
    assert fingerprint(plain(1.0)) != fingerprint(plain(1.0001))


@pytest.mark.slow
def test_second_process_waits_and_opens_the_same_map(tmp_path):
    code = (
        "import creeping as cr, scatterers as sc\n"
        "def say(text): print(text, flush=True)\n"
        "options = dict(horizon=0.25, grid=(10, 12), degree=3, progress=say)\n"
        f"cr.build_phase_map(sc.Ellipsoid(1.0, 0.8, 0.6), cache={str(tmp_path)!r}, **options)"
    )
    both = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate(timeout=HANGS)[0] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert sorted("tracing" in text for text in said) == [False, True]
    assert len([p for p in tmp_path.iterdir() if p.is_dir()]) == 1


ODD = {
    "nodes": [[12], ["12", 12, 12], [1.5, 12, 12], [-4, 12, 12], None],
    "periodic": [[True], [1, 0], "ab"],
    "degree": ["3", None, 1e300],
    "times": [[], None, [float("nan")]],
    "model": [None, "none"],
    "body": [None, "Sphere"],
}


@pytest.mark.parametrize("key", ODD)
def test_a_signed_manifest_with_odd_values(key, folder):
    for value in ODD[key]:
        edit(folder, lambda content, value=value: content.__setitem__(key, value))
        with pytest.raises(cr.StoredMapError):
            cr.load_phase_map(folder, BODY)
    edit(folder, lambda content: content.pop(key))
    with pytest.raises(cr.StoredMapError, match=r"incomplete|is a map of|no readable"):
        cr.load_phase_map(folder, BODY)
    for content in (3, [1], None):
        (folder / MANIFEST).write_text(json.dumps({"content": content, "blake2b": content_digest(content)}))
        with pytest.raises(cr.StoredMapError, match="no readable phase map"):
            cr.load_phase_map(folder, BODY)
