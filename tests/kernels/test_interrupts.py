"""Ctrl-C ends what takes long within about a second of processor time, and leaves no traceback on the command line."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import creeping as cr
from creeping.kernels.callback import BlockCallback
from tests.patience import HANGS, until
from tests.plain_body import PlainEllipsoid

ROOT = Path(__file__).parents[2]
BEGIN = """
import sys, numpy as np, creeping as cr, scatterers as sc
from creeping.geodesics.states import random_bundle_points
from creeping.geodesics.states import pack
body, rng = sc.Ellipsoid(1.0, 0.8, 0.6), np.random.default_rng(0)
direct = cr.DirectFlow(body)
def rays(count, lanes): return pack(*random_bundle_points(body, count, rng=rng), lanes=lanes)
def small(**more): return cr.build_phase_map(body, horizon=0.5, grid=(16, 24), cache=False, **more)
def fan(): return cr.launch(direct, cr.shadow_line(body, (1, 0, 0)), length=4.0, n_rays=256)
def ready(): print("ready", flush=True)
"""
LONG = {
    "flow of one block": "f, s = small(), rays(64, 12); f.transport(s, np.ones(1)); ready()\n"
    "while True: f.transport(s, np.array([4e4]))",
    "map build": "body = sc.TwistedEllipsoid(); ready()\n"
    "while True: cr.build_phase_map(body, tolerance=1e-7, length=8.0, cache=False)",
    "far field by rays": "a = fan(), cr.fibonacci_directions(100_000), 90.0; ready()\n"
    "while True: cr.far_field(a[0], a[1], wavenumber=a[2], method='rays')",
    "sweep": "d = cr.fibonacci_directions(10**5); ready(); cr.sweep_directions(direct, d, wavenumbers=40.0)",
    "numpy methods": "from tests.plain_body import PlainEllipsoid\n"
    "direct, s = cr.DirectFlow(PlainEllipsoid(1.0, 0.8, 0.6)), rays(20_000, 12)\n"
    "direct.transport(s[:64], np.ones(1)); ready()\n"
    "direct.transport(s, np.array([99.0]))",
}
QUICK = (("flow of one block", 2),)


def seconds_of(process):
    """Processor time that a process has taken."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def interrupted(command, folder, wait, *, again=False):
    """Exit status, standard error and processor seconds of a process after a signal, ``wait`` s after it is ready.

    numba swallows an interrupt that meets it while it loads code: where it may still do so, ``again`` sends a second.
    """
    with (folder / "err").open("w") as err:
        process = subprocess.Popen(
            command,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=err,
            text=True,
            # what is started in the background of a shell ignores the signal, and so would its children
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        with process.stdout:
            assert wait(process), (folder / "err").read_text()
    before = seconds_of(process)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, (folder / "err").read_text(), usage.ru_utime + usage.ru_stime - before
        if again and time.monotonic() > sent + 10:
            again, before = False, seconds_of(process)
            process.send_signal(signal.SIGINT)
        if time.monotonic() > sent + HANGS:
            process.kill()
            process.wait()
            raise AssertionError("never interrupted")
        time.sleep(0.01)


def test_an_interrupt_meets_a_callback_before_it_catches(monkeypatch, interruptible):
    views, calls = BlockCallback._views, []

    def interrupting(callback, fields):
        calls.append(1)
        if len(calls) == 3:
            signal.raise_signal(signal.SIGINT)
        return views(callback, fields)

    monkeypatch.setattr(BlockCallback, "_views", interrupting)
    body, handler = PlainEllipsoid(1.0, 0.8, 0.6), signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        cr.trace(body, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], np.ones(1))
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processor time is read from /proc")
@pytest.mark.parametrize(
    "what, threads",
    [*QUICK, *(pytest.param(w, 2, marks=pytest.mark.slow) for w in LONG if (w, 2) not in QUICK)],
)
def test_long_calls_are_interrupted(what, threads, tmp_path, monkeypatch):
    monkeypatch.setenv("CREEPING_THREADS", str(threads))

    def wait(process):
        told = process.stdout.readline() == "ready\n"
        time.sleep(0.8)
        return told and process.poll() is None

    code, err, seconds = interrupted([sys.executable, "-c", BEGIN + LONG[what]], tmp_path, wait)
    assert code == -signal.SIGINT and err.rstrip().endswith("KeyboardInterrupt")
    # the end of the interpreter is in it, and what else the machine does makes seconds longer
    assert seconds < 3 * threads


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processor time is read from /proc")
@pytest.mark.slow
def test_the_command_line_says_one_line(tmp_path):
    run = "from creeping.commands.main import main; main()"
    command = [sys.executable, "-c", run, "run", "ellipsoid:a=1,b=0.8,c=0.6", "-o", str(tmp_path / "out")]

    def wait(process):
        until(lambda: "tracing" in (tmp_path / "err").read_text() or process.poll() is not None, pause=0.02)
        time.sleep(0.2)
        return process.poll() is None

    code, err, seconds = interrupted(
        [*command, "--flow", "map", "--tolerance", "1e-9", "--no-cache", "--direction", "1", "0", "0"],
        tmp_path,
        wait,
        again=True,
    )
    assert code == 130 and "Traceback" not in err and err.splitlines()[-1] == "creeping: interrupted"
    assert seconds < 1.5
