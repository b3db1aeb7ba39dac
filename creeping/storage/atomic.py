"""Files as they are read and written: written aside and renamed, so that a reader never meets half of one.

What is no file is written through. What is read is a regular file of a size that is bounded: a pipe would be waited
for, a device has no end.
"""

import errno
import io
import math
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from creeping.errors import CreepingError

_REMEDIES = {
    errno.ENOENT: "create the folder first",
    errno.ENOTDIR: "a part of the path is a file; choose another folder",
    errno.EISDIR: "the path is a folder; give a file name",
    errno.EACCES: "choose another name, or a folder that you may write to",
    errno.EPERM: "choose a folder you may write to",
    errno.EROFS: "choose a folder you may write to",
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.ELOOP: "its links lead in a circle; choose another path",
}


@contextmanager
def written_aside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path; on success what is written there stands at ``path``, on any error it is removed.

    A file is replaced at once, where a link leads to if ``path`` is one. A device, a pipe or an open file of this
    process (``/dev/stdout``) stays what it is: the bytes are written to it.

    Raises
    ------
    CreepingError
        If the file cannot be written: missing folder, no permission, full disk.
    """
    target = Path(path)
    aside: Path | None = None
    try:
        through = _written_through(target)
        real = Path(os.path.realpath(target))
        # the suffix stays last: writers of pictures choose the format by it
        handle, name = tempfile.mkstemp(
            suffix=target.suffix, prefix=f".{real.stem[:100]}-", dir=None if through else real.parent
        )
        os.close(handle)
        aside = Path(name)
        yield aside
        if through:
            with open(aside, "rb") as made, open(target, "wb") as stream:
                shutil.copyfileobj(made, stream)
            return
        aside.chmod(_mode(real))
        # wait until a file is on disk: renamed before it is, it would be empty after a power failure
        with open(aside, "rb+") as stream:
            os.fsync(stream.fileno())
        os.replace(aside, real)
        aside = None
    except OSError as error:
        remedy = _REMEDIES.get(error.errno or 0, "choose another path")
        raise CreepingError(f"cannot write {target}: {error.strerror or error}; {remedy}", path=target) from error
    finally:
        if aside is not None:
            with suppress(OSError):
                aside.unlink()


def _written_through(target: Path) -> bool:
    """Whether what stands at the path is neither a file nor a folder, or is a file that a process holds open."""
    try:
        mode = os.stat(target).st_mode
    except FileNotFoundError:
        return False
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode):
        return True
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, "the file may not be written")
    place = str(target)
    # /dev/stdout and /dev/fd/1 lead to /proc/self/fd/1: replaced, the file would lose what else is written to it
    while not os.path.realpath(os.path.dirname(place) or ".").startswith("/proc/"):
        if not os.path.islink(place):
            return False
        place = os.path.join(os.path.dirname(place), os.readlink(place))
    return True


def _mode(path: Path) -> int:
    """Mode of the file that is there, else that which open() would give a new one."""
    with suppress(FileNotFoundError):
        return stat.S_IMODE(os.stat(path).st_mode)
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask


def opened(path: str | os.PathLike[str], most: float = math.inf) -> io.BufferedReader:
    """Open a regular file, or a link to one, of at most ``most`` bytes; nothing is waited for.

    Raises
    ------
    OSError
        If there is none, it is something else, or it is larger.

    Examples
    --------
    >>> opened("/")
    Traceback (most recent call last):
    ...
    OSError: [Errno 22] it is no regular file, but a folder, a pipe, a socket or a device
    """
    # before it is opened: to open a device may do something
    _require_regular(os.stat(path))
    stream = open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0)))
    try:
        # what stands there may have changed meanwhile
        found = os.fstat(stream.fileno())
        _require_regular(found)
        if found.st_size > most:
            raise OSError(errno.EFBIG, f"it has {found.st_size / 1e6:.0f} MB, {most / 1e6:.0f} are the most")
    except OSError:
        stream.close()
        raise
    return stream


def _require_regular(found: os.stat_result) -> None:
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "it is no regular file, but a folder, a pipe, a socket or a device")


def bytes_of(path: str | os.PathLike[str], most: int) -> bytes:
    """All of a file, as `opened`."""
    with opened(path, most) as stream:
        # files that the system makes up have no size
        found = stream.read(most + 1)
    if len(found) > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 1e6:.0f} MB")
    return found


def text_of(path: str | os.PathLike[str], most: int, encoding: str = "utf-8") -> str:
    """Text of a file, its lines ended by newlines, as `opened`.

    Raises
    ------
    UnicodeDecodeError
        If it is no such text.
    """
    return io.StringIO(bytes_of(path, most).decode(encoding), newline=None).read()
