"""Compiled kernels are dropped when a source that they are made of has changed, and only then."""

from pathlib import Path

import pytest

from creeping.kernels import cache as of_creeping
from scatterers.kernels import cache as of_scatterers


@pytest.mark.parametrize("module", [of_creeping, of_scatterers])
def test_kernels_are_dropped_when_a_source_changes(module, tmp_path: Path):
    package = tmp_path / "package"
    source, constants, other = (
        package / "room/kernels/inner.py",
        package / "room/constants.py",
        package / "room/other.py",
    )
    source.parent.mkdir(parents=True)
    source.write_text("from package.room.constants import A\n")
    constants.write_text("A = 1\n")
    other.write_text("")
    cached = source.parent / "__pycache__" / "outer.kernel-1.py311.nbi"
    cached.parent.mkdir()
    cached.write_bytes(b"old")
    module.discard_stale(package)
    assert not cached.exists(), "kernels of unknown sources"
    for changed in (source, constants):
        cached.write_bytes(b"new")
        module.discard_stale(package)
        assert cached.exists(), "kernels of these very sources"
        changed.write_text(changed.read_text() + "# changed\n")
        module.discard_stale(package)
        assert not cached.exists(), "kernels of sources that changed"
    if module is of_creeping:
        cached.write_bytes(b"new")
        other.write_text("B = 2\n")
        module.discard_stale(package)
        assert cached.exists(), "no kernel takes anything from there"


@pytest.mark.parametrize("module", [of_creeping, of_scatterers])
def test_unwritable_cache_is_left_alone(module, tmp_path: Path):
    (tmp_path / "__pycache__").write_text("no folder")
    module.discard_stale(tmp_path)
    assert (tmp_path / "__pycache__").read_text() == "no folder"
