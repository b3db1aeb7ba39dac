"""What tests of bodies compare: compiled functions and their source, derivatives and differences, closed surfaces."""

import numpy as np
from numba import njit

from creeping.geometry.evaluators import polar_frame


@njit
def call(function, *arguments):
    function(*arguments)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def directions(rng, n):
    return unit(rng.normal(size=(n, 3)))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def volume(vertices, triangles=None):
    """Of vertices and triangles, or of a mesh that has both."""
    if triangles is None:
        vertices, triangles = vertices.vertices, vertices.triangles
    a, b, c = np.moveaxis(np.asarray(vertices)[np.asarray(triangles)], 1, 0)
    return float(np.sum(a * np.cross(b, c))) / 6


def evaluated_by(run, compiled, points):
    """F (n,), gradient (n, 3) and packed Hessian (n, 6) of a compiled level, as ``run`` fills them."""
    out = np.zeros(len(points)), np.zeros((3, len(points))), np.zeros((6, len(points)))
    run(np.ascontiguousarray(points.T), *out, compiled.parameters)
    return [part.T for part in out]


def assert_compiled_is_its_source(compiled, points, tolerance):
    fast = evaluated_by(lambda *arguments: call(compiled.function, *arguments), compiled, points)
    for a, b in zip(fast, evaluated_by(compiled.source, compiled, points), strict=True):
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance)


def assert_derivatives(body, points, step, slope_at, bend_at):
    """Gradient and Hessian against central differences."""
    for of, function, near in (
        (body.level, body.gradient, slope_at),
        (body.gradient, body.hessian, bend_at),
    ):
        found = [(of(points + h) - of(points - h)) / (2 * step) for h in step * np.eye(3)]
        np.testing.assert_allclose(function(points), np.stack(found, axis=-1), atol=near)


def normal_curvature(body, points, along):
    """Of unit tangents at points (n, 3); the part across the surface is taken out."""
    gradient = body.gradient(points)
    n = unit(gradient)
    along = unit(along - np.sum(along * n, axis=-1, keepdims=True) * n)
    bent = np.einsum("...i,...ij,...j->...", along, body.hessian(points), along)
    return bent / np.linalg.norm(gradient, axis=-1)


def shape_operator(body, points):
    gradient, hessian = body.gradient(points), body.hessian(points)
    n = unit(gradient)[:, :, None]
    flat = np.eye(3) - n * n.swapaxes(1, 2)
    return flat @ hessian @ flat / np.linalg.norm(gradient, axis=-1)[:, None, None]


def assert_sphere_map(sphere_map, s):
    """Its derivative against differences along the sphere, its inverse, and their compiled twins."""
    points, derivative, rng = sphere_map.forward(s), sphere_map.derivative(s), np.random.default_rng(5)
    np.testing.assert_allclose(sphere_map.inverse(points), s, atol=1e-14)
    for _ in range(2):
        t = np.cross(s, directions(rng, len(s)))
        difference = (sphere_map.forward(unit(s + 1e-6 * t)) - sphere_map.forward(unit(s - 1e-6 * t))) / 2e-6
        np.testing.assert_allclose((derivative @ t[..., None])[..., 0], difference, atol=1e-8)
    forward, inverse = sphere_map.compiled_forward, sphere_map.compiled_inverse
    assert (forward.kind, inverse.kind) == ("forward", "inverse")
    x, d, back = np.empty((3, len(s))), np.empty((9, len(s))), np.empty((3, len(s)))
    call(forward.function, np.ascontiguousarray(s.T), x, d, forward.parameters)
    np.testing.assert_allclose(x.T, points, atol=1e-14)
    np.testing.assert_allclose(d.T.reshape(-1, 3, 3), derivative, atol=1e-13)
    call(inverse.function, x, back, inverse.parameters)
    np.testing.assert_allclose(back.T, s, atol=1e-14)


def located(body, points, gradients):
    """Charts (n,), their coordinates (n, 2) and polar frames (n, 3, 2) that the compiled locator finds."""
    n, locator = len(points), body.atlas.compiled
    chart, uv, frame = np.empty(n, np.int64), np.empty((2, n)), np.empty((6, n))
    rows = np.ascontiguousarray(points.T), np.ascontiguousarray(gradients.T)
    call(locator.function, *rows, chart, uv, frame, locator.parameters)
    return chart, uv.T, frame.reshape(2, 3, n).transpose(2, 1, 0)


def assert_locator(body, rng):
    for number, chart in enumerate(body.atlas.charts):
        uv = rng.uniform(0.001, 0.999, (40, 2))
        points = chart.point(uv)
        found, found_uv, frame = located(body, points, body.gradient(points))
        assert np.all(found == number)
        np.testing.assert_allclose(found_uv, uv, atol=1e-13)
        np.testing.assert_allclose(frame, polar_frame(chart.tangents(uv)), atol=1e-12)
