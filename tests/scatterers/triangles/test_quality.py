"""Verdicts on meshes: smooth ones even and uneven, noisy, sharp, too coarse, and C1 ones whose curvature jumps."""

import json

import numpy as np
import pytest
import trimesh

import scatterers as sc
from scatterers.triangles.jets import osculating_jets
from scatterers.triangles.quality import MeshQuality, assess
from tests.exact_meshes import almond, capsule, geodesic_sphere, noisy, slivers, torus_grid

make = trimesh.creation


def judged(vertices, triangles):
    vertices = np.array(vertices, dtype=float)
    triangles = np.array(triangles)
    return assess(vertices, triangles, osculating_jets(vertices, triangles))


def even(body, n):
    points, triangles = geodesic_sphere(n)
    return body.forward(points), triangles


def single(vertices, triangles):
    return vertices.astype(np.float32), triangles


def of(mesh):
    return mesh.vertices, mesh.faces


ELLIPSOID, TORUS, TWISTED = sc.Ellipsoid(1.2, 0.8, 0.8), sc.Torus(), sc.TwistedEllipsoid()
SMOOTH = {
    "ellipsoid 2k, single": lambda: single(*even(ELLIPSOID, 2000)),
    "torus 2k": lambda: torus_grid(2000),
    "torus slivers": lambda: slivers(TORUS, 32),
    "twisted slivers": lambda: slivers(TWISTED, 32),
    "ball by latitudes": lambda: of(make.uv_sphere(count=[32, 64])),
}
FAULTY = {
    "cube": (lambda: of(make.box()), "sharp"),
    "cube, divided": (lambda: of(make.box().subdivide().subdivide().subdivide()), "sharp"),
    "cone": (lambda: of(make.cone(1, 2).subdivide_to_size(0.3)), "sharp"),
    "capsule 5k": (lambda: capsule(5000), "curvature jumps"),
    "capsule of long triangles": (lambda: of(make.capsule(height=2, radius=0.5, count=[32, 64])), "too coarse"),
    "torus 444": (lambda: torus_grid(444), "too coarse"),
    "ball, 42": (lambda: of(make.icosphere(1)), "too coarse"),
    "noise .01, 2k": (lambda: noisy(*even(TWISTED, 2000), 1e-2), "noisy"),
    "noise .05 on slivers": (lambda: noisy(*slivers(TORUS, 32), 5e-2), "noisy"),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if "2k" in name else pytest.mark.slow) for name in SMOOTH]
)
def test_smooth_meshes_pass(name):
    quality = judged(*SMOOTH[name]())
    assert quality.verdict == "smooth", quality
    assert quality.bad_share == 0 and quality.jumps == 0 and not quality.bad.any()
    assert quality.noise < 1e-5


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if "slivers" in name else ()) for name in FAULTY]
)
def test_faults_are_named(name):
    source, verdict = FAULTY[name]
    quality = judged(*source())
    assert quality.verdict == verdict, quality
    assert ";" in quality.reasons


@pytest.mark.parametrize("amount", [3e-4, 5e-2])
def test_noise_is_measured(amount):
    quality = judged(*noisy(*even(TWISTED, 2000), amount))
    assert quality.noise == pytest.approx(amount, rel=0.15)


def test_figures():
    quality = judged(*of(make.icosphere(4)))
    assert (quality.vertices, quality.triangles) == (2562, 5120)
    np.testing.assert_allclose(quality.size, 2, rtol=1e-12)
    assert quality.edge_min < quality.edge_mean < quality.edge_max < 0.1
    # the sphere's triangles turn by about kappa times twice a third of their heights
    assert 0.5 * quality.edge_mean < np.radians(quality.dihedral[0]) < 0.8 * quality.edge_mean
    assert quality.curvature == pytest.approx(quality.edge_mean, rel=1e-3)
    assert quality.badness.shape == (2562,) and quality.badness.max() < 1e-4
    assert judged(*of(make.box())).dihedral[2] == pytest.approx(90)


def test_rims_are_where_the_badness_is():
    body = make.box().subdivide().subdivide().subdivide()
    quality = judged(*of(body))
    distance = np.sort(0.5 - np.abs(body.vertices), axis=1)[:, 1]
    assert quality.bad[distance < 1e-9].mean() > 0.9
    assert not quality.bad[distance > 0.3].any()


def test_tips_are_bad():
    """Jets at a tip may follow one side of it, both degrees alike; the almond's tip passed as smooth."""
    points, triangles = almond(4000)
    quality = judged(points, triangles[:, ::-1])
    tip = int(np.argmax(points[:, 0]))
    assert quality.bad[tip] and quality.badness[tip] > 0.5


def test_summary_and_json():
    quality = judged(*torus_grid(2000))
    text = quality.summary()
    assert "smooth" in text and "3 x 3 x 1 m" in text and "wavelengths" not in text
    assert "6 x 6 x 2 wavelengths" in quality.summary(4 * np.pi)
    again = MeshQuality.from_json(json.loads(json.dumps(quality.to_json())), quality.badness)
    assert again.summary(2.0) == quality.summary(2.0) and repr(again) == repr(quality)
    np.testing.assert_array_equal(again.bad, quality.bad)
    for wavenumber in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match=r"wavenumber = .* is not positive and finite"):
            quality.summary(wavenumber)
