"""Symmetries of a body's nodes that turn signs of coordinates, and the blocks of the equation's matrix for each parity.

Let the P_g be such symmetries: mirrors, half turns, the inversion, and their products, 2^s in all, and chi(g) = +-1 say
in which of them a field is odd. Fields of one chi stay so when they are scattered, so that with the nodes i of one part
of space and their images gi

    A_chi[i, j] = sum_g chi(g) s_g(j) A[i, gj],   u(gi) = chi(g) s_g(i) u(i)

are 2^s equations of n/2^s unknowns, of any field u with u_chi(i) = 2^-s sum_g chi(g) s_g(i) u(gi). A node on a plane is
an image of itself, has that share of its weight, and is 0 in odd fields. s is 1 of scalar fields; of J, in components
along tangents, whether these have the image's sign: J(P x) = chi P J(x).

Sources: [K05]; Derivations, F36.
"""

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.equation.matrix import BLOCK, Matrix, Places
from creeping.field.equation.tiles import Tiles
from creeping.geometry.surface import memo

FLIPS: tuple[tuple[int, ...], ...] = (0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)
FEW = 32
"""Rows that are added up at a time: as many as a cache holds."""
SAME = 1e-9
"""Distance of a node's image from a node, and difference of weights and tangents, up to which they are one."""


class Mirrors(NamedTuple):
    """Symmetries of nodes.

    Attributes
    ----------
    flips : tuple of tuple of int
        Axes whose coordinates each of s symmetries turns: (0,) is the mirror x = 0, (0, 1) half a turn about z.
    part : (m,)
        Nodes of which all others are images: n / 2^s, and more where nodes are their own images.
    images : (2^s, m)
        Numbers of the images, in the order of `product` over flips, the nodes themselves first.
    signs : (2^s, m, c)
        Signs of the images of tangents.
    """

    flips: tuple[tuple[int, ...], ...]
    part: IntArray
    images: IntArray
    signs: FloatArray

    @property
    def characters(self) -> FloatArray:
        """chi by parities in the flips and by image: (2^s, 2^s)."""
        odd = np.array(list(product((0, 1), repeat=len(self.flips)))).reshape(2 ** len(self.flips), -1)
        return np.asarray((-1.0) ** (odd @ odd.T))

    @property
    def times(self) -> IntArray:
        """How often each node of the part is among its own images (m,)."""
        return np.asarray(np.sum(self.images == self.part, axis=0))

    def shares(self, values: ComplexArray) -> ComplexArray:
        """Fields times sqrt(w) (n c, p) by their parities, over the root of `times`: (2^s, m c, p).

        Their squares add up to those of the fields over 2^s.
        """
        q, m, c = self.signs.shape
        signs = self.signs / np.sqrt(self.times)[:, None] / q
        each = values.reshape(-1, c, values.shape[1])[self.images] * signs[..., None]
        return np.asarray(np.einsum("xg,gicp->xicp", self.characters, each).reshape(q, m * c, -1))

    def whole(self, shares: ComplexArray) -> ComplexArray:
        """The fields (n c, p) that have these `shares`."""
        q, m, c = self.signs.shape
        each = np.einsum("xg,xicp->gicp", self.characters, shares.reshape(q, m, c, -1))
        out = np.empty((self.images.max() + 1, c, shares.shape[2]), dtype=complex)
        out[self.images] = each * (self.signs * np.sqrt(self.times)[:, None])[..., None]
        return out.reshape(-1, shares.shape[2])


def mirrors_of(tiles: Tiles, boundary: Boundary, center: FloatArray | None = None) -> Mirrors:
    """Symmetries of the nodes of tiles about a centre, their own if it is not given; none where the admittance varies.

    Those about their own centre are cached.
    """
    n, c = len(tiles.points), 2 if boundary.kind == "conductor" else 1
    if boundary.varies:
        return no_mirrors(n, c)
    if center is not None:
        return _found(tiles, c, center)
    middle = 0.5 * (tiles.points.max(axis=0) + tiles.points.min(axis=0))
    return memo(tiles, f"mirrors of {c} columns", lambda: _found(tiles, c, middle))


def _found(tiles: Tiles, c: int, center: FloatArray) -> Mirrors:
    from scipy.spatial import cKDTree

    n, x = len(tiles.points), tiles.points - center
    places, tree = Places.at(tiles.points, tiles.normals), cKDTree(x)
    flips: list[tuple[int, ...]] = []
    made: set[frozenset[int]] = {frozenset()}
    images, signs = np.arange(n)[None], np.ones((1, n, c))
    for axes in FLIPS:
        if frozenset(axes) in made:
            continue
        step = _image(places, tiles.weights, tree, axes, c)
        if step is None:
            continue
        flips.append(axes)
        made |= {one ^ frozenset(axes) for one in made}
        at, turned = step
        # the last flip varies fastest
        images = np.stack([images, at[images]], axis=1).reshape(-1, n)
        both = turned[images[::2]] * signs
        signs = np.stack([signs, both], axis=1).reshape(-1, n, c)
    part = np.flatnonzero(images.min(axis=0) == np.arange(n))
    return Mirrors(tuple(flips), part, images[:, part], signs[:, part])


def no_mirrors(nodes: int, columns: int) -> Mirrors:
    """No planes: every node stands for itself."""
    return Mirrors((), np.arange(nodes), np.arange(nodes)[None], np.ones((1, nodes, columns)))


def _image(
    places: Places, weights: FloatArray, tree: Any, axes: tuple[int, ...], c: int
) -> tuple[IntArray, FloatArray] | None:
    """Number of the image of each node (n,) by one flip, and signs of its tangents (n, c); None if there is none.

    ``tree`` holds the nodes about the centre.
    """
    x, flip = tree.data, np.ones(3)
    flip[list(axes)] = -1.0
    away, at = tree.query(x * flip, distance_upper_bound=SAME * float(np.max(np.abs(x))))
    if not np.all(np.isfinite(away)) or np.any(at[at] != np.arange(len(x))):
        return None
    off = np.max(np.abs(places.normals[at] - places.normals * flip))
    if off > SAME or np.max(np.abs(np.sqrt(weights[at] / weights) - 1)) > SAME:
        return None
    if c == 1:
        return at, np.ones((len(x), 1))
    signs = np.stack([np.sum(t[at] * t * flip, axis=1) for t in (places.a, places.b)], axis=1)
    return (at, np.round(signs)) if np.max(np.abs(np.abs(signs) - 1)) < SAME else None


def blocks_of(matrix: Matrix, mirrors: Mirrors) -> np.ndarray:
    """Blocks of a matrix by parity, of values over the root of `Mirrors.times`: (2^s, m c, m c), single precision."""
    c, part = matrix.columns, mirrors.part
    root, (above, beneath) = matrix.root[part] / np.sqrt(mirrors.times), matrix.beneath(part)
    images = mirrors.images
    m = c * images.shape[1]
    columns = (c * images[:, :, None] + np.arange(c)).reshape(len(images), -1)
    signs = mirrors.signs / np.sqrt(mirrors.times)[:, None]
    signs = signs.reshape(len(images), -1).astype(np.float32)
    out = np.zeros((len(images), m, m), dtype=np.complex64)

    def add(at: IntArray, rows: np.ndarray, factor: complex) -> None:
        """Rows of the matrix, added up over images: sums and differences, one flip after the other."""
        if len(out) == 1:
            out[0][at] += np.complex64(factor) * rows
            return
        for first in range(0, len(rows), FEW):
            some = rows[first : first + FEW]
            each = [some[:, order] * sign for order, sign in zip(columns, signs, strict=True)]
            # the last flip varies fastest
            for flip in range(len(mirrors.flips)):
                step = 2**flip
                for even in range(len(each)):
                    if not even & step:
                        one, other = each[even], each[even + step]
                        each[even], each[even + step] = one + other, one - other
            for block, part_of in zip(out, each, strict=True):
                block[at[first : first + FEW]] += np.complex64(factor) * part_of

    numbers = np.arange(m)
    own = matrix.nodes.part(part)
    for first in range(0, len(part), BLOCK):
        at = slice(first, first + BLOCK)
        rows = matrix.rows(own.part(at), root[at])
        add(numbers[c * first : c * (first + BLOCK)], rows, 1.0 if matrix.soft else -1.0)
    for block in out:
        if matrix.soft:
            block[:] = block.T.copy()
        block[np.diag_indices(m)] += 1.0
    for first in range(0, len(above), BLOCK):
        here, under = (lane[first : first + BLOCK] for lane in (above, beneath))
        rows = matrix.rows(matrix.inner.part(under), root[here], "slope" if matrix.soft else "double")
        add((c * here[:, None] + np.arange(c)).ravel(), rows, -1j if matrix.soft else 1j)
    return out
