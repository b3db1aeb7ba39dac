"""Curves in the plane of two angles, cut where an angle jumps.

An angle jumps by 2 pi across its seam at +-pi: both ends are carried on to the seam. An azimuth jumps by about pi where
a curve passes a pole: no line in the plane belongs there, and the ends stay as they are.
"""

import numpy as np

from creeping._typing import FloatArray

POLE_JUMP = np.pi / 2
"""Step of an angle, seams apart, that only the passage of a pole makes on a well sampled curve."""


def split_at_seam(parameters: FloatArray, *, closed: bool) -> list[FloatArray]:
    """Cut a curve of angles at seams and poles.

    Parameters
    ----------
    parameters : (m, 2)
        Angles in [-pi, pi].
    closed : bool
        Whether the last point is joined to the first.

    Returns
    -------
    list of (k, 2)
        Pieces in order; no step of a piece exceeds pi/2.
    """
    path = np.concatenate([parameters, parameters[:1]]) if closed else parameters
    if np.all(np.abs(np.diff(path, axis=0)) <= POLE_JUMP):
        return [np.array(path)] if len(path) > 1 else []
    pieces: list[FloatArray] = []
    current = [path[0]]
    for after in path[1:]:
        jump = after - current[-1]
        short = jump - 2 * np.pi * np.round(jump / (2 * np.pi))
        if np.any(np.abs(short) > POLE_JUMP):
            pieces.append(np.array(current))
            current = [after]
            continue
        # a step may cross the seams of both angles
        for axis in (0, 1):
            jump = after - current[-1]
            if abs(jump[axis]) <= np.pi:
                continue
            side = np.sign(current[-1][axis]) or 1.0
            short = jump - 2 * np.pi * np.round(jump / (2 * np.pi))
            share = (side * np.pi - current[-1][axis]) / short[axis] if short[axis] != 0 else 0.0
            crossing = current[-1] + np.clip(share, 0.0, 1.0) * short
            entry = crossing.copy()
            crossing[axis], entry[axis] = side * np.pi, -side * np.pi
            pieces.append(np.array([*current, crossing]))
            current = [entry]
        current.append(after)
    pieces.append(np.array(current))
    return [piece for piece in pieces if len(piece) > 1]
