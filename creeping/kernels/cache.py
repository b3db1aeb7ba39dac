"""What is kept on disk between runs: compiled kernels match their sources, and folders are those of this user alone.

numba looks at the file of a kernel only, not at those it calls into. The sources of the kernels are the files of all
`kernels` folders of the package and the modules these take constants from.

numba unpickles and runs what it finds in its cache, and a fit or a map that somebody else has put there is another
body. A folder is trusted if nobody but the user, root and the owner of the package can put files into it or replace it.
Both packages keep theirs by it.
"""

import hashlib
import os
import re
import stat
import sys
import warnings
from contextlib import suppress
from pathlib import Path


def kernel_sources(package: Path) -> list[Path]:
    """Files that decide what the kernels of a package are: (m,), sorted."""
    kernels = {path for path in package.rglob("*.py") if path.parent.name == "kernels"}
    imported = re.compile(r"^from \w+((?:\.\w+)+) import", re.MULTILINE)
    named = {name for path in kernels for name in imported.findall(path.read_text(encoding="utf-8"))}
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
    with suppress(OSError):
        if not stamp.is_file() or stamp.read_text() != digest.hexdigest():
            stamp.parent.mkdir(exist_ok=True)
            for cached in package.rglob("__pycache__/*.nb[ic]"):
                cached.unlink(missing_ok=True)
            stamp.write_text(digest.hexdigest())
    return digest.hexdigest()


def open_to_others(folder: Path, trusted: frozenset[int]) -> bool:
    """Whether users other than the ``trusted`` can put files into a folder, or another folder in its place."""
    try:
        own, above = folder.stat(), folder.resolve().parent.stat()
    except OSError:
        return False
    replaceable = bool(above.st_mode & stat.S_IWOTH) and not above.st_mode & stat.S_ISVTX
    shared = bool(own.st_mode & stat.S_IWGRP) and _has_others(own.st_gid)
    return own.st_uid not in trusted or bool(own.st_mode & stat.S_IWOTH) or shared or replaceable


def _has_others(group: int) -> bool:
    """Whether a group has members besides this user; the one that many systems give each user has none."""
    import grp
    import pwd

    try:
        user = pwd.getpwuid(os.getuid())
        return group != user.pw_gid or bool(set(grp.getgrgid(group).gr_mem) - {user.pw_name})
    except KeyError:
        return True


def require_private(path: Path) -> None:
    """Refuse a file or folder that users other than this one and root can write, or put another in place of.

    Raises
    ------
    PermissionError
    """
    if hasattr(os, "getuid") and open_to_others(path, trusted := frozenset((0, os.getuid()))):
        owner = path.stat().st_uid
        whose = "can be written by other users" if owner in trusted else f"belongs to user {owner}"
        raise PermissionError(f"{path} {whose}; make it yours alone (chmod go-w), or name another by CREEPING_CACHE")


def private_folder(folder: Path) -> Path:
    """Make a folder that only this user can write, or check one that is there.

    Raises
    ------
    PermissionError
        If others can write it, too.
    OSError
        If it cannot be made.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    require_private(folder)
    return folder


def keep_private(package: Path, digest: str) -> None:
    """Have numba keep compiled code in a folder of this user alone if others can write the one it would take.

    That is $NUMBA_CACHE_DIR, or the package's ``__pycache__`` folders; the other one is in the user's cache, named
    after the digest of the package's sources.

    Raises
    ------
    PermissionError
        If others can write that one, too.
    """
    if not hasattr(os, "getuid"):
        return
    import platformdirs

    named = os.environ.get("NUMBA_CACHE_DIR")
    trusted = frozenset((0, os.getuid(), package.stat().st_uid))
    sources = {path.parent for path in package.rglob("*.py")}
    usual = [Path(named)] if named else sorted(folder / "__pycache__" for folder in sources)
    bad = next((folder for folder in usual if open_to_others(folder, trusted)), None)
    root = platformdirs.user_cache_path("creeping-kernels")
    if bad is None:
        if not named or Path(named).parent != root or digest[:16] in Path(named).name:
            return
        # the other package has found its folder open: what is kept there belongs to the sources of both
        private = root / f"{Path(named).name}-{digest[:16]}"
    else:
        private = root / digest[:16]
    private.mkdir(mode=0o700, parents=True, exist_ok=True)
    remedy = f"make it yours alone (chmod go-w), or name another folder by NUMBA_CACHE_DIR: {bad}"
    if open_to_others(root, trusted) or open_to_others(private, trusted):
        raise PermissionError(f"other users can write where compiled code is kept, and {private} as well; {remedy}")
    if bad is not None:
        warnings.warn(
            f"other users can write where compiled code is kept; it is kept in {private} instead; {remedy}",
            RuntimeWarning,
            stacklevel=2,
        )
    os.environ["NUMBA_CACHE_DIR"] = str(private)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(private)
