"""Where currents are integrated: nodes all over the body for the lit side, and along creeping rays for the shadow.

    lit      quadrature of the body (`creeping.geometry.quadrature`), its nodes from the light to xi = 0.6
    shadow   dS = |J| ds dsigma_perp on the rays of a fan, dsigma_perp = |b.dx0| across them

A current goes like |J|^(-1/2), so that its caustics on the body cost nothing in ray coordinates. From xi = 0 to 0.6
behind the line both parts have a share, W(xi; 0, 0.6) that of the rays, W a smooth step.

Also here: the wave of a scalar boundary at nodes of the lit side and of creeping rays.

On rays it is the sum of creeping modes, or, where the admittance varies and there are none, the marched wave

    u = y |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

of `creeping.field.marching.fan_waves`; then what is of second order has u's phase and the size of its error.

Sources: [LK59]; Derivations, F16 and F22.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.boundary import Boundary, fock_scale, slowest_decay
from creeping.field.currents.lit import Ground, lit_currents
from creeping.field.marching.fan_waves import fan_waves, march_alone, marchable, spread_out
from creeping.field.waves.shed_wave import smoothstep
from creeping.field.waves.surface import surface_waves
from creeping.geometry.directions import tangent_frames
from creeping.geometry.piecewise import is_piecewise, piece_ahead, pieces_of
from creeping.geometry.quadrature import BodyNodes, body_nodes, nearest_points, nodes_at
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.fan import RayFan, launch
from creeping.rays.quantities import SHARPEST, STEEPEST, RayPoints
from creeping.rays.reach import ray_length
from creeping.rays.strips import ray_points
from creeping.shadow.attachment import occluded
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import PointState

PENUMBRA = (0.0, 0.6)
"""xi over which the rays take over from the lit side's nodes."""
TAKEN_OVER = 2 * PENUMBRA[1]
"""xi by m at the start of a ray beyond which it has taken over: twice the end, for m at its points is another."""
RAYS, STEPS = 4.0, 5.0
"""Rays a wavelength along the line, and steps a wavelength along them."""
STEP = 1e-4
"""Distance over which curvature is differenced, in body sizes."""


@dataclass(frozen=True, eq=False)
class LitNodes:
    """Nodes of the lit side with what its currents ask for.

    Attributes
    ----------
    points, normals : (n, 3), L and 1
    weights : (n,), L^2
        Of the quadrature, times the share of the lit side.
    cosine : (n,)
        c = -n.d.
    along, across : (n,), 1/L
        Normal curvatures along and across the plane of incidence.
    rate, bend : (n,)
        rho' and rho rho'' of rho = 1/kappa_a along it.
    axes : (n, 3)
        Unit tangents a in the plane of incidence, with d.a >= 0.
    twist : (n,), 1/L
        Entry of the shape operator between a and b = n x a.
    """

    points: FloatArray
    normals: FloatArray
    weights: FloatArray
    cosine: FloatArray
    along: FloatArray
    across: FloatArray
    rate: FloatArray
    bend: FloatArray
    axes: FloatArray
    twist: FloatArray

    @property
    def ground(self) -> Ground:
        """What the currents depend on."""
        return Ground(self.cosine, self.along, self.across, self.twist, self.rate, self.bend)


@dataclass(frozen=True, eq=False)
class RayNodes:
    """Nodes along creeping rays.

    Attributes
    ----------
    fan : RayFan
        The rays.
    rows : (n,) of int
        Of each node's ray in it.
    rays : RayPoints
        (n,)
    normals : (n, 3)
    weights : (n,), L^2
        |J| ds dsigma_perp, times the share of the rays.
    twist : (n,), 1/L
        Entry of the shape operator between p and n x p, the torsion of the rays.
    """

    fan: RayFan
    rows: IntArray
    rays: RayPoints
    normals: FloatArray
    weights: FloatArray
    twist: FloatArray

    def __getitem__(self, index: BoolArray) -> "RayNodes":
        """Some of the nodes."""
        parts = (self.rows[index], self.rays[index], self.normals[index], self.weights[index], self.twist[index])
        return RayNodes(self.fan, *parts)


def plane_of_incidence(nodes: BodyNodes, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """c = -n.d and the normal curvatures, 1/L, along and across the plane of incidence (n,)."""
    along = nodes.curvature(axes_of_incidence(nodes.normals, direction))
    return -nodes.normals @ direction, along, nodes.total_curvature - along


def axes_of_incidence(normals: FloatArray, direction: FloatArray) -> FloatArray:
    """Unit tangents in the plane of incidence (n, 3)."""
    along = direction - (normals @ direction)[:, None] * normals
    length = np.linalg.norm(along, axis=1, keepdims=True)
    # at normal incidence any plane will do: kappa_a/c^2 + kappa_b is the sum of both there
    return np.where(length > 1e-6, along / np.maximum(length, 1e-300), tangent_frames(normals)[0])


def lit_nodes(body: Surface, line: ShadowLine, wavenumber: float) -> LitNodes:
    """Nodes of the lit side of an incidence, for far fields at this wavenumber, 1/L, and below."""
    # of the integrand e^{ik(d - r).x}
    whole = body_nodes(body, 2 * wavenumber)
    # m c is at least PENUMBRA's end where the surface is that dark, unless it is nearly flat
    nodes = whole.part(np.flatnonzero(-whole.normals @ line.direction > -0.6))
    return lit_part(body, line, nodes, wavenumber)[1]


def lit_part(body: Surface, line: ShadowLine, nodes: BodyNodes, wavenumber: float) -> tuple[IntArray, LitNodes]:
    """Rows of the nodes that the wave of an incidence reaches, to the end of the penumbra, and what they ask for."""
    d = line.direction
    cosine, along, across = plane_of_incidence(nodes, d)
    # flat along d, as on a cylinder met along its axis: 0 times infinity
    with np.errstate(invalid="ignore"):
        xi = -fock_scale(wavenumber, along) * cosine
    dark = cosine <= 0
    kept = ~dark | ((along > 0) & (xi < PENUMBRA[1]))
    kept[kept] = ~_out_of_the_wave(line, nodes.points[kept], dark[kept])
    at = np.flatnonzero(kept)
    share = np.where(dark[at], 1 - smoothstep(xi[at], *PENUMBRA), 1.0)
    rate, bend = np.zeros((2, len(at)))
    # farther towards the light the rate of curvature does not matter
    varies = (along[at] > 0) & (xi[at] > -6)
    rate[varies], bend[varies] = radius_rates(body, nodes.points[at][varies], d, along[at][varies])
    taken = nodes.part(at)
    axes = axes_of_incidence(taken.normals, d)
    scalars = cosine[at], along[at], across[at], rate, bend
    return at, LitNodes(taken.points, taken.normals, taken.weights * share, *scalars, axes, taken.twist(axes))


def _out_of_the_wave(line: ShadowLine, points: FloatArray, dark: BoolArray) -> BoolArray:
    """Whether the wave does not come to points of the lit side, or of the penumbra where ``dark`` (n,)."""
    out = np.zeros(len(points), dtype=bool)
    if line.fractions["attached"] == 1.0 and len(line.curves) == 1:
        return out
    out[~dark] = occluded(line.body, points[~dark], line.direction)
    from scipy.spatial import cKDTree

    # a point of the penumbra has the state of the line next to it
    on_line = np.concatenate([curve.points for curve in line.curves])
    state = np.concatenate([curve.state_at(curve.arclength) for curve in line.curves])
    out[dark] = state[cKDTree(on_line).query(points[dark])[1]] != PointState.ATTACHED
    return out


def radius_rates(
    body: Surface, points: FloatArray, direction: FloatArray, along: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """rho' and rho rho'' (n,) of rho = 1/kappa_a along the plane of incidence at points (n, 3), L.

    Next to a joint those of its own piece.
    """
    if is_piecewise(body):
        rate, bend = np.empty((2, len(points)))
        numbers = piece_ahead(body, points, np.zeros(3))
        for number in np.unique(numbers):
            mine = numbers == number
            rate[mine], bend[mine] = radius_rates(pieces_of(body)[number], points[mine], direction, along[mine])
        return rate, bend
    n = normal(body, points)
    t = direction - np.sum(n * direction, axis=1, keepdims=True) * n
    t /= np.maximum(np.linalg.norm(t, axis=1, keepdims=True), 1e-300)
    ends, step = [], STEP * size(body)
    for sign in (1, -1):
        x, normals, hessians, _ = nearest_points(body, points + sign * step * t)
        ends.append(plane_of_incidence(BodyNodes(x, normals, np.ones(len(x)), hessians, 0.0), direction)[1])
    slope, bent = (ends[0] - ends[1]) / (2 * step), (ends[0] - 2 * along + ends[1]) / step**2
    # at a tip curvature is infinite
    with np.errstate(over="ignore", invalid="ignore"):
        rate, bend = -slope / along**2, -bent / along**3 + 2 * slope**2 / along**4
    return np.clip(rate, -STEEPEST, STEEPEST), np.clip(bend, -SHARPEST, SHARPEST)


def ray_nodes(fan: RayFan, wavenumber: float, boundary: Boundary) -> RayNodes:
    """Nodes along the creeping rays of a fan's incidence, as long and as dense as the wavenumber, 1/L, asks for."""
    typical = fan.curvature[:, 0]
    # a boundary's own mode may be slower than the hard one's, by which rays are long by default
    m = fock_scale(wavenumber, np.median(typical, keepdims=True) if len(typical) else np.ones(1))
    slowest = slowest_decay(boundary, m, fan.points[:, 0]) if np.all(np.isfinite(m)) else 0.0
    # a mode that decays less ends with the longest rays
    length = ray_length(fan.line, wavenumber=wavenumber, decay=max(slowest, 1e-3))
    wavelength = 2 * np.pi / wavenumber
    attached = sum(curve.length for curve in fan.line.curves) * fan.line.fractions["attached"]
    # marches ask for some rays on each arc, and arcs of bodies of pieces are many and short
    fewest = 96 if is_piecewise(fan.body) else 16
    n_rays = max(fewest, int(np.ceil(RAYS * attached / wavelength)))
    dense = launch(fan.flow, fan.line, length=length, n_rays=n_rays, max_gap=0.5 * wavelength, measured=False)
    times = np.linspace(0.0, length, max(16, int(np.ceil(STEPS * length / wavelength))) + 1)
    _, rays = ray_points(dense, times)
    ds = np.full(len(times), times[1])
    ds[[0, -1]] /= 2
    weights = np.abs(rays.spreading) * ds * (dense.spacing * rays.width[:, 0])[:, None]
    # a cut at the end would radiate
    weights = weights * (1 - smoothstep(times, 0.85 * length, length))
    shape = rays.time.shape
    points = rays.points.reshape(-1, 3)
    normals = normal(fan.body, points).reshape(*shape, 3)
    weights = weights * _share_of_rays(fan.body, rays, normals, fan.line.direction, wavenumber)
    # marched waves go on where creeping modes have ended
    goes_on = march_alone(fan.body, boundary) & dense.launched[:, None]
    there = (rays.alive | goes_on) & np.isfinite(weights) & (weights > 0)
    rays, normals, weights = rays[there], normals[there], weights[there]
    twist = nodes_at(fan.body, rays.points, normals).twist(rays.directions)
    return RayNodes(dense, np.nonzero(there)[0], rays, normals, weights, twist)


def _share_of_rays(
    body: Surface, rays: RayPoints, normals: FloatArray, direction: FloatArray, wavenumber: float
) -> FloatArray:
    """Share of the rays (rays, steps): W up to where it first is 1, then 1."""
    cosine = -normals @ direction
    share = np.ones(cosine.shape)
    near = -cosine * fock_scale(wavenumber, np.maximum(rays.curvature[0], 1e-300)) < TAKEN_OVER
    near &= np.logical_and.accumulate(near, axis=1)
    _, along, _ = plane_of_incidence(nodes_at(body, rays.points[near], normals[near]), direction)
    with np.errstate(invalid="ignore"):
        xi = np.where(along > 0, -fock_scale(wavenumber, along) * cosine[near], np.inf)
    share[near] = smoothstep(xi, *PENUMBRA)
    return np.where(np.maximum.accumulate(share >= 1, axis=1), 1.0, share)


def lit_waves(
    part: LitNodes, direction: FloatArray, extent: float, k: float, kind: Boundary
) -> tuple[ComplexArray, ComplexArray]:
    """Wave at nodes of the lit side of a body of size ``extent``, L, by second and by first order (n,)."""
    along = direction + part.cosine[:, None] * part.normals
    here = kind.at(part.points, along, STEP * extent)
    wave = np.exp(1j * k * (part.points @ direction))
    second, first = (wave * lit_currents(part.ground, k, here, order) for order in (2, 1))
    return second, first


def ray_waves(nodes: RayNodes, k: float, kind: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Wave at nodes of rays, 0 where there is none, and what of it is of second order (n,)."""
    if march_alone(nodes.fan.body, kind):
        return _marched(nodes, k, kind)
    waves, first = (surface_waves(nodes.rays, k, kind, order) for order in (2, 1))
    # on a caustic of the body the current is infinite and its weight 0
    ok = np.isfinite(waves) & np.isfinite(first)
    return np.where(ok, waves, 0.0), np.where(ok, waves - first, 0.0)


def _marched(nodes: RayNodes, k: float, kind: Boundary) -> tuple[ComplexArray, ComplexArray]:
    if not marchable(nodes.fan, kind, 2):
        some = f"of {len(nodes.fan.status)} rays of this incidence some stand alone, where no wave can be marched"
        if not kind.varies:
            raise SurfaceError(f"the body has joints, and {some}; its far field by rays is known, or another incidence")
        raise InvalidInputError(
            f"the admittance {kind.coating} varies, and {some}; give a constant admittance, or another incidence"
        )
    y, error = fan_waves(nodes.fan, wavenumber=k, boundary=kind).along(nodes.rows, nodes.rays.time)
    wave = spread_out(y, nodes.rays, k)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = wave * np.minimum(error / np.abs(y), 1.0)
    known = np.isfinite(error) & np.isfinite(wave) & np.isfinite(off)
    return np.where(known, wave, 0.0), np.where(known, off, 0.0)
