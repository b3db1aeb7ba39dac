"""Opening stored phase maps, and the cache that spares building them again."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

from creeping._errors import CreepingError, StoredMapError
from creeping._typing import Any
from creeping._version import __version__
from creeping.phaseflow.phase_map import Grid, Leap, MapError, PhaseMap
from creeping.phaseflow.storing import SCHEMA, content_digest, fingerprint, open_array, read_manifest
from creeping.surface import Surface


def cache_folder() -> Path:
    """Folder of cached maps: $CREEPING_CACHE, or ``maps`` in the user's cache folder."""
    import platformdirs

    named = os.environ.get("CREEPING_CACHE")
    return Path(named) if named else platformdirs.user_cache_path("creeping") / "maps"


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
            Leap(
                float(time),
                open_array(folder, f"state-{k}.npy", content),
                open_array(folder, f"jacobi-{k}.npy", content),
            )
            for k, time in enumerate(content["times"])
        )
    except (KeyError, TypeError, IndexError, ValueError) as reason:
        if isinstance(reason, CreepingError):
            raise
        raise StoredMapError(f"{folder}: the manifest is incomplete ({reason!r}); rebuild the map") from reason
    _check_shapes(folder, grid, leaps, len(body.atlas.charts))
    return PhaseMap(body, grid, leaps, error, content["parameters"])


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

    root = cache_folder() if folder is True else Path(str(folder))
    digest = content_digest({"schema": SCHEMA, "version": __version__, "body": fingerprint(body), **key})
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
            result.save(place)
        except StoredMapError as error:
            progress(f"not cached: {error}")
        return result
    finally:
        lock.release()
