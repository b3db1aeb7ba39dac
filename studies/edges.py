"""How accurate is the far field of bodies with edges and tips? `creeping.solve` against equations of other kinds.

Far fields of `tests.reference.cases`, sixty directions each with the forward lobe among them: bodies of revolution by
Fourier modes on panels that are graded towards edges, the cube by parity classes. For each body and boundary: nodes;
root mean square and largest of the error over the directions, per cent of the largest |f| (of the worst incidence and
polarisation); share of the values whose stated error covers the true one, per cent; stated over true error in the
median; and seconds from the body to the far field of the first incidence, compiled before.

Run ``python -m studies.edges`` (a minute).
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import FloatArray
from scatterers.exact.profile import Arc, Line, Segment
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


@dataclass(frozen=True)
class Row:
    """Errors of one body and boundary.

    Attributes
    ----------
    nodes : int
    rms, largest : float
        Of the worst incidence and polarisation, over the largest |f|.
    true, stated : (n,), L
        Error of each value, and what is stated of it.
    """

    nodes: int
    rms: float
    largest: float
    true: FloatArray
    stated: FloatArray

    @property
    def covered(self) -> float:
        """Share of the values whose stated error covers the true one."""
        return float(np.mean(self.true <= self.stated))


def names() -> list[tuple[str, str]]:
    """Body and boundary of each far field that is stored."""
    return [(name, kind) for name in BODIES for kind in BOUNDARIES if kind in stored.read(f"edged_{name}")]


def row(name: str, kind: str, incidences: int | None = None) -> Row:
    """Errors of one body and boundary, of the first so many incidences, or of all together."""
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
    return Row(found.nodes, float(rms.max()), float(largest.max()), true.ravel(), stated.ravel())


def seconds(name: str, kind: str) -> float:
    """Time to the far field of the first incidence, of a new body."""
    body, k = BODIES[name]
    case, boundary = stored.read(f"edged_{name}"), BOUNDARIES[kind]
    # compiles
    cr.solve(sc.Cylinder(1.0, 1.0), (1, 0, 0), wavenumber=1.0, boundary=boundary).far_field([(1, 0, 0)])
    start = time.perf_counter()
    cr.solve(body(), case["incident"][0].real, wavenumber=k, boundary=boundary).far_field(case["directions"].real)
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    print(f"{'body, boundary':22} {'nodes':>6} {'rms %':>7} {'largest %':>10} {'covered %':>10} {'ratio':>6} {'s':>6}")
    rows = []
    for name, kind in names():
        took = seconds(name, kind)
        one = row(name, kind)
        rows.append(one)
        ratio = np.median(one.stated / one.true)
        shares = f"{100 * one.rms:7.3f} {100 * one.largest:10.3f} {100 * one.covered:10.1f}"
        print(f"{name + ', ' + kind:22} {one.nodes:6d} {shares} {ratio:6.1f} {took:6.1f}", flush=True)
    covered = np.mean(np.concatenate([one.true <= one.stated for one in rows]))
    print(f"stated errors cover {100 * covered:.1f} % of all values")


if __name__ == "__main__":
    main()
