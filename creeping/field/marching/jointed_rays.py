"""Rays of a body with joints at nodes of their own: evenly spread between joints, at each of which two nodes stand.

Between the states of a common lattice and those at joints a ray is the cubic of both ends, x with p and J with J'; each
stretch is on one piece, whose curvatures hold up to both its ends. A ray that has ended at an edge or a tip stays
where it is.

Sources: Derivations, R1, F22 and F30.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from creeping._typing import Any, FloatArray, IntArray
from creeping.field.marching.profile import LEAST_NODES
from creeping.geodesics.own_times import trace_own
from creeping.geodesics.pieces import trace_pieces
from creeping.geodesics.states import M11, M21, WITH_JACOBI, P, X
from creeping.geometry.creased import pieces_of
from creeping.geometry.quadrature import BodyNodes, nodes_at
from creeping.geometry.surface import normal, project

OWN = 1e-12
"""Relative tolerance of the way from the lattice to a joint."""


class JointedRays(NamedTuple):
    """Rays at nodes of their own.

    Attributes
    ----------
    times : (rays, m), L
        Ascending from 0; the time at which a ray crosses a joint stands twice.
    states : (rays, m, 10)
        x, p and the Jacobi fields' J and J' in their lanes; the others are not there.
    pieces : (rays, m) of int
        On which each node is.
    ends : (rays,), L
        Time at which a ray has ended, inf if it has not.
    """

    times: FloatArray
    states: FloatArray
    pieces: IntArray
    ends: FloatArray


def jointed_rays(body: Any, states: FloatArray, times: FloatArray, *, rtol: float) -> JointedRays:
    """Trace states (rays, 10) through a lattice of times (k,), L, from 0 on."""
    trace = trace_pieces(body, states, times, rtol=rtol)
    found = [_ray(body, times, trace.states[ray], *_passed(trace, ray), rtol) for ray in range(len(states))]
    count = max(sum(stretch.nodes for stretch in ray) for ray in found)
    own, lanes, on = np.empty((len(found), count)), np.zeros((len(found), count, WITH_JACOBI)), []
    for row, ray in enumerate(found):
        # the last stretch has what others have more
        spare = count - sum(stretch.nodes for stretch in ray)
        ray[-1] = ray[-1]._replace(nodes=ray[-1].nodes + spare)
        own[row] = np.concatenate([stretch.at for stretch in ray])
        lanes[row] = np.concatenate([stretch.states() for stretch in ray])
        on.append(np.repeat([stretch.piece for stretch in ray], [stretch.nodes for stretch in ray]))
    return JointedRays(own, lanes, np.stack(on), trace.end)


def piece_nodes(body: Any, points: FloatArray, pieces: IntArray) -> BodyNodes:
    """Nodes of weight 1 at points (n, 3), L, put onto their pieces (n,)."""
    x, n = np.empty_like(points), np.empty_like(points)
    entries = np.empty((len(points), 6))
    for number in np.unique(pieces):
        mine, piece = pieces == number, pieces_of(body)[number]
        x[mine] = project(piece, points[mine])
        n[mine] = normal(piece, x[mine])
        entries[mine] = nodes_at(piece, x[mine], n[mine]).hessians
    return BodyNodes(x, n, np.ones(len(points)), entries, 0.0)


class _Stretch(NamedTuple):
    """A ray between two joints: knots (n,) and states there (n, 10), its piece, and how many nodes it gets."""

    knots: FloatArray
    values: FloatArray
    piece: int
    nodes: int
    still: bool = False

    @property
    def at(self) -> FloatArray:
        """Times of its nodes."""
        return np.linspace(self.knots[0], self.knots[-1], self.nodes)

    def states(self) -> FloatArray:
        """States at the nodes (nodes, 10)."""
        if self.still:
            return np.repeat(self.values[:1], self.nodes, axis=0)
        out = np.zeros((self.nodes, WITH_JACOBI))
        curve = CubicHermiteSpline(self.knots, self.values[:, X], self.values[:, P])
        tube = CubicHermiteSpline(self.knots, self.values[:, M11], self.values[:, M21])
        out[:, X], out[:, P] = curve(self.at), curve(self.at, 1)
        out[:, P] /= np.linalg.norm(out[:, P], axis=1, keepdims=True)
        out[:, M11], out[:, M21] = tube(self.at), tube(self.at, 1)
        return out


def _passed(trace: Any, ray: int) -> tuple[FloatArray, float]:
    """Times at which a ray crosses joints, and its end."""
    mine = trace.passages.ray == ray
    return trace.passages.travel_time[mine], float(trace.end[ray])


def _ray(
    body: Any, times: FloatArray, states: FloatArray, joints: FloatArray, end: float, rtol: float
) -> list[_Stretch]:
    """Stretches of a ray with states (k, 10) at a lattice of times, across joints at times (j,)."""
    last = min(float(times[-1]), end)
    marks = np.unique(np.concatenate([[0.0], joints[(joints > 0) & (joints < last)], [last]]))
    spacing = times[1] - times[0]
    found: list[_Stretch] = []
    before = states[0]
    for low, high in pairwise(marks):
        inside = (times > low + 1e-9 * spacing) & (times < high - 1e-9 * spacing)
        known = np.concatenate([[before], states[inside]])
        knots = np.concatenate([[low], times[inside]])
        middle = min(0.5 * (low + min(high, knots[1] if len(knots) > 1 else high)), end)
        ahead = known[0, X] + (middle - low) * known[0, P]
        piece = int(np.asarray(body.piece(ahead[None]))[0])
        if high < times[-1]:
            step = np.array([high - knots[-1]])
            after = trace_own(pieces_of(body)[piece], known[-1:, :WITH_JACOBI], step, rtol=min(rtol, OWN))[0]
        else:
            after = states[-1]
        known, knots = np.concatenate([known, [after]]), np.append(knots, high)
        nodes = max(LEAST_NODES, int(np.ceil((high - low) / spacing)) + 1)
        found.append(_Stretch(knots, known, piece, nodes))
        before = after
    if last < times[-1]:
        nodes = max(LEAST_NODES, int(np.ceil((times[-1] - last) / spacing)) + 1)
        found.append(_Stretch(np.array([last, times[-1]]), np.stack([before, before]), found[-1].piece, nodes, True))
    return found
