"""Compiled kernels are dropped when any source of their package has changed, and only then."""

from pathlib import Path

import pytest

from creeping.kernels import cache as of_creeping
from scatterers.kernels import cache as of_scatterers


@pytest.mark.parametrize("module", [of_creeping, of_scatterers])
def test_kernels_are_dropped_when_a_source_changes(module, tmp_path: Path):
    (tmp_path / "inner.py").write_text("a = 1\n")
    cached = tmp_path / "__pycache__" / "outer.kernel-1.py311.nbi"
    cached.parent.mkdir()
    cached.write_bytes(b"old")
    module.discard_stale(tmp_path)
    assert not cached.exists(), "kernels of unknown sources"
    cached.write_bytes(b"new")
    module.discard_stale(tmp_path)
    assert cached.exists(), "kernels of these very sources"
    (tmp_path / "inner.py").write_text("a = 2\n")
    module.discard_stale(tmp_path)
    assert not cached.exists(), "kernels of sources that changed"


@pytest.mark.parametrize("module", [of_creeping, of_scatterers])
def test_unwritable_cache_is_left_alone(module, tmp_path: Path):
    (tmp_path / "__pycache__").write_text("no folder")
    module.discard_stale(tmp_path)
    assert (tmp_path / "__pycache__").read_text() == "no folder"
