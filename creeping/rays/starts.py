"""Where the rays of one fan start: the launch points of the line, and further ones between them.

A position is an arclength that grows along its arc, beyond the curve's length where the arc comes round.

Sources: Derivations, R4.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.shadow.attachment import Arc, LaunchPoints
from creeping.shadow.line import ShadowLine

MANY, FEW = 4096, 32
"""Rays that are enough for a line of several arcs to begin with, or so many for each in the mean: of many holes and
fillets each has as many points as a body's only curve."""


class Starts(NamedTuple):
    """Starts of one incidence in the order of their arcs.

    Attributes
    ----------
    arcs : list of Arc
        Those that hold rays.
    arc : (n,)
    position : (n,), L
    points : (n, 3), L
    state : (n,)
        Codes of `creeping.shadow.status.STATUSES`.
    spacing, arclength : (n,), L
        Length of the line that each stands for, and the position modulo the length of its curve.
    """

    arcs: list[Arc]
    arc: IntArray
    position: FloatArray
    points: FloatArray
    state: IntArray
    spacing: FloatArray
    arclength: FloatArray

    @classmethod
    def of(cls, line: ShadowLine, n_rays: int | None, launch_from: str) -> "Starts":
        """The launch points of a line: so many, or at the spacing of its points; one at least on each arc."""
        arcs = line.arcs(launch_from)
        if n_rays is None:
            shares = [(a.end - a.start) / line.curves[a.curve].length * len(line.curves[a.curve].points) for a in arcs]
            n_rays = sum(max(1, round(share)) for share in shares)
            if len(arcs) > 1:
                n_rays = min(n_rays, max(MANY, FEW * len(arcs)))
        launch = line.launch_points(max(n_rays, len(arcs)), launch_from)
        there = np.flatnonzero(launch.there[0])
        _, arc = np.unique(launch.arc_index[0, there], return_inverse=True)
        position, found = launch.arclength[0, there].copy(), []
        for number in range(int(arc.max(initial=-1)) + 1):
            mine = np.flatnonzero(arc == number)
            curve, spacing = int(launch.curve_index[0, there[mine[0]]]), launch.spacing[0, there[mine]]
            round_ = np.cumsum(np.diff(position[mine], prepend=0.0) < 0)
            position[mine] += round_ * line.curves[curve].length
            closed = bool(launch.closed[0, there[mine[0]]] == 1)
            begin = float(position[mine[0]]) - (0.0 if closed else 0.5 * float(spacing[0]))
            found.append(Arc(curve, begin, begin + float(np.sum(spacing)), closed))
        state = launch.state[0, there].astype(np.int64)
        return cls(
            found, arc, position, launch.points[0, there], state, launch.spacing[0, there], launch.arclength[0, there]
        )

    @classmethod
    def at(cls, line: ShadowLine, arcs: list[Arc], arc: IntArray, position: FloatArray) -> "Starts":
        """Those at positions of the line (n,), (n,)."""
        points, state = np.empty((len(arc), 3)), np.empty(len(arc), dtype=np.int64)
        for number, one in enumerate(arcs):
            mine = np.flatnonzero(arc == number)
            points[mine] = line.curves[one.curve].at(position[mine])
            state[mine] = line.curves[one.curve].state_at(position[mine])
        lengths = np.array([line.curves[one.curve].length for one in arcs])
        return cls(arcs, arc, position, points, state, np.full(len(arc), np.nan), position % lengths[arc])

    def joined(self, more: "Starts") -> tuple["Starts", IntArray]:
        """Both in order, and where each comes from in the one followed by the other."""
        arc, position = np.concatenate([self.arc, more.arc]), np.concatenate([self.position, more.position])
        points, state = np.concatenate([self.points, more.points]), np.concatenate([self.state, more.state])
        order = np.lexsort((position, arc))
        arc, position, spacing = arc[order], position[order], np.empty(len(order))
        for number, one in enumerate(self.arcs):
            mine = arc == number
            s, long = position[mine], one.end - one.start
            # half the way to either neighbour
            ends = [s[-1] - long, *s, s[0] + long] if one.closed else [2 * one.start - s[0], *s, 2 * one.end - s[-1]]
            spacing[mine] = 0.5 * (np.array(ends[2:]) - np.array(ends[:-2]))
        arclength = np.concatenate([self.arclength, more.arclength])[order]
        return Starts(self.arcs, arc, position, points[order], state[order], spacing, arclength), order

    def launch_points(self, line: ShadowLine) -> LaunchPoints:
        """As launch points of one incidence."""
        curve = np.array([self.arcs[k].curve for k in self.arc], dtype=np.int64)
        rows: tuple[Any, ...] = (
            self.points,
            self.arclength,
            curve,
            self.arc.astype(float),
            self.spacing,
            np.array([self.arcs[k].closed for k in self.arc], dtype=float),
            self.state,
        )
        return LaunchPoints(line.wave[None], *(row[None] for row in rows))
