"""The total field nearer to the body than currents serve: between the field on it and that of currents above.

Along the normal at x, h above the body, t = kh and c = -n.d, at least 0.15,

    u = a cos ct + b sin(ct)/c + a' t sin(ct)/c + b' 3 (sin ct - ct cos ct)/c^3

with u and du/dn on the body from the surface field and u at 0.27 and 0.54 wavelengths from currents. Incident and
reflected wave of a plane are a and b; where the wave grazes the four are 1, t, t^2 and t^3. Each weight of a value is 1
at most; what four terms leave out is about 0.1 |kappa_1 + kappa_2|/k of the incident wave, 0.03 on an impedance; on a
saddle the root of kappa_1^2 + kappa_2^2 stands for the sum.

Sources: Derivations, F20.
"""

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.currents.total import far_enough, total_at
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.on_body import total_on
from creeping.field.point_result import FieldStatus
from creeping.field.served import Served, measured_field
from creeping.geometry.quadrature import BodyNodes, nearest_points
from creeping.geometry.surface import Surface, size
from creeping.rays.fan import RayFan
from creeping.shadow.occlusion import occluded

ABOVE = (0.27, 0.54)
"""Heights, in wavelengths, of the points at which currents are asked."""
CLEAR = 0.2
"""Distance from all of the body that nodes must tell of these, in wavelengths: they are too far apart to tell more."""
GRAZING = 0.15
"""Least c: below, the four terms are powers of t to rounding."""
LEFT_OUT = {"soft": 0.1, "hard": 0.1, "impedance": 0.03}
"""Error of four terms, in |kappa_1 + kappa_2|/k, or on a saddle the root of the sum of squares."""
FOOT = 1e-6
"""Distance, in body sizes, up to which a point is above its foot."""


def layer_field(fan: RayFan, currents: SurfaceCurrents, points: FloatArray, kind: Boundary) -> tuple[IntArray, Served]:
    """Rows of the points (n, 3), L, less than half a wavelength off the body, that the layer serves, and its field."""
    body, k, d = fan.body, currents.wavenumber, currents.direction
    at, nodes, height, tops = feet_of(body, points, k, ABOVE)
    foot, n = nodes.points, nodes.normals
    surface = total_on(fan, foot, k, kind, 2, currents)
    good = np.flatnonzero(surface.status == FieldStatus.OK)
    at, surface, height, nodes = at[good], surface[good], height[good], nodes.part(good)
    known, errors = _on_body(surface.values, surface.error, k, kind.at(nodes.points))
    for top in tops:
        incident, scattered, its = total_at(currents, top[good], occluded(body, top[good], d))
        known.append(incident + scattered)
        errors.append(its)
    # waves behind the body run along it
    weights = _weights(np.maximum(-n[good] @ d, GRAZING), k * height)
    errors = [weights[:, i] * one for i, one in enumerate(errors)]
    values = np.sum(weights * np.stack(known, axis=1), axis=1)
    error = np.linalg.norm([*errors, LEFT_OUT[kind.kind] * nodes.bending / k], axis=0)
    return at, measured_field(values, error, "layer", "extinction+expansion")


def feet_of(
    body: Surface, points: FloatArray, k: float, above: tuple[float, ...], clear: float = CLEAR
) -> tuple[IntArray, BodyNodes, FloatArray, list[FloatArray]]:
    """Rows of the points (n, 3), L, at most two heights up that have a foot: feet, own heights, and points above them.

    Heights ``above`` are in wavelengths; at each of them the point above a foot is outside, and ``clear`` of the body.
    """
    foot, n, hessians, height = nearest_points(body, points)
    scale = size(body)
    there = np.linalg.norm(foot + height[:, None] * n - points, axis=1) < FOOT * scale
    there &= (height > 0) & (height < above[1] * 2 * np.pi / k)
    there &= np.abs(body.level(foot)) <= FOOT * scale * np.linalg.norm(body.gradient(foot), axis=1)
    tops = [foot + share * 2 * np.pi / k * n for share in above]
    for top in tops:
        at = np.flatnonzero(there)
        # over a bay they may be in the body or near its other side
        there[at] = (body.level(top[at]) > 0) & far_enough(body, k, top[at], clear)
    at = np.flatnonzero(there)
    nodes = BodyNodes(foot[at], n[at], np.ones(len(at)), hessians[at], 0.0)
    return at, nodes, height[at], [top[at] for top in tops]


def _on_body(
    on: ComplexArray, off: FloatArray, k: float, kind: Boundary
) -> tuple[list[ComplexArray], list[FloatArray]]:
    """The field u and (1/k) du/dn on the body (n,), and their errors."""
    nothing = np.zeros_like(on)
    if kind.kind == "soft":
        return [nothing, on / k], [np.abs(nothing), off / k]
    slope = np.asarray(-1j * kind.admittance * on)
    return [on, slope], [off, np.abs(kind.admittance) * off]


def _weights(c: FloatArray, t: FloatArray) -> FloatArray:
    """Weights (n, 4) of u and (1/k) du/dn on the body and of u at both heights above, at kh = t (n,)."""
    slope = np.tile([0.0, 1.0, 0.0, 0.0], (len(c), 1))
    rows = [layer_terms(c, 0.0), slope, *(layer_terms(c, 2 * np.pi * share) for share in ABOVE)]
    return solved(rows, layer_terms(c, t))


def layer_terms(c: FloatArray, t: ArrayLike) -> FloatArray:
    """The four terms (n, 4) at heights t (n,) or t, kh."""
    t = np.asarray(t, dtype=float)
    sine, cosine = np.sin(c * t), np.cos(c * t)
    return np.stack([cosine, sine / c, t * sine / c, 3 * (sine - c * t * cosine) / c**3], axis=1)


def solved(rows: list[FloatArray], terms: FloatArray) -> FloatArray:
    """Weights (n, r) of known values, whose terms are ``rows`` (n, r) each, that give what has ``terms`` (n, r)."""
    return np.asarray(np.linalg.solve(np.stack(rows, axis=2), terms[..., None])[..., 0])
