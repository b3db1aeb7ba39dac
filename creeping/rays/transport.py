"""Rays of many incidences carried by a flow in one call.

Rays of an incidence start in blocks of their own, the last one filled up: a tracer that adapts its step to a block
then gives the same, bit for bit, in whatever company an incidence is computed.

Also here: spreading of rays launched from a shadow line: J, J' and the caustics passed.

    J = c I,  I(t) = I(0) M11(t) + I'(0) M12(t),  I(0) = 1/c,  I'(0) = (J'(0) - (p.grad c))/c,

M the Jacobi matrix that the flow carries along; J(0), J'(0) of `creeping.geodesics.equations.launch_spreading`.

Sources: Derivations, R3 to R5 and R19.
"""

from typing import Protocol

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import launch_spreading
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geodesics.states import M11, M12, M21, M22, P, X, pack
from creeping.geometry.arguments import checked_body, shown
from creeping.geometry.evaluators import speed_of, speed_values
from creeping.geometry.incident import headings
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.kernels.threads import BLOCK
from creeping.shadow.attachment import LaunchPoints


class Flow(Protocol):
    """What carries the rays: a `PhaseMap` or a `DirectFlow`."""

    @property
    def body(self) -> Surface:
        """Body whose flow it is."""
        ...

    @property
    def horizon(self) -> float:
        """Time of one leap."""
        ...

    @property
    def error(self) -> ErrorEstimate | None:
        """Measured error of one leap, None if direct."""
        ...

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance states (n, 12) to ascending times (m,): (n, m, 12)."""
        ...


def checked_flow(flow: Flow) -> None:
    """Refuse what carries no rays.

    Raises
    ------
    InvalidInputError
    """
    fits = all(hasattr(flow, name) for name in ("body", "horizon", "error")) and not isinstance(flow, type)
    if not (fits and callable(getattr(flow, "transport", None))):
        raise InvalidInputError(
            f"flow = {shown(flow)} is no flow; make one by creeping.build_phase_map, DirectFlow or choose_flow"
        )
    checked_body(flow.body, charts=not is_piecewise(flow.body))


def carried(flow: Flow, launch: LaunchPoints, times: FloatArray, *, components: int) -> FloatArray:
    """States (n, rays, m, components) of all rays at the times (m,); what stands for no ray is not to be read."""
    there = launch.there
    n, rays = there.shape
    padded = -(-rays // BLOCK) * BLOCK
    some = np.flatnonzero(there.any(axis=1))
    if not len(some):
        return np.full((n, rays, len(times), components), np.nan)
    points = launch.points
    if padded > rays or not there.all():
        points = np.empty((len(some), padded, 3))
        points[:, :rays] = launch.points[some]
        # places without a ray go along as copies of the first
        filled = np.zeros((len(some), padded), dtype=bool)
        filled[:, :rays] = there[some]
        points[~filled] = np.broadcast_to(points[:, :1], points.shape)[~filled]
    directions = headings(launch.waves[some, None], points)
    states = flow.transport(pack(points, directions, lanes=components), times)
    states = states.reshape(len(some), padded, len(times), components)[:, :rays]
    if len(some) == n:
        return states
    whole = np.full((n, rays, len(times), components), np.nan)
    whole[some] = states
    return whole


def spread(
    body: Surface,
    points: FloatArray,
    tangents: FloatArray | None,
    directions: FloatArray,
    openings: FloatArray,
    states: FloatArray,
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """J, J' (rays, steps) and the rays whose launch point has no speed.

    Parameters
    ----------
    body : Surface
    points, tangents, directions : (rays, 3)
        Of the line, where the rays start, and those of the launch; without a weight the tangents are not needed.
    openings : (rays,), 1/L
        1/R of the wave that launches them, 0 of a plane wave.
    states : (rays, steps, 10 or more)
        What the flow carried from there.
    """
    speed = speed_of(body)
    if speed is None:
        none = np.zeros(len(points), dtype=bool)
        if not np.any(openings):
            # J(0) = 1, J'(0) = 0: the first column of the Jacobi matrix
            return states[..., M11], states[..., M21], none
        a = openings[:, None]
        return states[..., M11] + a * states[..., M12], states[..., M21] + a * states[..., M22], none
    assert tangents is not None
    first = launch_spreading(body, points, directions, tangents, openings)
    x, p = states[..., X], states[..., P]
    c, c0 = speed_values(body, x), speed_values(body, points)
    rate = np.sum(speed.gradient(x) * p, axis=-1)
    stalled = c0 < 1e-12 * float(np.max(c, initial=0.0))
    c0 = np.where(stalled, np.nan, c0)
    i = first[:, 0] / c0
    j = (first[:, 1] - np.sum(speed.gradient(points) * directions, axis=-1)) / c0
    reduced = i[:, None] * states[..., M11] + j[:, None] * states[..., M12]
    reduced_rate = i[:, None] * states[..., M21] + j[:, None] * states[..., M22]
    # J' = c I' + (dc/dt) I with dc/dt = c grad c.p
    return c * reduced, c * reduced_rate + c * rate * reduced, stalled


def zeros_passed(spreading: FloatArray) -> IntArray:
    """Number of sign changes of J up to each step (rays, steps); a zero on a step counts from the next."""
    sign = np.sign(spreading)
    # the last step of each at which J was not 0
    last = np.maximum.accumulate(np.where(sign != 0, np.arange(sign.shape[1]), 0), axis=1)
    sign = np.take_along_axis(sign, last, axis=1)
    flips = np.concatenate([0 * sign[:, :1], sign[:, 1:] * sign[:, :-1]], axis=1) < 0
    return np.cumsum(flips, axis=1)
