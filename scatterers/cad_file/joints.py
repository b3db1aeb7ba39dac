"""Where faces of a CAD file join smoothly while the curvature jumps, from the normals that the faces have.

Across an edge of the mesh that lies on the joint of two faces, each face bends by

    kappa = (n_far - n_near).t / (x_far - x_near).t,

t across the edge in the face, near the middle of the edge and far the corner opposite to it; each errs by half an edge
times the change of kappa along t. The median of kappa_left - kappa_right over the joint of two faces tells a jump from
that: between a fillet and a plane it is all of the larger.

Sources: Derivations, B13.
"""

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.topology import edges_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
JUMP = 0.3
"""Of the larger curvature: where a resolved mesh's curvature only varies, two sides of an edge differ by less."""
FLAT = 1e-3
"""Curvature times edge below which a face counts as plane."""


def curvature_jumps(
    vertices: FloatArray, triangles: IntArray, faces: IntArray, normals: FloatArray, level: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Edges (e,) of the joints of two faces along which the curvature jumps.

    Parameters
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    faces : (m,)
        Face of each triangle.
    normals : (m, 3, 3)
        Outward at the corners, each of the triangle's own face.
    level : (e,) bool
        Edges, in the order of `scatterers.triangles.topology.edges_of`, at which faces join smoothly.
    """
    jumps = np.zeros(len(level), dtype=bool)
    if not level.any():
        return jumps
    at = np.flatnonzero(level)
    order = np.argsort(edges_of(triangles).number, kind="stable").reshape(-1, 2)[level]
    bends = np.stack([_bend(vertices, triangles, normals, side) for side in order.T], axis=1)
    sides = np.sort(faces[order // 3], axis=1)
    _, joint = np.unique(sides, axis=0, return_inverse=True)
    # always minus the one of the lower face
    bends = np.where((faces[order[:, :1] // 3] == sides[:, :1]), bends, bends[:, ::-1])
    length = np.linalg.norm(vertices[triangles.ravel()[order[:, 0]]] - vertices[_next(triangles, order[:, 0])], axis=1)
    for number in range(int(joint.max()) + 1):
        mine = joint.ravel() == number
        jump = abs(float(np.median(bends[mine, 0] - bends[mine, 1])))
        larger = float(np.median(np.abs(bends[mine]).max(axis=1)))
        if larger * float(np.median(length[mine])) > FLAT and jump > JUMP * larger:
            jumps[at[mine]] = True
    return jumps


def _next(triangles: IntArray, corner: IntArray) -> IntArray:
    """Vertex that follows a corner (k,) of the flat triangles."""
    return np.asarray(triangles.ravel()[np.where(corner % 3 == 2, corner - 2, corner + 1)])


def _bend(vertices: FloatArray, triangles: IntArray, normals: FloatArray, corner: IntArray) -> FloatArray:
    """Curvature (k,) of the faces of triangles across the edges that begin at these corners, 1/L."""
    row, first = corner // 3, corner % 3
    second, far = (first + 1) % 3, (first + 2) % 3
    a, b, c = (vertices[triangles[row, k]] for k in (first, second, far))
    n_near = 0.5 * (normals[row, first] + normals[row, second])
    across = c - 0.5 * (a + b)
    along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1, keepdims=True), 1e-300)
    t = across - np.sum(across * along, axis=1, keepdims=True) * along
    square = np.maximum(np.sum(t**2, axis=1), 1e-300)
    return np.asarray(np.sum((normals[row, far] - n_near) * t, axis=1) / square)
