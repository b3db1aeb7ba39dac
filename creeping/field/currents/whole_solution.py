"""Currents of the whole body by its integral equation, asked on two surfaces at once, from those of the expansions.

With w the total field that currents u give inside the body, or its derivative along n, or n x H of a conductor, which
is 0 there if they are right, and K the sums of `creeping.field.currents.node_sums`,

    w(x) = u_inc(x) - (1 - K) u(x)/2,   w(x') = u_inc(x') + (K u)(x')/2,   x' = x - h n,   kh = pi/2
    w(x) - i w(x') = 0:   (1 - K) u (x) + i (K u)(x') = 2 [u_inc(x) - i u_inc(x')]

w(x) = 0 alone leaves waves inside undamped at the body's resonances, which lie close, and GMRES takes many steps. A
wave that comes to the body from inside has w(x') = -i w(x) and none of it is seen; one that leaves has w(x') = i w(x),
twice of it is. So nothing is thrown back, no wave stands inside, and some five steps of GMRES from the expansions'
currents solve the equation. It holds whatever h is: where the body is thin h is less, and where it is thinner than
nodes are apart w(x') is not asked.

Sources: [WY94], [SS86]; Derivations, F32.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.currents.node_sums import sums_at
from creeping.field.currents.second_kind import twice_incident
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.creased import has_edges
from creeping.geometry.kept import kept
from creeping.geometry.quadrature import BodyNodes, body_nodes, node_count, nodes_at
from creeping.geometry.surface import Surface
from creeping.shadow.occlusion import occluded

WINDOW, APART = 0.8, 3.0
"""Width of the windows of `creeping.field.currents.node_sums`, over 1/k and, at most, over the spacing of nodes."""
DEPTH = np.pi / 2
"""Depth of the second surface, over 1/k."""
CLEAR, SHALLOWER = 0.7, 0.6
"""Least distance of its points from all nodes, over the depth, and the factor by which that is less else."""
LEAST_DEPTH = 1.3
"""Least depth, over the spacing of nodes: nearer sums over them err."""
ON_BODY = 5.0
"""Error of solved currents at a point, in what they leave inside."""
RATE, FINE_RATE = 1.5, 2.0
"""Of nodes between which it is solved, over k, and of those where these leave more than WELL; the kernels ask for 2."""
WELL, MORE = 3e-3, 1.25
"""What solved currents may leave inside before nodes are taken closer together, and how many more these must be."""
SHARP = 1.0
"""Kappa_1 + kappa_2, times the spacing of nodes, from which the equation is not that of a smooth place."""
MOST, ASKED = 1e9, 2e10
"""Pairs of nodes up to which the equation is solved, ten seconds of a core or half a minute of a conductor, twice that
next to tips; and those up to which it is if it is asked for, one minute or three."""
ENOUGH, STEPS = 1e-3, 30
"""What is left of the equation, as a share of its right side, and steps at most."""


def pairs_of(body: Surface, wavenumber: float) -> int:
    """Between how many pairs of nodes the equation of a body would be solved by itself; 0 if it would not."""
    pairs = node_count(body, RATE * wavenumber) ** 2
    return pairs if pairs <= MOST and not why_not(body, wavenumber) else 0


def why_not(body: Surface, wavenumber: float) -> str:
    """Why the equation of a body cannot be solved even if it is asked for, or nothing.

    It is of bodies without edges and smooth all over by their own word.
    """
    if has_edges(body):
        return "the body has edges"
    if _is_rough(body):
        return "the body has ground that is not smooth enough"
    nodes = node_count(body, RATE * wavenumber)
    return "" if nodes**2 <= ASKED else f"it needs {nodes} nodes, more than {int(ASKED**0.5)}"


def too_many(body: Surface, wavenumber: float, most: float) -> str:
    """Why nodes are too many to be solved between by so many pairs, or nothing; they are made, and kept.

    Until then their number is that of a mesh that need not close.
    """
    nodes = len(body_nodes(body, RATE * wavenumber).points)
    return f"it needs {nodes} nodes, more than {int(most**0.5)}" if nodes**2 > most else ""


def _is_rough(body: Surface) -> bool:
    """Whether a body says of itself that it is somewhere not smooth enough for rays: what it is there is not known."""
    rough = getattr(body, "non_smooth", None)
    return rough is not None and kept(body, "rough somewhere", lambda: bool(np.any(rough(points_of_charts(body)))))


def solved_on_whole_body(currents: SurfaceCurrents, most: float) -> SurfaceCurrents:
    """Currents at nodes all over the body that satisfy the equation of the boundary, found from these.

    Their change is what a step would add, of what is left of the equation. ``most`` is what pairs of nodes it may take.
    """
    found = _solved(currents, RATE)
    # between nodes so far apart some incidences are not resolved, unless it is the body that asks for as many
    coarse, fine = (node_count(currents.body, rate * currents.wavenumber) for rate in (RATE, FINE_RATE))
    if found.extinction > WELL and fine > MORE * coarse and fine**2 <= most:
        found = _solved(found, FINE_RATE)
    return found


def _solved(currents: SurfaceCurrents, rate: float) -> SurfaceCurrents:
    """The same, the equation solved between nodes for a rate over k."""
    k, body = currents.wavenumber, currents.body
    nodes = body_nodes(body, rate * k)
    coarse = _at_nodes(currents, nodes)
    x, n, nothing = coarse.points, coarse.normals, coarse.values
    window = windows_of(nodes, k, x)
    at, inner = second_surface(body, nodes, k)
    # one sum over the nodes for both surfaces
    both = sums_at(coarse, *(np.concatenate(part) for part in ((x, inner), (n, n[at]), (window, np.zeros(len(at))))))
    wave = twice_incident(coarse, x, n)
    start = sums_at(currents, x, n, window).closed(currents.values, wave).ravel()
    wave[at] -= 1j * twice_incident(coarse, inner, n[at])

    def left_side(values: ComplexArray) -> ComplexArray:
        u = values.reshape(nothing.shape)
        on, under = np.split(both.total(u, np.concatenate([u, nothing[at]])), [len(u)])
        out = u - on
        out[at] += 1j * under
        return out.ravel()

    right = wave.ravel()
    # where nothing can be expanded it is worse than no current
    if not np.linalg.norm(right - left_side(start)) < np.linalg.norm(right):
        start = nothing.ravel()
    operator = LinearOperator((nothing.size, nothing.size), matvec=left_side, dtype=complex)
    found, _ = gmres(operator, right, x0=start, rtol=ENOUGH, restart=STEPS, maxiter=1)
    left = right - left_side(found)
    fine = _at_nodes(currents, body_nodes(body, 2 * k))
    sums = sums_at(coarse, fine.points, fine.normals, windows_of(nodes, k, fine.points))
    values, change = (
        sums.closed(its.reshape(nothing.shape), incident)
        for its, incident in ((found, twice_incident(fine, fine.points, fine.normals)), (left, fine.values))
    )
    return replace(fine, values=values, change=change)


def _at_nodes(currents: SurfaceCurrents, nodes: BodyNodes) -> SurfaceCurrents:
    """No currents, at nodes all over the body."""
    x, d = nodes.points, currents.direction
    nothing = np.zeros((len(x), *currents.values.shape[1:]), dtype=complex)
    lit = lit_ground(currents.body, x, nodes.normals, d)
    return replace(
        currents,
        points=x,
        normals=nodes.normals,
        weights=nodes.weights,
        travel=np.broadcast_to(d, x.shape),
        values=nothing,
        change=nothing,
        lit=lit,
        solved=True,
    )


def lit_ground(body: Surface, points: FloatArray, normals: FloatArray, direction: FloatArray) -> BoolArray:
    """Whether the wave comes straight to points of the body with normals (m, 3): (m,)."""
    lit = np.asarray(normals @ direction < 0)
    lit[lit] = ~occluded(body, points[lit], direction)
    return lit


def solved_at(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray) -> ComplexArray:
    """Field u, du/dn if soft, or J, that solved currents have at points of the body with normals (m, 3): (m, ...).

    It errs by ON_BODY times what they leave inside, of the incident wave.
    """
    window = windows_of(body_nodes(currents.body, 2 * currents.wavenumber), currents.wavenumber, points)
    sums = sums_at(currents, points, normals, window)
    return sums.closed(currents.values, twice_incident(currents, points, normals))


def resolved_at(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray) -> BoolArray:
    """Whether the body is no sharper at points (m, 3) than nodes are apart, unlike next to a tip: (m,)."""
    apart = body_nodes(currents.body, 2 * currents.wavenumber).spacing_at(points)
    with np.errstate(all="ignore"):
        bent = np.abs(nodes_at(currents.body, points, normals).total_curvature)
    return np.asarray(bent * apart < SHARP)


def windows_of(nodes: BodyNodes, wavenumber: float, points: FloatArray) -> FloatArray:
    """Width of the windows of sums over nodes at points of the body (m, 3), L: (m,)."""
    return np.minimum(WINDOW / wavenumber, APART * nodes.spacing_at(points))


def second_surface(body: Surface, nodes: BodyNodes, wavenumber: float) -> tuple[IntArray, FloatArray]:
    """Rows of the nodes that have a point x' beneath them, and these points (m, 3), L."""
    depth, least = np.full(len(nodes.points), DEPTH / wavenumber), LEAST_DEPTH * nodes.spacing_at(nodes.points)
    near = np.arange(len(depth))
    while len(near):
        inner = nodes.points[near] - depth[near, None] * nodes.normals[near]
        near = near[(nodes.nearest(inner) < CLEAR * depth[near]) | (body.level(inner) >= 0)]
        depth[near] *= SHALLOWER
        near = near[depth[near] >= least[near]]
    at = np.flatnonzero(depth >= least)
    return at, nodes.points[at] - depth[at, None] * nodes.normals[at]
