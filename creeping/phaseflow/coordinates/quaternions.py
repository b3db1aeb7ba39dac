"""Unit quaternions (w, x, y, z) of rotations, arrays (n, 4)."""

import numpy as np

from creeping._typing import FloatArray


def quaternions(s: FloatArray, q: FloatArray) -> FloatArray:
    """Unit quaternions (n, 4) of the rotations with columns s, q, s x q, from the largest of their components."""
    b = np.cross(s, q)
    (sx, sy, sz), (qx, qy, qz), (bx, by, bz) = s.T, q.T, b.T
    w, x, y, z = 1 + sx + qy + bz, 1 + sx - qy - bz, 1 - sx + qy - bz, 1 - sx - qy + bz
    rows = np.array(
        [
            [w, qz - by, bx - sz, sy - qx],
            [qz - by, x, qx + sy, bx + sz],
            [bx - sz, qx + sy, y, by + qz],
            [sy - qx, bx + sz, by + qz, z],
        ]
    )
    best = np.argmax([w, x, y, z], axis=0)
    found = rows[best, :, np.arange(len(s))]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def quaternion_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Product a b of quaternions (n or 1, 4)."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a.T, b.T
    rows = (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
    return np.stack(rows, axis=1)
