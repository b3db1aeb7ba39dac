"""Curved triangles: points between the corners of a mesh that has normals there, and a mesh made of them.

With corners x_i, normals n_i and barycentric coordinates b_i, the cubic triangle of [VPBM01],

    x = sum b_ijk(x, n) 3!/(i! j! k!) b_1^i b_2^j b_3^k,   b_210 = (2 x_1 + x_2 - ((x_2 - x_1).n_1) n_1)/3, ...,

and quadratic normals, which mirror the mean of two normals in the middle of a side. Neighbours with common normals meet
without gaps.

Sources: [VPBM01] Vlachos, Peters, Boyd, Mitchell, Curved PN triangles, I3D 2001, eqs. 1 to 6.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
MOST = 4_000_000
"""Triangles of a mesh that is made."""


def divided(corners: FloatArray, edge: float) -> tuple[IntArray, FloatArray]:
    """Triangles (m, 3, 3) cut into others whose sides are at most ``edge`` long: of which one, and where.

    Returns
    -------
    origin : (k,)
        Number of the triangle that each of the k ones is part of.
    barycentric : (k, 3, 3)
        Of its corners, in that triangle.

    Raises
    ------
    ValueError
        If they are more than `MOST`.

    Examples
    --------
    >>> import numpy as np
    >>> origin, place = divided(np.array([[[0.0, 0, 0], [4, 0, 0], [0, 1, 0]]]), 1.5)
    >>> len(origin), bool(np.allclose(place.sum(axis=-1), 1))
    (9, True)
    """
    origin = np.arange(len(corners))
    place = np.broadcast_to(np.eye(3), (len(corners), 3, 3)).copy()
    done: list[tuple[IntArray, FloatArray]] = []
    while len(origin):
        x = place @ corners[origin]
        side = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
        longest = np.argmax(side, axis=1)
        fine = side[np.arange(len(x)), longest] <= edge
        done.append((origin[fine], place[fine]))
        origin, place, longest = origin[~fine], place[~fine], longest[~fine]
        if sum(len(part) for part, _ in done) + 2 * len(origin) > MOST:
            raise ValueError(f"sides of at most {edge:.3g} L ask for more than {MOST} triangles; take longer ones")
        # halved at the longest side: the same point on both sides of it
        rows = np.arange(len(origin))
        a, b, c = (place[rows, (longest + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        origin = np.concatenate([origin, origin])
        place = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate([part for part, _ in done]), np.concatenate([part for _, part in done])


def curved(corners: FloatArray, normals: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points (..., 3), L, and unit normals of triangles (..., 3, 3) with such at their corners, at places (..., 3)."""
    b = place[..., None]
    x, n = np.moveaxis(corners, -2, 0), np.moveaxis(normals, -2, 0)
    w = np.moveaxis(b, -2, 0)
    points = sum(w[i] ** 3 * x[i] for i in range(3))
    normal = sum(w[i] ** 2 * n[i] for i in range(3))
    sides = np.zeros_like(x[0])
    for i in range(3):
        for j in range(3):
            if i != j:
                toward = (2 * x[i] + x[j] - np.sum((x[j] - x[i]) * n[i], axis=-1, keepdims=True) * n[i]) / 3
                points = points + 3 * w[i] ** 2 * w[j] * toward
                sides = sides + toward / 6
    # the middle of the sides' points, and half as far again from the plane
    points = points + 6 * w[0] * w[1] * w[2] * (1.5 * sides - 0.5 * (x[0] + x[1] + x[2]) / 3)
    for i in range(3):
        j = (i + 1) % 3
        along = x[j] - x[i]
        both = n[i] + n[j]
        length = np.maximum(np.sum(along**2, axis=-1, keepdims=True), 1e-300)
        middle = both - 2 * np.sum(along * both, axis=-1, keepdims=True) / length * along
        middle = middle / np.maximum(np.linalg.norm(middle, axis=-1, keepdims=True), 1e-300)
        normal = normal + 2 * w[i] * w[j] * middle
    return np.asarray(points), np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
