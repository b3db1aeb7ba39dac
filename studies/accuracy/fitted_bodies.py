"""How good are bodies from meshes? Fits against exact bodies, and their own estimates.

Meshes have their vertices on the body. ``even``: rms distance, angle between normals and difference of kappa_n (random
directions) over random points of T1Q, median distance of geodesics after t = 2, rms difference of the integral of
kappa_n^(2/3) along those that stay on convex regions, the fit's own estimate of the error of kappa_n, seconds, and
orders of convergence. ``awkward``: noisy and uneven meshes. ``geodesics``: rays from vertices by
the fit, and by the tracer of geometry-central (through potpourri3d, if it is installed), which unfolds triangles along
straight lines; costs on one thread, the fit apart. Run ``python -m studies fitted_bodies [--quick]``.
"""

import time
from collections.abc import Iterator
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import FloatArray, IntArray
from creeping.geodesics.states import pack, project_bundle, random_bundle_points
from creeping.geometry.surface import normal, project
from studies import Row, main
from studies.accuracy.bodies import rms
from tests.exact_meshes import on_body, scattered, slivers

LENGTH = 2.0
NAMES = ("ellipsoid", "torus", "twisted")
COUNTS = (2000, 10_000, 40_000)


def mesh_body(points: FloatArray, triangles: IntArray, **options: Any) -> Any:
    """Mesh of arrays, fitted anew."""
    return sc.Mesh(SimpleNamespace(vertices=points, faces=triangles), cache=False, **options)


def errors(exact: Any, body: Any) -> dict[str, float]:
    """Differences of a body from the exact one; see the module head."""
    x, p = random_bundle_points(exact, 3000, rng=np.random.default_rng(3))
    y = project(body, x)
    kappa = [
        np.einsum("ni,nij,nj->n", p, one.hessian(at), p) / np.linalg.norm(one.gradient(at), axis=1)
        for one, at in ((exact, x), (body, y))
    ]
    times = np.linspace(0, LENGTH, 17)
    starts = [(exact, x[:60], p[:60]), (body, *project_bundle(body, y[:60], p[:60]))]
    ends = [cr.DirectFlow(one, rtol=1e-11).transport(pack(a, b, lanes=12), times)[:, -1] for one, a, b in starts]
    convex = np.isinf(ends[0][:, 11]) & np.isinf(ends[1][:, 11])
    return {
        "position": rms(np.linalg.norm(x - y, axis=1)),
        "normal": rms(np.linalg.norm(normal(exact, x) - normal(body, y), axis=1)),
        "kappa_n": rms(kappa[0] - kappa[1]),
        "geodesic": float(np.median(np.linalg.norm(ends[0][:, :3] - ends[1][:, :3], axis=1))),
        "attenuation": rms((ends[0][:, 10] - ends[1][:, 10])[convex]),
    }


def even(counts: tuple[int, ...] = COUNTS) -> Iterator[Row]:
    """Even meshes against the exact body; lengths in m."""
    for name in NAMES:
        before: Row | None = None
        for count in counts:
            exact, points, triangles = on_body(name, count)
            started = time.process_time()
            body = mesh_body(points, triangles)
            seconds = time.process_time() - started
            row = {"body": name, "vertices": len(points), **errors(exact, body)}
            row |= {"estimate": body.fit.normal_curvature_error, "seconds": seconds, "order": float("nan")}
            if before is not None:
                # edges go like the root of the number of vertices
                ratio = 0.5 * np.log(row["vertices"] / before["vertices"])
                row["order"] = float(np.log(before["kappa_n"] / row["kappa_n"]) / ratio)
            yield row
            before = row


def awkward(count: int = 10_000) -> Iterator[Row]:
    """Noisy and uneven meshes."""
    for name in NAMES:
        exact, points, triangles = on_body(name, count)
        cases: dict[str, tuple[FloatArray, IntArray]] = {
            f"noise {amount:g} e": (scattered(exact, points, triangles, amount), triangles) for amount in (1e-3, 1e-2)
        }
        cases["slivers"] = slivers(exact, round(44 * np.sqrt(count / 10_000)))
        for case, (vertices, faces) in cases.items():
            body = mesh_body(vertices, faces)
            row = {"body": name, "case": f"{case:12}", "vertices": len(vertices), **errors(exact, body)}
            yield row | {"estimate": body.fit.normal_curvature_error, "verdict": body.quality.verdict}


def geodesics(names: tuple[str, ...] = NAMES, counts: tuple[int, ...] = COUNTS) -> Iterator[Row]:
    """Median and 95 % errors of the ends of rays of t = 2, L, and microseconds a ray, of each mesh."""
    for name in names:
        for count in counts:
            exact, points, triangles = on_body(name, count)
            rng = np.random.default_rng(5)
            starts = rng.integers(len(points), size=4096)
            _, p = project_bundle(exact, points[starts], rng.normal(size=(4096, 3)))
            ends, _ = cr.trace(exact, points[starts], p, LENGTH, rtol=1e-12)
            row: Row = {"body": name, "vertices": len(points)}
            row |= _fitted(points, triangles, points[starts], p, ends)
            # fewer: it takes as long
            row |= _unfolded(points, triangles, starts[:200], p[:200], ends[:200])
            yield row


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


if __name__ == "__main__":
    quick: dict[str, Any] = {"even": {"counts": COUNTS[:2]}, "awkward": {"count": 2000}}
    main((even, awkward, geodesics), quick | {"geodesics": {"counts": COUNTS[:1]}})
