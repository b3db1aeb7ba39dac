"""Profiles of the rays of a fan: curvatures, twist and spreading, and those of the lit side behind the shadow line.

    kappa_n = p.Hp/|grad F|,   kappa_t = b.Hb/|grad F|,   tau = b.Hp/|grad F|,   b = n x p
    J'' + K J = 0,   J(0) = 1,   J'(0) = 0,   V = K/2 (+ (J'/2J)^2 on the lit side),   K = kappa_n kappa_t - tau^2

Lambda = D y/y_s is that of the incident wave where it drives the layer, behind that of Fock's, a function of xi alone:

    lit      Lambda = d.b/(d.p - 1)
    shadow   Lambda = [kappa_n^(-2/3) dA/dsigma_perp + tau_1/kappa_1]/J,   A = int kappa_n^(2/3) ds

Both are tau/kappa_n on the line. It fades out where kappa_n falls below FLAT of that on the line, for good: there no
single xi tells the wave; and it levels off at 1, where J falls to 0. Rays are traced both ways from the shadow line,
beyond detachment and across joints too: marching goes on where creeping modes end.

Also here: rays of a body with joints at nodes of their own: evenly spread between joints, at each of which two nodes
stand.

Between the states of a common lattice and those at joints a ray is the cubic of both ends, x with p and J with J'; each
stretch is on one piece, whose curvatures hold up to both its ends. A ray that has ended at an edge or a tip stays
where it is.

Sources: Derivations, R1, R3, F22 and F30.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from creeping._typing import Any, FloatArray, IntArray
from creeping.field.arguments import checked_plain
from creeping.field.boundary import Boundary
from creeping.field.marching.profile import LEAST_NODES, RayProfiles
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.shed_wave import smoothstep
from creeping.geodesics.attenuation import trace_own
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.pieces import trace_pieces
from creeping.geodesics.states import M11, M21, WITH_JACOBI, P, X, pack
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.piecewise import is_piecewise, pieces_of
from creeping.geometry.quadrature import BodyNodes, nodes_at
from creeping.geometry.surface import normal, project, size
from creeping.rays.fan import RayFan
from creeping.rays.strips import Strip, strip_rows

FLAT = 0.3
"""Share of the first curvature at which Lambda begins to fade."""


def fan_profiles(fan: RayFan, boundary: Boundary) -> RayProfiles:
    """Profiles of all rays of a fan, from as far back on the lit side as the march starts.

    Parameters
    ----------
    fan : RayFan
        Of a body without a speed.
    boundary : Boundary
        Whose admittance is taken along, if it varies.

    Returns
    -------
    RayProfiles
        In the order of the fan's rays.

    Raises
    ------
    InvalidInputError
        If the body has a speed, or edges.
    """
    checked_plain(fan.body, edgeless="marching along rays of a fan")
    body = fan.body
    x0, p0 = fan.points[:, 0], fan.directions[:, 0]
    least = 1 / size(body)
    kappa = normal_curvature(body, x0, p0)
    jointed = is_piecewise(body)
    # beyond a joint rays may be straighter than their neighbours
    typical = np.max if jointed else np.median
    # the march starts at 75 degrees at most
    back = float(typical(np.radians(80.0) / np.maximum(kappa, least)))
    sharpest = max(float(np.max(np.abs(fan.curvature))), least)
    ways = []
    for way, sense in ((back, -1.0), (fan.length, 1.0)):
        # the body turns by 0.03 between two nodes where it is most curved
        count = int(np.clip(np.ceil(way * sharpest / 0.03), 40, 2000))
        times = np.linspace(0, way, count + 1)
        begin = pack(x0, sense * p0, jacobi=True)
        if jointed:
            found = jointed_rays(body, begin, times, rtol=1e-10)
            own, states = found.times, found.states
            nodes = piece_nodes(body, states[..., X].reshape(-1, 3), found.pieces.ravel())
        else:
            states = trace_states(body, begin, times, rtol=1e-10)
            own, x = np.broadcast_to(times, states.shape[:2]), states[..., X].reshape(-1, 3)
            nodes = nodes_at(body, x, normal(body, x))
        ways.append(_along(fan, boundary, sense * own, nodes, states, sense))
    first, second = ways
    whole = {name: np.concatenate([first[name][:, :0:-1], second[name]], axis=1) for name in first}
    gauss = whole["curvature"] * whole["transverse"] - whole["torsion"] ** 2
    bent = (whole["rate"] / (2 * np.maximum(np.abs(whole["spreading"]), 1e-9))) ** 2
    # bounded; in the shadow it belongs to the spreading of beams
    bent = np.where(whole["s"] < 0, np.minimum(bent, 6 / size(body) ** 2), 0.0)
    return RayProfiles(
        **{name: whole[name] for name in ("s", "curvature", "transverse", "spreading", "torsion", "phase", "climb")},
        admittance=whole.get("admittance"),
        lean=_lean(fan, whole),
        potential=gauss / 2 + bent,
    )


def _along(
    fan: RayFan, boundary: Boundary, s: FloatArray, nodes: BodyNodes, states: FloatArray, sense: float
) -> dict[str, Any]:
    """What the states of rays (rays, steps, 10) say, each (rays, steps)."""
    d, shape = fan.line.direction, states.shape[:2]
    x, p = nodes.points, sense * states[..., P].reshape(-1, 3)
    b = np.cross(nodes.normals, p)
    away = x.reshape(*shape, 3) - fan.points[:, :1]
    found: dict[str, Any] = {
        "s": s,
        "curvature": nodes.curvature(p),
        "transverse": nodes.curvature(b),
        "torsion": nodes.twist(p),
        "spreading": states[..., M11],
        "rate": states[..., M21],
        "phase": away @ d - s,
        "climb": nodes.normals @ d,
        "aside": b @ d,
        "forward": p @ d,
    }
    if boundary.varies:
        found["admittance"] = boundary.at(x).admittance
    return {name: np.asarray(values).reshape(shape) for name, values in found.items()}


def _lean(fan: RayFan, whole: dict[str, Any]) -> FloatArray:
    """Lambda (rays, m)."""
    s, kappa, J = whole["s"], whole["curvature"], whole["spreading"]
    # rays may have nodes of their own, but as many of them behind the line
    start = int(np.argmax(s[0] == 0))
    lit, shadow = slice(0, start), slice(start + 1, None)
    on_line = whole["torsion"][:, start] / kappa[:, start]
    out = np.zeros(kappa.shape)
    # 1 - d.p without cancellation
    slope = whole["climb"] ** 2 + whole["aside"] ** 2
    out[:, lit] = (-whole["aside"] * (1 + whole["forward"]) / np.maximum(slope, 1e-300))[:, lit]
    out[:, start] = on_line
    # 1/J, but where |J| < 0.1
    inverse = J / (J**2 + 0.01 * np.exp(-((10 * J) ** 2)))
    late = np.repeat(on_line[:, None], s.shape[1] - start - 1, axis=1)
    for strip, mine in zip(fan_strips(fan), wide_rows(fan), strict=True):
        at = np.minimum(s[mine][:, shadow], strip.times[-1])
        change = _attenuation_slopes(strip, at)
        late[mine] += change / np.maximum(kappa[mine][:, shadow], 1e-9) ** (2 / 3)
    share = np.minimum.accumulate(smoothstep(kappa[:, shadow] / kappa[:, start, None], 0.0, FLAT), axis=1)
    out[:, shadow] = late * inverse[:, shadow] * share
    return np.asarray(out / (1 + out**4) ** 0.25)


def wide_rows(fan: RayFan) -> list[IntArray]:
    """Rows of the fan's rays on each of its strips that have several."""
    return [mine for mine in strip_rows(fan) if len(mine) > 1]


def _attenuation_slopes(strip: Strip, times: FloatArray) -> FloatArray:
    """dA/dsigma_perp of the rays of a strip at times of their own (rays, m), sigma_perp along b."""
    sigma = strip.positions
    slopes = strip.slopes(np.repeat(sigma, times.shape[1]), times.ravel())[:, 14].reshape(times.shape)
    along = strip.slopes(sigma, np.zeros(len(sigma)))[:, :3]
    b = np.cross(strip.first_normals(sigma), strip.rays.directions[:, 0])
    return np.asarray(slopes / np.sum(along * b, axis=1)[:, None])


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
    joints = [trace.passages.travel_time[trace.passages.ray == ray] for ray in range(len(states))]
    each = zip(trace.states, joints, trace.end.tolist(), strict=True)
    found = [_ray(body, times, *one, rtol) for one in each]
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
            after = trace_own(pieces_of(body)[piece], known[-1:, :WITH_JACOBI], step, rtol=min(rtol, 1e-12))[0]
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
