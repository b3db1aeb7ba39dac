"""All geodesics between ports on a body: fans from each port, and where they pass the others.

Each fan leaves its port in all directions, with its second Jacobi field J2, J2(0) = 0, J2'(0) = 1; a cell between two
rays and two steps in which another port may lie is searched by Newton's method on polynomials of degree 5 in angle and
arclength. Rays from port i to j > i serve both ways, so what is made of them is reciprocal.

Sources: Derivations, R3 and F25.
"""

from dataclasses import dataclass, replace

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import IntegrationError, SurfaceError
from creeping.geodesics.attenuation import curvature_values
from creeping.geodesics.equations import sharpest_curvature
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import M12, WITH_JACOBI, pack
from creeping.geometry.directions import first_of_equals, tangent_frames
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import Surface, normal, size
from creeping.storage.memory import within_budget

RAYS = 96
"""Rays of a fan, at least;"""
WIDEST = 0.2
"""neighbours part by no more than this, in body sizes, unless there are 1536 rays."""
TURN = 0.2
"""Largest angle by which a ray turns in one step."""
RTOL = 1e-9
"""Relative tolerance of rays. Twice as many rays, half of the gaps and steps, and a tenth of the tolerance find the
same geodesics (``tests/rays/test_port_rays.py``)."""
PER_PAIR = 3
"""Geodesics for which there is place at first, for each pair of ports."""


@dataclass(frozen=True, eq=False)
class PortRays:
    """Geodesics (m,) between n ports, each once, from the lower number to the higher.

    Attributes
    ----------
    body : Surface
    ports, normals : (n, 3), L and 1
    length : float, L
        How far fans go.
    first, second : (m,)
        Numbers of the ports at both ends.
    arclength : (m,), L
    points, directions : (m, 2, 3), L and 1
        Of both ends; directions are unit tangents, towards the second port.
    spreading : (m,), L
        J2, negative beyond an odd number of caustics.
    rates : (m, 2)
        Its slopes at both ends, as seen from the other.
    caustics : (m,)
        Zeros of J2 passed.
    curvature, torsion : (m, 2), 1/L
        kappa_n and p.Hb/|grad F| at both ends.
    bend : (m, 2)
        rho rho'' - (2/3) rho'^2 at both ends.
    integrals : (m, 5), L^(1/3), L^(-1/3), L^(-1/3), L^(1/3), L^(-1/3)
        Of A, of the second order, and of the Gaussian curvature; see `creeping.rays.kernels.port_fans`.
    turning : (m, 2), L^(1/3) over L
        Change of A with the place of each end along b = n x p there, the other end held.
    error : (m,), L
        Of the arclength, by polynomials of lower degree.
    folds, ended : (s, n), L^(1/3)
        Of the s ports that send fans, the first ones: least A at which rays merge close to a port of higher number, and
        of rays that pass close to it after kappa_n has fallen to 0; inf where none do.
    """

    body: Surface
    ports: FloatArray
    normals: FloatArray
    length: float
    first: IntArray
    second: IntArray
    arclength: FloatArray
    points: FloatArray
    directions: FloatArray
    spreading: FloatArray
    rates: FloatArray
    caustics: IntArray
    curvature: FloatArray
    torsion: FloatArray
    bend: FloatArray
    integrals: FloatArray
    turning: FloatArray
    error: FloatArray
    folds: FloatArray
    ended: FloatArray

    def __len__(self) -> int:
        """Number of geodesics."""
        return len(self.first)

    def between(self, sources: BoolArray, receivers: BoolArray) -> "PortRays":
        """Those from some of the n ports (n,) to some, whose numbers stay."""
        some = sources[self.first] & receivers[self.second]
        ends = "first", "second", "points", "directions", "rates", "curvature", "torsion", "bend", "turning"
        whole = "arclength", "spreading", "caustics", "integrals", "error"
        parts: dict[str, Any] = {name: getattr(self, name)[some] for name in (*ends, *whole)}
        pairs = np.outer(sources, receivers)[: len(self.folds)]
        folds, ended = (np.where(pairs, least, np.inf) for least in (self.folds, self.ended))
        return replace(self, folds=folds, ended=ended, **parts)


def departures(normals: FloatArray, angles: FloatArray) -> FloatArray:
    """Unit tangents at angles (r,), radians, in the frame of each normal (n, 3): (n, r, 3)."""
    one, two = tangent_frames(normals)
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(one[:, None] * cosine + two[:, None] * sine)


def rays_between(
    body: Surface, ports: FloatArray, length: float, *, pad: float = 0.0, sources: int | None = None
) -> PortRays:
    """All geodesics between ports up to a length, along which kappa_n > 0.

    Parameters
    ----------
    body : Surface
        Plain and smooth.
    ports : (n, 3), L
        On the body, no two of them the same.
    length : float, L
    pad : float, L
        How far from a caustic a port counts as close to it.
    sources : int, optional
        How many of the ports, the first ones, send fans; all if not given. Pairs of others have no geodesics.

    Raises
    ------
    SurfaceError
        If rays cannot be traced on the body.
    """
    from creeping.rays.kernels.port_fans import GUARD, LANES, START

    normals = normal(body, ports)
    steps = np.maximum(16, np.ceil(length * sharpest_curvature(body) / TURN))
    # of a node two states with their Jacobi fields, and what is carried
    within_budget(600.0 * RAYS * steps, f"fans of length {length:g}", "give a shorter length", asked=length)
    steps = int(steps)
    times = length / steps * np.arange(steps + GUARD + 1, dtype=float)
    senders = len(ports) if sources is None else sources
    within_budget(24.0 * PER_PAIR * (LANES + START + 3) * len(ports) * senders, f"{len(ports)} ports", "ask for fewer")
    folds = np.full((2, senders, len(ports)), np.inf)
    owners, rows = [], []
    counts = _ray_counts(body, ports[:senders], normals[:senders], times)
    for rays in np.unique(counts):
        mine = np.flatnonzero(counts == rays)
        # 60 MB of nodes of fans are held at once
        some = max(1, 400_000 // (int(rays) * len(times)))
        for begin in range(0, len(mine), some):
            numbers = mine[begin : begin + some]
            states = traced_fans(body, ports[numbers], normals[numbers], int(rays), times)
            for number, fan in zip(numbers, states, strict=True):
                owner, found = _passages(body, fan, times[1], ports, int(number), pad, folds[:, number])
                owners.append(np.stack([np.full(len(owner), number), owner]))
                rows.append(found)
    return _assembled(body, ports, length, np.concatenate(owners, axis=1), np.concatenate(rows), folds)


def _ray_counts(body: Surface, ports: FloatArray, normals: FloatArray, times: FloatArray) -> IntArray:
    """Even numbers of rays (n,) with which neighbours stay close, powers of 2 times RAYS, by a few rays of each."""
    few = 16
    sparse = times[:: max(1, len(times) // 24)]
    states = traced_fans(body, ports, normals, few, sparse)
    convex = curvature_values(body, states.reshape(-1, WITH_JACOBI)).reshape(states.shape[:3]) > 0
    creeps = np.logical_and.accumulate(convex, axis=2)
    widest = np.max(np.abs(states[..., M12]), axis=(1, 2), where=creeps, initial=0.0)
    asked = 2 * np.pi * widest / (WIDEST * size(body))
    factor = 2.0 ** np.ceil(np.log2(np.maximum(asked / RAYS, 1.0)))
    return np.asarray(np.minimum(RAYS * factor, 1536), dtype=np.int64)


def traced_fans(body: Surface, ports: FloatArray, normals: FloatArray, rays: int, times: FloatArray) -> FloatArray:
    """Fans of ports (n, 3) at the times: (n, rays, times, 10)."""
    directions = departures(normals, 2 * np.pi * np.arange(rays) / rays)
    points = np.broadcast_to(ports[:, None], directions.shape)
    try:
        states = trace_states(body, pack(points, directions, jacobi=True), times, rtol=RTOL)
    except IntegrationError as error:
        raise SurfaceError(f"no geodesics between ports on {body!r}: {error}") from error
    return states.reshape(len(ports), rays, len(times), -1)


def _passages(
    body: Surface,
    states: FloatArray,
    step: float,
    ports: FloatArray,
    number: int,
    pad: float,
    folds: FloatArray,
) -> tuple[IntArray, FloatArray]:
    """Ports of higher numbers that one fan passes (m,), angle, arclength and lanes there; fills ``folds`` (2, n)."""
    from creeping.rays.kernels.port_fans import BEHIND, LANES, START, passed, port_fan
    from creeping.rays.kernels.quantities import polynomial_matrix

    rays, count = states.shape[:2]
    lanes, last = np.zeros((rays, count - 4 + BEHIND, LANES)), np.zeros(rays, dtype=np.int64)
    with evaluators(body) as parts:
        port_fan(parts.level, parts.level_parameters, step, size(body), 1.0, states, lanes, last)
    axis = int(np.argmax(np.ptp(ports, axis=0)))
    order = np.argsort(ports[:, axis], kind="stable")
    matrices = polynomial_matrix(BEHIND + 1), np.pad(polynomial_matrix(2), ((0, 2), (1, 1)))
    most, ports = PER_PAIR * len(ports) + 64, np.ascontiguousarray(ports)
    while True:
        owner, found = np.empty(most, dtype=np.int64), np.empty((most, LANES + START + 3))
        total = passed(lanes, last, matrices, ports, order, axis, number, pad, folds, owner, found)
        if total <= most:
            break
        most = total
    owner, found = owner[:total], found[:total]

    def alike(i: IntArray, j: IntArray) -> BoolArray:
        turn, later = np.abs(found[i, :2] - found[j, :2]).T
        return np.asarray((np.minimum(turn, rays - turn) < 1e-4) & (later < 1e-4))

    kept = first_of_equals(owner, alike)
    owner, found = owner[kept], found[kept]
    found[:, :2] *= 2 * np.pi / rays, step
    return owner, found


def _assembled(
    body: Surface, ports: FloatArray, length: float, ends: IntArray, rows: FloatArray, folds: FloatArray
) -> PortRays:
    """Geodesics between ports (2, m), in order of pairs and length."""
    from creeping.rays.kernels import port_fans as lane

    order = np.flatnonzero(rows[:, 1] <= length)
    order = order[np.lexsort((rows[order, 1], *ends[::-1, order]))]
    (first, second), rows, normals = ends[:, order], rows[order], normal(body, ports)
    angles, arclength = rows[:, 0], rows[:, 1]
    known, start = rows[:, 2 : 2 + lane.LANES], rows[:, 2 + lane.LANES :]
    one, two = tangent_frames(normals)
    leaving = one[first] * np.cos(angles)[:, None] + two[first] * np.sin(angles)[:, None]
    arriving = known[:, 3:6]
    facing = np.sum(arriving * normals[second], axis=1, keepdims=True)
    arriving = arriving - facing * normals[second]
    arriving /= np.linalg.norm(arriving, axis=1, keepdims=True)
    J2, rate = known[:, lane.LANE.J2], known[:, lane.LANE.rate]
    principal = np.arctan2(J2, size(body) * rate)
    # J2 > 0 for angles from 0 to pi: whole half turns beyond are zeros
    principal = np.where(principal < 0, principal + np.pi, principal)
    caustics = np.maximum(np.rint((known[:, lane.LANE.angle] - principal) / np.pi), 0).astype(np.int64)

    def at_ends(of: int) -> FloatArray:
        return np.stack([start[:, of - lane.LANE.kappa], known[:, of]], axis=1)

    # of the Jacobi field that is 1 at the first end and 0 at the second
    with np.errstate(divide="ignore", invalid="ignore"):
        aside = known[:, lane.LANE.turning] / J2
        turning = np.stack([known[:, lane.LANE.moving] - known[:, lane.LANE.M11] * aside, aside], axis=1)
    return PortRays(
        body=body,
        ports=ports,
        normals=normals,
        length=length,
        first=first,
        second=second,
        arclength=arclength,
        points=ports[np.stack([first, second], axis=1)],
        directions=np.stack([leaving, arriving], axis=1),
        spreading=J2,
        rates=np.stack([known[:, lane.LANE.M11], rate], axis=1),
        caustics=caustics,
        curvature=at_ends(lane.LANE.kappa),
        torsion=at_ends(lane.LANE.T),
        bend=at_ends(lane.LANE.B),
        integrals=known[:, lane.LANE.integrals : lane.LANE.integrals + lane.PARTS],
        turning=turning,
        error=start[:, lane.START],
        folds=folds[0],
        ended=folds[1],
    )
