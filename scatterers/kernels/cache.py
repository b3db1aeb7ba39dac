"""Compiled functions on disk match the sources: numba looks at a function's own file only, not at those it calls into.

A body's level is compiled from the file of the body itself, so every source of the package counts.
"""

import hashlib
from pathlib import Path


def discard_stale(package: Path) -> str:
    """Delete what is cached for a package's folder unless it belongs to its sources as they are.

    A cache that cannot be written (numba keeps it elsewhere then) is left alone. Returns the digest of the sources.
    """
    digest = hashlib.blake2b(digest_size=16)
    for source in sorted(package.rglob("*.py")):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    stamp = package / "__pycache__" / "kernels.digest"
    try:
        if stamp.is_file() and stamp.read_text() == digest.hexdigest():
            return digest.hexdigest()
        stamp.parent.mkdir(exist_ok=True)
        for cached in package.rglob("__pycache__/*.nb[ic]"):
            cached.unlink(missing_ok=True)
        stamp.write_text(digest.hexdigest())
    except OSError:
        pass
    return digest.hexdigest()
