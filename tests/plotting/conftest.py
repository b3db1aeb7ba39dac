"""What pictures need of the machine: OpenGL, and a verdict about it that is fresh."""

import pytest

from creeping.plotting import scene


@pytest.fixture
def fresh_display(monkeypatch, tmp_path):
    """No verdict in memory, an empty cache folder, no wish in the environment."""
    monkeypatch.delenv("CREEPING_NO_GL", raising=False)
    monkeypatch.setattr(scene, "_cache_file", lambda: tmp_path / "cache" / "gl.json")
    scene._verdict.cache_clear()
    yield tmp_path / "cache" / "gl.json"
    scene._verdict.cache_clear()


@pytest.fixture(scope="session")
def opengl():
    probe = scene.gl_available()
    if not probe.ok:
        pytest.skip(probe.reason)
