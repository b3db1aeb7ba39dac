"""Files written aside and renamed, so that a reader never meets half of one."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from creeping.errors import CreepingError

_REMEDIES = {
    errno.ENOENT: "create the folder first",
    errno.ENOTDIR: "a part of the path is a file; choose another folder",
    errno.EISDIR: "the path is a folder; give a file name",
    errno.EACCES: "choose a folder you may write to",
    errno.EPERM: "choose a folder you may write to",
    errno.EROFS: "choose a folder you may write to",
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.ENAMETOOLONG: "choose a shorter name",
}


@contextmanager
def written_aside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside ``path``; on success it replaces ``path``, on any error it is removed.

    Raises
    ------
    CreepingError
        If the file cannot be written: missing folder, no permission, full disk.
    """
    target = Path(path)
    aside: Path | None = None
    try:
        # the suffix stays last: writers of pictures choose the format by it
        handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=f".{target.stem[:100]}-", dir=target.parent)
        os.close(handle)
        aside = Path(name)
        yield aside
        # mkstemp makes the file private; give it the mode that open() would have given
        umask = os.umask(0)
        os.umask(umask)
        aside.chmod(0o666 & ~umask)
        os.replace(aside, target)
        aside = None
    except OSError as error:
        remedy = _REMEDIES.get(error.errno or 0, "choose another path")
        raise CreepingError(f"cannot write {target}: {error.strerror or error}; {remedy}", path=target) from error
    finally:
        if aside is not None:
            with suppress(OSError):
                aside.unlink()
