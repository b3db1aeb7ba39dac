"""The current at points of a conductor, and around them, by a step of its integral equation from solved currents.

    J = 2 n x H_inc + 2 n x int grad_x G x J dS_y,   J under the integral that of nodes, next to x that of x

It is taken where ground is lit, as by `creeping.field.currents.second_kind` for scalar fields; on dark ground what it
would change is what J is off by. Around a point, where its divergence is asked for, as much of it is taken as there.

Sources: Derivations, F32.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.second_kind import step_error, stepped, with_step
from creeping.field.served import Served


def by_a_step(
    currents: ConductorCurrents,
    served: list[Served],
    total: ComplexArray,
    places: tuple[FloatArray, FloatArray, FloatArray],
    left: FloatArray,
) -> tuple[list[Served], ComplexArray]:
    """J of each polarisation at points (n,), and at them and four around each (5n, 3, p), by a step from these.

    ``places`` are the points and those around them (5n, 3), L, their normals, and the share (5n,) that is lit ground;
    ``left`` (p,) is what the currents leave inside of each incident wave.
    """
    points, normals, share = places
    count = len(points) // 5
    known = np.all([np.isfinite(one.values).all(axis=1) for one in served], axis=0)
    around = np.tile(known & (share[:count] > 0), 5)
    rows = np.flatnonzero(np.where(np.arange(5 * count) < count, np.tile(known, 5), around))
    at = rows[rows < count]
    change = np.zeros_like(total)
    change[rows] = stepped(currents, points[rows], normals[rows], total[rows]) - total[rows]
    found, moved = [], total.copy()
    for i, own in enumerate(step_error(currents, left)):
        one, taken = with_step(served[i], at, change[at, :, i], share[at], float(own), solved=True)
        part = np.zeros(count)
        part[at] = taken
        moved[:, :, i] += np.tile(part, 5)[:, None] * change[:, :, i]
        found.append(one)
    return found, moved
