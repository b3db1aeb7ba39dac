"""Fields: a far-field cut on the exact curve, on a body, along rays, and the quality of meshes."""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any
from creeping.plotting import decay_picture, far_cut_picture, surface_field_picture
from creeping.plotting.pictures import MeshValues, mesh_picture
from studies.accuracy.field import fan_of, sphere_fan, surface_errors
from tests.exact_meshes import almond
from tests.reference import sphere


def cut(path: Path, quick: bool) -> dict[str, Any]:
    """Far field of a hard sphere, ka = 30: creeping rays, reflection and forward lobe on the exact curve."""
    ka = 30.0
    step = 1.0 if quick else 0.25
    theta = np.radians(np.arange(0, 180 + step / 2, step))
    fan = sphere_fan(6.6)
    directions = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    field = cr.far_field(fan, directions, wavenumber=ka, boundary="hard")
    exact = sphere.far_field(ka, 1.0, np.cos(theta), "hard")
    error = np.abs(field.total - exact)
    share = {
        "largest_over_largest": float(error.max() / np.abs(exact).max()),
        "median_relative": float(np.median(error / np.abs(exact))),
    }
    look: dict[str, Any] = {"angle_name": "angle from the forward direction", "title": "Hard sphere, ka = 30"}
    far_cut_picture(path, theta, {"asymptotic": field}, exact=exact, parts=True, dpi=100 if quick else 300, **look)
    return {
        "parameters": {"body": "Sphere()", "ka": ka, "boundary": "hard", "rays": len(fan.points), "step_degrees": step},
        "error": {"field": share},
        "headline": f"against partial waves: median {100 * share['median_relative']:.2f} %, largest "
        f"{100 * share['largest_over_largest']:.2f} % of the largest value",
    }


def body(path: Path, quick: bool) -> dict[str, Any]:
    """Field on a hard triaxial ellipsoid, k = 40, in decibels: light, penumbra, and the shadow with its caustics."""
    k = 20.0 if quick else 40.0
    fan = fan_of("triaxial", 0)
    drawn_by = surface_field_picture(
        path, fan, wavenumber=k, boundary="hard", cells=48 if quick else None, dpi=100 if quick else 300
    )
    thirds, share = surface_errors("triaxial", "hard", k, 0, 2)
    return {
        "parameters": _asked(fan, k) | {"drawn_by": drawn_by, "version": cr.__version__},
        "error": {"field": {"median_relative_by_arclength": thirds, "median_over_largest": share}},
        "headline": "in the shadow against fundamental solutions, s = 0.3 to 0.9: median "
        f"{np.median(thirds):.1f} %, or {share:.1f} % of the largest value",
    }


def decay(path: Path, quick: bool) -> dict[str, Any]:
    """Decay along creeping rays of a hard triaxial ellipsoid, k = 40, with the caustics that each ray passes."""
    k = 40.0
    line = fan_of("triaxial", 0).line
    flow = cr.build_phase_map(line.body, tolerance=1e-6)
    fan = cr.launch(flow, line, length=4.0, n_rays=384, n_steps=400)
    decay_picture(path, fan, wavenumber=k, boundary="hard", dpi=100 if quick else 300)
    both = [np.abs(cr.surface_field(fan, wavenumber=k, boundary="hard", order=order)) for order in (1, 2)]
    shadow = (fan.travel_time > 0.3) & (fan.travel_time < 0.9)
    change = float(np.median(np.abs(both[1][:, shadow] / both[0][:, shadow] - 1)))
    return {
        "parameters": _asked(fan, k),
        "error": {"field": {"second_order_changes_by": change}},
        "headline": f"second order changes the amplitude by {100 * change:.0f} % (median, s = 0.3 to 0.9)",
    }


def _asked(fan: cr.RayFan, k: float) -> dict[str, Any]:
    """Parameters of a hard body."""
    direction = np.asarray(fan.line.direction).tolist()
    told = {"direction": direction, "wavenumber": k, "boundary": "hard", "rays": len(fan.points)}
    return {"body": repr(fan.body), **told}


def mesh_quality(path: Path, quick: bool) -> dict[str, Any]:
    """Is a mesh smooth enough? One made elsewhere (pyvista's sphere of 422 vertices) and the tip of the NASA almond."""
    vertices, triangles = almond(10_000 if quick else 40_000)
    sources: list[tuple[str, Any, str | None]] = [
        ("sphere.ply of pyvista", shipped_mesh(), "mm"),
        ("NASA almond, 1 m", SimpleNamespace(vertices=vertices, faces=triangles), None),
    ]
    reports, shown = {}, []
    for name, source, units in sources:
        mesh, quality = sc.examined_mesh(source, units)
        title = f"{name}: {quality.verdict}"
        shown.append(MeshValues(mesh.vertices, mesh.triangles, quality.badness, quality.bad, title))
        reports[name] = {**quality.to_json(), "summary": quality.summary().splitlines()}
        if name.startswith("NASA"):
            nearest = float(np.linalg.norm(mesh.vertices[quality.bad] - [0.583333, 0, 0], axis=1).min())
    mesh_picture(path, *shown, dpi=100 if quick else 200)
    return {
        "parameters": {"meshes": list(reports)},
        "error": {"quality": reports},
        "headline": f"{reports['sphere.ply of pyvista']['verdict']}; almond {reports['NASA almond, 1 m']['verdict']}, "
        f"rough {1e3 * nearest:.1f} mm from its tip",
    }


def shipped_mesh() -> Path:
    """The mesh of a sphere that comes with pyvista."""
    spec = importlib.util.find_spec("pyvista")
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).parent / "examples" / "sphere.ply"
