"""Arrays on disk: a folder of .npy files with manifest.json, for phase maps and parts of results.

What is stored is data only: arrays are opened without pickle, after their size, shape and blake2b digest agree with the
manifest, whose own digest is checked first. Folders are written aside and renamed under a lock.
"""

import hashlib
import json
import shutil
import tempfile
from pathlib import Path

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import CreepingError, StoredMapError
from creeping.storage.atomic import bytes_of

SCHEMA = 4
MANIFEST = "manifest.json"
TYPES = {
    name: getattr(np, name) for name in ("float32", "float64", "complex64", "complex128", "uint8", "int64", "bool")
}


def write_folder(folder: str | Path, content: dict[str, Any], arrays: dict[str, FloatArray]) -> Path:
    """Write arrays and the content of their manifest to a new folder.

    Raises
    ------
    StoredMapError
        If the folder exists or cannot be written; nothing half-written is left.
    """
    from filelock import FileLock

    folder = Path(folder)
    aside = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(f"{folder}.lock"):
            if folder.exists():
                raise StoredMapError(f"{folder} exists; choose another folder or remove it")
            aside = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
            files = {}
            for name, array in arrays.items():
                np.save(aside / name, array, allow_pickle=False)
                files[name] = {"shape": list(array.shape), "type": str(array.dtype), "blake2b": _digest(aside / name)}
            signed = {"schema": SCHEMA, **content, "files": files}
            text = json.dumps({"content": signed, "blake2b": content_digest(signed)}, indent=1)
            (aside / MANIFEST).write_text(text)
            aside.rename(folder)
        Path(f"{folder}.lock").unlink(missing_ok=True)
    except OSError as error:
        if aside is not None:
            shutil.rmtree(aside, ignore_errors=True)
        need = f"{sum(a.nbytes for a in arrays.values()) / 1e6:.0f} MB"
        raise StoredMapError(
            f"cannot write {folder}: {error}; it needs {need} of space and write permission"
        ) from error
    return folder


def read_manifest(folder: Path, *, any_schema: bool = False) -> dict[str, Any]:
    """Content of a folder's manifest, its own digest checked; ``any_schema`` takes those of other versions too.

    Raises
    ------
    StoredMapError
        If there is none, it is damaged, or of another version.
    """
    path = folder / MANIFEST
    try:
        document = json.loads(bytes_of(path, 1_000_000))
        content = document["content"]
        intact = document["blake2b"] == content_digest(content)
        if not isinstance(content, dict):
            raise TypeError(f"its content is a {type(content).__name__}")
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        if isinstance(error, CreepingError):
            raise
        raise StoredMapError(f"{folder} holds no readable phase map ({error!r}); rebuild it") from error
    if not intact:
        raise StoredMapError(f"{path} is damaged: its digest differs; rebuild the map")
    if content.get("schema") != SCHEMA and not any_schema:
        raise StoredMapError(f"{folder} has schema {content.get('schema')!r}, this version reads {SCHEMA}; rebuild it")
    return dict(content)


def remove_folder(folder: Path) -> str:
    """Remove a stored map: the files that its manifest names, and the folder if nothing else is in it.

    Returns
    -------
    str
        What was left and why; nothing if all is gone. A folder without an intact manifest of ours is left alone.
    """
    if folder.is_symlink():
        return f"{folder} is a link"
    try:
        content = read_manifest(folder, any_schema=True)
    except StoredMapError as error:
        return str(error)
    try:
        for name in (*content.get("files", {}), MANIFEST):
            if Path(name).name == name:
                (folder / name).unlink(missing_ok=True)
        left = sorted(path.name for path in folder.iterdir())
        if left:
            return f"{folder} has files of others: {', '.join(left[:5])}"
        folder.rmdir()
    except OSError as error:
        return f"{folder} cannot be removed: {error}"
    return ""


def verify_files(folder: Path) -> dict[str, Any]:
    """Check every file of a stored map against the manifest, and return the manifest's content."""
    content = read_manifest(folder)
    for name in content["files"]:
        open_array(folder, name, content)
    return content


def open_array(folder: Path, name: str, content: dict[str, Any]) -> FloatArray:
    """Map one array after checking size, digest, header and shape.

    Raises
    ------
    StoredMapError
        If the file is missing, damaged, or holds another array than the manifest says.
    """
    path, entry = folder / name, content["files"][name]
    shape = tuple(int(n) for n in entry["shape"])
    kind = TYPES[entry["type"]]
    try:
        # the header of a .npy file takes one or two blocks of 64 bytes; a longer file is not what was written
        extra = path.stat().st_size - np.dtype(kind).itemsize * int(np.prod(shape, dtype=object))
        if not 0 < extra <= 256:
            raise StoredMapError(f"{path} is truncated or too long; rebuild the map")
        if _digest(path) != entry["blake2b"]:
            raise StoredMapError(f"{path} is damaged: its digest differs; rebuild the map")
        array = np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
    except (OSError, ValueError) as error:
        if isinstance(error, CreepingError):
            raise
        raise StoredMapError(f"{path} cannot be read ({error}); rebuild the map") from error
    if array.shape != shape or array.dtype != kind or not array.flags.c_contiguous:
        raise StoredMapError(f"{path} holds {array.dtype} {array.shape}, not {entry['type']} {shape}; rebuild the map")
    return array


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=32)).hexdigest()


def content_digest(content: Any) -> str:
    """Digest of what json makes of the content."""
    return hashlib.blake2b(json.dumps(content, sort_keys=True).encode(), digest_size=32).hexdigest()
