"""Opening stored phase maps, and the cache that spares building them again."""

import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from creeping._typing import Any
from creeping._version import __version__
from creeping.errors import CreepingError, StoredMapError
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geometry.arguments import checked_body, folder_path
from creeping.geometry.surface import Surface, fingerprint
from creeping.kernels.cache import private_folder, require_private
from creeping.phaseflow.coordinates import Model, model_of
from creeping.phaseflow.phase_map import TABLES, ErrorGrowth, PhaseMap
from creeping.phaseflow.rotation import CompiledModel
from creeping.phaseflow.splines import Grid, Leap
from creeping.storage.folder import SCHEMA, content_digest, open_array, read_manifest


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

    Examples
    --------
    >>> import tempfile
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> pm = cr.build_phase_map(ball, horizon=0.5, grid=(16, 16), degree=3, cache=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     stored = pm.save(f"{folder}/map")
    ...     cr.load_phase_map(stored, ball).horizon
    0.5
    """
    folder = folder_path(folder, "folder")
    checked_body(body)
    content = read_manifest(folder)
    if content.get("body") != fingerprint(body):
        raise StoredMapError(f"{folder} is a map of {content.get('body')}, not of {fingerprint(body)}; rebuild it")
    try:
        grid = _grid_of(content)
        error = ErrorEstimate(float(content["error"][0]), float(content["error"][1]), int(content["error"][2]))
        rows = content["growth"] and [tuple(map(float, row)) for row in content["growth"]]
        growth = ErrorGrowth(rows[0], rows[1], rows[2], rows[3][0]) if rows else None
        leaps = tuple(
            Leap(
                float(time),
                centre=np.array([float(value) for value in content["centres"][k]]),
                matrix=np.array([float(value) for value in content["matrices"][k]]),
                **{name: open_array(folder, f"{name}-{k}.npy", content) for name in TABLES},
            )
            for k, time in enumerate(content["times"])
        )
        model, parameters = model_of(body, str(content["model"])), dict(content["parameters"])
    except (KeyError, TypeError, IndexError, ValueError) as reason:
        if isinstance(reason, CreepingError):
            raise
        raise StoredMapError(f"{folder}: the manifest is incomplete ({reason!r}); rebuild the map") from reason
    if model.name != content["model"]:
        raise StoredMapError(f"{folder} is stored as {content['model']!r}, which {body!r} does not offer; rebuild it")
    _check_shapes(folder, grid, leaps, model)
    return PhaseMap(body, model, grid, leaps, error, growth, parameters)


def _grid_of(content: dict[str, Any]) -> Grid:
    nodes, degree, periodic = tuple(content["nodes"]), content["degree"], tuple(content["periodic"])
    if (
        len(nodes) != 3
        or any(type(n) is not int or n < least for n, least in zip(nodes, (1, 2, 2), strict=True))
        or degree not in (3, 5)
    ):
        raise ValueError(f"a grid of {nodes} with degree {degree}")
    if len(periodic) != 2 or any(type(wraps) is not bool for wraps in periodic):
        raise ValueError(f"a grid whose periods are {periodic}")
    times = [float(time) for time in content["times"]]
    if not times or not all(0 < time < np.inf for time in times):
        raise ValueError(f"leaps of {times}")
    return Grid(nodes, int(degree), periodic)


def _check_shapes(folder: Path, grid: Grid, leaps: tuple[Leap, ...], model: Model) -> None:
    """Kernels trust shapes and types, so they must follow from the grid."""
    whole = (model.charts, *grid.sides)
    for leap in leaps:
        fits = grid.is_flat == model.is_flat and grid.periodic == model.periodic
        fits &= leap.state.shape == (*whole, model.lanes) and grid.degree in (3, 5)
        fits &= leap.centre.shape == (model.lanes,)
        fits &= leap.curvature.shape in ((*whole, 8), (0, *grid.sides, 8)) and leap.curvature.dtype == leap.state.dtype
        packed = leap.is_packed and leap.has_curvature and isinstance(model, CompiledModel)
        shapes = ((*whole, 8),) if packed else ((*whole, 4), (0, *grid.sides, 4))
        fits &= leap.jacobi.shape in shapes and leap.jacobi.dtype == leap.state.dtype
        fits &= leap.matrix.shape == leap.jacobi.shape[4:]
        fits &= leap.flagged.shape == (whole if packed else (0, *grid.sides)) and leap.flagged.dtype == np.uint8
        if not fits:
            raise StoredMapError(f"{folder}: tables {leap.state.shape} do not fit grid {grid.nodes}; rebuild the map")


def cached_place(body: Surface, key: dict[str, Any], folder: bool | str | Path) -> Path:
    """Where the cache has, or would have, what a body and these parameters decide."""
    root = cache_folder() if folder is True else Path(str(folder))
    digest = content_digest({"schema": SCHEMA, "version": __version__, "body": fingerprint(body), **key})
    return root / f"{type(body).__name__.lower()}-{digest[:24]}"


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

    place = cached_place(body, key, folder)
    root = place.parent
    try:
        private_folder(root)
        # a lock waits for a folder that cannot be written as for one that is in use
        with tempfile.TemporaryFile(dir=root):
            pass
        lock = FileLock(root / f".{place.name}.lock")
        lock.acquire()
    except OSError as error:
        progress(f"no cache in {root} ({error}); building without it")
        return build()
    try:
        if place.exists():
            try:
                # it may be from when others could write the cache
                require_private(place)
                return load_phase_map(place, body)
            except (OSError, StoredMapError) as error:
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
