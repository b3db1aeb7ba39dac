"""Fields know no unit of length: a body s times as large at k/s, for every boundary and every field there is."""

from functools import cache

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.surface import normal, project

D = np.array([0.36, 0.48, 0.8])
R = np.concatenate([fibonacci_directions(30), [D, -D]])
K = 14.0
BOUNDARIES = {"soft": "soft", "hard": "hard", "impedance": cr.ImpedanceBoundary(0.7), "pec": "pec"}
SCALES = [1e-6, pytest.param(1e6, marks=pytest.mark.slow)]
STORED = 1e-9
"""Fields by currents and at points, whose nodes scale with the body: what is left is rounding."""
SINGLE = 1e-6
"""Fields of currents that are solved, whose matrix is in single precision: 1e-7 of the largest."""
ENDS = 1e-2
"""Errors of what is solved, in which the last step of the solution is: single precision is in it."""
TRACED = 5e-5
"""Rays, which end their steps and searches at other last digits: 8e-6 far, 5e-5 in a sweep."""


@cache
def fan_of(s):
    body = sc.Ellipsoid(s, 0.8 * s, 0.6 * s)
    return cr.launch(cr.DirectFlow(body, rtol=1e-9), cr.shadow_line(body, D), length=4.0 * s, n_rays=64)


def compare(found, expected, tolerance):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@cache
def far(s, kind, method):
    return cr.far_field(fan_of(s), R, wavenumber=K / s, boundary=BOUNDARIES[kind], method=method)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    "kind", [kind if kind != "pec" else pytest.param(kind, marks=pytest.mark.slow) for kind in BOUNDARIES]
)
@pytest.mark.parametrize("method, tolerance", [("currents", STORED), ("rays", TRACED)])
def test_far_field(method, kind, tolerance, scale):
    one, other = far(1.0, kind, method), far(scale, kind, method)
    if np.any(one.method == "equation"):
        tolerance = SINGLE
    for part, values in (one.parts | {"total": one.total}).items():
        np.testing.assert_allclose(
            (other.total if part == "total" else other.parts[part]) / scale,
            values,
            rtol=0,
            atol=tolerance * np.abs(one.total).max(),
        )
    # errors by rays are differences of near values
    compare(other.error / scale, one.error, 40 * tolerance if method == "rays" else ENDS)
    np.testing.assert_array_equal(other.unresolved, one.unresolved)
    np.testing.assert_array_equal(other.method, one.method)
    np.testing.assert_allclose(other.validity, one.validity, rtol=1e-6)


def points(s):
    """On the body, and at heights of 0.03 to 3 of its largest half-axis."""
    body = fan_of(s).body
    # the first direction is one where tiles meet: last digits decide which is its own
    on = project(body, R[1:30] * np.array([1.0, 0.8, 0.6]) * s)
    return on, on + s * np.geomspace(0.03, 3.0, 29)[:, None] * normal(body, on)


@cache
def at_points(s, kind):
    on, off = points(s)
    options = {"wavenumber": K / s, "boundary": BOUNDARIES[kind]}
    if options["boundary"] == "pec":
        return [(cr.conductor_current(fan_of(s), on, wavenumber=K / s), 1.0)]
    # du/dn of the soft boundary is 1/L
    unit = s if kind == "soft" else 1.0
    return [
        (cr.surface_field(fan_of(s), on, **options), unit),
        (cr.near_field(fan_of(s), off, **options), 1.0),
        (cr.near_field(fan_of(s), off, method="rays", **options), 1.0),
    ]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    "kind", ["hard", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("soft", "impedance", "pec"))]
)
def test_fields_at_points(kind, scale):
    for (one, unit), (other, its_unit) in zip(at_points(1.0, kind), at_points(scale, kind), strict=True):
        np.testing.assert_array_equal(other.status, one.status)
        np.testing.assert_array_equal(other.method, one.method)
        compare(np.asarray(other) * its_unit, np.asarray(one) * unit, TRACED)
        compare(other.error * its_unit, one.error * unit, ENDS if np.any(one.method == "equation") else TRACED)
        if kind == "pec":
            compare(other.charge, one.charge, TRACED)


@cache
def sweep(s):
    flow = cr.DirectFlow(sc.Ellipsoid(s, 0.8 * s, 0.6 * s), rtol=1e-9)
    return cr.sweep_directions(
        flow,
        [D, (1.0, 0.2, 0.1), (-0.3, 0.9, 0.2)],
        wavenumbers=[K / s, 30.0 / s],
        boundary=list(BOUNDARIES.values()),
        length=4.0 * s,
        n_rays=64,
    )


@pytest.mark.parametrize("scale", SCALES)
def test_sweep(scale):
    one, other = sweep(1.0), sweep(scale)
    lengths = [name + end for name in ("creeping", "reflected", "error") for end in ("", "_pec")]
    for name in [*lengths, "line_length"]:
        compare(other[name].values / scale, one[name].values, TRACED)
    for name in ("incidence_status", "curves", "unresolved", "unresolved_pec"):
        np.testing.assert_array_equal(other[name], one[name])
    for name in ("attached", "occluded", "concave", "singular_distance", "least_k_rho", "largest_transverse"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-6)
