"""Compiled kernels on disk match the sources: numba looks at the file of a kernel only, not at those it calls into."""

import hashlib
from pathlib import Path


def discard_stale(folder: Path, *others: Path) -> None:
    """Delete the compiled kernels cached for a package's folder unless they belong to its sources as they are.

    ``others`` are folders with sources that they call into. A cache that cannot be written (numba keeps it elsewhere
    then) is left alone.
    """
    digest = hashlib.blake2b(digest_size=16)
    for source in [source for one in (folder, *others) for source in sorted(one.glob("*.py"))]:
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    stamp = folder / "__pycache__" / "kernels.digest"
    try:
        if stamp.is_file() and stamp.read_text() == digest.hexdigest():
            return
        stamp.parent.mkdir(exist_ok=True)
        for cached in stamp.parent.glob("*.nb[ic]"):
            cached.unlink(missing_ok=True)
        stamp.write_text(digest.hexdigest())
    except OSError:
        return
