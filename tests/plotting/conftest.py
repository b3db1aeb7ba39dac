"""What pictures need of the machine: OpenGL, and a verdict about it that is fresh."""

import pytest

from creeping.plotting import scene


@pytest.fixture
def fresh_display(monkeypatch):
    """No verdict in memory, no wish in the environment."""
    monkeypatch.delenv("CREEPING_NO_GL", raising=False)
    scene._probe.cache_clear()
    yield
    scene._probe.cache_clear()


@pytest.fixture(scope="session")
def opengl():
    probe = scene.gl_available()
    if not probe.ok:
        pytest.skip(probe.reason)
