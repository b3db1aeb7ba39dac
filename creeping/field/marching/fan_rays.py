"""Profiles of the rays of a fan: their curvatures and spreading, and those of the lit ground behind the shadow line.

    kappa_n = p.Hp/|grad F|,   kappa_t = b.Hb/|grad F|,   b = n x p,   J'' + K J = 0,   J(0) = 1,   J'(0) = 0

Rays are traced both ways from the shadow line, beyond detachment too: marching goes on where creeping modes end.

Sources: Derivations, R1 and R3.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.field.arguments import checked_plain
from creeping.field.marching.profile import RayProfiles
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import M11, P, X, pack
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan

TURN = 0.03
"""Radians that the body turns by between two nodes, at the largest curvature along rays."""
FEWEST, MOST = 40, 2000
"""Nodes of either way."""
BEHIND = np.radians(80.0)
"""Angle by which rays turn behind the line, in the median: the march starts at 75 degrees at most."""
RTOL = 1e-10


def fan_profiles(fan: RayFan, *, length: float | None = None, behind: float | None = None) -> RayProfiles:
    """Profiles of all rays of a fan.

    Parameters
    ----------
    fan : RayFan
        Of a body without a speed.
    length : float, L, optional
        Of the rays; that of the fan if not given.
    behind : float, L, optional
        How far the profiles go back on lit ground.

    Returns
    -------
    RayProfiles
        In the order of the fan's rays.

    Raises
    ------
    InvalidInputError
        If the body has a speed, or edges, joints or tips.
    """
    checked_plain(fan.body, smooth="marching along rays of a fan")
    body, x, p = fan.body, fan.points[:, 0], fan.directions[:, 0]
    kappa = normal_curvature(body, x, p)
    least = 1 / size(body)
    back = float(np.median(BEHIND / np.maximum(kappa, least))) if behind is None else behind
    ahead = fan.length if length is None else length
    sharpest = max(float(np.max(np.abs(fan.curvature))), least)
    ways = []
    for way, sense in ((back, -1.0), (ahead, 1.0)):
        count = int(np.clip(np.ceil(way * sharpest / TURN), FEWEST, MOST))
        times = np.linspace(0, way, count + 1)
        states = trace_states(body, pack(x, sense * p, jacobi=True), times, rtol=RTOL)
        ways.append((sense * times, *_of_states(fan, states)))
    (s0, *first), (s1, *second) = ways
    s = np.concatenate([s0[:0:-1], s1])
    joined = [np.concatenate([a[:, :0:-1], b], axis=1) for a, b in zip(first, second, strict=True)]
    return RayProfiles(np.tile(s, (len(x), 1)), *joined)


def _of_states(fan: RayFan, states: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """kappa_n, kappa_t and J (rays, steps)."""
    x, p = states[..., X].reshape(-1, 3), states[..., P].reshape(-1, 3)
    gradient = fan.body.gradient(x)
    n = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
    shape = states.shape[:2]
    along = normal_curvature(fan.body, x, p).reshape(shape)
    across = normal_curvature(fan.body, x, np.cross(n, p)).reshape(shape)
    return along, across, states[..., M11]
