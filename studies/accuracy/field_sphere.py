"""How accurate is the field on a sphere? Every part of it against exact series, over ka = 10, 30, 100, 300.

Errors are relative, per cent. The creeping part alone is judged by its Regge poles, since in the backward half it is
far below the total. Run ``python -m studies field_sphere`` (about a minute).
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import scalar_boundaries
from creeping.field.waves.far_geometry import far_geometry
from creeping.field.waves.far_rays import isolated_rays
from creeping.field.waves.forward import fan_half
from creeping.rays.fan import RayFan
from studies import tables
from studies.tables import Row
from tests.reference import sphere, watson

KA = (10.0, 30.0, 100.0, 300.0)
AZIMUTH = 0.3
"""Of the observers, radians: nothing may depend on it."""
BESIDE = np.arange(30, 151, 10.0)
"""Angles at which isolated rays are judged, degrees."""
LIMITS: dict[str, tuple[float, ...]] = {
    "creeping rays, soft, first order": (17, 8, 3.4, 2.7),
    "creeping rays, soft": (3, 0.9, 0.3, 0.08),
    "creeping rays, hard, first order": (62, 47, 29, 19),
    "creeping rays, hard": (9, 3, 0.8, 0.3),
    "back axis, soft, first order": (23, 10, 4.3, 2.7),
    "back axis, soft": (1.3, 0.35, 0.08, 0.02),
    "back axis, hard, first order": (76, 51, 33, 23),
    "back axis, hard": (8, 2.6, 0.7, 0.24),
    "forward, soft": (2.6, 0.7, 0.15, 0.04),
    "forward, hard": (10, 2.2, 0.4, 0.1),
    "total at 60 deg, soft": (1.5, 0.5, 0.09, 0.01),
    "total at 60 deg, hard": (18, 6, 2, 0.7),
    "near field in the shadow, soft": (6, 3, 1.4, 1.4),
    "near field in the shadow, hard": (7, 8, 3, 0.9),
    "PEC, E in the plane, from 20 deg": (39, 7, 2, 0.4),
    "PEC, E across the plane, from 20 deg": (33, 11, 4, 1.6),
}
"""Figures of a prototype of the same formulas, per cent, as rounded there: to be reproduced within a factor 1.5."""


def sphere_fan(length: float = 6.2) -> RayFan:
    """Fan of the unit sphere for incidence along z, once round; a map of 1e-6 would show at ka = 300, in the phase."""
    body = sc.Sphere()
    flow = cr.build_phase_map(body, tolerance=1e-7)
    return cr.launch(flow, cr.shadow_line(body, (0, 0, 1)), length=length, n_rays=256)


def observers(theta: FloatArray) -> FloatArray:
    """Directions at angles theta (m,) from the forward direction: (m, 3)."""
    sin = np.sin(theta)
    return np.stack([sin * np.cos(AZIMUTH), sin * np.sin(AZIMUTH), np.cos(theta)], axis=-1)


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
    directions = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    found = cr.far_field(fan, directions, wavenumber=k, boundary="pec", method="rays").total
    across, within = sphere.pec_far_field(k, 1.0, np.cos(theta))
    return worst(found[:, component, component], across if component else within)


def row_functions() -> dict[str, Callable[[RayFan, float], float]]:
    """What computes each row of LIMITS from a fan and ka."""
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
    return {name: rows[name] for name in LIMITS}


def parts(wavenumbers: Sequence[float] = KA) -> Iterator[Row]:
    """Largest relative error, per cent, by ka, and in brackets that of the prototype."""
    fan = sphere_fan()
    for name, function in row_functions().items():
        limits = dict(zip(KA, LIMITS[name], strict=True))
        yield {"part": f"{name:36}"} | {f"ka = {k:g}": f"{function(fan, k):.3g} ({limits[k]:g})" for k in wavenumbers}


if __name__ == "__main__":
    tables.main((parts,), {"parts": {"wavenumbers": KA[:2]}})
