"""How accurate is the field on bodies with no series? Triaxial and twisted ellipsoid against fundamental solutions.

Three incidences, k = 20 and 40, soft and hard. Medians are relative, per cent; largest errors are shares of the largest
value, per cent, since relative error means nothing at a null. Run
``python -m studies field_bodies`` (six minutes), ``--quick`` for soft at k = 20 alone.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise, product

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.waves.far_geometry import fan_strips
from creeping.geometry.surface import normal, project
from creeping.rays.fan import RayFan
from studies import tables
from studies.tables import Row
from tests.reference import clouds, fundamental

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
PROTOTYPE: dict[tuple[str, float], tuple[float, ...]] = {
    ("soft", 20.0): (1.9, 7, 2.2, 1.8, 1.0, 0.9, 1.1),
    ("soft", 40.0): (4, 1.7, 1.3, 0.9, 0.5, 0.5, 0.6),
    ("hard", 20.0): (5, 11, 4.5, 2.5, 1.6, 1.1, 1.6),
    ("hard", 40.0): (4, 2.6, 1.9, 1.0, 0.6, 0.6, 0.7),
}
"""Medians of a prototype in these sectors, first incidence, per cent."""


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


def sphere_of_directions(count: int) -> FloatArray:
    """Evenly spread unit vectors (count, 3), on a spiral."""
    i = np.arange(count) + 0.5
    z, phi = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    rim = np.sqrt(1 - z * z)
    return np.stack([rim * np.cos(phi), rim * np.sin(phi), z], axis=-1)


def largest(name: str, boundary: Any, k: float, incidence: int) -> float:
    """|f| straight ahead, the largest there is, L."""
    solution = reference(name, boundary, k)
    return float(np.abs(solution.far_field(solution.directions[[incidence]])[0, incidence]))


def far_errors(name: str, boundary: Any, k: float, incidence: int, count: int = 600) -> dict[str, Any]:
    """Total far field over the sphere of directions: medians by sector, largest error, and that of resolved ones.

    Of the unresolved directions how many are 90 deg from d or less, and whether all err by no more than they state.
    """
    solution, fan = reference(name, boundary, k), fan_of(name, incidence)
    r = sphere_of_directions(count)
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


Case = tuple[str, float]


def far(cases: Sequence[Case] = tuple(PROTOTYPE)) -> Iterator[Row]:
    """Far field: medians by sector (of the triaxial body's first incidence also the prototype's), and the largest."""
    for name, (boundary, k), incidence in product(BODIES, cases, range(3)):
        found = far_errors(name, boundary, k, incidence)
        row: Row = {"body": name, "d": incidence + 1, "boundary": boundary, "k": k}
        for number, (low, high) in enumerate(pairwise(EDGES)):
            row[f"{low}-{high}"] = f"{found['medians'][number]:.2f}"
            if name == "triaxial" and incidence == 0:
                row[f"{low}-{high}"] += f" ({PROTOTYPE[boundary, k][number]:g})"
        yield row | {key: found[key] for key in ("largest", "largest_resolved", "unresolved")}


if __name__ == "__main__":
    tables.main((far,), {"far": {"cases": (("soft", 20.0),)}})
