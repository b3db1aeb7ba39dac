"""Phase maps on disk: a folder of .npy files with manifest.json, and the cache of such folders.

A stored map is data only: arrays are opened without pickle, after their size, shape and blake2b digest agree with the
manifest, and the manifest names the body it belongs to. Folders are written aside and renamed under a lock.
"""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from creeping._errors import CreepingError, StoredMapError
from creeping._typing import Any, FloatArray
from creeping.phaseflow.phase_map import Grid, Leap, MapError, PhaseMap
from creeping.surface import Surface

SCHEMA = 1
MANIFEST = "manifest.json"
_MAX_MANIFEST = 1_000_000


def cache_folder() -> Path:
    """Folder of cached maps: $CREEPING_CACHE, or ``maps`` in the user's cache folder."""
    import platformdirs

    named = os.environ.get("CREEPING_CACHE")
    return Path(named) if named else platformdirs.user_cache_path("creeping") / "maps"


def fingerprint(body: Surface) -> str:
    """Text that tells bodies apart: their own, or a digest of F and the speed at points of the charts."""
    own = getattr(body, "fingerprint", None)
    if isinstance(own, str):
        return own
    uv = np.stack(np.meshgrid(*[np.linspace(0.03, 0.97, 9)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.concatenate([chart.point(uv) for chart in body.atlas.charts])
    parts: list[FloatArray] = [points, body.level(1.1 * points), body.gradient(points)]
    speed = getattr(body, "speed", None)
    if speed is not None:
        parts += [speed.value(points), speed.gradient(points)]
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        # ten digits: the same on every machine, however its libraries round
        digest.update(" ".join(f"{value:.9e}" for value in np.ravel(part)).encode())
    return f"{type(body).__name__}:{digest.hexdigest()}"


def save_phase_map(phase_map: PhaseMap, folder: str | Path) -> Path:
    """Write a map to a new folder.

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
            _write(phase_map, aside)
            aside.rename(folder)
        Path(f"{folder}.lock").unlink(missing_ok=True)
    except OSError as error:
        if aside is not None:
            shutil.rmtree(aside, ignore_errors=True)
        need = f"{phase_map.nbytes / 1e6:.0f} MB"
        raise StoredMapError(f"cannot write {folder}: {error}; it needs {need} of space and write permission") from error
    return folder


def _write(phase_map: PhaseMap, folder: Path) -> None:
    from creeping import __version__

    files = {}
    for k, leap in enumerate(phase_map.leaps):
        for name, table in ((f"state-{k}.npy", leap.state), (f"jacobi-{k}.npy", leap.jacobi)):
            np.save(folder / name, table, allow_pickle=False)
            files[name] = {"shape": list(table.shape), "blake2b": _digest(folder / name)}
    content = {
        "schema": SCHEMA,
        "version": __version__,
        "body": fingerprint(phase_map.body),
        "nodes": list(phase_map.grid.nodes),
        "degree": phase_map.grid.degree,
        "periodic": list(phase_map.grid.periodic),
        "times": [leap.time for leap in phase_map.leaps],
        "error": [phase_map.error.rms, phase_map.error.max, phase_map.error.samples],
        "parameters": phase_map.parameters,
        "files": files,
    }
    text = json.dumps({"content": content, "blake2b": _content_digest(content)}, indent=1)
    (folder / MANIFEST).write_text(text)


def load_phase_map(folder: str | Path, body: Surface) -> PhaseMap:
    """Open a stored map of a body.

    Parameters
    ----------
    folder : path
    body : Surface
        The body the map was built for; it is compared with the stored fingerprint.

    Returns
    -------
    PhaseMap
        Its arrays are mapped from the files, read-only.

    Raises
    ------
    StoredMapError
        If the folder is no map, is damaged, of another version or of another body.
    """
    folder = Path(folder)
    content = read_manifest(folder)
    if content["body"] != fingerprint(body):
        raise StoredMapError(f"{folder} is a map of {content['body']}, not of {fingerprint(body)}; rebuild it")
    try:
        grid = Grid(tuple(content["nodes"]), int(content["degree"]), tuple(content["periodic"]))
        error = MapError(float(content["error"][0]), float(content["error"][1]), int(content["error"][2]))
        leaps = tuple(
            Leap(float(time), _open(folder, f"state-{k}.npy", content), _open(folder, f"jacobi-{k}.npy", content))
            for k, time in enumerate(content["times"])
        )
    except (KeyError, TypeError, IndexError, ValueError) as reason:
        if isinstance(reason, CreepingError):
            raise
        raise StoredMapError(f"{folder}: the manifest is incomplete ({reason!r}); rebuild the map") from reason
    _check_shapes(folder, grid, leaps, len(body.atlas.charts))
    return PhaseMap(body, grid, leaps, error, content["parameters"])


def read_manifest(folder: Path) -> dict[str, Any]:
    """Content of a map's manifest, its own digest checked."""
    path = folder / MANIFEST
    try:
        if path.stat().st_size > _MAX_MANIFEST:
            raise StoredMapError(f"{path} is larger than a manifest can be; rebuild the map")
        document = json.loads(path.read_text())
        content = document["content"]
        intact = document["blake2b"] == _content_digest(content)
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        if isinstance(error, CreepingError):
            raise
        raise StoredMapError(f"{folder} holds no readable phase map ({error!r}); rebuild it") from error
    if not intact:
        raise StoredMapError(f"{path} is damaged: its digest differs; rebuild the map")
    if content.get("schema") != SCHEMA:
        raise StoredMapError(f"{folder} has schema {content.get('schema')!r}, this version reads {SCHEMA}; rebuild it")
    return dict(content)


def verify_files(folder: Path) -> dict[str, Any]:
    """Check every file of a stored map against the manifest, and return the manifest's content."""
    content = read_manifest(folder)
    for name in content["files"]:
        _open(folder, name, content)
    return content


def _open(folder: Path, name: str, content: dict[str, Any]) -> FloatArray:
    """Map one array after checking size, digest, header and shape."""
    path, entry = folder / name, content["files"][name]
    shape = tuple(int(n) for n in entry["shape"])
    try:
        # the header of a .npy file takes one or two blocks of 64 bytes; a longer file is not what was written
        extra = path.stat().st_size - 8 * int(np.prod(shape, dtype=object))
        if not 0 < extra <= 256:
            raise StoredMapError(f"{path} is truncated or too long; rebuild the map")
        if _digest(path) != entry["blake2b"]:
            raise StoredMapError(f"{path} is damaged: its digest differs; rebuild the map")
        array = np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
    except (OSError, ValueError) as error:
        if isinstance(error, CreepingError):
            raise
        raise StoredMapError(f"{path} cannot be read ({error}); rebuild the map") from error
    if array.shape != shape or array.dtype != np.float64 or not array.flags.c_contiguous:
        raise StoredMapError(f"{path} holds {array.dtype} {array.shape}, not float64 {shape}; rebuild the map")
    return array


def _check_shapes(folder: Path, grid: Grid, leaps: tuple[Leap, ...], charts: int) -> None:
    """Kernels trust the shapes, so they must follow from the grid."""
    p = grid.degree
    sides = [n + p if wraps else n + p - 1 for n, wraps in zip(grid.nodes, (*grid.periodic, True), strict=True)]
    for leap in leaps:
        for table, lanes in ((leap.state, 8), (leap.jacobi, 4)):
            if table.shape != (charts, *sides, lanes) or p not in (3, 5):
                raise StoredMapError(f"{folder}: table {table.shape} does not fit grid {grid.nodes}; rebuild the map")


def cached_phase_map(
    body: Surface,
    key: dict[str, Any],
    build: Callable[[], PhaseMap],
    *,
    folder: bool | str | Path,
    progress: Callable[[str], None],
) -> PhaseMap:
    """Open the map from the cache, or build it and store it; a second process waits for the first."""
    from filelock import FileLock

    from creeping import __version__

    root = cache_folder() if folder is True else Path(str(folder))
    digest = _content_digest({"schema": SCHEMA, "version": __version__, "body": fingerprint(body), **key})
    place = root / f"{type(body).__name__.lower()}-{digest[:24]}"
    try:
        root.mkdir(parents=True, exist_ok=True)
        lock = FileLock(root / f".{place.name}.lock")
        lock.acquire()
    except OSError as error:
        progress(f"no cache in {root} ({error}); building without it")
        return build()
    try:
        if place.exists():
            try:
                return load_phase_map(place, body)
            except StoredMapError as error:
                progress(f"rebuilding: {error}")
                shutil.rmtree(place, ignore_errors=True)
        result = build()
        try:
            save_phase_map(result, place)
        except StoredMapError as error:
            progress(f"not cached: {error}")
        return result
    finally:
        lock.release()


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=32)).hexdigest()


def _content_digest(content: Any) -> str:
    return hashlib.blake2b(json.dumps(content, sort_keys=True).encode(), digest_size=32).hexdigest()
