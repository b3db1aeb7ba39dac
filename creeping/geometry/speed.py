"""Speed c of a body's weighted flow."""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geometry.surface import Surface, size


def speed_of(body: Surface) -> Any:
    """Speed c of the body's weighted flow, or None."""
    return getattr(body, "speed", None)


def speed_values(body: Surface, points: FloatArray) -> FloatArray:
    """Speed c, 1 without a weight: (..., 3) -> (...)."""
    speed = speed_of(body)
    return np.ones(np.shape(points)[:-1]) if speed is None else np.asarray(speed.value(points), dtype=float)


def speed_hessian(body: Surface, points: FloatArray) -> FloatArray:
    """Hessian of c: (..., 3) -> (..., 3, 3), by central differences where the speed offers none."""
    speed = speed_of(body)
    if hasattr(speed, "hessian"):
        return np.asarray(speed.hessian(points), dtype=float)
    # rounding and truncation balance near eps^(1/3): relative error about 1e-10
    step = 6e-6 * size(body)
    columns = [(speed.gradient(points + step * e) - speed.gradient(points - step * e)) / (2 * step) for e in np.eye(3)]
    hessian = np.stack(columns, axis=-1)
    return np.asarray(0.5 * (hessian + np.swapaxes(hessian, -1, -2)))
