"""The total field nearer to the body than currents give it: between the field on it and that of currents above.

Along the normal at x, h above the body, t = kh and c = -n.d, at least 0.15, below which the four terms are powers of t
to rounding, each component is

    a cos ct + b sin(ct)/c + a' t sin(ct)/c + b' 3 (sin ct - ct cos ct)/c^3

of four values that are known, of u (in units of the incident wave) or of E and H of a conductor:

    u     value and slope du/dn on the body; values at two heights
    E_n   value q = n.E, slope -(kappa_1 + kappa_2) q/k on the body; values at two heights
    H_t   value J x n, slope -K H_t/k with the shape operator K; values at two heights
    H_n   value 0, slope -div (J x n)/k; values at two heights
    E_t   value 0; values at three heights

Incident and reflected wave of a plane are a and b; where the wave grazes the four are 1, t, t^2 and t^3. Each weight of
a value is 1 at most. The slopes of E and H are div E = 0, (curl H)_t = 0 and div H = 0 on the body, where E_t = 0 and
H_n = 0; curl E = ikH gives a slope of E_t by the gradient of the charge, which is not known well enough. What four
terms leave out is about 0.1 |kappa_1 + kappa_2|/k of the incident wave, 0.03 of an impedance and 0.3 of E_t, of a
conductor as the cube of the heights that the terms span; on a saddle the root of kappa_1^2 + kappa_2^2 stands for the
sum.

Sources: [CK13, sec. 6.2]; Derivations, F8, F20 and F26.
"""

from dataclasses import replace

import numpy as np

from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.currents.whole_body import SurfaceCurrents, far_enough
from creeping.field.on_body import OnBody, field_on_body
from creeping.field.results.conductor_result import E, H
from creeping.field.results.point_result import FieldStatus, PointValues, columns_of, measured_field
from creeping.field.routes import Problem
from creeping.geometry.quadrature import SYMMETRIC, BodyNodes, body_nodes, nearest_points
from creeping.geometry.surface import Surface, size
from creeping.shadow.attachment import occluded

LOWEST = 0.27
"""Least height, in wavelengths, at which currents are asked, and that of further points above it."""
FOOT = 1e-6
"""Distance, in body sizes, up to which a point is above its foot."""
Tops = tuple[list[ComplexArray], list[FloatArray]]
"""Fields at heights above the feet, and their errors."""


def heights_of(problem: Problem) -> tuple[float, ...]:
    """Heights above the body, in wavelengths, at which currents are asked; they are valid from the least one on.

    Raises
    ------
    SurfaceError
        If the wavenumber is too high for any mesh of the body.
    """
    if not problem.vector:
        return LOWEST, 2 * LOWEST
    nodes = body_nodes(problem.body, 2 * problem.wavenumber)
    # E of a sum over nodes falls off like e^(-2 pi h/distance)
    low = max(LOWEST, 1.3 * nodes.spacing * problem.wavenumber / (2 * np.pi))
    return low, low + LOWEST, low + 2 * LOWEST


def layer_fields(problem: Problem, currents: SurfaceCurrents, points: FloatArray) -> tuple[IntArray, list[PointValues]]:
    """Rows of the points (n, 3), L, in the layer, and the field there of each polarisation.

    Without the field on the body there is none above it.
    """
    body, k, d, heights = problem.body, problem.wavenumber, problem.direction, heights_of(problem)
    # of their distance from the body nodes, too far apart, must tell so much
    clear = 0.8 * heights[0] if problem.vector else 0.2
    at, nodes, height, tops = feet_of(body, points, k, heights, clear)
    surface = field_on_body(problem, nodes.points, currents)
    above = [currents.total(top, occluded(body, top, d)) for top in tops]
    # waves behind the body run along it
    c, t = np.maximum(-nodes.normals @ d, 0.15), k * height
    weights, columns = _weights(c, t, heights), []
    for i, one in enumerate(surface.columns):
        each: Any = tuple([columns_of(part)[i] for part in parts] for parts in zip(*above, strict=True))
        with np.errstate(invalid="ignore", over="ignore"):
            # what is not OK may be infinite
            if problem.vector:
                field, error = _vectors(nodes, surface, i, each, weights, k, heights[0])
            else:
                field, error = _scalars(nodes, one, each, weights[0], k, problem.kind.at(nodes.points))
        found = measured_field(field, error, "layer", "extinction+expansion")
        status = np.where(one.status == FieldStatus.OK, found.status, one.status)
        columns.append(replace(found, status=status.astype(np.int64)))
    good = np.flatnonzero(np.any([one.status == FieldStatus.OK for one in surface.columns], axis=0))
    return at[good], [one[good] for one in columns]


def _scalars(
    nodes: BodyNodes, surface: PointValues, tops: Tops, w: FloatArray, k: float, kind: Boundary
) -> tuple[ComplexArray, FloatArray]:
    """u and its error (n,) from that on the body and at two heights."""
    on, off, nothing = surface.values, surface.error, np.zeros_like(surface.values)
    if kind.kind == "soft":
        known, its = [nothing, on / k], [np.abs(nothing), off / k]
    else:
        known, its = [on, np.asarray(-1j * kind.admittance * on)], [off, np.abs(kind.admittance) * off]
    each = [w[:, i] * one for i, one in enumerate([*its, *tops[1]])]
    error = np.linalg.norm([*each, (0.03 if kind.kind == "impedance" else 0.1) * nodes.bending / k], axis=0)
    return np.sum(w * np.stack([*known, *tops[0]], axis=1), axis=1), error


def _vectors(
    nodes: BodyNodes,
    surface: OnBody,
    i: int,
    tops: Tops,
    weights: tuple[FloatArray, FloatArray],
    k: float,
    least: float,
) -> tuple[ComplexArray, FloatArray]:
    """E and H (n, 6) of a polarisation, and the larger error of the two (n,), from fields at heights (n, 6)."""
    (values, errors), (w, v) = tops, weights
    n, total = nodes.normals, nodes.total_curvature / k
    J, off = surface.columns[i].values, surface.columns[i].error
    charge, magnetic = surface.charge[:, i], np.cross(J, n)
    normal_E, normal_H = (np.stack([np.sum(n * top[:, part], axis=1) for top in values]) for part in (E, H))
    E_n = (w[:, 0] - w[:, 1] * total) * charge + w[:, 2] * normal_E[0] + w[:, 3] * normal_E[1]
    H_n = w[:, 1] * surface.slope[:, i] + w[:, 2] * normal_H[0] + w[:, 3] * normal_H[1]
    bent = np.einsum("nij,nj->ni", nodes.hessians[:, SYMMETRIC], magnetic) / k
    bent = bent - np.sum(n * bent, axis=1, keepdims=True) * n
    H_t = w[:, :1] * magnetic - w[:, 1:2] * bent
    E_t = np.zeros_like(H_t)
    for j, top in enumerate(values):
        E_t = E_t + v[:, j + 1, None] * (top[:, E] - normal_E[j][:, None] * n)
        if j < 2:
            H_t = H_t + w[:, j + 2, None] * (top[:, H] - normal_H[j][:, None] * n)
    field = np.concatenate([E_t + E_n[:, None] * n, H_t + H_n[:, None] * n], axis=1)
    left_out = nodes.bending / k * (least / LOWEST) ** 3
    shared = [w[:, 2] * errors[0], w[:, 3] * errors[1]]
    of_charge = (w[:, 0] - w[:, 1] * total) * surface.charge_error[:, i]
    across = [v[:, j + 1] * error for j, error in enumerate(errors)]
    plain = 0.1 * left_out
    of_H = np.linalg.norm([*shared, w[:, 0] * off, w[:, 1] * off, plain], axis=0)
    of_E = np.linalg.norm([*shared, *across, of_charge, plain, 0.3 * left_out], axis=0)
    return field, np.maximum(of_E, of_H)


def feet_of(
    body: Surface, points: FloatArray, k: float, above: tuple[float, ...], clear: float
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


def _weights(c: FloatArray, t: FloatArray, heights: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Weights (n, 4) at kh = t (n,) of what is known on the body and above it, at heights in wavelengths.

    Of value and slope on the body and two values; then of the value there and those at all heights.
    """
    on, slope, terms = _terms(c, 0.0), np.tile([0.0, 1.0, 0.0, 0.0], (len(c), 1)), _terms(c, t)
    above = [_terms(c, 2 * np.pi * share) for share in heights]
    pairs = [on, slope, *above[:2]], [on, *above]
    both = [np.linalg.solve(np.stack(rows, axis=2), terms[..., None])[..., 0] for rows in pairs if len(rows) == 4]
    return both[0], both[-1]


def _terms(c: FloatArray, t: ArrayLike) -> FloatArray:
    """The four terms (n, 4) at heights t (n,) or t, kh."""
    t = np.asarray(t, dtype=float)
    sine, cosine = np.sin(c * t), np.cos(c * t)
    return np.stack([cosine, sine / c, t * sine / c, 3 * (sine - c * t * cosine) / c**3], axis=1)
