"""What is told while something runs: within five seconds and every five after, also of one stage or one kernel."""

import re
import sys
import time
from types import SimpleNamespace

import pytest
import shared_bodies as sc

import creeping as cr
from creeping import _progress
from creeping._progress import Progress, reporting, say, telling
from creeping.kernels import first_use


@pytest.fixture
def hasty(monkeypatch):
    monkeypatch.setattr(_progress, "EVERY", 0.6)


@pytest.mark.slow
def test_lines_come_by_themselves(hasty, monkeypatch, capsys):
    with Progress("values") as progress:
        progress("a fit of the mesh")
        time.sleep(0.8)
        with monkeypatch.context() as patch:
            patch.setattr(first_use, "is_compiling", lambda: True)
            time.sleep(0.7)
        progress.begin(0, 10)
        progress.told(2, 10)
        time.sleep(0.1)
        progress.told(4, 10)
        say("factors of block 1")
        time.sleep(0.7)
        progress.told(10, 10)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "creeping: a fit of the mesh ..."
    assert lines[1] == "creeping: a fit of the mesh, a second"
    assert "compiling kernels" in lines[2]
    assert re.fullmatch(r"creeping: 4 of 10 values, (\d s|a second) left: factors of block 1", lines[-2]), lines
    assert lines[-1] == "creeping: 10 of 10 values"


def test_time_left_is_by_what_came_after_the_first(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(_progress.time, "monotonic", lambda: now[0])
    progress = Progress(quiet=True)
    progress.begin(20, 100)
    for seconds, done in ((50.0, 40), (4.0, 60)):
        now[0] += seconds
        progress.told(done, 100)
    # 20 in 4 s once kernels were there
    assert progress.left() == pytest.approx(8.0) and progress.done_now == 40


def test_true_shows_lines_where_no_terminal_is(capsys):
    flow = cr.DirectFlow(sc.Sphere(), rtol=1e-6)
    cr.sweep_directions(flow, [(0, 0, 1), (1, 1, 0)], quantity="rays", n_rays=4, length=1.0, progress=True)
    assert "2 of 2 incidences" in capsys.readouterr().err
    with telling(True) as tell:
        tell("factors")
    assert "creeping: factors ..." in capsys.readouterr().err
    with reporting(None, "x") as told, reporting(print, "x") as own:
        assert told is None and own is print
    with pytest.raises(cr.InvalidInputError, match="give True or a function"):
        cr.sweep_directions(flow, [(0, 0, 1)], quantity="rays", progress=3)


def test_a_terminal_has_a_bar(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with Progress("values") as progress:
        progress("fields")
        progress.told(3, 4)
        progress.note("a note")
    told = capsys.readouterr().err
    assert "3 of 4 values" in told and "creeping: a note" in told


def test_a_notebook_has_one_output_that_changes(monkeypatch, capsys):
    shown = []
    handle = SimpleNamespace(update=lambda content, raw: shown.append(content["text/plain"]))
    display = SimpleNamespace(display=lambda content, raw, display_id: handle)
    shell = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=1), display=display)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    with reporting(True, "values") as told:
        told(3, 4, 0.0)
    assert shown[-1].startswith(f"[{'=' * 22}        ] 3 of 4 values") and not capsys.readouterr().err
