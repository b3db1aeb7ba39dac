"""What pictures need of the machine: OpenGL, and a verdict about it that is fresh."""

import pytest

from creeping.plotting import display


@pytest.fixture
def fresh_display(monkeypatch, tmp_path):
    """No verdict in memory, an empty cache folder, no wish in the environment."""
    monkeypatch.delenv("CREEPING_NO_GL", raising=False)
    monkeypatch.setattr(display, "_cache_file", lambda: tmp_path / "cache" / "gl.json")
    display._verdict.cache_clear()
    yield tmp_path / "cache" / "gl.json"
    display._verdict.cache_clear()


@pytest.fixture(scope="session")
def opengl():
    probe = display.gl_available()
    if not probe.ok:
        pytest.skip(probe.reason)
