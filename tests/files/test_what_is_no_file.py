"""A pipe or a socket in the place of a file is refused at once, and so is what is too large, by every reader."""

import os
import socket

import pytest

from creeping.errors import CreepingError
from creeping.files import read_cut, read_ffe
from creeping.storage.atomic import bytes_of
from creeping.storage.folder import read_manifest
from creeping.sweeping.layout import unchanging_digest
from creeping.sweeping.study import read_study
from creeping.sweeping.study_tables import _table
from scatterers import Cad, Mesh


@pytest.fixture(params=["pipe", "link to a pipe", "socket"])
def no_file(request, tmp_path, monkeypatch):
    # the path of a socket is short
    monkeypatch.chdir(tmp_path)
    if request.param == "socket":
        with socket.socket(socket.AF_UNIX) as one:
            one.bind("manifest.json")
    else:
        os.mkfifo("pipe" if "link" in request.param else "manifest.json")
        if "link" in request.param:
            os.symlink("pipe", "manifest.json")
    return tmp_path / "manifest.json"


@pytest.mark.parametrize("read", [read_cut, read_ffe, read_study, lambda path: read_manifest(path.parent)])
def test_readers_do_not_wait(no_file, read):
    with pytest.raises(CreepingError, match="no regular file"):
        read(no_file)


def test_others_do_not_wait(no_file):
    with pytest.raises(OSError, match="no regular file"):
        _table(no_file)
    described = no_file.with_name("zarr.json")
    os.rename(no_file, described)
    with pytest.raises(OSError, match="no regular file"):
        unchanging_digest(no_file.parent.parent, [no_file.parent.name], [])
    os.rename(described, no_file)
    for kind, name in ((Mesh, "b.stl"), (Cad, "b.step")):
        os.rename(no_file, name)
        with pytest.raises(ValueError, match="no file"):
            kind(name)
        os.rename(name, no_file)


def test_sizes_are_bounded(tmp_path):
    path = tmp_path / "long"
    with path.open("wb") as stream:
        stream.truncate(5_000_000)
    assert len(bytes_of(path, 5_000_000)) == 5_000_000
    with pytest.raises(OSError, match="has 5 MB, 4 are the most"):
        bytes_of(path, 4_000_000)
