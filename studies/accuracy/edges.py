"""How accurate is the far field of bodies with edges and tips? `creeping.solve` against equations of other kinds.

Far fields of `tests.reference.cases`, sixty directions each with the forward lobe among them: bodies of revolution by
Fourier modes on panels that are graded towards edges, the cube by parity classes. For each body and boundary: nodes;
root mean square and largest of the error over the directions, per cent of the largest |f| (of the worst incidence and
polarisation); share of the values whose stated error covers the true one, per cent; stated over true error in the
median; and seconds from the body to the far field of the first incidence, compiled before.

Run ``python -m studies edges`` (a minute), ``--quick`` for one body.
"""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from scatterers.exact.profile import Arc, Line, Segment
from studies import tables
from studies.tables import Row
from tests.reference import stored
from tests.reference.cases import ADMITTANCE

HALF_BALL: list[Segment] = [Line((0, 0), (0, 1)), Arc((0, 1), (1, 0), (0, 0))]
"""Profile, L."""
BODIES: dict[str, tuple[Any, float]] = {
    "cylinder": (lambda: sc.Cylinder(1.0, 2.0), 10.0),
    "cone": (lambda: sc.Cone(1.0, 2.0), 10.0),
    "ogive": (lambda: sc.Ogive(0.5, 3.0), 10.0),
    "half_ball": (lambda: sc.Revolution(HALF_BALL), 10.0),
    "cube": (lambda: sc.Implicit("max(x-1,-x-1,y-1,-y-1,z-1,-z-1)", bounds=[[-1.1] * 3, [1.1] * 3]), 5.0),
}
"""Bodies of the cases ``edged_NAME`` and their wavenumbers, 1/L."""
BOUNDARIES: dict[str, Any] = {
    "hard": "hard",
    "soft": "soft",
    "impedance": cr.ImpedanceBoundary(ADMITTANCE),
    "pec": "pec",
}


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


def coverage(count: int | None = None) -> Iterator[Row]:
    """Errors of each body and boundary, per cent, and seconds; last the share of all values that is covered."""
    covered: list[Any] = []
    for name, kind in names()[:count]:
        took, one = seconds(name, kind), row(name, kind)
        covered.append(one["true"] <= one["stated"])
        shares = {
            "rms": 100 * one["rms"],
            "largest": 100 * one["largest"],
            "covered": 100 * float(np.mean(covered[-1])),
        }
        ratio = float(np.median(one["stated"] / one["true"]))
        yield {"body": name, "boundary": kind, "nodes": one["nodes"], **shares, "ratio": ratio, "s": took}
    share = 100 * float(np.mean(np.concatenate(covered)))
    yield {"body": "all", "boundary": "", "nodes": "", "rms": "", "largest": "", "covered": share}


if __name__ == "__main__":
    tables.main((coverage,), {"coverage": {"count": 1}})
