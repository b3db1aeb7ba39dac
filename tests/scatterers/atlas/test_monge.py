"""The atlas for bodies of any genus: its cover, charts and locator, a map on it, and the clouds it starts from."""

from functools import cache

import numpy as np
import pytest
from body_checks import located, unit
from scipy.spatial import cKDTree

import creeping as cr
import scatterers as sc
from creeping.geodesics.states import random_bundle_points
from creeping.geometry.evaluators import polar_frame
from creeping.geometry.surface import project
from scatterers.charts.monge import MongeAtlas
from scatterers.charts.samples import body_cloud, onto, sign_changes


def ring(x):
    return f"(sqrt((sqrt((x - {x})**2 + y**2) - 0.7)**2 + z**2) - 0.3)"


GENUS_2 = f"-log(exp(-12*{ring(-0.85)}) + exp(-12*{ring(0.85)}))/12"
SHAPES = {"ellipsoid": lambda: sc.Ellipsoid(1.2, 0.8, 0.8), "torus": sc.Torus, "genus 2": lambda: sc.Implicit(GENUS_2)}
# points of the clouds, and how many charts they may take
SIZES = {"ellipsoid": (12000, 55), "torus": (20000, 145), "genus 2": (25000, 360)}
every = pytest.mark.parametrize(
    "name", ["torus", *(pytest.param(name, marks=pytest.mark.slow) for name in ("ellipsoid", "genus 2"))]
)


class Covered:
    """A body whose only charts are those of its cover."""

    speed = None

    def __init__(self, shape, count):
        self.level, self.gradient, self.hessian = shape.level, shape.gradient, shape.hessian
        self.bounds = np.asarray(shape.bounds)
        self.compiled = shape.compiled
        self.cloud = body_cloud(shape.level, shape.gradient, self.bounds, count)
        self.atlas = MongeAtlas.covering(shape.level, shape.gradient, shape.hessian, self.cloud)

    def parameters(self, points):
        return points[..., :2]


@cache
def covered(name):
    return Covered(SHAPES[name](), SIZES[name][0])


def on(body, rng, n):
    """Points that the cover was not made from: those of a cloud, moved by several of its gaps."""
    points = body.cloud[rng.integers(len(body.cloud), size=n)]
    return project(body, points + 0.03 * rng.uniform(-1, 1, (n, 3)), iterations=20)


@every
def test_every_point_is_in_the_unit_square_of_its_chart_which_is_inverted(rng, name):
    body = covered(name)
    points, atlas = on(body, rng, 10_000), body.atlas
    chart, uv = atlas.locate(points)
    assert np.all(chart >= 0) and np.all((uv >= 0) & (uv <= 1))
    assert len(atlas.charts) <= SIZES[name][1]
    assert np.max(np.linalg.norm(atlas.graphs[chart].points(uv) - points, axis=-1)) < 1e-12
    for k in (0, len(atlas.charts) - 1):
        mine = uv[chart == k]
        np.testing.assert_allclose(atlas.charts[k].point(mine), points[chart == k], atol=1e-12)
        assert atlas.charts[k].point(mine[:, None]).shape == (len(mine), 1, 3)
    found, found_uv, frame = located(body, points, body.gradient(points))
    same = found == chart
    # two charts may suit a point equally well
    assert np.mean(same) > 0.999
    np.testing.assert_allclose(found_uv[same], uv[same], atol=1e-13)
    for k in np.unique(chart)[:5]:
        mine = same & (chart == k)
        np.testing.assert_allclose(frame[mine], polar_frame(atlas.charts[k].tangents(uv[mine])), atol=1e-11)


@every
def test_charts_reach_beyond_their_squares(rng, name):
    body = covered(name)
    graphs = body.atlas.graphs
    uv = rng.uniform(-0.3, 1.3, (200, 1, 2))
    uv[:4, 0] = [[-0.3, -0.3], [1.3, -0.3], [-0.3, 1.3], [1.3, 1.3]]
    x = graphs.points(uv)
    assert np.max(np.abs(body.level(x))) < 1e-11
    flat = np.einsum("nij,pnj->pni", graphs.axes[:, :2], x - graphs.centres) / graphs.half[:, None]
    np.testing.assert_allclose(flat, np.broadcast_to(2 * uv - 1, flat.shape), atol=1e-12)
    assert np.min(np.sum(unit(body.gradient(x)) * graphs.axes[:, 2], axis=-1)) > 0.1


@every
def test_polar_frame_is_the_least_rotation(rng, name):
    body = covered(name)
    for chart in body.atlas.charts[:3]:
        uv = rng.uniform(-0.3, 1.3, (50, 2))
        n = unit(body.gradient(chart.point(uv)))
        e, across = chart.graph.axes[:2], chart.graph.axes[2]
        turn = (n @ e.T)[:, None, :] * ((n + across) / (1 + n @ across)[:, None])[..., None]
        np.testing.assert_allclose(polar_frame(chart.tangents(uv)), e.T - turn, atol=1e-13)


def test_compiled_locator_bears_any_input():
    body = covered("torus")
    bad = [np.nan, np.inf, -np.inf, 1e300, -1e300, 50.0, 0.0]
    points = np.array([[a, b, c] for a in bad for b in bad for c in bad])
    for gradients in (points, np.zeros_like(points), np.ones_like(points), -points):
        chart, uv, _ = located(body, points, gradients)
        assert np.all((chart >= 0) & (chart < len(body.atlas.charts)))
        assert np.all(np.abs(uv - 0.5) < 0.8 + 1e-12)


def test_points_off_the_body_have_no_chart():
    chart, uv = covered("ellipsoid").atlas.locate(np.array([[[0, 0, 0], [np.nan, 0, 0]], [[0, 1e100, 1], [1.2, 0, 0]]]))
    np.testing.assert_array_equal(chart < 0, [[True, True], [True, False]])
    np.testing.assert_array_equal(np.isnan(uv).all(axis=-1), chart < 0)


@every
def test_check_passes(name):
    report = cr.check_surface(covered(name))
    assert report.ok, report
    assert report.genus == {"ellipsoid": 0, "torus": 1, "genus 2": 2}[name]


@pytest.mark.slow
def test_phase_map_in_space(rng):
    body = covered("ellipsoid")
    flow = cr.build_phase_map(body, horizon=1 / 8, grid=(16, 24), degree=5, method="direct", cache=False)
    # 1.3e-8 measured
    assert flow.error.rms < 1e-7
    x, p = random_bundle_points(body, 100, rng=rng)
    off = np.concatenate(flow.apply(x, p), axis=-1) - np.concatenate(cr.trace(body, x, p, flow.horizon), axis=-1)
    assert np.sqrt(np.mean(np.sum(off**2, axis=-1))) < 1e-7


def test_cover_is_the_same_each_time():
    body = covered("ellipsoid")
    again = MongeAtlas.covering(body.level, body.gradient, body.hessian, body.cloud)
    np.testing.assert_array_equal(again.parameters, body.atlas.parameters)
    assert again.digest == body.atlas.digest != covered("torus").atlas.digest


def test_small_and_large_bodies_take_the_same_charts():
    body = Covered(sc.Ellipsoid(1.2e-3, 0.8e-3, 0.8e-3), 12000)
    assert abs(len(body.atlas.charts) - len(covered("ellipsoid").atlas.charts)) <= 5


@pytest.mark.parametrize("name, area", [("ellipsoid", 10.1), ("torus", 19.7)])
def test_cloud_is_on_the_body_and_as_dense_as_asked(name, area):
    body = SHAPES[name]()
    for count in (500, 20_000):
        cloud = body_cloud(body.level, body.gradient, body.bounds, count)
        assert 0.75 * count < len(cloud) < 1.6 * count
        assert np.max(np.abs(body.level(cloud))) < 1e-12
        # no holes
        other = body_cloud(body.level, body.gradient, body.bounds, 3 * count)
        assert np.max(cKDTree(cloud).query(other)[0]) < 1.3 * np.sqrt(area / count)


def test_sign_changes_ignore_what_is_not_a_number():
    x, y, z = np.meshgrid(*3 * [np.linspace(-2, 2, 21)], indexing="ij")
    values = np.sqrt(x**2 + y**2 + z**2) - 1.03
    whole = sign_changes(values, np.full(3, -2.0), np.full(3, 0.2))
    np.testing.assert_allclose(np.linalg.norm(whole, axis=-1), 1.03, atol=0.01)
    values[np.abs(values) > 0.5] = np.nan
    np.testing.assert_array_equal(sign_changes(values, np.full(3, -2.0), np.full(3, 0.2)), whole)


THIN = sc.Ellipsoid(1.0, 1.0, 0.05)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: MongeAtlas.covering(*parts(THIN), cloud_of(THIN)), "thin"),
        (lambda: MongeAtlas.covering(*parts(sc.Sphere()), cloud_of(sc.Sphere())[::60]), "denser cloud"),
        (lambda: MongeAtlas.covering(*parts(sc.Sphere()), np.eye(3)), r"shape \(3, 3\)"),
        (lambda: MongeAtlas.covering(*parts(sc.Sphere()), np.full((100, 3), np.nan)), "not finite"),
        (lambda: body_cloud(sc.Sphere().level, sc.Sphere().gradient, [[2, 2, 2], [3, 3, 3]], 1000), "no sign change"),
        (lambda: body_cloud(sc.Sphere().level, sc.Sphere().gradient, [[-2] * 3, [2] * 3], 10**9), "more than"),
        (lambda: onto(lambda p: p[..., 0] ** 2 + 1, lambda p: 2 * p * [1, 0, 0], np.ones((5, 3)), 0.1), "5 of 5"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def parts(body):
    return body.level, body.gradient, body.hessian


def cloud_of(body, count=3000):
    return body_cloud(body.level, body.gradient, body.bounds, count)
