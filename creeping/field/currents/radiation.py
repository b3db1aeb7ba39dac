"""What currents radiate: the far field, the field at points, and what is left of the wave inside the body.

With G = e^{ikR}/(4 pi R), u and du/dn on the whole body, and J = n x H on a conductor:

    f(r) = -(1/4 pi) int (du/dn + ik (r.n) u) e^{-ikr.x} dS
    u_s(y) = int (u dG/dn_x - du/dn G) dS
    f(r) = (ik/4 pi) int [J - r (r.J)] e^{-ikr.x} dS,   H_s(y) = int grad_y G x J dS
    E_s(y) = ik int [J + grad_y grad_y.J/k^2] G dS

Directions r are taken one by one, or for a map of many by a nonuniform fast Fourier transform of the third kind
[BMK19], good to 1e-9 of the largest value, whichever costs less.

Inside the body the field of exact currents cancels the incident wave. What is left there, as a share of it, is the
error of the currents that radiates: if nothing were left, nothing would be wrong outside either, by uniqueness.

Sources: [CK13, sec. 2.2 and 6.2], [BMK19]; Derivations, F16 and F17.
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.kernels.threads import in_threads

SHARES = {"least": 32, "multiple": 8}
"""Fewest directions or points worth a thread, and what slices of them end at."""
EACH = 5e-9
"""Seconds, about, of one direction seen from one node."""
TOLERANCE = 1e-9
"""Of the transform, as a share of its largest value."""
PER_NODE, PER_CELL = 1500.0, 60.0
"""What a node and a cell of its grid cost, in terms of one direction seen from one node."""
OVERSAMPLED, RIM = 2.0, 20
"""Cells of the grid for each that the bandwidth asks for, and cells more along a side."""
MOST_CELLS = 40_000_000
"""Cells of the grid beyond which directions are taken one by one: 0.6 GB."""


def phase_sums(points: FloatArray, weights: ComplexArray, directions: FloatArray, wavenumber: float) -> ComplexArray:
    """Sums of w e^{-ik r.x} over nodes (n, 3), L, for columns w (c, n): (m, c).

    Examples
    --------
    >>> x = np.array([[0.0, 0.0, 0.5]])
    >>> phase_sums(x, np.ones((1, 1), complex), np.array([[0.0, 0.0, 1.0]]), 2 * np.pi).round(12)
    array([[-1.+0.j]])
    """
    cells = grid_cells(np.ptp(points, axis=0) if len(points) else np.zeros(3), wavenumber)
    if transformed(len(points), len(directions), cells):
        return _by_transform(points, weights, directions, wavenumber)
    from creeping.field.kernels.near_pairs import distant

    turns = np.ascontiguousarray(points.T) * (wavenumber / (2 * np.pi))
    real, imaginary = np.ascontiguousarray(weights.real), np.ascontiguousarray(weights.imag)
    columns = len(weights)
    out = np.empty((len(directions), 2 * columns))
    directions = np.ascontiguousarray(directions)
    in_threads(
        lambda part: distant(turns, real, imaginary, directions[part], out[part]),
        len(directions),
        seconds=EACH * len(points),
        **SHARES,
    )
    return np.asarray(out[:, :columns] + 1j * out[:, columns:])


def grid_cells(widths: FloatArray, wavenumber: float) -> float:
    """Cells of the transform's grid for nodes in a box of such widths (3,), L, and all directions."""
    return float(np.prod(OVERSAMPLED * wavenumber * widths / np.pi + RIM))


def transformed(nodes: int, directions: int, cells: float) -> bool:
    """Whether directions are worth a transform of so many cells."""
    return cells <= MOST_CELLS and PER_NODE * nodes + PER_CELL * cells < nodes * directions


def _by_transform(points: FloatArray, weights: ComplexArray, directions: FloatArray, wavenumber: float) -> ComplexArray:
    import finufft

    x, k = np.ascontiguousarray(points.T), np.ascontiguousarray(wavenumber * directions.T)
    # one column at a time bounds the memory; one thread adds in one order
    options = {"eps": TOLERANCE, "isign": -1, "nthreads": 1}
    sums = [finufft.nufft3d3(*x, np.ascontiguousarray(w, dtype=complex), *k, **options) for w in weights]
    return np.stack(sums, axis=1) if sums else np.zeros((len(directions), 0), dtype=complex)


def far_of_scalar(
    points: FloatArray,
    normals: FloatArray,
    u: ComplexArray | None,
    slope: ComplexArray | None,
    directions: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """f (m,), L, of u dS and du/dn dS at nodes (n,); None stands for nothing."""
    columns = [] if u is None else list(-1j * wavenumber * u * normals.T)
    if slope is not None:
        columns.append(-slope)
    sums = phase_sums(points, np.array(columns), directions, wavenumber) / (4 * np.pi)
    f = np.zeros(len(directions), dtype=complex) if slope is None else sums[:, -1]
    return np.asarray(f if u is None else f + np.sum(sums[:, :3] * directions, axis=1))


def field_of_scalar(
    points: FloatArray,
    normals: FloatArray,
    u: ComplexArray | None,
    slope: ComplexArray | None,
    at: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """Scattered field at points (m, 3), L, off the body, of u dS and du/dn dS at nodes (n,): (m,).

    Or of several columns (c, n) of them: (m, c).
    """
    from creeping.field.kernels.near_pairs import near

    given = slope if u is None else u
    nothing = np.zeros((1, len(points)) if given is None else np.atleast_2d(given).shape, dtype=complex)
    single = -(nothing if slope is None else np.atleast_2d(slope)) / (4 * np.pi)
    double = (nothing if u is None else np.atleast_2d(u)) / (4 * np.pi)
    out = np.empty((len(at), 2 * len(nothing)))
    columns = np.ascontiguousarray(points.T), np.ascontiguousarray(normals.T)
    pairs = [np.ascontiguousarray(np.stack([w.real, w.imag])) for w in (single, double)]
    at = np.ascontiguousarray(at)
    in_threads(
        lambda part: near(*columns, *pairs, wavenumber, at[part], out[part]),
        len(at),
        seconds=EACH * len(points),
        **SHARES,
    )
    field = out[:, : len(nothing)] + 1j * out[:, len(nothing) :]
    return np.asarray(field if given is not None and given.ndim > 1 else field[:, 0])


def far_of_vector(
    points: FloatArray, currents: ComplexArray, directions: FloatArray, wavenumber: float
) -> ComplexArray:
    """f (m, 3, ...), L, of J dS (n, 3, ...)."""
    columns = currents.reshape(len(currents), -1).T
    sums = phase_sums(points, np.asarray(columns), directions, wavenumber).reshape(-1, *currents.shape[1:])
    along = np.einsum("mc...,mc->m...", sums, directions)
    return np.asarray(1j * wavenumber / (4 * np.pi) * (sums - np.einsum("m...,mc->mc...", along, directions)))


def magnetic_field_of_vector(
    points: FloatArray, currents: ComplexArray, at: FloatArray, wavenumber: float
) -> ComplexArray:
    """Scattered H (m, 3, ...) at points off the body, in the unit of the incident one, of J dS (n, 3, ...)."""
    from creeping.field.kernels.near_pairs import curl

    return _vector_sums(curl, points, currents, at, wavenumber)


def electric_field_of_vector(
    points: FloatArray, currents: ComplexArray, at: FloatArray, wavenumber: float
) -> ComplexArray:
    """Scattered E (m, 3, ...) at points off the body, in the unit of the incident one, of J dS (n, 3, ...)."""
    from creeping.field.kernels.near_pairs import electric

    return _vector_sums(electric, points, currents, at, wavenumber)


def _vector_sums(
    kernel: Callable[..., None], points: FloatArray, currents: ComplexArray, at: FloatArray, wavenumber: float
) -> ComplexArray:
    """A kernel's vectors (m, 3, ...) at points of J dS (n, 3, ...)."""
    if currents.ndim > 2:
        each = np.moveaxis(currents.reshape(*currents.shape[:2], -1), -1, 0)
        fields = [_vector_sums(kernel, points, one, at, wavenumber) for one in each]
        return np.stack(fields, axis=-1).reshape(len(at), 3, *currents.shape[2:])
    J = currents.T / (4 * np.pi)
    real, imaginary = np.ascontiguousarray(J.real), np.ascontiguousarray(J.imag)
    out = np.empty((len(at), 6))
    columns, at = np.ascontiguousarray(points.T), np.ascontiguousarray(at)
    in_threads(
        lambda part: kernel(columns, real, imaginary, wavenumber, at[part], out[part]),
        len(at),
        seconds=EACH * len(points),
        **SHARES,
    )
    return np.asarray(out[:, :3] + 1j * out[:, 3:])
