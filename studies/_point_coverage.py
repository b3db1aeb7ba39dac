"""Coverage of the errors of fields at points about a body: the points, the parts they fall into, shares, the table.

A case is a body, a wavenumber and a random incidence. Of the points of a part whose status is OK: share in which the
true error is within the stated one, per cent, stated over true error in the median, and a quantile of the true error.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np

import creeping as cr
from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.quadrature import body_nodes
from creeping.rays.fan import RayFan
from creeping.shadow.attachment import occluded
from studies.field_coverage import bodies

HEIGHTS = (0.03, 3.0)
Row = dict[str, float]


def random_fan(name: str, rng: np.random.Generator) -> RayFan:
    """Fan of a random incidence on a body that is not singular."""
    body = bodies()[name][0]
    while True:
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        try:
            line = cr.shadow_line(body, direction=d)
            break
        except SingularIncidenceError:
            continue
    return cr.launch(cr.DirectFlow(body), line, length=4.0, n_rays=128)


def places(name: str, d: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Points off the body, points on it with their normals, and which of the first are about the axis."""
    body = bodies()[name][0]
    nodes = body_nodes(body, 20.0)
    pick = rng.choice(len(nodes.points), 700, p=nodes.weights / nodes.weights.sum())
    on, normals = nodes.points[pick], nodes.normals[pick]
    height = np.exp(rng.uniform(np.log(HEIGHTS[0]), np.log(HEIGHTS[1]), 600))
    off = on[:600] + height[:, None] * normals[:600]
    axis = rng.uniform(1.1, 4.0, 100)[:, None] * d + 0.1 * rng.normal(size=(100, 3))
    points = np.concatenate([off, axis])
    outside = body.level(points) > 0
    return points[outside], on, normals, (np.arange(700) >= 600)[outside]


def parts_off(fan: RayFan, points: FloatArray, axis: BoolArray, close: BoolArray) -> dict[str, BoolArray]:
    """Which points off the body (n,) are of which part; ``close`` of the layer (n,), or (n, 2) for polarisations."""
    # one column for each polarisation
    columns = (-1, *[1] * (close.ndim - 1))
    dark = occluded(fan.body, points, fan.line.direction).reshape(columns)
    behind = axis.reshape(columns)
    return {
        "lit": ~dark & ~close,
        "close": close,
        "shadow": dark & ~behind & ~close,
        "axis": dark & behind & ~close,
    }


def bright(fan: RayFan, on: FloatArray, normals: FloatArray) -> BoolArray:
    """Which points on the body (n,) are lit."""
    found = np.asarray(normals @ fan.line.direction < 0)
    found[found] = ~occluded(fan.body, on[found], fan.line.direction)
    return found


def not_ok(near: Any, surface: Any) -> Row:
    """Per cent of the values off the body and on it that are not OK, and of those off it that are and come by rays."""
    return {
        "off": 100 * float(np.mean(~near.ok)),
        "on": 100 * float(np.mean(~surface.ok)),
        "rays": 100 * float(np.mean((near.method == "rays") & near.ok)),
    }


def coverage(
    part: str, true: FloatArray, field: Any, mask: BoolArray, *, residual: float, unit: float = 1.0, quantile: float
) -> Row:
    """Coverage, per cent, ratio and quantile of the true error, per cent of ``unit``, of one part: NaN if it is empty.

    ``residual`` is the reference's own error, which counts for nobody.
    """
    at = mask & field.ok
    if not np.any(at):
        return dict.fromkeys((part, f"{part} ratio", f"{part} error"), np.nan)
    return {
        part: 100 * float(np.mean(true[at] <= field.error[at] + residual)),
        f"{part} ratio": float(np.median(field.error[at] / true[at])),
        f"{part} error": 100 * float(np.quantile(true[at] / unit, quantile)),
    }


def cases(*axes: Sequence[Any], quick: bool) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Seeds and cases: every combination of values, the body first and the wavenumber last.

    If quick those of the first body at the first wavenumber alone.
    """
    kept = [values[:1] if quick and number in (0, len(axes) - 1) else values for number, values in enumerate(axes)]
    for case in product(*kept):
        yield 100 * axes[0].index(case[0]) + int(case[-1]), case


def print_table(
    head: str, parts: Sequence[str], rows: Iterator[tuple[str, Row]], cell: Callable[[Row, str], str]
) -> None:
    """Print rows, each as it comes, and what all of them come to; the words of a row stand before its cells.

    The head ends with what of "off", "on" and "rays" is told at the end of each row.
    """
    print(head)
    last = ("off", "on", "rays") if "rays" in head else ("off", "on")
    every = []
    for words, found in rows:
        every.append(found)
        cells = "".join(cell(found, part) for part in parts)
        print(f"{words} {cells}   " + " ".join(f"{found[name]:5.1f}" for name in last), flush=True)
    for part in parts:
        covers, ratios = ([found[f"{part}{what}"] for found in every] for what in ("", " ratio"))
        print(f"{part:8} covered {np.nanmean(covers):.1f} %, least {np.nanmin(covers):.1f}", end="; ")
        print(f"ratio {np.nanmedian(ratios):.1f}")
