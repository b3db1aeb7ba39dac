"""Files as they are read: regular ones, of a size that is bounded; a pipe would be waited for, a device has no end."""

import errno
import io
import math
import os
import stat


def opened(path: str | os.PathLike[str], most: float = math.inf) -> io.BufferedReader:
    """Open a regular file, or a link to one, of at most so many bytes; nothing is waited for.

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
