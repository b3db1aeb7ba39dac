"""How far off are fields of bodies with joints, and do their stated errors cover it? Against rings of sources inside.

Random incidences on capsules and cone-spheres of radius 1; for each the field on the body at points spread over it,
off it up to two radii away, and the far field in random directions. For each part: the true error that 95 of 100 keep
to and the largest, per cent of the largest value of the field (off the body of the incident wave), and the share within
the stated error. What is not OK or stated to be unresolved counts like all else.

Run ``python -m studies joints`` (half an hour), ``--quick`` for one capsule at the lowest wavenumber.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import ComplexArray, FloatArray
from studies import tables
from studies.accuracy.bodies import random_directions
from studies.tables import Row
from tests.reference.revolution import Profile, capsule_profile, cone_sphere_profile, scatter_by_rings

CASES: dict[str, tuple[Any, Profile]] = {
    "capsule 4": (sc.Capsule(1.0, 4.0), capsule_profile(1.0, 4.0)),
    "capsule 5.3": (sc.Capsule(1.0, 5.3), capsule_profile(1.0, 5.3)),
    "cone-sphere 4": (sc.ConeSphere(1.0, 4.0), cone_sphere_profile(1.0, 4.0)),
    "cone-sphere 3.3": (sc.ConeSphere(1.0, 3.3), cone_sphere_profile(1.0, 3.3)),
}
WAVENUMBERS = (20.0, 40.0)
COUNT, FAR_COUNT = 400, 1500
"""Points on and off the body, and far directions."""
PARTS = ("lit", "dark", "near", "far")


def spread(profile: Profile, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    """Points spread evenly over a body of revolution, and normals there (count, 3)."""
    places: list[FloatArray] = []
    widest = float(np.max(profile.at(np.linspace(0, profile.length, 500))[0][:, 0]))
    while len(places) < count:
        s = rng.uniform(0, profile.length, 1)
        if rng.uniform() * widest < profile.at(s)[0][0, 0]:
            places.append(s)
    x, n = profile.at(np.concatenate(places))
    phi = rng.uniform(0, 2 * np.pi, count)
    turn = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    return tuple(np.concatenate([one[:, :1] * turn, one[:, 1:]], axis=1) for one in (x, n))  # type: ignore[return-value]


def row(name: str, k: float, boundary: Any, theta: float, seed: int) -> dict[str, tuple[float, float, float]]:
    """Error of 95 of 100, largest error, and coverage, per cent, of each part; and the residual of the reference."""
    rng = np.random.default_rng(seed)
    body, profile = CASES[name]
    exact = scatter_by_rings(profile, k, [theta], boundary)
    d = exact.directions[0]
    kind: Any = cr.ImpedanceBoundary(boundary) if not isinstance(boundary, str) else boundary
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=5.0, n_rays=128)
    on, n = spread(profile, rng, COUNT)
    off = on[: COUNT // 2] + rng.uniform(0.3 * 2 * np.pi / k, 2.0, COUNT // 2)[:, None] * n[: COUNT // 2]
    r = random_directions(rng, FAR_COUNT)
    surface = cr.surface_field(fan, on, wavenumber=k, boundary=kind)
    near = cr.near_field(fan, off, wavenumber=k, boundary=kind)
    far = cr.far_field(fan, r, wavenumber=k, boundary=kind)
    u = (exact.normal_derivative(on, n) if boundary == "soft" else exact.total(on))[:, 0]
    lit = n @ d < 0
    largest = float(np.max(np.abs(u)))
    found = {
        "lit": _judged((surface.values - u)[lit], surface.error[lit], largest),
        "dark": _judged((surface.values - u)[~lit], surface.error[~lit], largest),
        "near": _judged(near.values - exact.total(off)[:, 0], near.error, 1.0),
    }
    f = exact.far_field(r)[:, 0]
    found["far"] = _judged(far.total - f, far.error, float(np.max(np.abs(f))))
    found["not OK"] = (100 * float(np.mean(~surface.ok)), 100 * float(np.mean(~near.ok)), float(exact.residual[0]))
    return found


def _judged(off: ComplexArray, stated: FloatArray, unit: float) -> tuple[float, float, float]:
    true = np.abs(off)
    return (
        100 * float(np.quantile(true, 0.95)) / unit,
        100 * float(np.max(true)) / unit,
        100 * float(np.mean(true <= stated)),
    )


def coverage(names: Sequence[str] = tuple(CASES), wavenumbers: Sequence[float] = WAVENUMBERS) -> Iterator[Row]:
    """Of each part: true error of 95 of 100, largest one, share covered; and what is not OK on and off the body."""
    rng = np.random.default_rng(31)
    for name in names:
        for k in wavenumbers:
            for boundary in ("hard", "soft"):
                theta = float(np.arccos(rng.uniform(-0.9, 0.9)))
                found = row(name, k, boundary, theta, int(k))
                off, beside, residual = found["not OK"]
                cells = {part: "{:.2f} {:.2f} {:.1f}".format(*found[part]) for part in PARTS}
                words = {"body": name, "k": k, "boundary": boundary, "theta": float(np.degrees(theta)), **cells}
                yield words | {"not OK on": off, "off": beside, "residual": residual}


if __name__ == "__main__":
    tables.main((coverage,), {"coverage": {"names": list(CASES)[:1], "wavenumbers": WAVENUMBERS[:1]}})
