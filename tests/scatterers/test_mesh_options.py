"""Options of a mesh, what its cache keeps, and grids of very fine meshes."""

import hashlib
import io
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

import scatterers as sc
from creeping.geometry.surface import project
from studies._meshes import geodesic_sphere


@pytest.mark.parametrize(
    "options, match",
    [
        ({"units": ["m"]}, "units = .* is no text"),
        ({"strict": "yes"}, "strict = 'yes' is neither True nor False"),
        ({"cache": 5}, "cache = 5 is neither True, False nor a folder"),
        ({"cache": None}, "cache = None is neither"),
    ],
)
def test_options_are_checked(options, match):
    with pytest.raises(ValueError, match=match):
        sc.Mesh("nowhere.stl", **options)


def test_progress_must_be_callable():
    with pytest.raises(TypeError, match="progress = 3 cannot be called"):
        sc.Mesh("nowhere.stl", progress=3)


def test_badness_comes_back_from_the_cache(tmp_path):
    points, triangles = geodesic_sphere(1000)
    made = [sc.Mesh(SimpleNamespace(vertices=points, faces=triangles), cache=tmp_path) for _ in range(2)]
    assert made[0].quality.badness.shape == (len(points),)
    np.testing.assert_array_equal(made[1].quality.badness, made[0].quality.badness)


@pytest.mark.slow
def test_fine_meshes_are_fitted_on_the_grid_that_suffices(monkeypatch):
    points, triangles = geodesic_sphere(4000)
    monkeypatch.setattr("scatterers.mesh.GRID", 20_000)
    body = sc.Mesh(SimpleNamespace(vertices=points, faces=triangles), cache=False)
    assert np.prod(body.fit.nodes) <= 20_000
    # vertices alone, and a coarser grid than theirs
    assert body.fit.points == len(points) and body.fit.spacing > 2 * body.quality.edge_mean
    x = project(body, points[::7])
    hessian, gradient = body.hessian(x), body.gradient(x)
    mean = 0.5 * (np.trace(hessian, axis1=1, axis2=2) / np.linalg.norm(gradient, axis=1))
    n = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    mean -= 0.5 * np.einsum("ni,nij,nj->n", n, hessian, n) / np.linalg.norm(gradient, axis=1)
    assert np.sqrt(np.mean((mean - 1) ** 2)) < 2e-3


SIGNED = {
    "no archive": lambda content: b"none",
    "cut short": lambda content: content[: len(content) // 2],
    "damaged inside": lambda content: content[:2000] + bytes(500) + content[2500:],
    "text without a report": lambda content: repacked(content, text=np.frombuffer(b'{"fit": 3}', dtype=np.uint8)),
    "report of another kind": lambda content: repacked(
        content,
        text=np.frombuffer(b'{"fit": 3, "reach": 1, "quality": {}, "repairs": []}', dtype=np.uint8),
    ),
    "flat coefficients": lambda content: repacked(content, **{"fine-coefficients": np.zeros(5)}),
    "few coefficients": lambda content: repacked(content, **{"coarse-coefficients": np.zeros((2, 2, 2))}),
    "NaN": lambda content: repacked(content, **{"fine-coefficients": np.full((9, 9, 9), np.nan)}),
    "grid of no size": lambda content: repacked(content, **{"fine-grid": np.zeros((2, 3))}),
}


def repacked(content, **changed):
    with np.load(io.BytesIO(content)) as held:
        arrays = {name: held[name] for name in held.files} | changed
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    return packed.getvalue()


@pytest.mark.slow
@pytest.mark.parametrize("which", SIGNED)
def test_a_stored_fit_that_is_signed_and_none_is_made_anew(which, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3)
    first = sc.Mesh(ball, cache=tmp_path)
    (place,) = tmp_path.glob("*.npz")
    whole = place.read_bytes()
    content = SIGNED[which](whole[32:])
    place.write_bytes(hashlib.blake2b(content, digest_size=32).digest() + content)
    assert sc.Mesh(ball, cache=tmp_path).level([1.1, 0, 0]) == first.level([1.1, 0, 0])
    assert place.read_bytes()[32:100] == whole[32:100] and len(place.read_bytes()) == len(whole)
