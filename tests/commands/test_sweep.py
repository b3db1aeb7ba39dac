"""``creeping sweep`` as a user meets it: output, exit codes, messages."""

import json
from contextlib import contextmanager

import numpy as np
import pytest
import xarray
from command_line import creeping
from filelock import FileLock

from creeping.commands import sweep as _sweep_command
from creeping.sweeping import cluster
from creeping.sweeping import run as running
from creeping.sweeping.study import EXAMPLE

STUDY = """
[study]
name = "a few"
body = "sphere:radius=2"
quantity = "rays"
rays = 8
steps = 2
length_in_body_sizes = 0.5
[incidences]
kind = "lebedev"
order = 3
[run]
chunk = 2
output = "out/rays.zarr"
"""


@pytest.fixture
def sweep(tmp_path, capsys):
    """Run the command on a study in this process: exit code, stdout, stderr."""

    def run(*arguments, study=STUDY):
        (tmp_path / "a.toml").write_text(study)
        return creeping("sweep", tmp_path / "a.toml", *arguments, capsys=capsys)

    return run


def test_a_study_becomes_a_dataset(sweep, tmp_path):
    code, out, err = sweep()
    folder = tmp_path / "out" / "rays.zarr"
    assert code == 0 and "6 incidences, rays: 6 ok" in out and str(folder) in out
    assert "creeping: 6 of 6 incidences" in err
    with xarray.open_zarr(folder, consolidated=False) as ds:
        assert ds.line_length.values == pytest.approx(4 * np.pi, rel=1e-9)
        # half the diagonal of the box of side 4
        assert ds.travel_time.values == pytest.approx(np.array([0.25, 0.5]) * 2 * np.sqrt(3))
        # great circles: J = cos(s/R)
        assert ds.spreading.values == pytest.approx(np.broadcast_to(np.cos(ds.travel_time / 2), (6, 8, 2)), abs=1e-6)
        assert ds.attrs["study"] == STUDY


def test_a_second_run_needs_resume_and_a_changed_study_another_place(sweep, tmp_path):
    assert sweep("--json")[0] == 0
    code, _, err = sweep()
    assert code == 3 and "exists; give --resume" in err
    code, out, _ = sweep("--resume")
    assert code == 0 and "nothing was missing" in out and "a second" not in out
    # the size of the tasks stays what it was
    code, out, _ = sweep("--resume", "--json", "--verify", study=STUDY.replace("chunk = 2", "chunk = 3"))
    assert json.loads(out)["chunk"] == 2
    summary = json.loads(out)
    assert code == 0 and summary["complete"] and summary["incidences_now"] == 0 and summary["status"]["ok"] == 6
    code, _, err = sweep("--resume", study=STUDY.replace("rays = 8", "rays = 9"))
    assert code == 3 and "another study: request.n_rays (stored 8, now 9)" in err
    # names, comments and the number of workers change no result
    assert sweep("--resume", study=STUDY.replace("a few", "some") + "# more\n")[0] == 0
    code, out, _ = sweep("-o", tmp_path / "b.zarr", "--json", study=STUDY.replace("rays = 8", "rays = 9"))
    assert code == 0 and json.loads(out)["output"] == str(tmp_path / "b.zarr")


@pytest.mark.slow
def test_damage_is_renewed_by_verify(sweep, tmp_path):
    sweep()
    victim = tmp_path / "out/rays.zarr/points/c/1/0/0/0"
    whole = victim.read_bytes()
    victim.write_bytes(whole[:-2] + b"??")
    code, out, err = sweep("--resume", "--verify")
    assert code == 0 and "task 1 is computed anew" in err and "2 of them now" in out
    assert victim.read_bytes() == whole


def test_a_sweep_that_takes_long_is_shared_out(sweep, tmp_path, monkeypatch):
    used = []
    monkeypatch.setattr(_sweep_command, "LARGE", -1.0)
    monkeypatch.setenv("CREEPING_THREADS", "2")

    @contextmanager
    def client(workers):
        used.append(workers)
        # which is this process
        yield None

    monkeypatch.setattr(cluster, "local_client", client)
    code, out, err = sweep()
    assert code == 0 and used == [2] and "sharing them among 2 worker processes" in err and "6 of them now" in out


def test_incidences_that_fail_are_data_unless_all_do(sweep, tmp_path, monkeypatch):
    def poisoned(sweeper, incidences):
        def call(d):
            if np.any(d[:, 2] > limit):
                raise ArithmeticError("too steep")
            return sweeper(d)

        call.request = sweeper.request
        return real(call, incidences)

    real = running.compute
    monkeypatch.setattr(running, "compute", poisoned)
    limit = 0.5
    code, out, _ = sweep()
    assert code == 4 and "5 ok, 1 failed" in out and "failed: ArithmeticError: too steep" in out
    assert "to try again those that failed: creeping sweep" in out
    limit = -2.0
    code, out, err = sweep("-o", tmp_path / "all.zarr", "--json")
    assert code == 3 and out == "" and "the first 2 incidences failed, all with ArithmeticError: too steep" in err
    assert "what is done is kept; to go on: creeping sweep" in err
    limit = 2.0
    code, out, _ = sweep("--resume")
    assert code == 0 and "2 of them now" in out


def test_a_store_is_held_from_check_to_end(sweep, tmp_path, monkeypatch):
    sweep()
    folder = tmp_path / "out/rays.zarr"
    with FileLock(folder / "study/.lock"):
        code, _, err = sweep("--resume", "--verify")
    assert code == 3 and "another process is filling" in err and "to go on" not in err

    def interrupted(plan, store, **options):
        assert store._lock.is_locked
        raise KeyboardInterrupt

    monkeypatch.setattr(running, "fill", interrupted)
    code, out, err = sweep("-o", tmp_path / "b.zarr", "--json")
    assert code == 130 and out == "" and "what is done is kept; to go on: creeping sweep" in err


def test_without_a_study_the_command_tells_where_to_start(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, _, err = creeping("sweep", capsys=capsys)
    assert code == 3 and "study.toml" in err and "creeping sweep --example > study.toml" in err


def test_mistakes_of_a_study_and_of_options(sweep, tmp_path, capsys):
    code, _, err = sweep(study=STUDY.replace("rays = 8", "ray = 8").replace("order = 3", "order = 4"))
    assert code == 3 and "has 2 mistakes" in err and "did you mean rays?" in err and "Lebedev" in err
    assert "unknown body 'spehre" in sweep(study=STUDY.replace("sphere", "spehre"))[2]
    assert "--verify goes with --resume" in sweep("--verify")[2]
    assert "give one" in sweep("--workers", 2, "--scheduler", "tcp://a:1")[2]
    assert "--workers 0" in sweep("--workers", 0)[2]
    assert not (tmp_path / "out").exists()
    assert creeping("sweep", "--example", capsys=capsys)[:2] == (0, EXAMPLE)
