"""Least-squares splines of points and normals: the kernel, the equations, order of convergence, and the report."""

from functools import cache

import numpy as np
import pytest
import trimesh
from body_checks import directions, rms, unit

import scatterers as sc
from creeping.geometry.directions import fibonacci_directions
from scatterers.fits import solver as _fitting
from scatterers.fits.solver import _Equations, fit
from scatterers.fits.tensor import TensorSpline, cardinal, coefficients
from scatterers.kernels.compiled import evaluated
from scatterers.kernels.tensor import OVERREAD, accumulate

SYMMETRIC = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
TRIAXIAL = sc.Ellipsoid(1.0, 0.8, 0.6)


def cloud(body, n):
    points = body.forward(fibonacci_directions(n))
    return points, unit(body.gradient(points))


def spacing(body, n):
    """Two distances between neighbours, of n points on a sphere of the same volume."""
    return 2 * np.sqrt(4 * np.pi / n) * np.prod(body.bounds[1]) ** (1 / 3)


@cache
def fitted(body, n):
    return fit(*cloud(body, n), spacing(body, n))


@cache
def errors(body, n):
    """Rms errors of position, normal and normal curvature at points that were not fitted."""
    rng = np.random.default_rng(7)
    at = body.forward(directions(rng, 2000))
    value, gradient, hessian = evaluated(fitted(body, n).spline.compiled, at)
    slope = np.linalg.norm(gradient, axis=-1)
    exact = body.gradient(at)
    e = unit(np.cross(exact, rng.normal(size=at.shape)))
    curvature = np.einsum("ni,nij,nj->n", e, body.hessian(at), e) / np.linalg.norm(exact, axis=-1)
    n_fit = gradient / slope[:, None]
    e = unit(e - np.sum(e * n_fit, axis=-1, keepdims=True) * n_fit)
    bent = np.einsum("ni,nij,nj->n", e, hessian[:, SYMMETRIC], e) / slope
    off = [value / slope, np.linalg.norm(n_fit - unit(exact), axis=-1), bent - curvature]
    return [rms(part) for part in off]


@pytest.fixture
def system(rng):
    shape = np.array([9, 11, 10])
    places = rng.uniform(0, shape - 5, (60, 3))
    # on cell faces, too
    places[:20] = np.floor(places[:20])
    size = int(np.prod(shape))
    return places, shape, np.concatenate([rng.normal(size=size), np.zeros(OVERREAD)])


def test_roughness_is_that_of_fourth_differences(rng):
    equations = _Equations(*cloud(TRIAXIAL, 200), 0.35, 0.3, 1.0)
    c = np.concatenate([rng.normal(size=np.prod(equations.shape)), np.zeros(OVERREAD)])
    rough, plain = (equations.residual(c, targets=True, rough=one)[:-OVERREAD] for one in (True, False))
    expected = np.zeros(equations.shape)
    for axis, n in enumerate(equations.shape):
        fourth = np.diff(np.eye(n), 4, axis=0)
        along = np.tensordot(fourth.T @ fourth, c[:-OVERREAD].reshape(equations.shape), axes=(1, axis))
        expected -= 0.3 * np.moveaxis(along, 0, axis)
    expected *= equations.unknown
    np.testing.assert_allclose((rough - plain).reshape(equations.shape), expected, atol=1e-11)


@pytest.mark.parametrize("shape", [(7, 20, 9), (5, 6, 130)])
def test_cardinal_coefficients_take_the_values(rng, shape):
    values = rng.normal(size=shape)
    found = cardinal(values)
    for axis, n in enumerate(shape):
        bands = [1, 26, 66, 26, 1]
        matrix = sum(np.diag(np.full(n - abs(k), bands[k + 2] / 120), k) for k in range(-2, 3))
        found = np.moveaxis(np.tensordot(matrix, found, axes=(1, axis)), 0, axis)
    np.testing.assert_allclose(found, values, atol=1e-12)


def test_rows_are_value_and_slopes_of_the_spline_and_scatter_is_their_adjoint(system, rng):
    places, shape, c = system
    spline = TensorSpline(c[:-OVERREAD].reshape(shape), np.zeros(3), np.ones(3))
    value, gradient = spline.value_and_gradient(places)
    values, slopes = rng.normal(size=60), rng.normal(size=(60, 3))
    for one, other in ([1.0, 0.0], [0.0, 1.0], [0.7, 2.0]):
        weight, out, adjoint = np.array([one, other]), np.zeros_like(c), np.zeros_like(c)
        # the targets that the spline meets leave nothing
        assert accumulate(places, value, gradient, weight, shape, c, out) < 1e-24
        np.testing.assert_allclose(out, 0, atol=1e-12)
        left = accumulate(places, values, slopes, weight, shape, np.zeros_like(c), adjoint)
        assert left == pytest.approx(one * np.sum(values**2) + other * np.sum(slopes**2), rel=1e-12)
        product = one * np.vdot(values, value) + other * np.vdot(slopes, gradient)
        assert np.vdot(c, adjoint) == pytest.approx(product, rel=1e-12)
        # what vectors load beyond the last row stays as it was
        np.testing.assert_array_equal(adjoint[-OVERREAD:], 0)


@pytest.fixture(scope="module")
def equations():
    return _Equations(*cloud(TRIAXIAL, 300), 0.35, 1e-3, 0.7)


def test_all_that_samples_see_is_unknown(equations):
    for places in equations.samples:
        cell = places.astype(int)
        for step in np.ndindex(6, 6, 6):
            assert np.all(equations.unknown[tuple((cell + step).T)])
    # and no more: a box of six about each cell, along each axis
    rows = np.flatnonzero(equations.unknown.any(axis=(1, 2)))
    cells = np.concatenate([places[:, 0].astype(int) for places in equations.samples])
    assert rows[0] == cells.min() and rows[-1] == cells.max() + 5


def test_residual_is_the_slope_of_what_is_minimised(equations, rng):
    shape = np.array(equations.shape)

    def objective(c):
        total, spline = 0.0, TensorSpline(c[:-OVERREAD].reshape(shape), np.zeros(3), np.ones(3))
        for sign, places in zip((0, 1, -1), equations.samples, strict=True):
            value, gradient = spline.value_and_gradient(places)
            total += (1.0 if sign == 0 else _fitting.OFFSET_WEIGHT) * np.sum((value - sign) ** 2)
            if sign == 0:
                total += equations.normal_weight * np.sum((gradient - equations.sorted_normals) ** 2)
        grid = c[:-OVERREAD].reshape(shape)
        return total + equations.smoothing * sum(np.sum(np.diff(grid, 4, axis=k) ** 2) for k in range(3))

    c = equations.start(None)
    away = np.concatenate([rng.normal(size=int(np.prod(shape))) * equations.unknown.ravel(), np.zeros(OVERREAD)])
    slope = (objective(c + away) - objective(c - away)) / 2
    assert slope == pytest.approx(-2 * np.vdot(away, equations.residual(c, targets=True)), rel=1e-9)


def test_errors_of_a_thousand_points():
    assert np.all(np.array(errors(sc.Ellipsoid(1.2, 0.8, 0.8), 1000)) < (3e-6, 7e-5, 1e-3))


def test_fit_tells_what_it_reached():
    found = fitted(TRIAXIAL, 2000)
    position, normal, curvature = errors(TRIAXIAL, 2000)
    # at the points fitted, errors are about as large as between them
    assert found.misfit == pytest.approx(position, rel=0.5)
    assert found.turn == pytest.approx(normal, rel=0.5)
    assert found.change < curvature
    assert found.spacing == spacing(TRIAXIAL, 2000)
    points, normals = cloud(TRIAXIAL, 2000)
    box = found.spline.box
    assert np.all(box[0] < points.min(0) - 4 * found.spacing) and np.all(box[1] > points.max(0) + 4 * found.spacing)
    # F grows as the distance near the body
    _, gradient, _ = evaluated(found.spline.compiled, points)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=-1), 1, atol=2e-3)
    for side in (0.5, -0.5):
        value, _, _ = evaluated(found.spline.compiled, points + side * found.spacing * normals)
        np.testing.assert_allclose(value, side * found.spacing, rtol=0.05)


def test_scale_and_place_change_nothing(rng):
    points, normals = cloud(TRIAXIAL, 500)
    h = spacing(TRIAXIAL, 500)
    plain, moved = fit(points, normals, h), fit(1e-3 * points + 7, normals, 1e-3 * h)
    at = TRIAXIAL.forward(directions(rng, 100))
    # which third of the points is offset hangs on rounding
    np.testing.assert_allclose(moved.spline.level(1e-3 * at + 7), 1e-3 * plain.spline.level(at), atol=5e-8)
    assert moved.change == pytest.approx(1e3 * plain.change, rel=0.5)


def test_progress_is_told():
    messages = []
    fit(*cloud(sc.Sphere(), 300), 0.4, progress=messages.append)
    assert messages and all("curvatures changing by" in line for line in messages)


def test_too_many_nodes_are_refused():
    points, normals = cloud(sc.Sphere(), 100)
    with pytest.raises(ValueError, match=r"2\d\d x 2\d\d x 2\d\d nodes .* more than 8000000; give a coarser mesh"):
        fit(points, normals, 0.01)


def test_values_at_the_nodes_are_those_of_the_spline(rng):
    samples = rng.normal(size=(8, 10, 9))
    spline = TensorSpline(coefficients(samples), np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(spline.at_nodes(), samples, atol=1e-12)
    nodes = np.moveaxis(np.indices(samples.shape), 0, -1) * spline.spacing + spline.origin
    np.testing.assert_allclose(spline.at_nodes(), spline.level(nodes), atol=1e-12)


def test_parts_that_keep_away_from_the_points_change_their_sign():
    normals = fibonacci_directions(600)
    equations = _Equations(normals, normals, 0.2, 1e-8, 1.0)
    axes = [equations.low[k] + 0.2 * (np.arange(equations.shape[k]) - 2.0) for k in range(3)]
    where = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    values = np.linalg.norm(where, axis=1) - 1
    assert not equations._stray(values, np.abs(values)).any()
    far = np.linalg.norm(where - [1.3, 1.3, 1.3], axis=1) < 0.3
    inside = np.linalg.norm(where, axis=1) < 0.3
    wrong = np.where(far | inside, -values, values)
    np.testing.assert_array_equal(equations._stray(wrong, np.abs(values)), far | inside)
    # what comes near to the points is no stray part
    near = np.linalg.norm(where - [1.0, 0, 0], axis=1) < 0.3
    assert not equations._stray(np.where(near, -values, values), np.abs(values)).any()


@pytest.mark.slow
@pytest.mark.parametrize(("depth", "symmetric"), [(0.0, True), (0.003, False)])
def test_a_body_is_made_its_own_mirror_image_where_it_is_one(depth, symmetric):
    """A dent at one end of an ellipsoid: not so along that axis, though it is along both others."""
    mesh = trimesh.creation.icosphere(subdivisions=4)
    away = np.linalg.norm(mesh.vertices - [1, 0, 0], axis=1)
    mesh.vertices = mesh.vertices * np.array([1.0, 0.8, 0.6]) * (1 - depth * np.exp(-((3 * away) ** 2)))[:, None]
    mesh.vertices += np.array([0.31, -0.17, 0.05])
    body = sc.Mesh(mesh, cache=False)
    at, middle = np.asarray(mesh.vertices), np.array([0.31, -0.17, 0.05])
    for axis, same in enumerate((symmetric, True, True)):
        image = at.copy()
        image[:, axis] = 2 * middle[axis] - at[:, axis]
        off = np.max(np.abs(body.level(image) - body.level(at)))
        assert (off < 1e-7) == same, (axis, off)
