"""Currents of lit ground that faces other parts of a body, or lies behind a dip: the integral equation, solved there.

    (1 - K_ee) u_e = 2 u_inc + K_er u_r,   of a conductor  (1 - K_ee) J_e = 2 n x H_inc + K_er J_r

u_e at the nodes of lit ground, and of dark ground to which no ray comes since part of the shadow line launches none;
u_r at those of rays, as they are; K the sums of `creeping.field.currents.node_sums`, du/dn for u of a soft body.
Optics knows neither what other parts of the body throw on a place, to and fro, nor that light which has just passed a
hump is no plane wave behind it: there it is off by as much as the incident wave. On lit ground the equation is well
posed and a few steps of GMRES solve it; dark ground with rays, where waves creep and errors would spread with them,
keeps its expansions.

Sources: [SS86]; Derivations, F32.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.currents.node_sums import sums_at
from creeping.field.currents.second_kind import twice_incident
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.creased import is_creased
from creeping.geometry.quadrature import body_nodes
from creeping.kernels.threads import in_threads

WINDOW, APART = 0.8, 3.0
"""Width of the window of `creeping.field.currents.node_sums`, over 1/k and, at most, over the spacing of nodes."""
KINDS = ("soft", "hard", "conductor")
"""Boundaries of which it is solved."""
MOST = 1e9
"""Pairs of a lit node and another up to which the equation is solved: some ten seconds of one core."""
ENOUGH, STEPS = 0.02, 12
"""What is left of the first step's change, and steps at most."""
AROUND, BARE = 1.5, 0.7
"""Distance, over 1/k, within which nodes cover a place, and the share of its area below which that is bare."""
EACH = 6e-10
"""Seconds of one pair when areas are added up, about."""


def solvable(currents: SurfaceCurrents) -> bool:
    """Whether the equation of lit ground is that of the body, without joints, and costs little enough."""
    pairs = int(currents.lit.sum()) * len(currents.lit)
    return currents.boundary.kind in KINDS and not is_creased(currents.body) and 0 < pairs <= MOST


def solved_on_lit_ground(currents: SurfaceCurrents) -> SurfaceCurrents:
    """Currents whose lit and bare nodes satisfy the equation of the boundary, those of its rays unchanged."""
    currents = with_bare_ground(currents)
    at = currents.even
    points, normals, values = currents.points[at], currents.normals[at], currents.values[at]
    window = min(WINDOW / currents.wavenumber, APART * body_nodes(currents.body, 2 * currents.wavenumber).spacing)
    received = sums_at(currents, points, normals, window).total(currents.values, values)
    wrong = twice_incident(currents, points, normals) + received - values
    sums = sums_at(currents.part(at), points, normals, window)

    def left_side(change: ComplexArray) -> ComplexArray:
        its = change.reshape(values.shape)
        return np.asarray(its - sums.total(its, its)).ravel()

    operator = LinearOperator((values.size, values.size), matvec=left_side, dtype=complex)
    change, _ = gmres(operator, wrong.ravel(), rtol=ENOUGH, restart=STEPS, maxiter=1)
    found = currents.values.copy()
    found[at] = values + change.reshape(values.shape)
    return replace(currents, values=found, solved=True)


def with_bare_ground(currents: SurfaceCurrents) -> SurfaceCurrents:
    """The same with nodes, of no current yet, where the others leave ground out: dark, or hidden by other parts."""
    nodes, reach = body_nodes(currents.body, 2 * currents.wavenumber), AROUND / currents.wavenumber
    covered = _area(nodes.points, currents.points, currents.weights, reach)
    covered /= _area(nodes.points, nodes.points, nodes.weights, reach)
    at = covered < BARE
    nothing = np.zeros((int(at.sum()), *currents.values.shape[1:]), dtype=currents.values.dtype)
    more: dict[str, Any] = {
        "points": nodes.points[at],
        "normals": nodes.normals[at],
        "weights": nodes.weights[at] * (1 - covered[at]),
        "travel": np.broadcast_to(currents.direction, (len(nothing), 3)),
        "values": nothing,
        "change": nothing,
        "lit": np.zeros(len(nothing), dtype=bool),
    }
    both: dict[str, Any] = {name: np.concatenate([getattr(currents, name), values]) for name, values in more.items()}
    return replace(currents, **both, bare=np.arange(len(both["lit"])) >= len(currents.lit))


def _area(points: FloatArray, nodes: FloatArray, weights: FloatArray, reach: float) -> FloatArray:
    """Area (m,), L^2, that the nodes (n, 3) within ``reach`` of points (m, 3) stand for."""
    from creeping.field.kernels.second_kind import area_within

    x, y = np.ascontiguousarray(points.T), np.ascontiguousarray(nodes.T)
    out = np.empty(len(points))

    def work(part: slice) -> None:
        area_within(x, y, weights, reach, part.start, part.stop, out)

    in_threads(work, len(points), least=64, multiple=1, seconds=EACH * len(nodes))
    return out
