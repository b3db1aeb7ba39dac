"""The equation of a matrix solved for many right sides: all that memory allows share each product with it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import Boundary
from creeping.field.equation.block_gmres import STEPS, TOLERANCE, block_gmres
from creeping.field.equation.matrix import Matrix
from creeping.field.equation.split_product import SplitProduct
from creeping.storage.memory import budget

TOGETHER = 2e8
"""Bytes of what GMRES keeps of right sides that are solved together."""
DENSE = 8e9
"""Bytes of a matrix, and of its transpose, that are kept at most."""


class Columns(NamedTuple):
    """Solutions at the nodes and what is left of the equation there (n, c, m), as a share of the right side (m,).

    c is 1, or 2 of a conductor. ``steps`` are those of GMRES.
    """

    values: ComplexArray
    change: ComplexArray
    left: FloatArray
    steps: int


def is_dense(nodes: int, boundary: Boundary) -> bool:
    """Whether the matrix is kept: else its products are sums (`creeping.field.equation.split_product`)."""
    return 16.0 * nodes**2 * (4 if boundary.kind == "conductor" else 1) <= min(DENSE, budget())


def solved_columns(
    matrix: Matrix, right: ComplexArray, under: ComplexArray, tell: Callable[[str], None] = lambda words: None
) -> Columns:
    """Solve for right sides at the nodes (n, ...), and at the points beneath them (s, ...): of a conductor (n, 2, ...).

    ``tell`` hears of each part of them that is begun.
    """
    nodes, c = len(matrix.root), matrix.columns
    right = right.reshape(nodes, c, -1).astype(complex)
    right[matrix.at] -= 1j * under.reshape(len(matrix.at), *right.shape[1:])
    right = (right * matrix.root[:, None, None]).reshape(nodes * c, -1)
    product = matrix.product if is_dense(nodes, matrix.boundary) else SplitProduct(matrix)
    n, columns = right.shape
    many = max(1, min(columns, int(TOGETHER / (16 * n * (STEPS + 1)))))
    values, change, left = np.empty_like(right), np.empty_like(right), np.empty(columns)
    steps = 0
    for first in range(0, columns, many):
        if first:
            tell(f"right side {first} of {columns}")
        at = slice(first, first + many)
        values[:, at], left[at], taken = block_gmres(product, right[:, at], TOLERANCE, STEPS)
        change[:, at] = right[:, at] - product(values[:, at])
        steps = max(steps, taken)
    # fields at points make rows of their own
    matrix.__dict__.pop("whole", None)
    back = matrix.root[:, None, None]
    return Columns(values.reshape(nodes, c, -1) / back, change.reshape(nodes, c, -1) / back, left, steps)
