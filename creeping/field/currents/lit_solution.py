"""Currents of lit ground that faces other parts of a body, or lies behind a dip: the integral equation, solved there.

    hard   u = 2 u_inc + 2 int u dG/dn_y dS,   soft   du/dn = 2 du_inc/dn - 2 int du/dn dG/dn_x dS

at the nodes of lit ground, unknown, with the currents of rays as they are. Optics knows neither what other parts of the
body throw on a place, to and fro, nor that light which has just passed a hump is no plane wave behind it: there it is
off by as much as the incident wave. On lit ground the equation is well posed and a few steps of GMRES solve it; dark
ground, where waves creep and errors would spread with them, keeps its expansions.

Sources: [SS86]; Derivations, F32.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from creeping._typing import ComplexArray
from creeping.field.currents.second_kind import received, twice_incident
from creeping.field.currents.whole_body import SurfaceCurrents

WINDOW = 0.8
"""Width of the window of `creeping.field.currents.second_kind`, over 1/k: some distances between nodes."""
MOST = 1e9
"""Pairs of a lit node and another up to which the equation is solved: some ten seconds of one core."""
ENOUGH, STEPS = 0.02, 12
"""What is left of the first step's change, and steps at most."""


def solvable(currents: SurfaceCurrents) -> bool:
    """Whether the equation of lit ground costs little enough."""
    lit = int(currents.lit.sum())
    return currents.boundary.kind in ("soft", "hard") and 0 < lit * len(currents.lit) <= MOST


def solved_on_lit_ground(currents: SurfaceCurrents) -> SurfaceCurrents:
    """Currents of a soft or hard body whose lit nodes satisfy the equation, those of its rays unchanged."""
    at = currents.lit
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
