"""The question whether OpenGL works, with a subprocess that answers in every way."""

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


def test_asks_once_per_process(answers):
    assert gl_available() == GLProbe(True, "rendered")
    assert gl_available().ok
    assert answers.calls == 1


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


def test_environment_says_no(answers, monkeypatch):
    monkeypatch.setenv("CREEPING_NO_GL", "1")
    probe = gl_available()
    assert not probe.ok
    assert "CREEPING_NO_GL" in probe.reason
    assert answers.calls == 0
