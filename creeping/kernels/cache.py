"""Compiled kernels on disk match the sources: numba looks at the file of a kernel only, not at those it calls into.

The sources of the kernels are the files of all `kernels` folders of the package and the modules these take constants
from.
"""

import hashlib
import re
from pathlib import Path

_IMPORT = re.compile(r"^from \w+((?:\.\w+)+) import", re.MULTILINE)


def kernel_sources(package: Path) -> list[Path]:
    """Files that decide what the kernels of a package are: (m,), sorted."""
    kernels = {path for path in package.rglob("*.py") if path.parent.name == "kernels"}
    named = {name for path in kernels for name in _IMPORT.findall(path.read_text(encoding="utf-8"))}
    places = {package.joinpath(*name.split(".")[1:]).with_suffix(".py") for name in named}
    return sorted(kernels | {place for place in places if place.is_file()})


def discard_stale(package: Path, *, every: bool = False) -> str:
    """Delete the compiled kernels cached for a package's folder unless they belong to its sources as they are.

    Those of its kernels; or ``every`` one, where what is compiled stands beside what is not. A cache that cannot be
    written (numba keeps it elsewhere then) is left alone. Returns the digest of the sources.
    """
    digest = hashlib.blake2b(digest_size=16)
    for source in sorted(package.rglob("*.py")) if every else kernel_sources(package):
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
