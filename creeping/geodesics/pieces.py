"""Geodesics of a body with creases, piece by piece: on each of them by the order-8 pair, up to where it ends.

A ray is traced on the smooth F_i of its piece, which goes on a little beyond its creases; where `piece` changes along
it, it has crossed a crease (`creeping.geodesics.piece_walk`). At a joint the ray starts anew on the next piece: J and
J' are continuous there, J'' is not. At an edge it ends, and within REACH of a tip; a ray that has ended stays where it
is, and so does one that cannot go on, far from any edge or tip: it ends without a crease.

Sources: Derivations, R1 and R3.
"""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geodesics.piece_trace import Passages, PieceTrace
from creeping.geodesics.piece_walk import GAP, WINDOW, Walk
from creeping.geodesics.states import WHOLE, windows
from creeping.geometry.piecewise import is_piecewise


def passages(body: Any, states: FloatArray, length: float, *, rtol: float) -> Passages:
    """Where rays from states (n, 6) go on across joints, up to a length; nowhere on a smooth body."""
    if not (is_piecewise(body) and len(states)):
        return Passages(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))
    return trace_pieces(body, states, np.array([length]), rtol=rtol).passages


def with_ends(body: Any, states: FloatArray, times: FloatArray, *, rtol: float, step: float | None) -> FloatArray:
    """Advance states of any number of components to the ascending times (m,): (n, m, the same)."""
    found = trace_pieces(body, states[:, :WHOLE], times, rtol=rtol, step=step)
    if states.shape[1] <= WHOLE:
        return found.states
    late = found.end[:, None] > times
    ends = np.stack([np.where(late, np.inf, found.end[:, None]), np.where(late, -1, found.crease[:, None])], axis=-1)
    return np.concatenate([found.states, ends], axis=-1)


def trace_pieces(
    body: Any,
    states: FloatArray,
    times: FloatArray,
    *,
    rtol: float,
    step: float | None = None,
    beyond: float = 0.0,
) -> PieceTrace:
    """Trace states (n, 6, 10 or 12) to the ascending times (m,).

    Parameters
    ----------
    body : PiecewiseSurface
    states, times
        As for `creeping.geodesics.integrator.trace_states`, which traces them on each piece.
    rtol, step
        As for `DirectFlow`.
    beyond : float, L
        How far a ray that has ended goes on, on its last piece as if it had no end, while that can be.
    """
    walk = Walk(body, states, rtol, step)
    times = np.asarray(times, dtype=float)
    out = np.empty((len(states), len(times), states.shape[1]))
    for stops, wanted in windows(times, GAP * walk.size, WINDOW * walk.size):
        found = walk.window(stops, beyond)
        for place, column in wanted:
            out[:, column] = found[:, place]
    none = np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64)
    rays, moments, creases = (np.concatenate(part) for part in zip(none, *walk.passed, strict=True))
    order = np.lexsort((moments, rays))
    passages = Passages(rays[order], moments[order], creases[order])
    return PieceTrace(out, walk.end, walk.crease, passages)


def trace_to(body: Any, states: FloatArray, lengths: FloatArray, *, rtol: float) -> tuple[FloatArray, FloatArray]:
    """Trace states (n, 6 or 10) to a length (n,) each: (n, the same), and the lengths (n,) at which rays ended, or inf.

    They begin one after the other and arrive together, so that windows and stops serve them all.
    """
    latest = np.array([np.max(lengths, initial=0.0)])
    walk = Walk(body, states, rtol, None, latest - lengths)
    for stops, _ in windows(latest, GAP * walk.size, WINDOW * walk.size):
        walk.window(stops, 0.0)
    return walk.states, walk.end - walk.begin
