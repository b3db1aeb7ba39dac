"""What may stand at the path of a writer: a file, a link, a pipe, a folder, nothing; in private folders, no devices."""

import os
import socket
import stat
import subprocess
import sys
import threading

import pytest

import creeping as cr
import scatterers as sc
from creeping import files
from creeping.errors import CreepingError
from creeping.storage.atomic import written_aside


@pytest.fixture(scope="module")
def fan():
    ball = sc.Sphere()
    return cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1), n_points=32), length=0.5, n_rays=8, n_steps=3)


def _far(fan):
    return cr.far_field(fan, [(0, 0, -1.0)], wavenumber=10.0, boundary="hard", method="rays")


def _picture(path, fan):
    with written_aside(path) as aside:
        aside.write_bytes(b"\x89PNG" * 1000)


WRITERS = {
    "text": lambda path, fan: files.write_text(path, "x" * 100_000),
    "csv": lambda path, fan: files.write_csv(path, fan=fan),
    "mat": lambda path, fan: files.write_mat(path, _far(fan)),
    "vtp": lambda path, fan: files.write_vtp(path, fan=fan),
    "picture": _picture,
}


@pytest.mark.parametrize("kind", WRITERS)
def test_pipe_is_written_through(kind, fan, tmp_path):
    plain, pipe, got = tmp_path / f"plain.{kind}", tmp_path / f"pipe.{kind}", []
    WRITERS[kind](plain, fan)
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    WRITERS[kind](pipe, fan)
    reader.join(timeout=20)
    # a MAT file holds when it was written in its first 128 bytes
    assert got[0][128:] == plain.read_bytes()[128:] and len(got[0]) > 1000
    assert stat.S_ISFIFO(os.stat(pipe).st_mode)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([plain.name, pipe.name])


@pytest.mark.parametrize("there", [True, False], ids=["file", "dangling"])
@pytest.mark.parametrize("kind", WRITERS)
def test_link_is_followed(kind, there, fan, tmp_path):
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    target, link = folder / f"target.{kind}", tmp_path / f"link.{kind}"
    if there:
        target.write_text("old")
        target.chmod(0o600)
    link.symlink_to(os.path.join("elsewhere", target.name))
    WRITERS[kind](link, fan)
    assert link.is_symlink() and target.is_file() and target.stat().st_size > 1000
    assert [p.name for p in folder.iterdir()] == [target.name]
    if there:
        assert stat.S_IMODE(target.stat().st_mode) == 0o600


@pytest.mark.parametrize("made", ["folder", "socket", "circle"])
def test_what_takes_no_bytes_is_refused_and_stays(made, fan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.txt"
    if made == "folder":
        path.mkdir()
    elif made == "socket":
        # a short name: one of a socket has at most 107 bytes
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind("a.txt")
    else:
        path.symlink_to("a.txt")
    mode = os.lstat(path).st_mode
    with pytest.raises(CreepingError, match=r"cannot write .*a\.txt"):
        files.write_text(path, "x")
    assert os.lstat(path).st_mode == mode and [p.name for p in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.skipif(os.getuid() == 0, reason="root may write any file")
def test_a_file_that_may_not_be_written_stays(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o444)
    with pytest.raises(CreepingError, match="may not be written"):
        files.write_text(path, "x")
    assert path.read_text() == "old"


@pytest.mark.slow
def test_standard_output_is_written_to_wherever_it_leads(tmp_path):
    # a file that a process holds open is not replaced: what else it writes there would be lost
    out = tmp_path / "out.txt"
    code = "from creeping.files import write_text; write_text('/dev/stdout', 'one '); print('two')"
    with out.open("w") as stream:
        subprocess.run([sys.executable, "-c", code], stdout=stream, check=True)
    assert "two" in out.read_text() and [p.name for p in tmp_path.iterdir()] == ["out.txt"]
    piped = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert piped.stdout == "one two\n"


def test_a_failed_writer_leaves_what_was_there(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"whole")
    old = path.read_bytes()
    with pytest.raises(RuntimeError), written_aside(path) as aside:
        aside.write_bytes(b"half")
        raise RuntimeError
    assert path.read_bytes() == old and len(list(tmp_path.iterdir())) == 1
