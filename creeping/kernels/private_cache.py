"""What is kept in caches is loaded from folders of this user alone.

numba unpickles and runs what it finds in its cache, and a fit or a map that somebody else has put there is another
body.

A folder is trusted if nobody but the user, root and the owner of the package can put files into it or replace it.
Both packages keep theirs by it.
"""

import os
import sys
import warnings
from pathlib import Path

ANYONE, GROUP, STICKY = 0o002, 0o020, 0o1000


def open_to_others(folder: Path, trusted: frozenset[int]) -> bool:
    """Whether users other than the ``trusted`` can put files into a folder, or another folder in its place."""
    try:
        own, above = folder.stat(), folder.resolve().parent.stat()
    except OSError:
        return False
    replaceable = bool(above.st_mode & ANYONE) and not above.st_mode & STICKY
    shared = bool(own.st_mode & GROUP) and _has_others(own.st_gid)
    return own.st_uid not in trusted or bool(own.st_mode & ANYONE) or shared or replaceable


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
    named = os.environ.get("NUMBA_CACHE_DIR")
    trusted = frozenset((0, os.getuid(), package.stat().st_uid))
    sources = {path.parent for path in package.rglob("*.py")}
    usual = [Path(named)] if named else sorted(folder / "__pycache__" for folder in sources)
    bad = next((folder for folder in usual if open_to_others(folder, trusted)), None)
    root = _user_cache() if bad or (named and "creeping-kernels" in named) else None
    if root is None:
        return
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


def _user_cache() -> Path:
    import platformdirs

    return platformdirs.user_cache_path("creeping-kernels")
