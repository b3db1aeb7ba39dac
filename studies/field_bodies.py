"""How accurate is the field on bodies with no series? Triaxial and twisted ellipsoid against fundamental solutions.

Three incidences, k = 20 and 40, soft and hard. Medians are relative, per cent; largest errors are shares of the largest
value, per cent, since relative error means nothing at a null. Run ``python -m studies.field_bodies`` (six minutes).
"""

from functools import cache
from itertools import pairwise

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.far_geometry import fan_strips
from creeping.geometry.surface import normal, project
from creeping.rays.fan import RayFan
from creeping.rays.shedding import shed_near
from creeping.shadow.attachment import occluded
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
REACHES = (0.05, 0.2, 0.5, 1.0, 2.0)


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


def scan_jump(name: str, boundary: Any, k: float, incidence: int, azimuth: float) -> float:
    """Largest change of the error between neighbours of a scan, 0 to 180 deg by 1.25, as a share of |f| ahead."""
    fan = fan_of(name, incidence)
    d = fan.line.direction
    e = np.cross(d, [0, 0, 1.0])
    e /= np.linalg.norm(e)
    side = np.cos(azimuth) * e + np.sin(azimuth) * np.cross(d, e)
    theta = np.radians(np.arange(0, 180.1, 1.25))[:, None]
    r = np.cos(theta) * d + np.sin(theta) * side
    found = cr.far_field(fan, r, wavenumber=k, boundary=boundary, method="rays").total
    error = found - reference(name, boundary, k).far_field(r)[:, incidence]
    return float(100 * np.max(np.abs(np.diff(error))) / largest(name, boundary, k, incidence))


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


def near_errors(name: str, boundary: Any, k: float, incidence: int) -> tuple[list[float], list[float]]:
    """Total field off the body in the shadow by rays, launched at s = 0.15 to 1.1: medians by reach, and at all.

    Points on caustics in space, |J + l J'| < 0.25 on a ray through them, are left out. The second list holds the median
    over all points, the largest error as a share of the largest value, and the least |J + l J'| at that point.
    """
    solution, fan = reference(name, boundary, k), fan_of(name, incidence)
    strip = fan_strips(fan)[0]
    rng = np.random.default_rng(0)
    medians, shares, errors, tubes, sizes = [], [], [], [], []
    for reach in REACHES:
        start = strip.at(rng.uniform(*strip.span, 150), rng.uniform(0.15, 1.1, 150))
        y = start.points + reach * start.directions
        y = y[occluded(fan.body, y, fan.line.direction)]
        shed = shed_near(fan_strips(fan), fan.body, y)
        tube = np.full(len(y), np.inf)
        np.minimum.at(tube, shed.observer, np.abs(shed.rays.spreading + shed.reach * shed.rays.spreading_rate))
        y, tube = y[tube > 0.25], tube[tube > 0.25]
        found = cr.near_field(fan, y, wavenumber=k, boundary=boundary, method="rays")
        exact = solution.total(y)[:, incidence]
        errors.append(np.abs(found - exact))
        sizes.append(np.abs(exact))
        shares.append(100 * errors[-1] / sizes[-1])
        tubes.append(tube)
        medians.append(float(np.median(shares[-1])))
    error, size, tube = np.concatenate(errors), np.concatenate(sizes), np.concatenate(tubes)
    at = int(np.argmax(error))
    return medians, [float(np.median(np.concatenate(shares))), float(100 * error[at] / size.max()), float(tube[at])]


def reciprocity(name: str, boundary: Any, k: float) -> float:
    """Largest |f(d -> r) - f(-r -> -d)| over pairs 8 to 150 deg apart, share of the largest |f| ahead, per cent."""
    body = BODIES[name][0]
    flow = cr.build_phase_map(body, tolerance=1e-6)
    rng = np.random.default_rng(1)
    worst, ahead = 0.0, 0.0
    for theta in np.radians([8.0, 15, 22, 30, 40, 60, 90, 120, 150]):
        d, side = rng.normal(size=(2, 3))
        d = d / np.linalg.norm(d)
        side = np.cross(d, side)
        r = np.cos(theta) * d + np.sin(theta) * side / np.linalg.norm(side)
        both = []
        for incident, observer in ((d, r), (-r, -d)):
            fan = cr.launch(flow, cr.shadow_line(body, incident), length=5.0, n_rays=256)
            found = cr.far_field(fan, [observer, incident], wavenumber=k, boundary=boundary, method="rays").total
            both.append(found[0])
            ahead = max(ahead, abs(found[1]))
        worst = max(worst, abs(both[0] - both[1]))
    return 100 * worst / ahead


def main() -> None:
    """Print the tables."""
    for name in BODIES:
        for (boundary, k), limits in PROTOTYPE.items():
            print(
                f"{name}, {boundary}, k = {k:g}: reference's residual {reference(name, boundary, k).residual.max():.0e}"
            )
            if name == "triaxial":
                print("  far, prototype     " + " ".join(f"{v:6.2f}" for v in limits))
            for incidence in range(3):
                far = far_errors(name, boundary, k, incidence)
                jump = max(scan_jump(name, boundary, k, incidence, azimuth) for azimuth in (0.4, 1.9))
                surface, share = surface_errors(name, boundary, k, incidence, 2)
                first, _ = surface_errors(name, boundary, k, incidence, 1)
                print(
                    f"  d{incidence + 1} far medians     {' '.join(f'{v:6.2f}' for v in far['medians'])}; largest "
                    f"{far['largest']:.2f}, resolved {far['largest_resolved']:.2f} ({far['unresolved']} of 600 not), "
                    f"jump {jump:.2f}"
                )
                print(
                    f"     surface medians {' '.join(f'{v:6.2f}' for v in surface)} (first order "
                    f"{' '.join(f'{v:.1f}' for v in first)}), {share:.2f} of the largest"
                )
                if name == "triaxial":
                    medians, (every, worst, tube) = near_errors(name, boundary, k, incidence)
                    print(
                        f"     near medians    {' '.join(f'{v:6.2f}' for v in medians)}; all {every:.2f}; largest "
                        f"{worst:.1f} where |J + lJ'| = {tube:.2f}"
                    )
    for name in BODIES:
        print(
            f"reciprocity, {name}, soft and hard, k = 20:",
            *(f"{reciprocity(name, b, 20.0):.2f}" for b in ("soft", "hard")),
        )


if __name__ == "__main__":
    main()
