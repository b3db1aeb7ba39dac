"""Shadow lines, fans and iso-phase curves as polylines with named arrays, for files and for pyvista alike."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from creeping._typing import Any, FloatArray, IntArray
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.rays.status import ENDED, RayStatus
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import STATUSES

KINDS = ("shadow line", "ray", "iso-phase curve")
RAY_ARRAYS = ("eikonal", "spreading", "spreading_rate", "curvature", "attenuation")
POINT_ARRAYS: dict[str, type] = dict.fromkeys(("travel_time", *RAY_ARRAYS), np.float64)
POINT_ARRAYS |= dict.fromkeys(("caustic_index", "line_status", "ray_status"), np.int64)
"""Arrays with a value per point, and their types,"""
CELL_ARRAYS: dict[str, type] = dict.fromkeys(("kind", "ray", "status", "curve_index"), np.int64) | {"level": np.float64}
"""and per polyline. Where one does not apply it is NaN, or -1 if of integers."""


class Polylines:
    """Polylines of any number of results, with their arrays.

    Parameters
    ----------
    line, fan, curves
        What to collect.

    Attributes
    ----------
    lines : list of (k,)
        Point numbers of each line; those of a closed one end with its first.
    """

    def __init__(
        self,
        line: ShadowLine | None = None,
        fan: RayFan | None = None,
        curves: Sequence[IsoPhaseCurve] = (),
    ) -> None:
        self._count = 0
        self._points: list[FloatArray] = []
        self.lines: list[IntArray] = []
        self._at_points: dict[str, list[Any]] = {name: [] for name in POINT_ARRAYS}
        self._of_lines: dict[str, list[Any]] = {name: [] for name in CELL_ARRAYS}
        if line is not None:
            self._add_line(line)
        if fan is not None:
            self._add_fan(fan)
        for curve in curves:
            values = {curve.of: np.full(len(curve.points), float(curve.level))}
            self._add("iso-phase curve", curve.points[None], bool(curve.closed), values, level=[curve.level])

    @property
    def points(self) -> FloatArray:
        """Points (n, 3), L: a copy."""
        return np.concatenate([np.zeros((0, 3)), *self._points])

    @property
    def point_data(self) -> dict[str, Any]:
        """Arrays (n,) by name."""
        return _joined(self._at_points, POINT_ARRAYS)

    @property
    def cell_data(self) -> dict[str, Any]:
        """Arrays (lines,) by name."""
        return _joined(self._of_lines, CELL_ARRAYS)

    def _add_line(self, line: ShadowLine) -> None:
        for number, curve in enumerate(line.curves):
            status = np.array([STATUSES.index(str(name)) for name in curve.status], dtype=np.int64)
            self._add("shadow line", curve.points[None], True, {"line_status": status}, curve_index=[number])

    def _add_fan(self, fan: RayFan) -> None:
        times = np.broadcast_to(fan.travel_time, np.shape(fan.eikonal))
        arrays = {name: getattr(fan, name) for name in (*RAY_ARRAYS, "caustic_index")} | {"travel_time": times}
        status, detachment = np.asarray(fan.status)[:, None], np.asarray(fan.detachment)[:, None]
        # these come on the way, other trouble is there from the start
        met = np.isin(status, ENDED)
        arrays["ray_status"] = np.where(met & (times <= detachment), RayStatus.OK, status)
        numbers = {"ray": range(len(status)), "status": fan.status, "curve_index": fan.curve_index}
        self._add("ray", fan.points, False, arrays, **numbers)

    def _add(self, kind: str, points: FloatArray, closed: bool, arrays: dict[str, Any], **of_lines: Any) -> None:
        """Add lines (lines, k, 3) with arrays (lines, k) or (k,)."""
        lines, length = np.shape(points)[:2]
        numbers = self._count + np.arange(lines * length, dtype=np.int64).reshape(lines, length)
        self._count += lines * length
        self._points.append(np.asarray(points, dtype=float).reshape(-1, 3))
        self.lines += list(np.concatenate([numbers, numbers[:, :1]], axis=1) if closed else numbers)
        of_lines["kind"] = np.full(lines, KINDS.index(kind))
        for name, dtype in POINT_ARRAYS.items():
            self._at_points[name].append(_column(arrays.get(name), dtype, lines * length))
        for name, dtype in CELL_ARRAYS.items():
            self._of_lines[name].append(_column(of_lines.get(name), dtype, lines))


def _column(values: Any, dtype: type, count: int) -> NDArray[Any]:
    """Values as one column, or what stands for none."""
    if values is None:
        return np.full(count, np.nan if dtype is np.float64 else -1, dtype=dtype)
    return np.asarray(values, dtype=dtype).reshape(-1)


def _joined(parts: dict[str, list[Any]], types: dict[str, type]) -> dict[str, Any]:
    return {name: np.concatenate([np.zeros(0, dtype=types[name]), *columns]) for name, columns in parts.items()}


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

    collected = Polylines(line, fan, curves)
    cells = np.concatenate([np.zeros(0, dtype=np.int64), *(np.append(len(one), one) for one in collected.lines)])
    mesh = pyvista.PolyData(collected.points, lines=cells)
    for name, values in collected.point_data.items():
        mesh.point_data[name] = values
    for name, values in collected.cell_data.items():
        mesh.cell_data[name] = values
    return mesh
