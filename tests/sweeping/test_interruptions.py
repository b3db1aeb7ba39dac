"""Drivers that are killed or interrupted: nothing committed is lost, and resuming computes exactly the rest."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import fake_sweeps as fake
import numpy as np
import pytest

from creeping._progress import Progress
from creeping.commands import sweep as _sweep_command
from creeping.sweeping.run import fill, open_store
from creeping.sweeping.store import SweepStore
from tests.patience import HANGS, until

ROOT = Path(__file__).parents[2]
STUDY = """
[study]
body = "sphere"
quantity = "rays"
rays = 8
length = 1.0
[incidences]
kind = "fibonacci"
count = 200
[flow]
kind = "direct"
[run]
chunk = 2
"""


def started(*arguments, **environment):
    """A process of Python with this repository on its path."""
    paths = {"PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"}
    return subprocess.Popen(
        [sys.executable, *arguments],
        env=os.environ | paths | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # what is started in the background of a shell ignores the signal, and so would its children
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def wait_for_tasks(folder, number, process):
    """Wait until so many tasks are marked."""

    def marked():
        done = len(list(folder.glob("task_status/c/*"))) >= number
        assert done or process.poll() is None, process.communicate()
        return done

    until(marked, lambda: f"{number} tasks were not done", pause=0.02)


@pytest.mark.parametrize(
    ("workers", "after", "seconds"), [(0, 7, 0.011), pytest.param(2, 5, 0.02, marks=pytest.mark.slow)]
)
def test_kill_9_of_the_driver(tmp_path, monkeypatch, workers, after, seconds):
    folder, diary = tmp_path / "s.zarr", tmp_path / "diary"
    code = f"import fake_sweeps; fake_sweeps.drive({str(folder)!r}, 60, 3, {workers})"
    driver = started("-c", code, FAKE_SECONDS=str(seconds))
    wait_for_tasks(folder, after, driver)
    os.kill(driver.pid, signal.SIGKILL)
    driver.communicate()
    if workers:
        # those end by themselves when they miss their scheduler; what they still write are the same bytes
        with suppress(ProcessLookupError):
            os.killpg(driver.pid, signal.SIGKILL)
    plan = fake.plan(60, 3)
    store = open_store(plan, folder, resume=True)
    missing = store.missing()
    assert after <= 20 - len(missing) < 20
    done = np.ones(60, dtype=bool)
    for task in missing:
        done[store.rows(task)] = False
    assert np.array_equal(store.dataset().creeping.values[done], fake.creeping_of(60)[done])
    diary.mkdir()
    monkeypatch.setenv("FAKE_DIARY", str(diary))
    assert fill(plan, store)
    assert len(list(diary.iterdir())) == len(missing)
    undisturbed = SweepStore.create(tmp_path / "whole.zarr", plan)
    fill(plan, undisturbed)
    assert fake.bytes_of(folder) == fake.bytes_of(undisturbed.folder)


@pytest.mark.slow
def test_one_interrupt_ends_the_command_with_4_and_tells_how_to_go_on(tmp_path):
    (tmp_path / "a study.toml").write_text(STUDY)
    folder = tmp_path / "a study.zarr"
    command = ("-c", "from creeping.commands.main import main; main()", "sweep")
    process = started(*command, str(tmp_path / "a study.toml"))
    wait_for_tasks(folder, 4, process)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=HANGS)
    assert process.returncode == 4, (out, err)
    assert "interrupt again to stop at once" in err and "Traceback" not in err
    (again,) = re.findall("not complete; to go on: (.*)", out)
    assert shlex.split(again)[:2] == ["creeping", "sweep"]
    done = [p.name for p in folder.glob("task_status/c/*")]
    assert 4 <= len(done) < 100
    times = {name: (folder / "points/c" / name / "0/0/0").stat().st_mtime_ns for name in done}
    process = started(*command, *shlex.split(again)[2:])
    out, err = process.communicate(timeout=HANGS)
    assert process.returncode == 0, (out, err)
    assert f"{200 - 2 * len(done)} of them now" in out and "200 incidences, rays: 200 ok" in out
    assert times == {name: (folder / "points/c" / name / "0/0/0").stat().st_mtime_ns for name in done}


def test_interrupts_are_counted(interruptible):
    meter = Progress(quiet=True)
    before = signal.getsignal(signal.SIGINT)
    with _sweep_command._stopping(meter) as asked:
        assert not asked.is_set()
        os.kill(os.getpid(), signal.SIGINT)
        assert asked.wait(HANGS)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(1)
    assert signal.getsignal(signal.SIGINT) is before
