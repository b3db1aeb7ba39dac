"""Bodies from meshes against the exact bodies that the vertices lie on; the cache, refusals, and non-smooth regions."""

import json
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
import trimesh

import creeping as cr
import scatterers as sc
from creeping.geometry.surface import normal, project
from scatterers.spline import cache as _fit_cache
from scatterers.spline.report import FitReport
from scatterers.triangles.quality import MeshQuality
from studies._meshes import capsule, on_body, scattered, slivers, torus_grid

NAMES = ("ellipsoid", "torus", "twisted")
POINTS, RAYS, LENGTH = 1000, 40, 2.0
QUANTITIES = ("position", "normals", "normal curvature", "geodesics", "attenuation")
# twice what was measured at 2000 vertices; at 10000 what the method promises for bodies of size 1 to 3
LIMITS = {
    ("ellipsoid", 2000): (4e-7, 6e-6, 1.5e-4, 1.3e-6, 3e-6),
    ("torus", 2000): (2.4e-5, 1.5e-4, 1.8e-3, 5e-5, 1.1e-4),
    ("twisted", 2000): (4e-6, 6e-5, 1.5e-3, 2.2e-5, 5e-5),
    ("ellipsoid", 10000): (1e-7, 6e-6, 3e-4, 4e-7, 4e-6),
    ("torus", 10000): (1e-7, 6e-6, 3e-4, 4e-7, 4e-6),
    ("twisted", 10000): (1e-7, 6e-6, 3e-4, 4e-7, 4e-6),
}
BALL = trimesh.creation.icosphere(3)


class Triangles:
    """The least that is a mesh."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@cache
def exact(name):
    return on_body(name, 500)[0]


@cache
def opened(name, n, kind="even"):
    """The body of a mesh: even, slivers, or with vertices off by a thousandth of an edge."""
    body, vertices, faces = on_body(name, n)
    if kind == "slivers":
        vertices, faces = slivers(body, 18)
    if kind == "noisy":
        vertices = scattered(body, vertices, faces, 1e-3)
    return sc.Mesh(Triangles(vertices, faces), cache=False)


@cache
def cloud(name):
    """Points spread evenly over a body, and directions along it."""
    body, rng = exact(name), np.random.default_rng(3)
    points = rng.uniform(*body.bounds, size=(40 * POINTS, 3))
    off = np.abs(body.level(points)) / np.linalg.norm(body.gradient(points) + 1e-9, axis=-1)
    points = project(body, points[off < 0.1][:POINTS])
    assert len(points) == POINTS
    return points, unit(np.cross(normal(body, points), rng.normal(size=points.shape)))


def curvature(body, points, along):
    gradient = body.gradient(points)
    n = unit(gradient)
    along = unit(along - np.sum(along * n, axis=-1, keepdims=True) * n)
    bent = np.einsum("...i,...ij,...j->...", along, body.hessian(points), along)
    return bent / np.linalg.norm(gradient, axis=-1)


def traced(body, points, along):
    """Ends of geodesics and integrals of max(kappa_n, 0)^(2/3) along them."""
    start = project(body, points)
    n = normal(body, start)
    along = unit(along - np.sum(along * n, axis=-1, keepdims=True) * n)
    times = np.linspace(0, LENGTH, 201)
    x, p = cr.trace(body, start, along, times, rtol=1e-11)
    rate = np.maximum(curvature(body, x, p), 0) ** (2 / 3)
    return x[:, -1], np.sum(rate[:, 1:] + rate[:, :-1], axis=1) * times[1] / 2


def curvature_error(name, n, kind="even"):
    points, along = cloud(name)
    mesh = opened(name, n, kind)
    return rms(curvature(mesh, project(mesh, points), along) - curvature(exact(name), points, along))


@cache
def errors(name, n, kind="even"):
    mesh, body = opened(name, n, kind), exact(name)
    points, along = cloud(name)
    found = project(mesh, points)
    ends, attenuation = (
        np.array(two) for two in zip(*(traced(b, points[:RAYS], along[:RAYS]) for b in (body, mesh)), strict=True)
    )
    return (
        rms(np.linalg.norm(found - points, axis=1)),
        rms(np.linalg.norm(normal(mesh, found) - normal(body, points), axis=1)),
        curvature_error(name, n, kind),
        float(np.median(np.linalg.norm(ends[1] - ends[0], axis=1))),
        rms(attenuation[1] - attenuation[0]),
    )


def sizes(*counts):
    fast = [(NAMES[0], n) for n in counts if n <= 4000]
    return [
        pytest.param(*case, marks=() if case in fast else pytest.mark.slow)
        for n in counts
        for case in [(name, n) for name in NAMES]
    ]


@pytest.mark.parametrize("name, n", sizes(2000, 10000))
def test_errors_against_the_exact_body(name, n):
    mesh = opened(name, n)
    assert mesh.quality.verdict == "smooth" and mesh.repairs == ()
    found = dict(zip(QUANTITIES, errors(name, n), strict=True))
    allowed = dict(zip(QUANTITIES, LIMITS[name, n], strict=True))
    assert {quantity: value for quantity, value in found.items() if value > allowed[quantity]} == {}
    assert not mesh.non_smooth(cloud(name)[0]).any()


@pytest.mark.parametrize("name, n", sizes(2000, 10000))
def test_own_estimate_covers_the_error_of_the_curvature(name, n):
    mesh, body = opened(name, n), exact(name)
    points, along = cloud(name)
    stated, fine = mesh.fit.normal_curvature_error, errors(name, n)[2]
    on_coarse = project(mesh.coarse_fit, points)
    coarse = rms(curvature(mesh.coarse_fit, on_coarse, along) - curvature(body, points, along))
    # a difference of two fits is no larger than the errors of both; it is taken at other points, hence twice
    assert fine <= stated <= 2 * (fine + coarse)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_order_of_the_curvature(name):
    # in between, the solver's end shows: it goes on while curvatures improve, to a different depth each time
    edges, off = zip(*((opened(name, n).quality.edge_mean, errors(name, n)[2]) for n in (2000, 40000)), strict=True)
    assert np.log(off[0] / off[1]) / np.log(edges[0] / edges[1]) > 3


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_slivers_are_as_good(name):
    # as many vertices as the even mesh or more, of all shapes
    assert opened(name, 2000, "slivers").quality.verdict == "smooth"
    assert np.all(np.array(errors(name, 2000, "slivers")) < LIMITS[name, 2000])


@pytest.mark.parametrize("name", [NAMES[0], *(pytest.param(name, marks=pytest.mark.slow) for name in NAMES[1:])])
def test_noise_is_met_and_told(name):
    mesh, clean = opened(name, 2000, "noisy"), opened(name, 2000)
    assert mesh.quality.verdict in ("smooth", "noisy")
    assert mesh.quality.noise == pytest.approx(1e-3, rel=0.3)
    assert mesh.fit.noise == pytest.approx(1e-3 * mesh.quality.edge_mean, rel=0.3)
    assert mesh.fit.smoothing > clean.fit.smoothing and mesh.fit.points == clean.quality.vertices
    true = curvature_error(name, 2000, "noisy")
    assert true < 2 * mesh.fit.normal_curvature_error
    # twice what was measured
    assert true < 0.01 * mesh.fit.normal_curvature


@cache
def ball(units=None):
    return sc.Mesh(BALL, units, cache=False)


def test_units_scale_the_body():
    metres, inches = ball(), ball("in")
    np.testing.assert_allclose(inches.bounds, 0.0254 * metres.bounds, rtol=1e-9)
    assert inches.fit.normal_curvature == pytest.approx(metres.fit.normal_curvature / 0.0254, rel=1e-6)
    # neighbours at equal distances are chosen by rounding
    assert inches.quality.curvature == pytest.approx(metres.quality.curvature, rel=1e-4)
    directions = unit(np.random.default_rng(1).normal(size=(50, 3)))
    np.testing.assert_allclose(project(inches, 0.0254 * directions), 0.0254 * directions, atol=2e-6 * 0.0254)


def test_an_object_and_a_file_are_the_same_body(tmp_path):
    # text keeps every digit
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in BALL.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (BALL.faces + 1).tolist()]
    (tmp_path / "ball.obj").write_text("\n".join(lines))
    read = sc.Mesh(tmp_path / "ball.obj", "m", cache=False)
    at = np.random.default_rng(2).uniform(-1, 1, size=(200, 3))
    np.testing.assert_allclose(read.level(at), ball().level(at), atol=1e-12)
    assert read.fit == ball().fit
    # the one is known by its bytes, the other by its arrays
    assert read.fingerprint != ball().fingerprint


def open_in(folder, messages=None, **options):
    return sc.Mesh(BALL, cache=folder, progress=None if messages is None else messages.append, **options)


def test_second_opening_takes_the_fit_from_the_cache(tmp_path):
    messages = [], []
    first, second = open_in(tmp_path, messages[0]), open_in(str(tmp_path), messages[1])
    assert [f.name for f in tmp_path.iterdir()] == [f"{first._identity()}.npz"]
    assert messages[0][0] == "reading the mesh" and "normals of 642 vertices" in messages[0]
    assert any("fitting" in line for line in messages[0])
    assert messages[1] == []
    assert second.fingerprint == first.fingerprint == ball().fingerprint
    assert (second.fit, repr(second.quality)) == (first.fit, repr(first.quality))
    at = np.random.default_rng(2).uniform(-1, 1, size=(200, 3))
    for body, again in ((first, second), (first.coarse_fit, second.coarse_fit)):
        np.testing.assert_array_equal(again.level(at), body.level(at))


def test_the_cache_does_not_need_what_reads_meshes(tmp_path):
    BALL.export(tmp_path / "ball.ply")
    made = sc.Mesh(tmp_path / "ball.ply", "m", cache=tmp_path / "fits")
    code = (
        f"import sys, scatterers as sc; body = sc.Mesh({str(tmp_path / 'ball.ply')!r}, 'm', "
        f"cache={str(tmp_path / 'fits')!r}); print(body.fingerprint, 'trimesh' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [*made.fingerprint.split(), "False"]


def test_the_users_cache_is_used_unless_told_otherwise(tmp_path, monkeypatch):
    monkeypatch.setenv("CREEPING_CACHE", str(tmp_path))
    sc.Mesh(BALL, cache=False)
    assert list(tmp_path.iterdir()) == []
    body = sc.Mesh(BALL)
    assert (tmp_path / "fits" / f"{body._identity()}.npz").is_file()


@pytest.mark.parametrize(
    "damage",
    [
        lambda b: b[: len(b) // 2],
        pytest.param(lambda b: b[:-9] + b"nonsense!", marks=pytest.mark.slow),
        pytest.param(lambda b: b"", marks=pytest.mark.slow),
    ],
)
def test_a_damaged_fit_is_made_again(tmp_path, damage):
    open_in(tmp_path)
    (file,), messages = tmp_path.iterdir(), []
    file.write_bytes(damage(file.read_bytes()))
    body = open_in(tmp_path, messages)
    assert any("fitting" in line for line in messages)
    assert body.fit == ball().fit
    assert _fit_cache.load(tmp_path, body._identity()) is not None


def test_an_unwritable_cache_is_said_and_no_more(tmp_path):
    (tmp_path / "file").write_text("")
    messages = []
    body = open_in(tmp_path / "file" / "fits", messages)
    assert body.fit == ball().fit
    assert len([line for line in messages if line.startswith("the fit is not cached: ")]) == 1


def test_what_is_asked_is_part_of_the_name():
    content = b"\0" * 100
    names = {
        _fit_cache.key_of("mesh", content, units=None, strict=False),
        _fit_cache.key_of("mesh", content, units="m", strict=False),
        _fit_cache.key_of("mesh", content, units=None, strict=True),
        _fit_cache.key_of("cad", content, units=None, strict=False),
        _fit_cache.key_of("mesh", content + b"\0", units=None, strict=False),
    }
    assert len(names) == 5


def test_reports_print_and_survive_json():
    body = ball()
    assert FitReport.from_json(json.loads(json.dumps(body.fit.to_json()))) == body.fit
    text = str(body.fit)
    assert f"fit: {body.fit.points} points" in text and "kappa_n" in text and len(text.splitlines()) == 4
    again = MeshQuality.from_json(json.loads(json.dumps(body.quality.to_json())), body.quality.badness)
    assert again.summary(10.0) == body.quality.summary(10.0)
    assert "size                       2 x 2 x 2 m" in body.quality.summary()
    assert repr(body).startswith("Mesh(mesh-") and repr(body.coarse_fit).startswith("SplineBody(mesh-")


def test_speed_weighs_the_flow():
    body = open_in(False, speed="1 + 0.1*x")
    assert body.fingerprint != ball().fingerprint
    assert cr.check_surface(body).ok


def cube():
    return trimesh.creation.box().subdivide().subdivide().subdivide()


REFUSED = {
    "cube": (cube, r"not smooth enough \(sharp\): .* lie on edges of more than 40 degrees .*; round the edges off"),
    "cube, bare": (trimesh.creation.box, r"not smooth enough \(sharp\)"),
    "coarse torus": (lambda: Triangles(*torus_grid(444)), r"not smooth enough \(too coarse\): .*; halve the edges"),
    "few vertices": (lambda: trimesh.creation.icosphere(1), r"\(too coarse\): 42 vertices are too few"),
    "capsule": (
        lambda: Triangles(*capsule(3000)),
        r"\(curvature jumps\): the curvature jumps at \d+ of \d+ vertices, .*: blend the faces",
    ),
    "open": (lambda: Triangles(BALL.vertices, BALL.faces[1:]), "3 of 1920 edges of the mesh are open"),
    "nothing": (lambda: None, "a NoneType is no mesh"),
    "words": (lambda: Triangles([["a"] * 3], BALL.faces), "not numbers"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_smooth_body_is_refused_as_strict(name, tmp_path):
    make, message = REFUSED[name]
    with pytest.raises(ValueError, match=message):
        sc.Mesh(make(), strict=True, cache=tmp_path)
    # nor is anything kept
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["open", "nothing", "words"])
def test_what_is_no_body_is_refused_by_default_too(name):
    make, message = REFUSED[name]
    with pytest.raises(ValueError, match=message):
        sc.Mesh(make(), cache=False)


@pytest.mark.parametrize("make", [trimesh.creation.box, pytest.param(cube, marks=pytest.mark.slow)])
def test_edges_are_taken_in_pieces(make):
    body = sc.Mesh(make(), cache=False)
    assert body.quality.verdict == "sharp" and len(body.pieces) == 6 and len(body.creases) == 12
    points = np.random.default_rng(4).uniform(-0.7, 0.7, size=(2000, 3))
    assert np.array_equal(body.level(points) < 0, np.all(np.abs(points) < 0.5, axis=1))


def test_a_coarse_mesh_is_judged_by_its_fit():
    body = sc.Mesh(Triangles(*torus_grid(444)), cache=False)
    assert body.quality.verdict == "too coarse" and body.creases == ()
    points, along = cloud("torus")
    off = curvature(body, project(body, points), along) - curvature(exact("torus"), points, along)
    # the error is told: within a factor of 10 of the truth
    assert rms(off) / 10 < body.fit.normal_curvature_error < 10 * rms(off) and rms(off) < 0.25
    with pytest.raises(ValueError, match="the fit has failed"):
        sc.Mesh(trimesh.creation.icosphere(1), cache=False)


@pytest.mark.parametrize(
    "times, distance, bend", [(4, 2e-7, 4e-5), pytest.param(5, 4e-9, 2e-5, marks=pytest.mark.slow)]
)
def test_vertices_are_fitted_as_well_as_their_spline_can(times, distance, bend):
    """What smooths F far from the body, where its distance has kinks, must not bend it on the body."""
    ball, sides = trimesh.creation.icosphere(subdivisions=times), (1.3, 1.0, 0.9)
    body = sc.Mesh(trimesh.Trimesh(ball.vertices * sides, ball.faces, process=False), cache=False)
    exact = sc.Ellipsoid(*sides)
    x = np.random.default_rng(11).normal(size=(1000, 3))
    x = exact.forward(x / np.linalg.norm(x, axis=1, keepdims=True))
    n = exact.gradient(x)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    e = np.cross(n, [0.3, -0.5, 0.8])
    e /= np.linalg.norm(e, axis=1, keepdims=True)

    def curvature(shape):
        return np.einsum("ni,nij,nj->n", e, shape.hessian(x), e) / np.linalg.norm(shape.gradient(x), axis=1)

    off = body.level(x) / np.linalg.norm(body.gradient(x), axis=1)
    assert np.sqrt(np.mean(off**2)) < distance
    wanted = curvature(exact)
    assert np.sqrt(np.mean((curvature(body) - wanted) ** 2)) < bend * np.sqrt(np.mean(wanted**2))
    # and the coarser fit tells it
    stated = np.sqrt(np.mean((curvature(body) - curvature(body.coarse_fit)) ** 2))
    assert stated > np.sqrt(np.mean((curvature(body) - wanted) ** 2))
