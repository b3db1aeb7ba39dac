"""The angle along a cut of the far field, found from its directions.

Every cut lies in a plane through the origin or on a cone about z. In order of preference the angle is θ (the plane
contains z), φ (one θ), or the angle from the first direction.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.files.tables import angles_of

TOLERANCE = 1e-6
"""Distance of unit directions from the plane or the cone."""


@dataclass(frozen=True)
class CutAngles:
    """Angles (m,), radians; what they are; and the order (m,) of the directions in which to join them."""

    values: FloatArray
    name: str
    order: IntArray


def cut_angles(directions: FloatArray) -> CutAngles:
    """Angle along a cut (m, 3).

    Raises
    ------
    InvalidInputError
        If the directions are fewer than two, or on no cut.
    """
    r = np.asarray(directions, dtype=float)
    if len(r) < 2:
        raise InvalidInputError(f"{len(r)} directions make no cut; give two at least")
    for find in (_through_z, _about_z, _great_circle):
        found = find(r)
        if found is not None:
            return found
    raise InvalidInputError(
        f"the {len(r)} directions are on no cut (a plane through the origin, or one theta); "
        "give angles= in radians, one a direction, or write_csv or write_ffe them"
    )


def _through_z(r: FloatArray) -> CutAngles | None:
    widest = r[np.argmax(np.hypot(r[:, 0], r[:, 1]))]
    azimuth = float(np.arctan2(widest[1], widest[0]))
    along, across = _turned(r, azimuth)
    if np.any(np.abs(across) > TOLERANCE):
        return None
    if np.all(along > -TOLERANCE):
        return _named(np.arctan2(np.maximum(along, 0.0), r[:, 2]), "θ", "φ", azimuth)
    found = _unrolled(np.arctan2(along, r[:, 2]))
    # the side that makes the angle grow; if neither does, the one in front
    turn = found[0][-1] < found[0][0] if found[2] else not -np.pi / 2 < azimuth <= np.pi / 2
    if turn:
        azimuth += np.pi if azimuth <= 0 else -np.pi
        found = _unrolled(np.arctan2(_turned(r, azimuth)[0], r[:, 2]))
    return _named(*found[:1], "θ", "φ", azimuth, order=found[1])


def _about_z(r: FloatArray) -> CutAngles | None:
    if np.ptp(r[:, 2]) > TOLERANCE:
        return None
    theta, phi = np.moveaxis(angles_of(r), -1, 0)
    values, order, _ = _unrolled(phi)
    return _named(values, "φ", "θ", float(theta[0]), order=order)


def _great_circle(r: FloatArray) -> CutAngles | None:
    normal = np.linalg.svd(r)[2][-1]
    if np.any(np.abs(r @ normal) > TOLERANCE):
        return None
    first = r[0] / np.linalg.norm(r[0])
    values, order, _ = _unrolled(np.arctan2(r @ np.cross(normal, first), r @ first))
    if values[-1] < values[0]:
        values = -values
    return CutAngles(values, "angle from the first direction", order)


def _turned(r: FloatArray, azimuth: float) -> tuple[FloatArray, FloatArray]:
    """Components along an azimuth and across it."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    return r[:, 0] * c + r[:, 1] * s, r[:, 1] * c - r[:, 0] * s


def _unrolled(angles: FloatArray) -> tuple[FloatArray, IntArray, bool]:
    """Angles in [-π, π] without their jumps and the order to join them, theirs if they run one way."""
    smooth = np.unwrap(angles)
    steps = np.diff(smooth)
    if not (np.all(steps > -TOLERANCE) or np.all(steps < TOLERANCE)):
        return angles, np.argsort(angles, kind="stable"), False
    middle = 0.5 * (smooth.min() + smooth.max())
    # a whole turn from 0 stays from 0: its middle may be π
    turns = np.ceil((middle - np.pi) / (2 * np.pi) - TOLERANCE)
    return smooth - 2 * np.pi * turns, np.arange(len(smooth)), True


def _named(values: FloatArray, name: str, other: str, at: float, order: IntArray | None = None) -> CutAngles:
    degrees = round(np.degrees(at), 6) + 0.0
    order = np.argsort(values, kind="stable") if order is None else order
    return CutAngles(values, f"{name} at {other} = {degrees:g}°", order)
