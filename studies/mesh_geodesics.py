"""How exact are geodesics on a mesh, and what do they cost? A mesh tracer against the smooth body fitted to the mesh.

Rays start at vertices that lie on an exact body, in random tangent directions, and run for t = 2. The tracer of
geometry-central (through potpourri3d, if it is installed) unfolds triangles along straight lines; `scatterers.Mesh`
fits a smooth F first and integrates its geodesics. Ends are compared with those of the exact body at 1e-12; costs are
of one thread, the fit apart. Run ``python -m studies.mesh_geodesics [--quick]``.
"""

import argparse
import time
from importlib import import_module

import numpy as np

import creeping as cr
from creeping._typing import Any, FloatArray, IntArray
from creeping.geodesics.bundle import project_bundle
from studies.fitted_bodies import mesh_body
from tests.exact_meshes import on_body

NAMES = ("ellipsoid", "torus", "twisted")
COUNTS = (2000, 10_000, 40_000)
LENGTH = 2.0
TRACED, CARRIED = 200, 4096
"""Rays of the mesh tracer and of the fitted body."""

Row = dict[str, Any]


def rows(names: tuple[str, ...] = NAMES, counts: tuple[int, ...] = COUNTS) -> list[Row]:
    """Median and 95 % errors of the ends, L, and microseconds a ray, of each mesh."""
    out = []
    for name in names:
        for count in counts:
            exact, points, triangles = on_body(name, count)
            starts, p = _starts(exact, points, CARRIED)
            ends, _ = cr.trace(exact, points[starts], p, LENGTH, rtol=1e-12)
            row: Row = {"body": name, "vertices": len(points)}
            row |= _fitted(points, triangles, points[starts], p, ends)
            row |= _unfolded(points, triangles, starts[:TRACED], p[:TRACED], ends[:TRACED])
            out.append(row)
    return out


def _starts(exact: Any, points: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    rng = np.random.default_rng(5)
    starts = rng.integers(len(points), size=count)
    _, p = project_bundle(exact, points[starts], rng.normal(size=(count, 3)))
    return starts, p


def _fitted(points: FloatArray, triangles: IntArray, x: FloatArray, p: FloatArray, ends: FloatArray) -> Row:
    began = time.perf_counter()
    body = mesh_body(points, triangles)
    fit = time.perf_counter() - began
    flow = cr.DirectFlow(body, rtol=1e-8)
    start = project_bundle(body, x, p)
    flow.flow(start[0][:64], start[1][:64], LENGTH)
    began = time.perf_counter()
    found, _ = flow.flow(*start, LENGTH)
    cost = time.perf_counter() - began
    return {"fit s": fit, "fitted us": 1e6 * cost / len(x)} | _errors("fitted", found - ends)


def _unfolded(points: FloatArray, triangles: IntArray, starts: IntArray, p: FloatArray, ends: FloatArray) -> Row:
    try:
        tracer = import_module("potpourri3d").GeodesicTracer(points, triangles)
    except ImportError:
        return {"unfolded": "needs potpourri3d"}
    found = np.empty_like(ends)
    began = time.perf_counter()
    for row, (vertex, direction) in enumerate(zip(starts.tolist(), p, strict=True)):
        # the length is that of the direction given
        found[row] = tracer.trace_geodesic_from_vertex(vertex, LENGTH * direction)[-1]
    cost = time.perf_counter() - began
    return {"unfolded us": 1e6 * cost / len(starts)} | _errors("unfolded", found - ends)


def _errors(name: str, difference: FloatArray) -> Row:
    distance = np.linalg.norm(difference, axis=1)
    return {f"{name} median": float(np.median(distance)), f"{name} 95 %": float(np.quantile(distance, 0.95))}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Geodesics on meshes: unfolded triangles against a fitted body.")
    parser.add_argument("--quick", action="store_true", help="one small mesh of each body")
    asked = parser.parse_args()
    found = rows(counts=COUNTS[:1] if asked.quick else COUNTS)
    for row in found:
        print(
            "  ".join(
                f"{key} {value:.2g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()
            )
        )


if __name__ == "__main__":
    main()
