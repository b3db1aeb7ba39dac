"""The charge q = n.E on a conductor whose current is known, and the electric field at any distance from it.

    (1 + M*) q = 2 n.E_inc + 2ik n.int J G dS                             on the body, M* as of soft bodies
    E(x) = E_inc + ik int J G dS - int q grad_x G dS                      off it

since div J = ikq, and since the normal part of the second is q on the body and 0 inside. q so found is no derivative of
J: it holds next to edges and tips, where both grow without bound and differences of J tell nothing.

Sources: [CK13, sec. 6.3 and 6.4], [TY06]; Derivations, F36.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.equation.columns import solved_columns
from creeping.field.equation.matrix import Matrix, Places
from creeping.field.polarisation import spherical_frame


def twice_normal(
    matrix: Matrix, places: Places, J: ComplexArray, directions: FloatArray, electric: ComplexArray | FloatArray
) -> ComplexArray:
    """2 n.E_inc + 2ik n.int J G dS at places (p,) of J (n, 3, m, c) at the nodes, E0 (m, 3, c): (p, m, c).

    ``matrix`` is that of soft bodies on the same tiles.
    """
    wave = 2 * np.exp(1j * matrix.k * (places.points @ directions.T))
    incident = wave[:, :, None] * np.einsum("px,mxc->pmc", places.normals, electric)
    potential = matrix.received(places, J, "single")
    return np.asarray(incident + 1j * matrix.k * np.einsum("px,pxmc->pmc", places.normals, potential))


def charges(matrix: Matrix, J: ComplexArray, directions: FloatArray) -> ComplexArray:
    """q at the nodes of J (n, 3, m, 2), of waves along directions (m, 3) with E0 along theta and phi: (n, m, 2)."""
    electric = np.swapaxes(spherical_frame(directions), 1, 2)
    right, under = (twice_normal(matrix, places, J, directions, electric) for places in (matrix.nodes, matrix.inner))
    found = solved_columns(matrix, right, under)
    return found.values.reshape(right.shape)


def scattered_electric(matrix: Matrix, points: FloatArray, J: ComplexArray, q: ComplexArray) -> ComplexArray:
    """Scattered E at points (p, 3), L, at any distance, of J (n, 3, c) and q (n, c): (p, 3, c)."""
    up = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    field = 0.5j * matrix.k * matrix.received(Places.at(points, up), J, "single")
    for axis, along in enumerate(np.eye(3)):
        places = Places.at(points, np.broadcast_to(along, points.shape))
        field[:, axis] -= 0.5 * matrix.received(places, q, "slope")
    return field
