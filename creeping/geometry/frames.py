"""Orthonormal frames of tangent planes.

The polar frame of a chart with tangents T = [x_u, x_v] (3 x 2) is the orthogonal polar factor
E = T (T^T T)^(-1/2): orthonormal, tangent, and nearest to T.

Sources: [H86]; Derivations, B2.
"""

import numpy as np

from creeping._typing import FloatArray


def polar_frame(tangents: FloatArray) -> FloatArray:
    """Polar frame E = T (T^T T)^(-1/2) of chart tangents, of any unit: (..., 3, 2) -> (..., 3, 2).

    The 2 x 2 root is closed: G^(1/2) = (G + s)/t with s = sqrt(det G), t = sqrt(tr G + 2 s).

    Examples
    --------
    >>> polar_frame(np.array([[2.0, 1.0], [0.0, 1.0], [0.0, 0.0]])).round(4)
    array([[ 0.9487,  0.3162],
           [-0.3162,  0.9487],
           [ 0.    ,  0.    ]])
    """
    gram = np.swapaxes(tangents, -1, -2) @ tangents
    p, q, r = gram[..., 0, 0], gram[..., 0, 1], gram[..., 1, 1]
    s = np.sqrt(p * r - q * q)
    t = np.sqrt(p + r + 2 * s)
    # inverse of (G + s)/t; its determinant is s t^2
    scale = 1.0 / (s * t)
    root = np.empty_like(gram)
    root[..., 0, 0] = (r + s) * scale
    root[..., 1, 1] = (p + s) * scale
    root[..., 0, 1] = root[..., 1, 0] = -q * scale
    return np.asarray(tangents @ root)
