"""Planes through the centre in which a body's nodes are mirrored, and waves that are even or odd in each of them.

Let P_g mirror in some of s planes, and chi(g) = +-1 say in which of them a field is odd. Fields of one chi stay so when
they are scattered, so that with the nodes i of one part of space and their images gi

    A_chi[i, j] = sum_g chi(g) s_g(j) A[i, gj],   u(gi) = chi(g) s_g(i) u(i)

are 2^s equations of n/2^s unknowns: a matrix of 8 such blocks is factorised in a 64th of the time. A node on a plane is
an image of itself, has that share of its weight, and is 0 in odd fields. s is 1 of scalar fields; of J, in components
along tangents, whether these have the image's sign: J(P x) = chi P J(x).

    psi_lm(P x):   x -> -x   psi_l-m,    y -> -y   (-1)^m psi_l-m,    z -> -z   (-1)^(l+m) psi_lm

so that (psi_lm +- psi_l-m)/2^(1/2) are even or odd; N of psi is as psi, and M, an axial vector, the other way.

Sources: [K05]; Derivations, F36.
"""

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.field.equation.matrix import Matrix
from creeping.field.tmatrix.spherical_waves import degrees, vector_degrees

SAME = 1e-9
"""Distance of a node's image from a node, and difference of weights and tangents, up to which they are one."""


class Mirrors(NamedTuple):
    """Mirrors of nodes.

    Attributes
    ----------
    axes : tuple of int
        Normals of the planes: 0, 1, 2.
    part : (m,)
        Nodes of which all others are images: n / 2^s, and more where nodes on a plane are their own images.
    images : (2^s, m)
        Numbers of the images, in the order of `product` over axes, not mirrored first.
    signs : (2^s, m, c)
        Signs of the images of tangents.
    """

    axes: tuple[int, ...]
    part: IntArray
    images: IntArray
    signs: FloatArray

    @property
    def characters(self) -> FloatArray:
        """chi by parities of the axes and by image: (2^s, 2^s)."""
        odd = np.array(list(product((0, 1), repeat=len(self.axes)))).reshape(2 ** len(self.axes), -1)
        return np.asarray((-1.0) ** (odd @ odd.T))

    @property
    def times(self) -> IntArray:
        """How often each node of the part is among its own images (m,)."""
        return np.asarray(np.sum(self.images == self.part, axis=0))


def mirrors_of(matrix: Matrix, center: FloatArray) -> Mirrors:
    """Mirrors that the nodes of an equation have: none where the admittance varies."""
    n, c = len(matrix.root), matrix.columns
    x = matrix.nodes.points - center
    found = {} if matrix.boundary.varies else {axis: _image(matrix, x, axis) for axis in range(3)}
    steps = {axis: step for axis, step in found.items() if step is not None}
    images, signs = np.arange(n)[None], np.ones((1, n, c))
    part = np.ones(n, dtype=bool)
    for axis, (at, turned) in steps.items():
        # the last axis varies fastest
        images = np.stack([images, at[images]], axis=1).reshape(-1, n)
        both = turned[images[::2]] * signs
        signs = np.stack([signs, both], axis=1).reshape(-1, n, c)
        part &= (x[:, axis] > 0) | (at == np.arange(n))
    return Mirrors(tuple(steps), np.flatnonzero(part), images[:, part], signs[:, part])


def no_mirrors(matrix: Matrix) -> Mirrors:
    """No planes: every node stands for itself."""
    n = len(matrix.root)
    return Mirrors((), np.arange(n), np.arange(n)[None], np.ones((1, n, matrix.columns)))


def _image(matrix: Matrix, x: FloatArray, axis: int) -> tuple[IntArray, FloatArray] | None:
    """Number of the image of each node (n,) in one plane, and signs of its tangents (n, c); None if there is none."""
    from scipy.spatial import cKDTree

    flip = np.ones(3)
    flip[axis] = -1.0
    size = float(np.max(np.abs(x)))
    away, at = cKDTree(x).query(x * flip)
    nodes, root = matrix.nodes, matrix.root
    if np.max(away) > SAME * size or np.any(at[at] != np.arange(len(x))):
        return None
    if np.max(np.abs(root[at] / root - 1)) > SAME or np.max(np.abs(nodes.normals[at] - nodes.normals * flip)) > SAME:
        return None
    if not matrix.vector:
        return at, np.ones((len(x), 1))
    signs = np.stack([np.sum(t[at] * t * flip, axis=1) for t in (nodes.a, nodes.b)], axis=1)
    return (at, np.round(signs)) if np.max(np.abs(np.abs(signs) - 1)) < SAME else None


def parities(order: int, axes: tuple[int, ...], *, vector: bool) -> tuple[Any, IntArray]:
    """Waves even or odd in each plane as sums of spherical ones, sparse (waves, waves), and the number of their chi."""
    from scipy.sparse import csr_array, eye_array

    deg, m, kind = vector_degrees(order) if vector else (*degrees(order), None)
    n = len(deg)
    paired = bool({0, 1} & set(axes))
    sums = eye_array(n, format="csr")
    if paired:
        number, other = np.arange(n), np.arange(n) - 2 * m * (2 if vector else 1)
        half = np.sqrt(0.5)
        # even ones stand at m > 0, odd ones at m < 0
        own = np.where(m > 0, half, np.where(m < 0, -half, 1.0))
        cross = np.where(m == 0, 0.0, half)
        sums = csr_array((np.concatenate([own, cross]), (np.tile(number, 2), np.concatenate([number, other]))), (n, n))
    t = np.where(m < 0, -1, 1)
    even = {0: t, 1: t * (-1) ** (m % 2), 2: (-1) ** ((deg + m) % 2)}
    sign = 1 if kind is None else np.where(kind == 1, 1, -1)
    which = np.zeros(n, dtype=np.int64)
    for axis in axes:
        which = 2 * which + (even[axis] * sign < 0)
    return sums, which
