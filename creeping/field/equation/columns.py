"""The equation of a matrix solved for many right sides: all that memory allows share each product with it.

Bodies whose nodes are mirrored have one equation for each parity, with a share of the unknowns (`mirrors`).

Also here: GMRES of several right sides at once: each has its own Krylov space, and all share the products with the
matrix.

Also here: products with the matrix of the equation where it has too many entries to be kept.

    M v = plain sums over all nodes, split (`creeping.field.equation.split_sums`) + C v
    C   = integrals over tiles near to points less what plain sums have of their nodes, a sparse matrix

Sources: [SS86]; [E21]; Derivations, F35 and F36.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from creeping._progress import say
from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import Boundary
from creeping.field.equation.matrix import Matrix, Places
from creeping.field.equation.mirrors import blocks_of, mirrors_of, no_mirrors
from creeping.field.equation.split_sums import CURL, ONE_LAYER, TWO_LAYERS, SmoothKernel, SplitSums, best_split
from creeping.storage.memory import budget
from creeping.storage.parts import Arrays, Keeping, not_kept

TOGETHER = 5e8
"""Bytes of what GMRES keeps of right sides that are solved together."""
DENSE, SHARE, HELD = 4e9, 0.7, 0.125
"""Bytes of a scalar matrix that is kept at most: beyond, a product of one column takes longer than its sums. Shares of
the memory's budget: up to the first the matrix of a conductor is sooner than sums; up to the second the matrix stays
with its body for incidences to come, so that most of the budget is left for what is asked for next."""

TOLERANCE, COARSE_TOLERANCE, STEPS = 3e-5, 3e-3, 80
"""Residual of the equation relative to its right side, and most steps. Coarse tiles err by 0.03 % of the largest
amplitude; 3e-3 gives 0.03 to 0.05 %, 1e-2 gives 0.1 % (cylinders, k = 20 and 40)."""

ODD = 1e-3
"""Share of the tolerance below which a field of one parity is not worth solving for."""
ROWS = 4096
"""Rows of the sparse matrix that are made at a time."""


class Columns(NamedTuple):
    """Solutions and what is left of the equation, (n, m) or at the nodes (n, c, m), as a share of the right side (m,).

    c is 1, or 2 of a conductor. ``steps`` are those of GMRES.
    """

    values: ComplexArray
    change: ComplexArray
    left: FloatArray
    steps: int


def matrix_bytes(nodes: int, boundary: Boundary, parts: int) -> float:
    """Bytes of the matrix in blocks, for ``parts`` of the body that are images of each other."""
    entries = 8.0 * nodes**2 * (4 if boundary.kind == "conductor" else 1) / parts
    # one block is transposed
    return entries * (1 + 1 / parts) if boundary.kind == "soft" else entries


def is_dense(nodes: int, boundary: Boundary, parts: int) -> bool:
    """Whether the matrix is kept: else its products are sums (`SplitProduct`)."""
    most = SHARE * budget()
    return matrix_bytes(nodes, boundary, parts) <= (most if boundary.kind == "conductor" else min(DENSE, most))


def solved_columns(
    matrix: Matrix,
    right: ComplexArray,
    under: ComplexArray,
    tell: Callable[[str], None] = say,
    keep: Keeping = not_kept,
    *,
    start: ComplexArray | None = None,
    steps: int = STEPS,
) -> Columns:
    """Solve for right sides at the nodes (n, ...), and at the points beneath them (s, ...): of a conductor (n, 2, ...).

    ``tell`` hears of each part of them that is begun; ``keep`` has those that are done. ``start`` (n, m) is the share
    of the right sides at the nodes, m of them or m times some, that the currents are about; these have
    COARSE_TOLERANCE and no more than ``steps``.
    """
    nodes, c = len(matrix.root), matrix.columns
    right = right.reshape(nodes, c, -1).astype(complex)
    first_guess, tolerance = None, TOLERANCE
    if start is not None:
        share = np.repeat(start, right.shape[2] // start.shape[1], axis=1)[:, None]
        first_guess, tolerance = (right * share * matrix.root[:, None, None]).reshape(nodes * c, -1), COARSE_TOLERANCE
    right[matrix.at] -= 1j * under.reshape(len(matrix.at), *right.shape[1:])
    right = (right * matrix.root[:, None, None]).reshape(nodes * c, -1)
    n, columns = right.shape
    mirrors = mirrors_of(matrix.tiles, matrix.boundary)
    # blocks that are there serve, however little memory is free by now
    dense = bool(matrix.products) or is_dense(nodes, matrix.boundary, len(mirrors.images))
    if not dense:
        mirrors = no_mirrors(nodes, c)
    parts = len(mirrors.images)
    many = max(1, min(columns, int(parts * TOGETHER / (8 * n * (steps + 1)))))
    values, change, left = np.empty_like(right), np.empty_like(right), np.empty(columns)
    products, taken = list(matrix.products), 0

    def solved(at: slice) -> Arrays:
        if not products:
            blocks = blocks_of(matrix, mirrors) if dense else ()
            products.extend([partial(_times, block) for block in blocks] or [SplitProduct(matrix)])
            if dense and matrix_bytes(nodes, matrix.boundary, parts) <= HELD * budget():
                matrix.products = list(products)
        if at.start:
            tell(f"right side {at.start} of {columns}")
        rest = mirrors.shares(right[:, at])
        size = np.linalg.norm(rest, axis=1)
        begun = np.zeros((parts, 0, 0)) if first_guess is None else mirrors.shares(first_guess[:, at])
        solution, left, used = np.zeros_like(rest), np.zeros_like(size), 0
        for number, product in enumerate(products):
            if begun.size:
                after = rest[number] - product(begun[number])
                # optics has faces along the wave lit here and dark there: such odd fields are worse than none
                better = np.linalg.norm(after, axis=0) < size[number]
                solution[number], rest[number] = begun[number] * better, np.where(better, after, rest[number])
            # waves along a plane have no odd fields in it but for rounding
            some = np.flatnonzero(size[number] > tolerance * ODD * np.linalg.norm(size, axis=0))
            found = block_gmres(product, rest[number][:, some], tolerance, steps, size=size[number, some])
            solution[number][:, some] += found.values
            left[number] = np.linalg.norm(rest[number], axis=0)
            rest[number][:, some], left[number, some] = found.change, found.left * size[number, some]
            used = max(used, found.steps)
        share = np.linalg.norm(left, axis=0) / np.maximum(np.linalg.norm(size, axis=0), np.finfo(float).tiny)
        known = {"values": mirrors.whole(solution), "change": mirrors.whole(rest)}
        return {**known, "left": share, "steps": np.array([used])}

    for first in range(0, columns, many):
        at = slice(first, first + many)
        part = keep(f"columns-{n}-{steps}-{first}", partial(solved, at))
        values[:, at], change[:, at], left[at] = part["values"], part["change"], part["left"]
        taken = max(taken, int(part["steps"][0]))
    back = matrix.root[:, None, None]
    return Columns(values.reshape(nodes, c, -1) / back, change.reshape(nodes, c, -1) / back, left, taken)


def _times(block: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A block of the matrix times columns (n, m), single precision."""
    return np.asarray(block @ values.astype(np.complex64, copy=False))


def block_gmres(
    product: Callable[[Any], Any],
    right: ComplexArray,
    tolerance: float,
    steps: int,
    *,
    size: FloatArray | None = None,
) -> Columns:
    """Solutions x (n, m) of A x = right (n, m), right - A x, and that as a share of the right sides' size (m,).

    Parameters
    ----------
    product : callable
        A times columns (n, m).
    right : (n, m)
    tolerance : float
        What may be left.
    steps : int
        At most.
    size : (m,)
        What shares are of, if not the norm of the right sides.

    Examples
    --------
    >>> A = np.array([[2.0, 1.0], [0.0, 1.0]])
    >>> found = block_gmres(lambda v: A @ v, np.eye(2, dtype=complex), 1e-6, 5)
    >>> bool(np.allclose(A @ found.values, np.eye(2))), found.steps
    (True, 2)
    """
    n, m = right.shape
    norm = np.linalg.norm(right, axis=0)
    whole = norm if size is None else size
    scale = np.where(whole > 0, whole, 1.0)
    # in single precision, as products are
    basis: Any = np.empty((m, steps + 1, n), dtype=np.complex64)
    basis[:, 0] = (right / np.where(norm > 0, norm, 1.0)).T
    H = np.zeros((m, steps + 1, steps), dtype=complex)
    used, left, y = 0, norm / scale, np.zeros((m, steps), dtype=complex)
    for step in range(steps):
        if np.all(left <= tolerance):
            break
        new = np.ascontiguousarray(product(basis[:, step].T).T, dtype=np.complex64)
        # twice, for the sake of rounding
        for _ in range(2):
            along = np.conj(basis[:, : step + 1] @ np.conj(new)[:, :, None])
            new -= (along.swapaxes(1, 2) @ basis[:, : step + 1])[:, 0]
            H[:, : step + 1, step] += along[:, :, 0]
        length = np.linalg.norm(new, axis=1)
        H[:, step + 1, step] = length
        basis[:, step + 1] = new / np.where(length > 0, length, 1.0)[:, None]
        used = step + 1
        first = np.zeros((m, used + 1), dtype=complex)
        first[:, 0] = norm
        # each right side ends where it would by itself
        for one in np.flatnonzero(left > tolerance):
            h = H[one, : used + 1, :used]
            found = np.linalg.lstsq(h, first[one], rcond=None)[0]
            y[one, :used] = found
            left[one] = np.linalg.norm(h @ found - first[one]) / scale[one]
    shares = np.stack([H[:, : used + 1, :used] @ y[:, :used, None], np.pad(y, ((0, 0), (0, 1)))[:, : used + 1, None]])
    known, values = (each.swapaxes(1, 2).astype(np.complex64) @ basis[:, : used + 1] for each in shares)
    return Columns(values[:, 0].T.astype(complex), np.asarray(right - known[:, 0].T), left, used)


class SplitProduct:
    """A matrix that is not kept: it multiplies columns by sums over the nodes."""

    def __init__(self, matrix: Matrix) -> None:
        self._of, k = matrix, matrix.k
        nodes, inner = matrix.nodes, matrix.inner
        x, n = (np.concatenate(part) for part in ((nodes.points, inner.points), (nodes.normals, inner.normals)))
        low, high = nodes.points.min(axis=0), nodes.points.max(axis=0)
        plain = matrix.soft or matrix.boundary.kind == "hard"
        load = CURL if matrix.vector else ONE_LAYER if plain else TWO_LAYERS
        best = best_split(lambda a: SmoothKernel(k, high - low, a), x, nodes.points, load, np.inf)
        if best is None:
            raise InvalidInputError(
                f"sums over {len(nodes.points)} nodes take more memory than there is; lower the wavenumber or set "
                "CREEPING_MEMORY"
            )
        self._sums = SplitSums(best.kernel, x, n, nodes.points, nodes.normals, matrix.root**2 / (4 * np.pi))
        self._own = _correction(matrix, nodes, matrix.root, "double")
        self._under = _correction(matrix, inner, matrix.root[matrix.at], "slope" if matrix.soft else "double")

    def __call__(self, values: ComplexArray) -> ComplexArray:
        """The matrix times columns (n, m)."""
        matrix = self._of
        own, under = self._vectors(values) if matrix.vector else self._scalars(values)
        small = values.astype(np.complex64)
        own = own + (self._own.T if matrix.soft else self._own) @ small
        under = under + self._under @ small
        out, c = values + (own if matrix.soft else -own), matrix.columns
        rows = (c * matrix.at[:, None] + np.arange(c)).ravel()
        out[rows] += (-1j if matrix.soft else 1j) * under
        return np.asarray(out)

    def _scalars(self, values: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Plain sums at the nodes and beneath them, times sqrt(w)."""
        matrix, sums = self._of, self._sums
        single = matrix.single("double")
        found = []
        for column in (values / matrix.root[:, None]).T:
            if matrix.soft:
                found.append(-sums.tilted_at_points(column))
            else:
                both = sums.tilted_at_nodes(column)
                found.append(both + sums.values(single * column) if len(single) else both)
        both = 2 * np.stack(found, axis=1)
        n = len(matrix.root)
        return both[:n] * matrix.root[:, None], both[n:] * matrix.root[matrix.at, None]

    def _vectors(self, values: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """The same along a and b, of a conductor."""
        matrix, n = self._of, len(self._of.root)
        u = values.reshape(n, 2, -1) / matrix.root[:, None, None]
        nodes, inner = matrix.nodes, matrix.inner
        curl = self._sums.curl(nodes.a[:, :, None] * u[:, :1] + nodes.b[:, :, None] * u[:, 1:])
        parts = []
        for places, field, root in ((nodes, curl[:n], matrix.root), (inner, curl[n:], matrix.root[matrix.at])):
            turned = 2 * root[:, None, None] * np.cross(places.normals[:, :, None], field, axis=1)
            along = [np.einsum("mx,mxc->mc", t, turned) for t in (places.a, places.b)]
            parts.append(np.stack(along, axis=1).reshape(2 * len(root), u.shape[-1]))
        return parts[0], parts[1]


def _correction(matrix: Matrix, places: Places, scale: FloatArray, kind: str) -> Any:
    """The sparse matrix C of places (m,), times a scale (m,), for values u sqrt(w)."""
    from scipy.sparse import csr_array, vstack

    c, m, n = matrix.columns, len(places.points), len(matrix.root)
    # a thin body has no points beneath it
    parts = [csr_array((0, c * n), dtype=np.complex64)]
    for first in range(0, m, ROWS):
        some = places.part(slice(first, first + ROWS))
        targets, columns, near = matrix.near(some, kind)
        near = near - _plain(matrix, some, targets, columns, kind)
        share = scale[first + targets, None] / (2 * np.pi * matrix.root[columns])
        count = len(some.points)
        if c == 2:
            entries = near * share[:, None, :, None]
            rows = np.broadcast_to(2 * targets[:, None, None, None] + np.arange(2)[:, None, None], entries.shape)
            ends = np.broadcast_to(2 * columns[:, None, :, None] + np.arange(2), entries.shape)
        else:
            entries, ends = near * share, columns
            rows = np.broadcast_to(targets[:, None], entries.shape)
        data = entries.ravel().astype(np.complex64)
        shape = (c * count, c * n)
        parts.append(csr_array((data, (rows.ravel().astype(np.int32), ends.ravel().astype(np.int32))), shape))
    return vstack(parts, format="csr")


def _plain(matrix: Matrix, places: Places, targets: IntArray, columns: IntArray, kind: str) -> ComplexArray:
    """What plain sums have of the same pairs, as of `Matrix.near`."""
    nodes, k = matrix.nodes, matrix.k
    away = places.points[targets, None] - nodes.points[columns]
    R = np.linalg.norm(away, axis=2)
    same = R * k < 1e-6
    R[same] = 1.0
    G = np.exp(1j * k * R) / R
    slope = np.where(same, 0.0, G * (1j * k - 1 / R) / R)
    weights = matrix.root[columns] ** 2
    if kind == "slope":
        return np.asarray(weights * slope * np.einsum("px,pjx->pj", places.normals[targets], away))
    if not matrix.vector:
        found = -slope * np.einsum("pjx,pjx->pj", nodes.normals[columns], away)
        single = matrix.single(kind)
        if len(single):
            found = found + single[columns] * np.where(same, 1j * k, G)
        return np.asarray(weights * found)
    lean = np.einsum("px,pjx->pj", places.normals[targets], away)
    out = np.empty((len(targets), 2, columns.shape[1], 2), dtype=complex)
    for row, p in enumerate((places.a[targets], places.b[targets])):
        along = np.einsum("px,pjx->pj", p, away)
        for column, q in enumerate((nodes.a[columns], nodes.b[columns])):
            turned = along * np.einsum("px,pjx->pj", places.normals[targets], q)
            out[:, row, :, column] = weights * slope * (turned - np.einsum("px,pjx->pj", p, q) * lean)
    return out
