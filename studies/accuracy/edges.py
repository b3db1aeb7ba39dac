"""How accurate are fields with edges, tips and joints? Against equations of other kinds and rings of sources inside.

``edged``: far fields by `creeping.solve` against those of `tests.reference.cases`, sixty directions each with the
forward lobe among them: bodies of revolution by Fourier modes on panels that are graded towards edges, the cube by
parity classes. For each body and boundary: nodes; root mean square and largest of the error over the directions, per
cent of the largest |f| (of the worst incidence and polarisation); share of the values whose stated error covers the
true one, per cent; stated over true error in the median; and seconds from the body to the far field of the first
incidence, compiled before.

``joints``: random incidences on capsules and cone-spheres of radius 1; for each the field on the body at points spread
over it, off it up to two radii away, and the far field in random directions. For each part: the true error that 95 of
100 keep to and the largest, per cent of the largest value of the field (off the body of the incident wave), and the
share within the stated error. What is not OK or stated to be unresolved counts like all else.

Run ``python -m studies edges --tables edged`` (a minute) or ``joints`` (half an hour), ``--quick`` for one body.
"""

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import ComplexArray, FloatArray
from scatterers.exact.profile import Arc, Line
from studies import Row, main
from studies.accuracy.bodies import kind_of, random_directions
from tests.reference import stored
from tests.reference.cases import ADMITTANCE
from tests.reference.revolution import Profile, capsule_profile, cone_sphere_profile, scatter_by_rings

BODIES: dict[str, tuple[Any, float]] = {
    "cylinder": (lambda: sc.Cylinder(1.0, 2.0), 10.0),
    "cone": (lambda: sc.Cone(1.0, 2.0), 10.0),
    "ogive": (lambda: sc.Ogive(0.5, 3.0), 10.0),
    "half_ball": (lambda: sc.Revolution([Line((0, 0), (0, 1)), Arc((0, 1), (1, 0), (0, 0))]), 10.0),
    "cube": (lambda: sc.Implicit("max(x-1,-x-1,y-1,-y-1,z-1,-z-1)", bounds=[[-1.1] * 3, [1.1] * 3]), 5.0),
}
"""Bodies of the cases ``edged_NAME`` and their wavenumbers, 1/L."""
BOUNDARIES: dict[str, Any] = {kind: kind for kind in ("hard", "soft", "pec")}
BOUNDARIES["impedance"] = cr.ImpedanceBoundary(ADMITTANCE)

CASES: dict[str, tuple[Any, Profile]] = {
    "capsule 4": (sc.Capsule(1.0, 4.0), capsule_profile(1.0, 4.0)),
    "capsule 5.3": (sc.Capsule(1.0, 5.3), capsule_profile(1.0, 5.3)),
    "cone-sphere 4": (sc.ConeSphere(1.0, 4.0), cone_sphere_profile(1.0, 4.0)),
    "cone-sphere 3.3": (sc.ConeSphere(1.0, 3.3), cone_sphere_profile(1.0, 3.3)),
}
"""Bodies with joints, and their profiles."""


def names() -> list[tuple[str, str]]:
    """Body and boundary of each far field that is stored."""
    return [(name, kind) for name in BODIES for kind in BOUNDARIES if kind in stored.read(f"edged_{name}")]


def row(name: str, kind: str, incidences: int | None = None) -> Row:
    """Nodes and errors of one body and boundary, of the first so many incidences, or of all together.

    "rms" and "largest" are of the worst incidence and polarisation, over the largest |f|; "true" and "stated" are those
    of each value (n,), L.
    """
    body, k = BODIES[name]
    case = stored.read(f"edged_{name}")
    d, r, exact = case["incident"].real[:incidences], case["directions"].real, case[kind][:, :incidences]
    found = cr.solve(body(), d, wavenumber=k, boundary=BOUNDARIES[kind])
    each = [found.far_field(r, number) for number in range(len(d))]
    true = np.abs(np.stack([far.total for far in each], axis=1) - exact)
    stated = np.stack([far.error for far in each], axis=1)
    # E of both polarisations that are scattered: one length for each incident one
    size, off = np.abs(exact), true
    if exact.ndim == 4:
        size, off = np.linalg.norm(exact, axis=2), np.linalg.norm(true, axis=2)
    size, off = size.reshape(len(r), -1), off.reshape(len(r), -1)
    rms = np.sqrt(np.mean(off**2, axis=0)) / size.max(axis=0)
    largest = off.max(axis=0) / size.max(axis=0)
    worst = {"rms": float(rms.max()), "largest": float(largest.max())}
    return {"nodes": found.nodes, **worst, "true": true.ravel(), "stated": stated.ravel()}


def seconds(name: str, kind: str) -> float:
    """Time to the far field of the first incidence, of a new body."""
    body, k = BODIES[name]
    case, boundary = stored.read(f"edged_{name}"), BOUNDARIES[kind]
    # compiles
    cr.solve(sc.Cylinder(1.0, 1.0), (1, 0, 0), wavenumber=1.0, boundary=boundary).far_field([(1, 0, 0)])
    start = time.perf_counter()
    cr.solve(body(), case["incident"][0].real, wavenumber=k, boundary=boundary).far_field(case["directions"].real)
    return time.perf_counter() - start


def edged(count: int | None = None) -> Iterator[Row]:
    """Errors of each body and boundary, per cent, and seconds; last the share of all values that is covered."""
    covered: list[Any] = []
    for name, kind in names()[:count]:
        took, one = seconds(name, kind), row(name, kind)
        covered.append(one["true"] <= one["stated"])
        shares = {"rms": 100 * one["rms"], "largest": 100 * one["largest"], "covered": 100 * np.mean(covered[-1])}
        ratio = float(np.median(one["stated"] / one["true"]))
        yield {"body": name, "boundary": kind, "nodes": one["nodes"], **shares, "ratio": ratio, "s": took}
    share = 100 * float(np.mean(np.concatenate(covered)))
    yield {"body": "all", "boundary": "", "nodes": "", "rms": "", "largest": "", "covered": share}


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


def joint_row(name: str, k: float, boundary: Any, theta: float, seed: int) -> dict[str, tuple[float, float, float]]:
    """Error of 95 of 100, largest error, and coverage, per cent, of each part; and the residual of the reference."""
    rng = np.random.default_rng(seed)
    body, profile = CASES[name]
    exact = scatter_by_rings(profile, k, [theta], boundary)
    d = exact.directions[0]
    kind = kind_of(boundary)
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=5.0, n_rays=128)
    on, n = spread(profile, rng, 400)
    off = on[:200] + rng.uniform(0.3 * 2 * np.pi / k, 2.0, 200)[:, None] * n[:200]
    r = random_directions(rng, 1500)
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
    worst = 100 * float(np.quantile(true, 0.95)) / unit, 100 * float(np.max(true)) / unit
    return *worst, 100 * float(np.mean(true <= stated))


def joints(names: Sequence[str] = tuple(CASES), wavenumbers: Sequence[float] = (20.0, 40.0)) -> Iterator[Row]:
    """Of each part: true error of 95 of 100, largest one, share covered; and what is not OK on and off the body."""
    rng = np.random.default_rng(31)
    for name in names:
        for k in wavenumbers:
            for boundary in ("hard", "soft"):
                theta = float(np.arccos(rng.uniform(-0.9, 0.9)))
                found = joint_row(name, k, boundary, theta, int(k))
                off, beside, residual = found["not OK"]
                cells = {part: "{:.2f} {:.2f} {:.1f}".format(*found[part]) for part in ("lit", "dark", "near", "far")}
                words = {"body": name, "k": k, "boundary": boundary, "theta": float(np.degrees(theta)), **cells}
                yield words | {"not OK on": off, "off": beside, "residual": residual}


if __name__ == "__main__":
    main((edged, joints), {"edged": {"count": 1}, "joints": {"names": list(CASES)[:1], "wavenumbers": (20.0,)}})
