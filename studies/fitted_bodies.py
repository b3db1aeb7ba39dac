"""How good are bodies from meshes, CAD files and expressions? Fits against exact bodies, and their own estimates.

Table 1: even meshes whose vertices lie on the body; rms distance, angle between normals and difference of kappa_n
(random directions) over random points of T1Q, median distance of geodesics after t = 2, rms difference of the integral
of kappa_n^(2/3) along those that stay on convex regions, the fit's own estimate of the error of kappa_n, seconds, and
orders of convergence. Table 2: noisy and uneven meshes. Table 3: fan and far field of one ellipsoid as Implicit, Mesh
and Cad against the exact one, with the estimates that the library reports. Table 4: maps of genus 2 and of a peanut.
Run ``python -m studies.fitted_bodies [--quick]``.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import FloatArray, IntArray
from creeping.geodesics.bundle import project_bundle, random_bundle_points
from creeping.geodesics.states import pack
from creeping.geometry.surface import normal, project
from tests.exact_meshes import on_body, scattered, slivers

POINTS, RAYS, LENGTH = 3000, 60, 2.0
NAMES = ("ellipsoid", "torus", "twisted")
COUNTS = (2000, 10_000, 40_000)
WAVENUMBER = 20.0
PEANUT = "(x**2 + y**2 + z**2 + 0.64)**2 - 4*0.64*x**2 - 0.9**4"
RING = "-4*((sqrt((x {}1.1)**2 + y**2) - 0.9)**2 + z**2 - 0.16)"
GENUS_2 = f"-log(exp({RING.format('-')}) + exp({RING.format('+ ')}))/4"


def mesh_body(points: FloatArray, triangles: IntArray, **options: Any) -> Any:
    """Mesh of arrays, fitted anew."""
    return sc.Mesh(SimpleNamespace(vertices=points, faces=triangles), cache=False, **options)


def errors(exact: Any, body: Any, seed: int = 3) -> dict[str, float]:
    """Differences of a body from the exact one; see the module head."""
    x, p = random_bundle_points(exact, POINTS, rng=np.random.default_rng(seed))
    y = project(body, x)
    kappa = [
        np.einsum("ni,nij,nj->n", p, one.hessian(at), p) / np.linalg.norm(one.gradient(at), axis=1)
        for one, at in ((exact, x), (body, y))
    ]
    times = np.linspace(0, LENGTH, 17)
    starts = [(exact, x[:RAYS], p[:RAYS]), (body, *project_bundle(body, y[:RAYS], p[:RAYS]))]
    ends = [cr.DirectFlow(one, rtol=1e-11).transport(pack(a, b, lanes=12), times)[:, -1] for one, a, b in starts]
    convex = np.isinf(ends[0][:, 11]) & np.isinf(ends[1][:, 11])
    return {
        "position": _rms(np.linalg.norm(x - y, axis=1)),
        "normal": _rms(np.linalg.norm(normal(exact, x) - normal(body, y), axis=1)),
        "kappa_n": _rms(kappa[0] - kappa[1]),
        "geodesic": float(np.median(np.linalg.norm(ends[0][:, :3] - ends[1][:, :3], axis=1))),
        "attenuation": _rms((ends[0][:, 10] - ends[1][:, 10])[convex]),
    }


def fitted_rows(counts: tuple[int, ...]) -> list[dict[str, Any]]:
    """Table 1."""
    rows = []
    for name in NAMES:
        before: dict[str, Any] | None = None
        for count in counts:
            exact, points, triangles = on_body(name, count)
            started = time.process_time()
            body = mesh_body(points, triangles)
            seconds = time.process_time() - started
            row = {"body": name, "vertices": len(points), **errors(exact, body)}
            row |= {"estimate": body.fit.normal_curvature_error, "seconds": seconds}
            if before is not None:
                # edges go like the root of the number of vertices
                ratio = 0.5 * np.log(row["vertices"] / before["vertices"])
                row["order"] = float(np.log(before["kappa_n"] / row["kappa_n"]) / ratio)
            rows.append(row)
            before = row
    return rows


def awkward_rows(count: int) -> list[dict[str, Any]]:
    """Table 2."""
    rows = []
    for name in NAMES:
        exact, points, triangles = on_body(name, count)
        cases: dict[str, tuple[FloatArray, IntArray]] = {
            f"noise {amount:g} e": (scattered(exact, points, triangles, amount), triangles) for amount in (1e-3, 1e-2)
        }
        cases["slivers"] = slivers(exact, round(44 * np.sqrt(count / 10_000)))
        for case, (vertices, faces) in cases.items():
            body = mesh_body(vertices, faces)
            row = {"body": name, "case": case, "vertices": len(vertices), "verdict": body.quality.verdict}
            row |= {**errors(exact, body), "estimate": body.fit.normal_curvature_error}
            rows.append(row)
    return rows


def ellipsoids(count: int) -> dict[str, Callable[[], Any]]:
    """Makers of one ellipsoid from an expression, a mesh and, where gmsh is installed, a CAD file."""

    def cad() -> Any:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "ellipsoid.step"
            write_ellipsoid(path)
            return sc.Cad(path, points=count, cache=False)

    return {
        "Implicit": lambda: sc.Implicit("x**2/1.44 + y**2/0.64 + z**2/0.64 - 1"),
        "Mesh": lambda: mesh_body(*on_body("ellipsoid", count)[1:]),
        "Cad": cad,
    }


def write_ellipsoid(path: Path) -> None:
    """STEP file of the ellipsoid 1.2, 0.8, 0.8 m, by gmsh in a process of its own."""
    import subprocess

    code = (
        "import gmsh, sys; gmsh.initialize(readConfigFiles=False); gmsh.option.setNumber('General.Terminal', 0); "
        "m = gmsh.model.occ; s = m.addSphere(0, 0, 0, 1000); m.dilate([(3, s)], 0, 0, 0, 1.2, 0.8, 0.8); "
        "m.synchronize(); gmsh.write(sys.argv[1])"
    )
    subprocess.run([sys.executable, "-c", code, str(path)], check=True, capture_output=True)


def chain_rows(count: int) -> list[dict[str, Any]]:
    """Table 3."""
    exact = sc.Ellipsoid(1.2, 0.8, 0.8)
    direction = (1.0, 1.0, 1.0)
    angles = np.radians(np.arange(0.0, 181.0, 2.0))
    looks = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=1)

    def fan_of(body: Any) -> cr.RayFan:
        line = cr.shadow_line(body, direction, n_points=128)
        return cr.launch(cr.DirectFlow(body, rtol=1e-10), line, length=4.0, n_rays=128, n_steps=128, max_gap=np.inf)

    reference = fan_of(exact)
    rows = []
    for name, make in ellipsoids(count).items():
        body = make()
        fan = fan_of(body)
        line = abs(fan.line.curves[0].length - reference.line.curves[0].length)
        row: dict[str, Any] = {"body": name, "line": line}
        known = cr.body_uncertainty(fan)
        if known is not None:
            row |= {"points, said": known.points, "J, said": known.spreading, "A, said": known.attenuation}
        row |= _against(exact, fan)
        for boundary in ("soft", "hard"):
            asked: dict[str, Any] = {"wavenumber": WAVENUMBER, "boundary": boundary}
            f, g = (cr.far_field(one, looks, **asked).total for one in (fan, reference))
            said = cr.far_field_uncertainty(fan, looks, **asked)
            largest = float(np.abs(g).max())
            row[f"far {boundary}"] = _rms(np.abs(f - g)) / largest
            row[f"{boundary}, said"] = float("nan") if said is None else _rms(said) / largest
        rows.append(row)
    return rows


def _against(exact: Any, fan: cr.RayFan) -> dict[str, float]:
    """The fan's rays against those of the exact body from the same points."""
    some = slice(None, None, 4)
    x, p = project_bundle(exact, project(exact, fan.points[some, 0]), fan.directions[some, 0])
    end = cr.DirectFlow(exact, rtol=1e-11).transport(pack(x, p, lanes=12), fan.travel_time)[:, -1]
    return {
        "points": _rms(np.linalg.norm(end[:, :3] - fan.points[some, -1], axis=1)),
        "J": _rms(end[:, 6] - fan.spreading[some, -1]),
        "A": _rms(end[:, 10] - fan.attenuation[some, -1]),
    }


def map_rows() -> list[dict[str, Any]]:
    """Table 4."""
    rows = []
    for name, text, direction in (("peanut", PEANUT, (1.0, 0.05, 0.02)), ("genus 2", GENUS_2, (0.3, 0.2, 1.0))):
        body = sc.Implicit(text)
        started = time.process_time()
        flow = cr.build_phase_map(body, tolerance=1e-5, cache=False)
        seconds = time.process_time() - started
        line = cr.shadow_line(body, direction)
        rows.append(
            {
                "body": name,
                "charts": len(body.atlas.charts),
                "T0": flow.horizon,
                "rms": flow.error.rms,
                "max": flow.error.max,
                "MB": flow.nbytes / 1e6,
                "seconds": seconds,
                "shadow lines": " ".join(f"{curve.length:.8f}" for curve in line.curves),
            }
        )
    return rows


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if values.size else float("nan")


def _show(title: str, rows: list[dict[str, Any]]) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = [names] + [[_text(row.get(name, "")) for name in names] for row in rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(names))]
    print(f"\n{title}")
    for row in table:
        print("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)))


def _text(value: Any) -> str:
    return f"{value:.2g}" if isinstance(value, float) else str(value)


def main() -> None:
    """Print the tables."""
    quick = "--quick" in sys.argv[1:]
    counts = COUNTS[:2] if quick else COUNTS
    _show("Table 1: even meshes against the exact body; lengths in m.", fitted_rows(counts))
    _show("Table 2: noisy and uneven meshes.", awkward_rows(2000 if quick else 10_000))
    title = f"Table 3: fan of length 4 and far field at k = {WAVENUMBER:g} (shares of the largest) of an ellipsoid."
    _show(title, chain_rows(2000 if quick else 10_000))
    _show("Table 4: maps with tolerance 1e-5.", map_rows())


if __name__ == "__main__":
    main()
