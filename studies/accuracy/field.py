"""How accurate is the field? Against exact series on a sphere, and fundamental solutions on bodies with no series.

``parts``: every part of the field on a sphere, over ka = 10, 30, 100, 300. Errors are relative, per cent. The creeping
part alone is judged by its Regge poles, since in the backward half it is far below the total.

``far``: triaxial and twisted ellipsoid, three incidences, k = 20 and 40, soft and hard. Medians are relative, per cent;
largest errors are shares of the largest value, per cent, since relative error means nothing at a null.

Run ``python -m studies field`` (seven minutes), ``--quick`` for ka = 10 and 30, and soft at k = 20 alone.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import pairwise, product

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.boundary import scalar_boundaries
from creeping.field.waves.far_geometry import fan_strips, far_geometry
from creeping.field.waves.far_rays import isolated_rays
from creeping.field.waves.forward import fan_half
from creeping.geometry.directions import directions_from_angles
from creeping.geometry.surface import normal, project
from creeping.rays.fan import RayFan
from studies import Row, main
from tests.reference import clouds, fundamental, sphere, watson

KA = (10.0, 30.0, 100.0, 300.0)
BESIDE = np.arange(30, 151, 10.0)
"""Angles at which isolated rays are judged, degrees."""
INCIDENCES = {
    "triaxial": ((0.3, 0.5, 0.812), (0.8, -0.3, 0.5), (0.1, 0.9, 0.4)),
    "twisted": ((1.0, 1.0, 1.0), (0.3, 0.5, 0.812), (0.0, 1.0, 0.3)),
}
BODIES: dict[str, tuple[Any, Any, float]] = {
    "triaxial": (sc.Ellipsoid(1, 0.8, 0.6), clouds.ellipsoid(1, 0.8, 0.6), 0.15),
    "twisted": (sc.TwistedEllipsoid(), clouds.twisted_ellipsoid(), 0.12),
}
"""Body, the same for the reference, and the depth of the reference's sources."""
EDGES = (0, 20, 35, 60, 90, 120, 150, 180)
"""Sectors of the angle from d, degrees."""


def sphere_fan(length: float = 6.2) -> RayFan:
    """Fan of the unit sphere for incidence along z, once round; a map of 1e-6 would show at ka = 300, in the phase."""
    body = sc.Sphere()
    flow = cr.build_phase_map(body, tolerance=1e-7)
    return cr.launch(flow, cr.shadow_line(body, (0, 0, 1)), length=length, n_rays=256)


def observers(theta: FloatArray) -> FloatArray:
    """Directions at angles theta (m,) from the forward direction: (m, 3)."""
    # at some azimuth: nothing may depend on it
    return directions_from_angles(theta, 0.3)


def worst(found: ComplexArray, exact: ComplexArray) -> float:
    """Largest relative error, per cent."""
    return float(100 * np.max(np.abs(found - exact) / np.abs(exact)))


@cache
def poles(k: float, boundary: Any) -> ComplexArray:
    """Sum of the Regge poles at `BESIDE` (m,)."""
    return np.asarray(watson.far_field(k, 1.0, np.radians(BESIDE), boundary, modes=12 if k < 20 else 8))


def creeping_rays(fan: RayFan, k: float, boundary: Any, order: int) -> float:
    """Short and long isolated ray, 30 to 150 deg, against the Regge poles."""
    theta = np.radians(BESIDE)
    geometry = far_geometry(fan, observers(theta))
    kind = scalar_boundaries(boundary)[0]
    found = np.zeros(len(theta), dtype=complex)
    np.add.at(found, geometry.shed.observer, isolated_rays(geometry, k, kind)[order - 1])
    reference: Any = boundary if isinstance(boundary, str) else boundary.admittance
    return worst(found, poles(k, reference))


def back_axis(fan: RayFan, k: float, boundary: Any, order: int) -> float:
    """Fan integral at backscatter, where all rays merge, against the Regge poles."""
    geometry = far_geometry(fan, [[0.0, 0, -1]])
    nodes = geometry.fan_nodes(k, np.array([True]))
    found = fan_half(nodes, geometry.directions, k, scalar_boundaries(boundary)[0])[order - 1].sum()
    return worst(np.array([found]), watson.far_field(k, 1.0, [np.pi], boundary))


def total(fan: RayFan, k: float, boundary: Any, degrees: FloatArray) -> float:
    """Total far field by rays at angles from the forward direction, against partial waves."""
    theta = np.radians(degrees)
    found = cr.far_field(fan, observers(theta), wavenumber=k, boundary=boundary, method="rays")
    return worst(found.total, sphere.far_field(k, 1.0, np.cos(theta), boundary))


def near(fan: RayFan, k: float, boundary: Any) -> float:
    """Total field in the shadow by rays, 1.1 to 3 radii from the centre and 0.4 or more from the axis, a caustic."""
    theta = np.radians(np.arange(8, 84, 4.0))
    points = np.concatenate([radius * observers(theta) for radius in (1.1, 1.3, 1.5, 2.0, 3.0)])
    across = np.hypot(points[:, 0], points[:, 1])
    points = points[(across > 0.4) & (across < 0.95)]
    found = cr.near_field(fan, points, wavenumber=k, boundary=boundary, method="rays").values
    exact = sphere.total_field(k, 1.0, points, np.array([0.0, 0, 1]), boundary)
    return worst(found, exact)


def conductor(fan: RayFan, k: float, component: int) -> float:
    """Total far field by rays of a perfect conductor, 20 to 180 deg in steps of 10, against Mie's series.

    Component 0 is E in the plane of scattering, 1 across it.
    """
    theta = np.radians(np.arange(20, 181, 10.0))
    directions = directions_from_angles(theta, 0.0)
    found = cr.far_field(fan, directions, wavenumber=k, boundary="pec", method="rays").total
    across, within = sphere.pec_far_field(k, 1.0, np.cos(theta))
    return worst(found[:, component, component], across if component else within)


def row_functions() -> dict[str, Callable[[RayFan, float], float]]:
    """What computes each part of the field, by its name, from a fan and ka."""
    rows: dict[str, Callable[[RayFan, float], float]] = {}
    for b in ("soft", "hard"):
        for order, label in ((1, ", first order"), (2, "")):
            rows[f"creeping rays, {b}{label}"] = partial(creeping_rays, boundary=b, order=order)
            rows[f"back axis, {b}{label}"] = partial(back_axis, boundary=b, order=order)
        rows[f"forward, {b}"] = partial(total, boundary=b, degrees=np.array([0.0]))
        rows[f"total at 60 deg, {b}"] = partial(total, boundary=b, degrees=np.array([60.0]))
        rows[f"near field in the shadow, {b}"] = partial(near, boundary=b)
    rows["PEC, E in the plane, from 20 deg"] = partial(conductor, component=0)
    rows["PEC, E across the plane, from 20 deg"] = partial(conductor, component=1)
    return rows


def parts(wavenumbers: Sequence[float] = KA) -> Iterator[Row]:
    """Largest relative error, per cent, by ka."""
    fan = sphere_fan()
    for name, function in row_functions().items():
        yield {"part": f"{name:36}"} | {f"ka = {k:g}": function(fan, k) for k in wavenumbers}


@cache
def reference(name: str, boundary: Any, k: float) -> fundamental.Solution:
    """Fundamental solutions for all three incidences of a body."""
    _, body, depth = BODIES[name]
    directions = np.array(INCIDENCES[name])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    per_wavelength = 8.0 if k < 30 else 6.0
    return fundamental.scatter(body, k, directions, boundary, depth=depth, per_wavelength=per_wavelength)


@cache
def fan_of(name: str, incidence: int) -> RayFan:
    """Fan of 384 rays or more, five units long."""
    body = BODIES[name][0]
    flow = cr.build_phase_map(body, tolerance=1e-6)
    return cr.launch(flow, cr.shadow_line(body, INCIDENCES[name][incidence]), length=5.0, n_rays=384)


def largest(name: str, boundary: Any, k: float, incidence: int) -> float:
    """|f| straight ahead, the largest there is, L."""
    solution = reference(name, boundary, k)
    return float(np.abs(solution.far_field(solution.directions[[incidence]])[0, incidence]))


def far_errors(name: str, boundary: Any, k: float, incidence: int, count: int = 600) -> dict[str, Any]:
    """Total far field over the sphere of directions: medians by sector, largest error, and that of resolved ones.

    Of the unresolved directions how many are 90 deg from d or less, and whether all err by no more than they state.
    """
    solution, fan = reference(name, boundary, k), fan_of(name, incidence)
    r = np.asarray(cr.fibonacci_directions(count))
    found = cr.far_field(fan, r, wavenumber=k, boundary=boundary, method="rays")
    exact = solution.far_field(r)[:, incidence]
    error, theta = np.abs(found.total - exact), np.degrees(np.arccos(r @ fan.line.direction))
    share = 100 * error / np.abs(exact)
    scale = 100 / largest(name, boundary, k, incidence)
    return {
        "medians": [float(np.median(share[(theta >= a) & (theta < b)])) for a, b in pairwise(EDGES)],
        "largest": float(scale * error.max()),
        "largest_resolved": float(scale * error[~found.unresolved].max()),
        "unresolved": int(found.unresolved.sum()),
        "unresolved_ahead": int(found.unresolved[theta <= 90].sum()),
        "covered": bool(np.all(error[found.unresolved] <= found.error[found.unresolved])),
    }


def surface_errors(name: str, boundary: Any, k: float, incidence: int, order: int) -> tuple[list[float], float]:
    """Total field on the body at s = 0.3 to 0.9: medians in thirds of s, and the median share of the largest value."""
    solution, fan = reference(name, boundary, k), fan_of(name, incidence)
    strip = fan_strips(fan)[0]
    rng = np.random.default_rng(0)
    points = strip.at(rng.uniform(*strip.span, 300), rng.uniform(0.3, 0.9, 300))
    points = points[points.alive]
    y = project(fan.body, points.points)
    found = cr.surface_field(fan, y, wavenumber=k, boundary=boundary, order=order)
    exact: ComplexArray = (
        solution.total(y) if boundary == "hard" else solution.normal_derivative(y, normal(fan.body, y))
    )[:, incidence]
    error = np.abs(found - exact)
    share = 100 * error / np.abs(exact)
    thirds = [float(np.median(share[(points.time >= s) & (points.time < s + 0.2)])) for s in (0.3, 0.5, 0.7)]
    return thirds, float(100 * np.median(error) / np.abs(exact).max())


def far(boundaries: Sequence[str] = ("soft", "hard"), wavenumbers: Sequence[float] = (20.0, 40.0)) -> Iterator[Row]:
    """Far field: medians by sector, and the largest."""
    for name, boundary, k, incidence in product(BODIES, boundaries, wavenumbers, range(3)):
        found = far_errors(name, boundary, k, incidence)
        row: Row = {"body": name, "d": incidence + 1, "boundary": boundary, "k": k}
        row |= {f"{a}-{b}": share for (a, b), share in zip(pairwise(EDGES), found["medians"], strict=True)}
        yield row | {key: found[key] for key in ("largest", "largest_resolved", "unresolved")}


if __name__ == "__main__":
    main((parts, far), {"parts": {"wavenumbers": KA[:2]}, "far": {"boundaries": ("soft",), "wavenumbers": (20.0,)}})
