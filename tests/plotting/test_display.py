"""The question whether OpenGL works, with a subprocess that answers in every way."""

import json
from types import SimpleNamespace

import pytest

from creeping.plotting import scene
from creeping.plotting.scene import GLProbe, gl_available


@pytest.fixture
def answers(monkeypatch, fresh_display):
    """Let the subprocess end with a given code; count how often it was asked."""
    state = SimpleNamespace(code=0, stderr=b"", calls=0, raises=None)

    def run(*_args, **_keywords):
        state.calls += 1
        if state.raises is not None:
            raise state.raises
        return SimpleNamespace(returncode=state.code, stderr=state.stderr)

    monkeypatch.setattr(scene.subprocess, "run", run)
    return state


def forget():
    scene._verdict.cache_clear()


def test_asks_once_per_process_and_once_per_machine(answers, fresh_display, monkeypatch):
    assert gl_available() == GLProbe(True, "rendered")
    assert gl_available().ok
    assert answers.calls == 1
    forget()
    assert gl_available().ok
    assert answers.calls == 1
    assert len(json.loads(fresh_display.read_text())) == 1
    # another display asks again
    monkeypatch.setenv("DISPLAY", ":77")
    assert gl_available().ok and answers.calls == 2


@pytest.mark.parametrize(
    ("code", "stderr", "message"),
    [(-11, b"", "signal 11"), (3, b"", "blank"), (1, b"ImportError: libX11.so.6: cannot open", "libX11.so.6")],
)
def test_failure_names_the_packages(answers, code, stderr, message):
    answers.code, answers.stderr = code, stderr
    probe = gl_available()
    assert not probe.ok
    assert message in probe.reason
    for package in ("libegl1", "libgl1-mesa-dri", "libx11-6"):
        assert package in probe.reason


@pytest.mark.parametrize("content", ["{", "null", '{"x": 3}', "\x00\xff"])
def test_damaged_cache_asks_again(answers, fresh_display, content):
    fresh_display.parent.mkdir()
    fresh_display.write_text(content, encoding="latin-1")
    assert gl_available().ok
    assert answers.calls == 1


def test_unwritable_cache_is_no_error(answers, monkeypatch, tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("in the way")
    monkeypatch.setattr(scene, "_cache_file", lambda: blocker / "creeping" / "gl.json")
    assert gl_available().ok


def test_environment_says_no(answers, monkeypatch):
    monkeypatch.setenv("CREEPING_NO_GL", "1")
    probe = gl_available()
    assert not probe.ok
    assert "CREEPING_NO_GL" in probe.reason
    assert answers.calls == 0
