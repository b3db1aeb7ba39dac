"""Shadow lines, fans and iso-phase curves as polylines with named arrays, for files and for pyvista alike."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from creeping._typing import Any, FloatArray
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.rays.status import ENDED, RayStatus
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import STATUSES

RAY_ARRAYS = ("eikonal", "spreading", "spreading_rate", "curvature", "attenuation")
POINT_ARRAYS: dict[str, type] = dict.fromkeys(("travel_time", *RAY_ARRAYS), np.float64)
POINT_ARRAYS |= dict.fromkeys(("caustic_index", "line_status", "ray_status"), np.int64)
"""Arrays with a value per point, and their types,"""
CELL_ARRAYS: dict[str, type] = dict.fromkeys(("kind", "ray", "status", "curve_index"), np.int64) | {"level": np.float64}
"""and per polyline. Where one does not apply it is NaN, or -1 if of integers."""

Lines = tuple[FloatArray, bool, dict[str, Any]]
"""Points (lines, k, 3), whether they are closed, and arrays (lines, k), (k,) and (lines,) by name."""


def polydata(line: ShadowLine | None = None, fan: RayFan | None = None, curves: Sequence[IsoPhaseCurve] = ()) -> Any:
    """Polylines as a ``pyvista.PolyData``, with the points and arrays that `write_vtp` writes.

    Building one loads no part of VTK that draws, so it needs neither a display nor OpenGL.

    Parameters
    ----------
    line, fan, curves
        What to collect; leave out what is not wanted.

    Returns
    -------
    pyvista.PolyData
        Copies: what is done to it leaves the results alone.
    """
    import pyvista

    found: list[Lines] = []
    for number, one in enumerate(line.curves if line is not None else ()):
        status = np.array([STATUSES.index(str(name)) for name in one.status], dtype=np.int64)
        found.append((one.points[None], True, {"kind": [0], "line_status": status, "curve_index": [number]}))
    if fan is not None:
        found.append((fan.points, False, _ray_arrays(fan)))
    for curve in curves:
        values = {"kind": [2], curve.of: np.full(len(curve.points), float(curve.level)), "level": [curve.level]}
        found.append((curve.points[None], bool(curve.closed), values))
    points, cells, first = [np.zeros((0, 3))], [np.zeros(0, dtype=np.int64)], 0
    for where, closed, _ in found:
        lines, length = np.shape(where)[:2]
        points.append(np.asarray(where, dtype=float).reshape(-1, 3))
        numbers = first + np.arange(lines * length, dtype=np.int64).reshape(lines, length)
        first += lines * length
        # the number of its points, then these; one that is closed ends with its first
        ends = np.concatenate([numbers, numbers[:, :1]], axis=1) if closed else numbers
        cells.append(np.insert(ends, 0, ends.shape[1], axis=1).ravel())
    mesh = pyvista.PolyData(np.concatenate(points), lines=np.concatenate(cells))
    for name, dtype in POINT_ARRAYS.items():
        columns = [_column(arrays.get(name), dtype, np.size(where) // 3) for where, _, arrays in found]
        mesh.point_data[name] = np.concatenate([np.zeros(0, dtype=dtype), *columns])
    for name, dtype in CELL_ARRAYS.items():
        columns = [_column(arrays.get(name), dtype, len(where)) for where, _, arrays in found]
        mesh.cell_data[name] = np.concatenate([np.zeros(0, dtype=dtype), *columns])
    return mesh


def _ray_arrays(fan: RayFan) -> dict[str, Any]:
    """Arrays of a fan at its points (rays, steps) and by ray (rays,)."""
    times = np.broadcast_to(fan.travel_time, np.shape(fan.eikonal))
    arrays = {name: getattr(fan, name) for name in (*RAY_ARRAYS, "caustic_index")} | {"travel_time": times}
    status, detachment = np.asarray(fan.status)[:, None], np.asarray(fan.detachment)[:, None]
    # these come on the way, other trouble is there from the start
    met = np.isin(status, ENDED)
    arrays["ray_status"] = np.where(met & (times <= detachment), RayStatus.OK, status)
    rays = len(status)
    return arrays | {"kind": [1] * rays, "ray": range(rays), "status": fan.status, "curve_index": fan.curve_index}


def _column(values: Any, dtype: type, count: int) -> NDArray[Any]:
    """Values as one column, or what stands for none."""
    if values is None:
        return np.full(count, np.nan if dtype is np.float64 else -1, dtype=dtype)
    return np.asarray(values, dtype=dtype).reshape(-1)
