"""Coarse files of tori, where their folder lies beside the project, against the closed form."""

from pathlib import Path

import numpy as np
import pytest

import scatterers as sc

FOLDER = Path(__file__).parents[3] / "shared" / "bodies"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not FOLDER.is_dir(), reason="no folder of real bodies"),
]
TORI = {"oded_torus.obj": (1.0, 0.25), "occ_torus_default_resolution.stl": (20.0, 10.0)}


def distances(body, points):
    return body.level(points) / np.linalg.norm(body.gradient(points), axis=1)


def torus_points(name):
    """Points (n, 3), m, all over the torus of a file, unit tangents along and around, and the curvatures there."""
    mesh, _ = sc.examined_mesh(FOLDER / name, "m")
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    axis = int(np.argmin(high - low))
    radius, minor = TORI[name]
    u, v = np.random.default_rng(4).uniform(0, 2 * np.pi, (2, 2000))
    zero = np.zeros_like(u)
    rho = radius + minor * np.cos(u)
    found = [
        np.stack([rho * np.cos(v), rho * np.sin(v), minor * np.sin(u)], axis=1),
        np.stack([-np.sin(v), np.cos(v), zero], axis=1),
        np.stack([-np.sin(u) * np.cos(v), -np.sin(u) * np.sin(v), np.cos(u)], axis=1),
    ]
    x, along, around = (np.roll(one, axis + 1, axis=1) for one in found)
    return x + 0.5 * (low + high), np.stack([along, around]), np.stack([np.cos(u) / rho, zero + 1 / minor])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("subdivide", [None, 1])
@pytest.mark.parametrize("name", TORI)
def test_a_torus_errs_as_stated(name, subdivide):
    body = sc.Mesh(FOLDER / name, "m", subdivide=subdivide, cache=False)
    x, tangents, wanted = torus_points(name)
    slope = np.linalg.norm(body.gradient(x), axis=1)
    error = rms(np.einsum("kni,nij,knj->kn", tangents, body.hessian(x), tangents) / slope - wanted)
    assert error / rms(wanted) < body.fit.normal_curvature_error / body.fit.normal_curvature
    # points lie between vertices, where the fit is free
    assert rms(distances(body, x)) < 1.3 * body.fit.misfit
    turned = np.cross(*tangents) * np.sign(np.sum(np.cross(*tangents) * body.gradient(x), axis=1, keepdims=True))
    assert rms(np.linalg.norm(body.gradient(x) / slope[:, None] - turned, axis=1)) < body.fit.turn
    assert subdivide or rms(distances(body, x)) < 5e-4 * float(np.max(body.quality.size))
