"""What the lit side that faces other parts of the body receives from them: one bounce of physical optics.

    hard  u(x) += 2 int_(t > 0) W(t) u dG/dn_y dS_y,   soft  du/dn(x) += 2ik int_(t > 0) t W(t) du/dn G dS_y
    conductor  J(x) += 2 n_x x int_(t > 0) W(t) grad_x G x J dS_y

over all the body's currents above the horizon of x, t = n_x.(y - x)/|y - x|; W is a smooth step from 0 to 0.3, without
which the cut at the horizon would radiate. What is above the horizon throws light on x, or shadow: its currents cancel
the incident wave behind it. A convex body has nothing there. What goes to and fro more often is left out, and what
ground in the dark receives. An impedance has no bounce: where it was tried, eta = 0.5, it made fields no better.

Source: Derivations, F29.
"""

import numpy as np
from scipy.spatial import cKDTree

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.currents.nodes import LitNodes
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.curvature import curvature_norms, gaussian_curvature
from creeping.geometry.memo import memo
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_threads

LOW = 0.3
"""T up to which W rises."""
BLOCK = 16
"""Nodes that are looked at together, neighbours in space."""
EACH = 2e-9
"""Seconds of one pair, about."""
VECTOR = 2.5
"""What a pair of a conductor takes of that, both polarisations."""
MOST_PAIRS = 4e9
"""Pairs of a point and a node up to which it is done: eight seconds, if all stand above each other's horizon."""
SADDLE = -1e-3
"""K, over the square of the largest curvature, below which a body is not convex."""


def self_reflects(part: LitNodes) -> bool:
    """Whether the lit side is somewhere not convex, so that it may face other parts of the body."""
    total = part.along + part.across
    gauss = part.along * part.across - part.twist**2
    return _has_saddles(gauss, total**2)


def _has_saddles(gauss: FloatArray, square: FloatArray) -> bool:
    """Whether K is negative anywhere (n,), by the largest (kappa_1 + kappa_2)^2 (n,)."""
    return bool(np.min(gauss, initial=0.0) < SADDLE * np.max(square, initial=0.0))


def may_self_reflect(body: Surface) -> bool:
    """`self_reflects` of all ground, by points all over a body."""

    def found() -> bool:
        points = points_of_charts(body)
        gauss = gaussian_curvature(body, points)
        return _has_saddles(gauss, curvature_norms(body, points) ** 2 + 2 * gauss)

    return memo(body, "may face itself", found)


def received(
    at: tuple[FloatArray, FloatArray],
    nodes: tuple[FloatArray, FloatArray],
    single: ComplexArray,
    double: ComplexArray,
    k: float,
    *,
    soft: bool,
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

    in_threads(work, len(of[1]), least=4, multiple=1, seconds=EACH * BLOCK * len(single))
    found = np.empty(len(out), dtype=complex)
    found[place] = out[:, 0] + 1j * out[:, 1]
    return found


def received_vectors(
    at: tuple[FloatArray, FloatArray], nodes: tuple[FloatArray, FloatArray], strength: ComplexArray, k: float
) -> ComplexArray:
    """J that points of a conductor receive (m, 3, p) from J dS/4 pi (n, 3, p) at nodes; the others as of `received`."""
    from creeping.field.kernels.bounce import vectors_from_above

    waves = strength.shape[2]
    if not _affordable(at, nodes, VECTOR):
        return np.zeros((len(at[0]), 3, waves), dtype=complex)
    place, points, of = _blocks(at)
    order, sources, others = _blocks(nodes)
    turned = np.moveaxis(strength[order], 0, 2)
    J = np.ascontiguousarray(np.concatenate([turned.real, turned.imag]).transpose(1, 0, 2))
    out = np.empty((len(at[0]), waves, 6))

    def work(part: slice) -> None:
        vectors_from_above(*points, of, sources[0], others, BLOCK, J, k, LOW, part.start, part.stop, out)

    in_threads(work, len(of[1]), least=4, multiple=1, seconds=EACH * VECTOR * BLOCK * len(strength))
    found = np.empty((len(out), 3, waves), dtype=complex)
    found[place] = np.moveaxis(out[..., :3] + 1j * out[..., 3:], 1, 2)
    return found


def _affordable(at: tuple[FloatArray, FloatArray], nodes: tuple[FloatArray, FloatArray], each: float = 1.0) -> bool:
    return 0 < each * len(at[0]) * len(nodes[0]) < MOST_PAIRS


def _blocks(
    pair: tuple[FloatArray, FloatArray],
) -> tuple[IntArray, tuple[FloatArray, FloatArray], tuple[FloatArray, ...]]:
    """An order in which neighbours follow each other; in it points and normals (3, m), and the balls of blocks."""
    from creeping.field.kernels.bounce import balls

    order = cKDTree(pair[0], leafsize=BLOCK).indices
    x, n = (np.ascontiguousarray(part[order].T) for part in pair)
    many = -(-x.shape[1] // BLOCK)
    found = np.empty((many, 3)), np.empty(many), np.empty((many, 3)), np.empty(many)
    balls(x, n, BLOCK, *found)
    return order, (x, n), found
