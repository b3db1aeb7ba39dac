"""E and H nearer to a conductor than currents serve: between J and the charge on it and the fields of currents above.

Along the normal at x, t = kh above the body, the four terms of `creeping.field.near` are those of

    E_n   value q = n.E, slope -(kappa_1 + kappa_2) q/k on the body; values at two heights
    H_t   value J x n, slope -K H_t/k with the shape operator K; values at two heights
    H_n   value 0, slope -div (J x n)/k; values at two heights
    E_t   value 0; values at three heights

The slopes are div E = 0, (curl H)_t = 0 and div H = 0 on the body, where E_t = 0 and H_n = 0. What four terms leave out
is about A |kappa_1 + kappa_2|/k of the incident wave, A = 0.1, and 0.3 of E_t, on a saddle with the root of the sum of
squares; curl E = ikH gives a slope of E_t by the gradient of the charge, which is not known well enough.

Also here: e and H at points off a conductor by the currents of its whole body, with their error.

    E_s(y) = ik int [J + grad_y grad_y.J/k^2] G dS,   H_s(y) = int grad_y G x J dS

Errors are those of `creeping.field.currents.whole_body`, with what currents leave of E and of H inside for epsilon, and
with the second order's E and H for u'; the larger of the two counts for both.

Sources: [CK13, sec. 6.2]; Derivations, F20, F26 and F17.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.conductor.on_body import OnConductor, on_conductor
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.whole_body import level_at
from creeping.field.near import GRAZING, feet_of, layer_terms, solved
from creeping.field.results.point_result import FieldStatus, PointValues, measured_field
from creeping.geometry.quadrature import SYMMETRIC, BodyNodes, body_nodes
from creeping.rays.fan import RayFan
from creeping.shadow.attachment import occluded

LOWEST, APART = 0.27, 0.27
"""Least height, in wavelengths, at which currents are asked, and that of further points above it."""
SPACED = 2.6
"""The same in terms of half the distance between nodes: E of a sum over nodes falls off like e^(-2 pi h/distance)."""
CLEAR = 0.8
"""Share of the least height that nodes must tell of it: they are too far apart to tell more."""
LEFT_OUT, LEFT_OUT_ACROSS = 0.1, 0.3
"""Error of four terms, in |kappa_1 + kappa_2|/k or on a saddle the root of the sum of squares, and of those of E_t; as
the cube of the heights they span."""

LIT_LEVEL, DARK_LEVEL, SHAPE = 2.3, 4.6, 2.3
"""Factors L and S of the error, set on the first four bodies of `studies.accuracy.point_coverage`."""
ELECTRIC, MAGNETIC = slice(0, 3), slice(3, 6)
"""Where E and H stand among six components."""


def lowest_height(currents: ConductorCurrents) -> float:
    """Height above the body, in wavelengths, from which sums over nodes are the fields of currents.

    Raises
    ------
    SurfaceError
        If the wavenumber is too high for any mesh of the body.
    """
    nodes = body_nodes(currents.body, 2 * currents.wavenumber)
    return max(LOWEST, SPACED * nodes.spacing / 2 * currents.wavenumber / (2 * np.pi))


def layer_fields(
    fan: RayFan, currents: ConductorCurrents, points: FloatArray, left: FloatArray
) -> tuple[IntArray, list[PointValues]]:
    """Rows of the points (n, 3), L, that the layer serves, and E and H (m, 6) there for each polarisation."""
    body, k, d = fan.body, currents.wavenumber, currents.direction
    low = lowest_height(currents)
    above = (low, low + APART, low + 2 * APART)
    at, nodes, height, tops = feet_of(body, points, k, above, CLEAR * low)
    surface = on_conductor(fan, nodes.points, k, currents.incident_electric, left, currents)
    values, errors = [], []
    for top in tops:
        incident, scattered, its = total_fields(currents, top, occluded(body, top, d))
        values.append(incident + scattered)
        errors.append(its)
    # waves behind the body run along it
    c, t = np.maximum(-nodes.normals @ d, GRAZING), k * height
    found = []
    for i in range(currents.mix.shape[1]):
        field, error = _between(
            nodes, surface, i, [v[..., i] for v in values], [e[:, i] for e in errors], c, t, k, above
        )
        one = measured_field(field, error, "layer", "extinction+expansion")
        # without the field on the body there is none above it
        status = np.where(surface.current[i].status == FieldStatus.OK, one.status, surface.current[i].status)
        found.append(PointValues(one.wave, one.creeping, one.error, one.error_by, status.astype(np.int64), one.method))
    return at, found


def _between(
    nodes: BodyNodes,
    surface: OnConductor,
    i: int,
    tops: list[ComplexArray],
    errors: list[FloatArray],
    c: FloatArray,
    t: FloatArray,
    k: float,
    heights: tuple[float, ...],
) -> tuple[ComplexArray, FloatArray]:
    """E and H (n, 6) of a polarisation, and the larger error of the two (n,), from fields at heights (n, 6)."""
    n, total = nodes.normals, nodes.total_curvature / k
    J, off = surface.current[i].values, surface.current[i].error
    assert surface.slope is not None
    on, slope = layer_terms(c, 0.0), np.tile([0.0, 1.0, 0.0, 0.0], (len(c), 1))
    above, terms = [layer_terms(c, 2 * np.pi * share) for share in heights], layer_terms(c, t)
    w, v = solved([on, slope, *above[:2]], terms), solved([on, *above], terms)
    charge, magnetic = surface.charge[:, i], np.cross(J, n)
    normal_E, normal_H = (np.stack([np.sum(n * top[:, part], axis=1) for top in tops]) for part in (ELECTRIC, MAGNETIC))
    E_n = (w[:, 0] - w[:, 1] * total) * charge + w[:, 2] * normal_E[0] + w[:, 3] * normal_E[1]
    H_n = w[:, 1] * surface.slope[:, i] + w[:, 2] * normal_H[0] + w[:, 3] * normal_H[1]
    bent = np.einsum("nij,nj->ni", nodes.hessians[:, SYMMETRIC], magnetic) / k
    bent = bent - np.sum(n * bent, axis=1, keepdims=True) * n
    H_t = w[:, :1] * magnetic - w[:, 1:2] * bent
    E_t = np.zeros_like(H_t)
    for j, top in enumerate(tops):
        E_t = E_t + v[:, j + 1, None] * (top[:, ELECTRIC] - normal_E[j][:, None] * n)
        if j < 2:
            H_t = H_t + w[:, j + 2, None] * (top[:, MAGNETIC] - normal_H[j][:, None] * n)
    field = np.concatenate([E_t + E_n[:, None] * n, H_t + H_n[:, None] * n], axis=1)
    left_out = nodes.bending / k * (heights[0] / LOWEST) ** 3
    shared = [w[:, 2] * errors[0], w[:, 3] * errors[1]]
    of_charge = (w[:, 0] - w[:, 1] * total) * surface.charge_error[:, i]
    across = [v[:, j + 1] * error for j, error in enumerate(errors)]
    of_H = np.linalg.norm([*shared, w[:, 0] * off, w[:, 1] * off, LEFT_OUT * left_out], axis=0)
    of_E = np.linalg.norm([*shared, *across, of_charge, LEFT_OUT * left_out, LEFT_OUT_ACROSS * left_out], axis=0)
    return field, np.maximum(of_E, of_H)


def incident_fields(direction: FloatArray, electric: ComplexArray, points: FloatArray, k: float) -> ComplexArray:
    """E and H (m, 6, p) of incident waves E0 (3, p) at points (m, 3), L."""
    both = np.concatenate([electric, np.cross(direction, electric, axisb=0).T])
    return np.asarray(np.multiply.outer(np.exp(1j * k * (points @ direction)), both))


def total_fields(
    currents: ConductorCurrents, points: FloatArray, dark: BoolArray
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Incident and scattered E and H (m, 6, p) at points (m, 3), L, some in the dark, and their error (m, p)."""
    k = currents.wavenumber
    incident = incident_fields(currents.direction, currents.incident_electric, points, k)
    scattered = np.concatenate([currents.scattered_electric(points), currents.scattered(points)], axis=1)
    left = currents.left_of_each
    shapes = currents.changed_electric(points), currents.changed_magnetic(points)
    error = np.empty((len(points), incident.shape[2]))
    for i, mean in enumerate(currents.amplitudes):
        level = level_at(currents, points, dark, float(mean), LIT_LEVEL, DARK_LEVEL)
        each = [left[j, i] * np.hypot(level, SHAPE * shape[:, i]) for j, shape in enumerate(shapes)]
        error[:, i] = np.maximum(*each)
    return incident, scattered, error
