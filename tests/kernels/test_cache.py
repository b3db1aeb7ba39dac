"""Compiled kernels are dropped when a source that they are made of has changed, and only then."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from creeping.kernels import cache
from creeping.kernels.cache import discard_stale

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("every", [False, True])
def test_kernels_are_dropped_when_a_source_changes(every, tmp_path: Path):
    package = tmp_path / "package"
    source, constants, other = (package / f"room/{name}.py" for name in ("kernels/inner", "constants", "other"))
    source.parent.mkdir(parents=True)
    source.write_text("from package.room.constants import A\n")
    constants.write_text("A = 1\n")
    other.write_text("")
    cached = source.parent / "__pycache__" / "outer.kernel-1.py311.nbi"
    cached.parent.mkdir()
    cached.write_bytes(b"old")
    (tmp_path / "__pycache__").write_text("no folder")
    discard_stale(tmp_path, every=every)
    assert (tmp_path / "__pycache__").read_text() == "no folder"
    discard_stale(package, every=every)
    assert not cached.exists(), "kernels of unknown sources"
    for changed in (source, constants):
        cached.write_bytes(b"new")
        discard_stale(package, every=every)
        assert cached.exists(), "kernels of these very sources"
        changed.write_text(changed.read_text() + "# changed\n")
        discard_stale(package, every=every)
        assert not cached.exists(), "kernels of sources that changed"
    if not every:
        cached.write_bytes(b"new")
        other.write_text("B = 2\n")
        discard_stale(package, every=every)
        assert cached.exists(), "no kernel takes anything from there"


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "package"
    (folder / "kernels/__pycache__").mkdir(parents=True)
    (folder / "kernels/inner.py").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.setattr(numba.config, "CACHE_DIR", numba.config.CACHE_DIR)
    return folder


@pytest.mark.parametrize("named", [False, True])
def test_folders_that_others_can_write_are_not_used(package, tmp_path, monkeypatch, named):
    cache.keep_private(package, 64 * "a")
    assert os.environ["NUMBA_CACHE_DIR"] == ""
    (tmp_path / "named").mkdir(mode=0o755)
    if named:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "named"))
        cache.keep_private(package, 64 * "a")
        assert os.environ["NUMBA_CACHE_DIR"] == str(tmp_path / "named")
    bad = tmp_path / "named" if named else package / "kernels/__pycache__"
    bad.chmod(0o777)
    with pytest.warns(RuntimeWarning, match=f"go-w.*{bad}"):
        cache.keep_private(package, 64 * "a")
    place = Path(os.environ["NUMBA_CACHE_DIR"])
    assert place == tmp_path / "cache/creeping-kernels" / (16 * "a") == Path(numba.config.CACHE_DIR)
    assert place.stat().st_mode & 0o777 == 0o700
    # the other package adds its digest, once, and says nothing
    cache.keep_private(package, 64 * "b")
    cache.keep_private(package, 64 * "b")
    assert os.environ["NUMBA_CACHE_DIR"] == f"{place}-{16 * 'b'}"


def test_no_folder_at_all_is_an_error(package, tmp_path):
    (package / "kernels/__pycache__").chmod(0o777)
    (tmp_path / "cache/creeping-kernels").mkdir(parents=True)
    (tmp_path / "cache/creeping-kernels").chmod(0o777)
    with pytest.raises(PermissionError, match="as well; make it yours alone"):
        cache.keep_private(package, 64 * "a")


@pytest.mark.parametrize(
    ("mode", "above", "expected"),
    [(0o755, 0o755, False), (0o755, 0o1777, False), (0o755, 0o777, True), (0o757, 0o755, True)],
)
def test_who_can_write(tmp_path, mode, above, expected):
    folder = tmp_path / "above/own"
    folder.mkdir(parents=True)
    folder.chmod(mode), folder.parent.chmod(above)
    assert cache.open_to_others(folder, frozenset((os.getuid(),))) is expected
    assert cache.open_to_others(folder, frozenset((os.getuid() + 1,)))
    assert not cache.open_to_others(folder / "none", frozenset())


def test_kernels_are_compiled_into_the_private_folder(tmp_path):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    code = "from creeping.kernels.splines import weights; from creeping.kernels import block; block.aligned(2, 3)"
    paths = {"NUMBA_CACHE_DIR": str(tmp_path / "open"), "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | paths, capture_output=True, text=True, check=True
    )
    assert "other users can write" in done.stderr
    assert list((tmp_path / "creeping-kernels").rglob("*aligned*.nbi")) and not list((tmp_path / "open").rglob("*"))
