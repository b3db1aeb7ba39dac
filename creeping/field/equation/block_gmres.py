"""GMRES of several right sides at once: each has its own Krylov space, and all share the products with the matrix.

Source: [SS86].
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import ComplexArray, FloatArray

TOLERANCE, STEPS = 3e-5, 80
"""What is left of the equation, as a share of its right side, and steps at most."""


def block_gmres(
    product: Callable[[ComplexArray], ComplexArray], right: ComplexArray, tolerance: float, steps: int
) -> tuple[ComplexArray, FloatArray, int]:
    """Solutions x (n, m) of A x = right (n, m), what is left of each as a share of its right side (m,), and steps.

    Parameters
    ----------
    product : callable
        A times columns (n, m).
    right : (n, m)
    tolerance : float
        What may be left.
    steps : int
        At most.

    Examples
    --------
    >>> A = np.array([[2.0, 1.0], [0.0, 1.0]])
    >>> x, left, steps = block_gmres(lambda v: A @ v, np.eye(2, dtype=complex), 1e-10, 5)
    >>> bool(np.allclose(A @ x, np.eye(2))), steps
    (True, 2)
    """
    n, m = right.shape
    size = np.linalg.norm(right, axis=0)
    scale = np.where(size > 0, size, 1.0)
    basis = np.empty((steps + 1, n, m), dtype=complex)
    basis[0] = right / scale
    H = np.zeros((m, steps + 1, steps), dtype=complex)
    used, left, y = 0, np.ones(m), np.zeros((m, steps), dtype=complex)
    for step in range(steps):
        new = product(basis[step])
        # twice, for the sake of rounding
        for _ in range(2):
            along = np.einsum("snm,nm->ms", np.conj(basis[: step + 1]), new)
            new = new - np.einsum("snm,ms->nm", basis[: step + 1], along)
            H[:, : step + 1, step] += along
        length = np.linalg.norm(new, axis=0)
        H[:, step + 1, step] = length
        basis[step + 1] = new / np.where(length > 0, length, 1.0)
        used = step + 1
        first = np.zeros((m, used + 1), dtype=complex)
        first[:, 0] = size
        # each right side ends where it would by itself
        for one in np.flatnonzero(left > tolerance):
            h = H[one, : used + 1, :used]
            found = np.linalg.lstsq(h, first[one], rcond=None)[0]
            y[one, :used] = found
            left[one] = np.linalg.norm(h @ found - first[one]) / scale[one]
        if np.all(left <= tolerance):
            break
    return np.einsum("snm,ms->nm", basis[:used], y[:, :used]), left, used
