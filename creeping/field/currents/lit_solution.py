"""Currents of lit ground that faces other parts of a body, or lies behind a dip: the integral equation, solved there.

    hard   u = 2 u_inc + 2 int u dG/dn_y dS,   soft   du/dn = 2 du_inc/dn - 2 int du/dn dG/dn_x dS

at the nodes of lit ground, unknown, with the currents of rays as they are; and at those of dark ground to which no ray
comes, since part of the shadow line launches none. Optics knows neither what other parts of the
body throw on a place, to and fro, nor that light which has just passed a hump is no plane wave behind it: there it is
off by as much as the incident wave. On lit ground the equation is well posed and a few steps of GMRES solve it; dark
ground, where waves creep and errors would spread with them, keeps its expansions.

Sources: [SS86]; Derivations, F32.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres
from scipy.spatial import cKDTree

from creeping._typing import Any, ComplexArray
from creeping.field.currents.second_kind import received, twice_incident
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.quadrature import body_nodes

WINDOW = 0.8
"""Width of the window of `creeping.field.currents.second_kind`, over 1/k: some distances between nodes."""
MOST = 1e9
"""Pairs of a lit node and another up to which the equation is solved: some ten seconds of one core."""
ENOUGH, STEPS = 0.02, 12
"""What is left of the first step's change, and steps at most."""
AROUND, BARE = 1.5, 0.7
"""Distance, over 1/k, within which nodes cover a place, and the share of its area below which that is bare."""
DARK = -0.3
"""n.d from which ground may be dark."""


def solvable(currents: SurfaceCurrents) -> bool:
    """Whether the equation of lit ground costs little enough."""
    lit = int(currents.lit.sum())
    return currents.boundary.kind in ("soft", "hard") and 0 < lit * len(currents.lit) <= MOST


def solved_on_lit_ground(currents: SurfaceCurrents) -> SurfaceCurrents:
    """Currents of a soft or hard body whose lit and bare nodes satisfy the equation, those of its rays unchanged."""
    currents = with_bare_ground(currents)
    at = currents.even
    points, normals, values = currents.points[at], currents.normals[at], currents.values[at]
    window = WINDOW / currents.wavenumber
    rest, own = received(currents, points, normals, window)
    wrong = twice_incident(currents, points, normals) + rest + (own - 1) * values
    part = currents.part(at)

    def left_side(change: ComplexArray) -> ComplexArray:
        return np.asarray((1 - own) * change - received(replace(part, values=change), points, normals, window)[0])

    count = len(values)
    operator = LinearOperator((count, count), matvec=left_side, dtype=complex)
    change, _ = gmres(operator, wrong, rtol=ENOUGH, restart=STEPS, maxiter=1)
    found = currents.values.copy()
    found[at] = values + change
    return replace(currents, values=found, solved=True)


def with_bare_ground(currents: SurfaceCurrents) -> SurfaceCurrents:
    """The same with nodes, of no current yet, where the others leave dark ground out."""
    k, d = currents.wavenumber, currents.direction
    nodes = body_nodes(currents.body, 2 * k)
    dark = np.flatnonzero(nodes.normals @ d > DARK)
    if not len(dark):
        return replace(currents, bare=np.zeros(len(currents.lit), dtype=bool))
    all_of_it, present = cKDTree(nodes.points), cKDTree(currents.points)
    around = [
        np.array([weights[near].sum() for near in tree.query_ball_point(nodes.points[dark], AROUND / k)])
        for tree, weights in ((present, currents.weights), (all_of_it, nodes.weights))
    ]
    covered = around[0] / around[1]
    few = covered < BARE
    at = dark[few]
    nothing = np.zeros(len(at), dtype=currents.values.dtype)
    more: dict[str, Any] = {
        "points": nodes.points[at],
        "normals": nodes.normals[at],
        "weights": nodes.weights[at] * (1 - covered[few]),
        "travel": np.broadcast_to(d, (len(at), 3)),
        "values": nothing,
        "change": nothing,
        "lit": np.zeros(len(at), dtype=bool),
    }
    both: dict[str, Any] = {name: np.concatenate([getattr(currents, name), values]) for name, values in more.items()}
    return replace(currents, **both, bare=np.arange(len(both["lit"])) >= len(currents.lit))
