"""What tests of bodies compare: compiled functions and their source, derivatives and differences, closed surfaces."""

import numpy as np
from numba import njit


@njit
def call(function, *arguments):
    function(*arguments)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def directions(rng, n):
    return unit(rng.normal(size=(n, 3)))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def volume(vertices, triangles):
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
