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

Also here: what the lit side that faces other parts of the body receives from them: one bounce of physical optics.

    hard  u(x) += 2 int_(t > 0) W(t) u dG/dn_y dS_y,   soft  du/dn(x) += 2ik int_(t > 0) t W(t) du/dn G dS_y
    conductor  J(x) += 2 n_x x int_(t > 0) W(t) grad_x G x J dS_y

over all the body's currents above the horizon of x, t = n_x.(y - x)/|y - x|; W is a smooth step from 0 to 0.3, without
which the cut at the horizon would radiate. What is above the horizon lights or shadows x: its currents cancel the
incident wave behind it. A convex body has nothing there. What goes to and fro more often is left out, and what
the shadow side receives. An impedance has no bounce: where it was tried, eta = 0.5, it made fields no better.

Sources: [CK13, sec. 2.2 and 6.2], [BMK19]; Derivations, F16, F17 and F29.
"""

import numpy as np
from scipy.spatial import cKDTree

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.currents.nodes import LitNodes
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.curvature import curvature_norms, gaussian_curvature
from creeping.geometry.surface import Surface, memo
from creeping.kernels.threads import in_threads

LOW = 0.3
"""t up to which W rises."""
BLOCK = 16
"""Nodes that are looked at together, neighbours in space."""
Nodes = tuple[FloatArray, FloatArray]
"""Places (n, 3), L, and normals there."""


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
        lambda part: distant(turns, real, imaginary, directions[part], out[part]), len(out), least=32, multiple=8
    )
    return np.asarray(out[:, :columns] + 1j * out[:, columns:])


def grid_cells(widths: FloatArray, wavenumber: float) -> float:
    """Cells of the transform's grid for nodes in a box of ``widths`` (3,), L, and all directions."""
    # two for each that the bandwidth asks for, and twenty more along a side
    return float(np.prod(2 * wavenumber * widths / np.pi + 20))


def transformed(nodes: int, directions: int, cells: float) -> bool:
    """Whether a transform of ``cells``, at most 0.6 GB, is faster than direct sums."""
    # what a node and a cell cost, in terms of one direction seen from one node
    return cells <= 40_000_000 and 1500.0 * nodes + 60.0 * cells < nodes * directions


def _by_transform(points: FloatArray, weights: ComplexArray, directions: FloatArray, wavenumber: float) -> ComplexArray:
    import finufft

    x, k = np.ascontiguousarray(points.T), np.ascontiguousarray(wavenumber * directions.T)
    # one column at a time bounds the memory; one thread adds in one order
    options = {"eps": 1e-9, "isign": -1, "nthreads": 1}
    sums = [finufft.nufft3d3(*x, np.ascontiguousarray(w, dtype=complex), *k, **options) for w in weights]
    return np.stack(sums, axis=1) if sums else np.zeros((len(directions), 0), dtype=complex)


def far_of_scalar(
    nodes: Nodes, u: ComplexArray | None, slope: ComplexArray | None, directions: FloatArray, wavenumber: float
) -> ComplexArray:
    """f (m,), L, of u dS and du/dn dS at nodes (n,); None stands for nothing."""
    columns = [] if u is None else list(-1j * wavenumber * u * nodes[1].T)
    if slope is not None:
        columns.append(-slope)
    sums = phase_sums(nodes[0], np.array(columns), directions, wavenumber) / (4 * np.pi)
    f = np.zeros(len(directions), dtype=complex) if slope is None else sums[:, -1]
    return np.asarray(f if u is None else f + np.sum(sums[:, :3] * directions, axis=1))


def field_of_scalar(
    nodes: Nodes, u: ComplexArray | None, slope: ComplexArray | None, at: FloatArray, wavenumber: float
) -> ComplexArray:
    """Scattered field at points (m, 3), L, off the body, of u dS and du/dn dS at nodes (n,): (m,).

    Or of several columns (c, n) of them: (m, c).
    """
    from creeping.field.kernels.near_pairs import near

    given = slope if u is None else u
    nothing = np.zeros((1, len(nodes[0])) if given is None else np.atleast_2d(given).shape, dtype=complex)
    single = -(nothing if slope is None else np.atleast_2d(slope)) / (4 * np.pi)
    double = (nothing if u is None else np.atleast_2d(u)) / (4 * np.pi)
    out = np.empty((len(at), 2 * len(nothing)))
    columns = [np.ascontiguousarray(part.T) for part in nodes]
    pairs = [np.ascontiguousarray(np.stack([w.real, w.imag])) for w in (single, double)]
    at = np.ascontiguousarray(at)
    in_threads(lambda part: near(*columns, *pairs, wavenumber, at[part], out[part]), len(at), least=32, multiple=8)
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


def field_of_vector(
    points: FloatArray, currents: ComplexArray, at: FloatArray, wavenumber: float, *, electric: bool
) -> ComplexArray:
    """Scattered E, or H in the unit of the incident one, (m, 3, ...) at points off the body, of J dS (n, 3, ...)."""
    from creeping.field.kernels import near_pairs

    if currents.ndim > 2:
        each = np.moveaxis(currents.reshape(*currents.shape[:2], -1), -1, 0)
        fields = [field_of_vector(points, one, at, wavenumber, electric=electric) for one in each]
        return np.stack(fields, axis=-1).reshape(len(at), 3, *currents.shape[2:])
    J = currents.T / (4 * np.pi)
    real, imaginary = np.ascontiguousarray(J.real), np.ascontiguousarray(J.imag)
    out = np.empty((len(at), 6))
    columns, at = np.ascontiguousarray(points.T), np.ascontiguousarray(at)
    given = columns, real, imaginary, wavenumber
    kernel = near_pairs.electric if electric else near_pairs.curl
    in_threads(lambda part: kernel(*given, at[part], out[part]), len(at), least=32, multiple=8)
    return np.asarray(out[:, :3] + 1j * out[:, 3:])


def self_reflects(part: LitNodes) -> bool:
    """Whether the lit side is somewhere not convex, so that it may face other parts of the body."""
    total = part.along + part.across
    gauss = part.along * part.across - part.twist**2
    return _has_saddles(gauss, total**2)


def _has_saddles(gauss: FloatArray, square: FloatArray) -> bool:
    """Whether K is negative anywhere (n,), beyond a thousandth of the largest (kappa_1 + kappa_2)^2 (n,)."""
    return bool(np.min(gauss, initial=0.0) < -1e-3 * np.max(square, initial=0.0))


def may_self_reflect(body: Surface) -> bool:
    """`self_reflects` of the whole surface of a body, lit or not."""

    def found() -> bool:
        points = points_of_charts(body)
        gauss = gaussian_curvature(body, points)
        return _has_saddles(gauss, curvature_norms(body, points) ** 2 + 2 * gauss)

    return memo(body, "may face itself", found)


def received(
    at: Nodes, nodes: Nodes, single: ComplexArray, double: ComplexArray, k: float, *, soft: bool
) -> ComplexArray:
    """What points of the body receive, u or du/dn if soft (m,); points and their normals (m, 3), those of nodes (n, 3).

    ``single`` and ``double`` (n,) are -du/dn dS/4 pi and u dS/4 pi; zeros where pairs are too many.
    """
    from creeping.field.kernels.bounce import from_above

    if not _affordable(at, nodes):
        return np.zeros(len(at[0]), dtype=complex)
    place, points, of = _blocks(at)
    order, sources, others = _blocks(nodes)
    weights = [np.ascontiguousarray(np.stack([one.real, one.imag])) for one in (single[order], double[order])]
    out = np.empty((len(at[0]), 2))

    def work(part: slice) -> None:
        given = (*points, of, *sources, others, BLOCK, *weights, k, LOW, soft)
        from_above(*given, part.start, part.stop, out)

    in_threads(work, len(of[1]), least=4, multiple=1)
    found = np.empty(len(out), dtype=complex)
    found[place] = out[:, 0] + 1j * out[:, 1]
    return found


def received_vectors(at: Nodes, nodes: Nodes, strength: ComplexArray, k: float) -> ComplexArray:
    """J that points of a conductor receive (m, 3, p) from J dS/4 pi (n, 3, p) at nodes; the others as of `received`."""
    from creeping.field.kernels.bounce import vectors_from_above

    waves = strength.shape[2]
    # both polarisations of a conductor take as long as 2.5 scalar pairs
    if not _affordable(at, nodes, 2.5):
        return np.zeros((len(at[0]), 3, waves), dtype=complex)
    place, points, of = _blocks(at)
    order, sources, others = _blocks(nodes)
    turned = np.moveaxis(strength[order], 0, 2)
    J = np.ascontiguousarray(np.concatenate([turned.real, turned.imag]).transpose(1, 0, 2))
    out = np.empty((len(at[0]), waves, 6))

    def work(part: slice) -> None:
        vectors_from_above(*points, of, sources[0], others, BLOCK, J, k, LOW, part.start, part.stop, out)

    in_threads(work, len(of[1]), least=4, multiple=1)
    found = np.empty((len(out), 3, waves), dtype=complex)
    found[place] = np.moveaxis(out[..., :3] + 1j * out[..., 3:], 1, 2)
    return found


def _affordable(at: Nodes, nodes: Nodes, each: float = 1.0) -> bool:
    """Whether pairs take no more than eight seconds, if all stand above each other's horizon."""
    return 0 < each * len(at[0]) * len(nodes[0]) < 4e9


def _blocks(pair: Nodes) -> tuple[IntArray, Nodes, tuple[FloatArray, ...]]:
    """An order in which neighbours follow each other; in it points and normals (3, m), and the balls of blocks."""
    from creeping.field.kernels.bounce import balls

    order = cKDTree(pair[0], leafsize=BLOCK).indices
    x, n = (np.ascontiguousarray(part[order].T) for part in pair)
    many = -(-x.shape[1] // BLOCK)
    found = np.empty((many, 3)), np.empty(many), np.empty((many, 3)), np.empty(many)
    balls(x, n, BLOCK, *found)
    return order, (x, n), found
