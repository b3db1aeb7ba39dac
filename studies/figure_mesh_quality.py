"""Is a mesh smooth enough? One made elsewhere (pyvista's sphere of 422 vertices) and the tip of the NASA almond."""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import scatterers as sc
from creeping._typing import Any
from creeping.plotting.mesh_picture import MeshValues, mesh_picture
from tests.exact_meshes import almond


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
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
