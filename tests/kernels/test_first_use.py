"""First use of kernels: told once, compiled ahead by a process that ends with its parent, garbage left for later."""

import gc
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba import njit

from creeping.commands import upkeep
from creeping.kernels import first_use
from tests.patience import HANGS, until

ROOT = Path(__file__).parents[2]


class Event:
    """As of numba, of a function of a module."""

    def __init__(self, module):
        function = type("Function", (), {"__module__": module})
        self.data = {"dispatcher": type("Dispatcher", (), {"py_func": function})}


@pytest.fixture
def started(monkeypatch):
    """Modules for which a process would have been started."""
    modules = []
    monkeypatch.setattr(first_use, "may_start", lambda *_: True)
    monkeypatch.setattr(first_use, "start", lambda first, *_: modules.append(first))
    monkeypatch.delitem(sys.modules, first_use.AHEAD, raising=False)
    return modules


def test_compilation_is_told_once_and_compiled_ahead(started, caplog, tmp_path):
    listener = first_use._FirstUse(tmp_path, "")
    usual = gc.get_threshold()
    for module in ("scipy.other", "creeping.kernels.block", "creeping.shadow.kernels.trace"):
        listener.on_start(Event(module))
        assert gc.get_threshold() == first_use.PATIENT
        listener.on_start(Event(module))
        listener.on_end(Event(module))
        assert gc.get_threshold() == first_use.PATIENT
        listener.on_end(Event(module))
        assert gc.get_threshold() == usual
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert "compiling kernels, once" in caplog.text
    assert started == ["creeping.kernels.block"]
    # code of others is not told
    caplog.clear()
    njit(lambda x: x + 1)(1.0)
    assert len(started) == 1 and not caplog.records


def test_commands_compile_ahead_and_say_so_themselves(started, caplog, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, first_use.AHEAD, upkeep)
    first_use._FirstUse(tmp_path, "").on_start(Event("creeping.shadow.kernels.trace"))
    assert started == ["creeping.shadow.kernels.trace"] and not caplog.records


def test_a_run_compiles_ahead_at_once_where_no_kernel_of_rays_is_kept(started, tmp_path, monkeypatch):
    monkeypatch.setattr(first_use, "_watching", [first_use._FirstUse(tmp_path, "")])
    first_use.begin("creeping.shadow")
    first_use.begin("creeping.shadow")
    assert started == ["creeping.shadow"]
    (tmp_path / "exponential.second_form-1.nbi").touch()
    monkeypatch.setattr(first_use, "_watching", [first_use._FirstUse(tmp_path, "")])
    first_use.begin("creeping.shadow")
    assert len(started) == 1


def test_nothing_is_compiled_ahead_without_need(monkeypatch, tmp_path):
    assert not first_use.may_start(tmp_path, "abc")
    monkeypatch.delitem(sys.modules, "pytest")
    monkeypatch.setenv("CREEPING_THREADS", "2")
    assert first_use.may_start(tmp_path / "later", "abc")
    (tmp_path / first_use.STAMP).write_text("abc")
    assert first_use.may_start(tmp_path, "abd") and not first_use.may_start(tmp_path, "abc")
    monkeypatch.setattr(sys, "executable", "/opt/modeller/modeller")
    assert not first_use.may_start(tmp_path, "abd")
    monkeypatch.undo()
    monkeypatch.delitem(sys.modules, "pytest")
    monkeypatch.setenv("CREEPING_THREADS", "1")
    assert not first_use.may_start(tmp_path, "abd")


@pytest.mark.slow
def test_it_ends_with_its_parent(tmp_path):
    # the parent is killed, and can tell nobody
    code = f"""
import os, pathlib, signal, time
from creeping.kernels import first_use
first_use.AHEAD = "slow"
first_use.start("first", pathlib.Path({str(tmp_path)!r}), "abc")
while not pathlib.Path({str(tmp_path / "pid")!r}).exists():
    time.sleep(0.01)
os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
"""
    (tmp_path / "slow.py").write_text(f"""
import os, pathlib, threading, time
from creeping.commands.upkeep import _end_with_parent
def main(*given):
    threading.Thread(target=_end_with_parent, daemon=True).start()
    pathlib.Path({str(tmp_path / "part")!r}).write_text(str(os.getpid()))
    os.replace({str(tmp_path / "part")!r}, {str(tmp_path / "pid")!r})
    time.sleep({2 * HANGS})
""")
    paths = {"PYTHONPATH": os.pathsep.join((str(ROOT), str(tmp_path)))}
    subprocess.run([sys.executable, "-c", code], env=os.environ | paths, timeout=HANGS, check=False)
    pid = int((tmp_path / "pid").read_text())

    def gone():
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        return False

    until(gone, lambda: "it goes on")


def test_what_is_compiled_ahead_is_noted_once(monkeypatch, tmp_path):
    ran = []
    monkeypatch.setattr(upkeep, "steps", lambda first: [lambda: ran.append(first)])
    monkeypatch.setattr(upkeep, "_end_with_parent", lambda: None)
    try:
        for _ in range(2):
            upkeep.main("creeping.shadow.kernels.trace", str(tmp_path / "new"), "abc")
    finally:
        gc.enable()
    assert ran == ["creeping.shadow.kernels.trace"] and first_use.is_done(tmp_path / "new", "abc")


@pytest.mark.slow
def test_the_job_runs():
    for first in ("creeping.shadow.kernels.newton", "creeping.geodesics.kernels.integrator"):
        for step in upkeep.steps(first):
            step()
