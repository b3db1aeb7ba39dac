"""Are shadow lines at sweep speed right in every direction? 1000 incidences on five bodies, two references.

Lines of the three meshes, the finer ones where needed, against (a) the finest mesh for all and (b) the independent
`creeping.shadow_line`, panels of exact points, on every tenth direction. Times are processor times on one thread, the
least of three, with 256 launch points. Run ``python -m studies sweep_lines [--quick]`` (three minutes).
"""

import time
from collections.abc import Iterator
from functools import cache, partial
from typing import NamedTuple

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.incident import rows_of
from creeping.shadow.arcs import finished
from creeping.shadow.curves import Curves
from creeping.shadow.line import TOGETHER, shadow_lines
from creeping.shadow.meshes import LineMeshes, critical_distances, judged, prepared, traced
from creeping.shadow.refinement import FORBIDDEN
from creeping.shadow.status import FOLLOWED, INCIDENCE_STATUSES, NEAR_SINGULAR, OK, SINGULAR
from studies import tables
from studies.cost.flow_cases import seconds_of, threads
from studies.tables import Row

BODIES: dict[str, Any] = {
    "ellipsoid": lambda: sc.Ellipsoid(1.2, 0.8, 0.8),
    "torus": sc.Torus,
    "twisted": sc.TwistedEllipsoid,
    "peanut": lambda: sc.Implicit("(x**2 + y**2 + z**2 + 0.64)**2 - 2.56*x**2 - 0.6561"),
    "bumpy": lambda: sc.Implicit("x**2 + y**2 + z**2 - 1 - 0.3*sin(3*x)*sin(3*y)*sin(3*z)"),
}
SHARES = ("attached", "occluded", "concave")
RAYS = 256
REPEATS = 3


class Lines(NamedTuple):
    """Lines of n incidences: status, curves, length and shares (n,) and (n, 3), and v."""

    status: Any
    curves: FloatArray
    length: FloatArray
    shares: FloatArray
    singular_distance: FloatArray


def on_mesh(body: Any, directions: FloatArray, tier: int) -> Lines:
    """Lines on one mesh; none is sought on another or followed."""
    waves, numbers = rows_of(directions), np.full((len(directions), 5), np.nan)
    certain = np.zeros(len(directions), dtype=bool)
    for start in range(0, len(waves), TOGETHER):
        nodes, sure = traced(body, waves[start : start + TOGETHER], tier)
        rows = start + np.flatnonzero([one is not None for one in nodes])
        curves = Curves.of(waves[rows], [one for one in nodes if one is not None])
        found = finished(body, curves, RAYS)
        numbers[rows] = np.column_stack([curves.counts, curves.lengths, found.shares])
        certain[rows] = sure[rows - start] & found.certain
    v = critical_distances(body, directions)
    _, status = judged(v, certain, prepared(body).turn(tier), LineMeshes.count - 2)
    status[v < FORBIDDEN] = SINGULAR
    return Lines(status, numbers[:, 0], numbers[:, 1], numbers[:, 2:], v)


def swept(body: Any, directions: FloatArray) -> Lines:
    """Lines as a sweep gets them."""
    found = shadow_lines(body, directions, RAYS)
    shares = np.stack([found.attached, found.occluded, found.concave], axis=1)
    return Lines(found.status, found.curves, found.length, shares, found.singular_distance)


def independent(body: Any, directions: FloatArray) -> tuple[Lines, float]:
    """Lines by `shadow_line`, and seconds of each."""
    n = len(directions)
    nothing = np.full((n, 6), np.nan)
    lines = Lines(np.zeros(n, np.int8), nothing[:, 0], nothing[:, 1], nothing[:, 2:5], nothing[:, 5])
    started = time.process_time()
    for row, d in enumerate(directions):
        try:
            line = cr.shadow_line(body, d)
        except cr.SingularIncidenceError:
            lines.status[row] = SINGULAR
            continue
        lines.curves[row], lines.length[row] = len(line.curves), line.length
        lines.shares[row] = [line.fractions[name] for name in SHARES]
    return lines, (time.process_time() - started) / n


def differences(found: Lines, exact: Lines) -> Row:
    """Lines that differ in the number of curves, and worst errors: of status OK, and of all (in brackets)."""
    both = np.isfinite(found.length) & np.isfinite(exact.length) & (exact.status < SINGULAR)
    certain = both & (found.status == OK)
    length = np.abs(found.length / np.where(both, exact.length, 1.0) - 1)
    share = np.abs(found.shares - exact.shares)
    row: Row = {}
    for suffix, rows in (("", certain), (", all", both)):
        row[f"counts differ{suffix}"] = int(np.sum(found.curves[rows] != exact.curves[rows]))
        row[f"length{suffix}"] = float(np.max(length[rows], initial=0.0))
        for k, name in enumerate(SHARES):
            row[f"{name}{suffix}"] = float(np.max(share[rows, k], initial=0.0))
    return row | {"compared": int(both.sum())}


@cache
def measured(name: str, count: int, every: int) -> tuple[Row, Row, Row]:
    """One body: cost and statuses, then errors against the finest mesh and against the independent line."""
    body, directions = BODIES[name](), fibonacci_directions(count)
    found = swept(body, directions)
    seconds, meshes = (
        seconds_of(call, REPEATS) / count
        for call in (partial(swept, body, directions), partial(on_mesh, body, directions, 0))
    )
    second = int(np.sum(on_mesh(body, directions, 0).status != OK))
    third = int(np.sum(on_mesh(body, directions, 1).status != OK))
    first: Row = {"body": name, "us a line": 1e6 * seconds, "on the first mesh": 1e6 * meshes}
    for code in (OK, NEAR_SINGULAR, FOLLOWED, SINGULAR):
        first[INCIDENCE_STATUSES[code].split(":")[0]] = int(np.sum(found.status == code))
    least = np.min(found.singular_distance)
    first |= {"need mesh 2": second, "need mesh 3": third}
    counts = np.unique(found.curves[np.isfinite(found.curves)]).astype(int)
    first |= {"curves seen": " ".join(map(str, counts)), "least v": float(least) if np.isfinite(least) else np.nan}
    exact = on_mesh(body, directions, 2)
    # what even the finest mesh is not certain of is no reference
    exact.length[exact.status == FOLLOWED] = np.nan
    one_by_one, each = independent(body, directions[::every])
    few = Lines(*(values[::every] for values in found))
    against = {"body": name, "s a line": each, **differences(few, one_by_one)}
    return first, {"body": name, **differences(found, exact)}, against


def lines(names: tuple[str, ...] = tuple(BODIES), count: int = 1000, every: int = 10) -> Iterator[Row]:
    """Cost of a line (and without following single lines), statuses, meshes and curves of Fibonacci incidences."""
    return (measured(name, count, every)[0] for name in names)


def finest(names: tuple[str, ...] = tuple(BODIES), count: int = 1000, every: int = 10) -> Iterator[Row]:
    """Against the finest mesh: counts that differ and worst errors, of certain lines and of all."""
    return (measured(name, count, every)[1] for name in names)


def panels(names: tuple[str, ...] = tuple(BODIES), count: int = 1000, every: int = 10) -> Iterator[Row]:
    """Against shadow_line, some of them: the same."""
    return (measured(name, count, every)[2] for name in names)


if __name__ == "__main__":
    with threads(1):
        tables.main((lines, finest, panels), {name: {"count": 100} for name in ("lines", "finest", "panels")})
