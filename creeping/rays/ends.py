"""Where rays end before the fan does: detached, at what a body calls not smooth, at its edges and tips."""

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geodesics.states import CREASE, DETACHMENT, END, WHOLE, X
from creeping.geometry.creased import is_creased, nearest_crease
from creeping.rays.nonsmooth import non_smooth_from
from creeping.rays.status import RayStatus

OF_CREASE = {"edge": RayStatus.EDGE, "tip": RayStatus.TIP}


def ends_of(
    body: Any, points: FloatArray, path: FloatArray, times: FloatArray, status: IntArray
) -> tuple[IntArray, FloatArray]:
    """Status of rays, and the travel time at which the field of each ends, inf where it does not.

    Parameters
    ----------
    body : Surface
    points : (rays, 3), L
        Where they start.
    path : (rays, steps, lanes)
        Their states at the times.
    times : (steps,), L
    status : (rays,)
        That of the line where they start: a ray that never was a creeping ray keeps it.
    """
    # a flow writes where a ray detaches beside every state
    detachment, creeping = path[:, -1, DETACHMENT], status == RayStatus.OK
    status = np.where(creeping & np.isfinite(detachment), RayStatus.DETACHED, status)
    first = detachment
    if path.shape[-1] > WHOLE:
        end = path[:, -1, END]
        # the last is of number -1: a ray that could not go on, far from any crease
        kinds = np.array(
            [*(OF_CREASE.get(crease.kind, RayStatus.EDGE) for crease in body.creases), RayStatus.NON_SMOOTH]
        )
        status = np.where(creeping & (end < first), kinds[path[:, -1, CREASE].astype(np.int64)], status)
        first = np.minimum(first, end)
    if hasattr(body, "non_smooth"):
        begun = np.concatenate([points[:, None], path[..., X]], axis=1) if times[0] > 0 else path[..., X]
        since = np.concatenate([[0.0], times]) if times[0] > 0 else times
        met = non_smooth_from(body, begun, since)
        # a ray that begins there has ended at the same time, without a crease
        sooner = np.isfinite(met) & (met <= first)
        status = np.where(creeping & sooner, _refused(body, begun, since, met), status)
        first = np.minimum(first, met)
    return status, first


def _refused(body: Any, path: FloatArray, times: FloatArray, met: FloatArray) -> IntArray:
    """Status (rays,) of rays that come at times ``met`` to what is not smooth enough: a body with creases says why."""
    out = np.full(len(met), int(RayStatus.NON_SMOOTH))
    if not is_creased(body):
        return out
    rows = np.flatnonzero(np.isfinite(met))
    places = np.array([[np.interp(met[row], times, path[row, :, axis]) for axis in range(3)] for row in rows])
    crease, _ = nearest_crease(body, places.reshape(-1, 3))
    for row, number in zip(rows, crease, strict=True):
        out[row] = OF_CREASE.get(body.creases[number].kind, RayStatus.NON_SMOOTH)
    return out
