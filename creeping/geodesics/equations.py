"""The geodesic flow of a body, plain and weighted, and the curvatures along it.

With n = grad F/|grad F|, H the Hessian of F, p (u when weighted) the unit tangent [YC06b]:

    plain      x' = p,    p' = -(p.Hp)/|grad F|^2 grad F
    weighted   x' = c u,  u' = -grad c + (grad c.n) n + (grad c.u) u - c (u.Hu)/|grad F| n

The weighted flow is that of the metric ds/c, time being travel time. Neighbouring rays part by J, with
J = c I and I'' + G I = 0; G is the Gaussian curvature of that metric,

    K = (grad F.adj(H) grad F)/|grad F|^4,    G = c^2 K + c Lap c - |grad_Q c|^2,

Lap the Laplacian on Q, Lap c = tr(P Hess c) - (kappa_1 + kappa_2) n.grad c with P = 1 - n n^T.
Normal curvature kappa_n = p.Hp/|grad F| is positive where the body is convex along p.

Sources: [YC06b], [C76], [G05]; Derivations, R1 to R4.
"""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geometry.curvature import curvature_norms, principal_curvature_bound, second_form
from creeping.geometry.evaluators import speed_of, speed_values
from creeping.geometry.piecewise import is_piecewise, pieces_of
from creeping.geometry.surface import Surface, memo, size
from creeping.geometry.triangulation import triangulate

USUAL = 0.98
"""Share of the points of a body with creases that a scale of it goes by."""


def points_of_charts(body: Surface) -> FloatArray:
    """Points all over a body (n, 3), L; of one with creases, or a piece of one, not on them.

    Where a body of pieces is not trusted its curvatures are those of a fit that failed: points there are left out.
    """
    if is_piecewise(body):
        return memo(body, "points of trusted pieces", lambda: _on_pieces(body))
    samples: FloatArray | None = getattr(body, "samples", None)
    if samples is not None:
        return samples
    # charts of other bodies may take a minute, and direct integration asks for none
    if not getattr(body, "quick_charts", True):
        return memo(body, "points without charts", lambda: _on_a_grid(body))
    try:
        charts = body.atlas.charts
    except ValueError:
        # too thin or too sharply curved for charts somewhere, which direct integration does not ask for
        return memo(body, "points without charts", lambda: _on_a_grid(body))
    uv = np.stack(np.meshgrid(*[np.linspace(0, 1, 33)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.concatenate([chart.point(uv) for chart in charts])


def _on_pieces(body: Surface) -> FloatArray:
    points = np.concatenate([piece.samples for piece in pieces_of(body)])
    rough: Any = getattr(body, "non_smooth", None)
    trusted = points if rough is None else points[~np.asarray(rough(points), dtype=bool)]
    return trusted if len(trusted) else points


def _on_a_grid(body: Surface) -> FloatArray:
    return triangulate(body).vertices


def natural_horizon(body: Surface) -> float:
    """Power of two next to the time a ray takes over the smallest radius of curvature."""

    def found() -> float:
        fastest = float(np.max(speed_values(body, points_of_charts(body)), initial=0.0)) or 1.0
        return float(2.0 ** np.round(np.log2(1 / (sharpest_curvature(body) * fastest))))

    return memo(body, "natural horizon", found)


def sharpest_curvature(body: Surface) -> float:
    """Largest |kappa_1| or |kappa_2| over points all over a body, 1/L; with creases, of USUAL of the points.

    Next to a tip curvatures have no bound.
    """

    def found() -> float:
        points = points_of_charts(body)
        if not (is_piecewise(body) or hasattr(body, "samples")):
            return principal_curvature_bound(body, points)
        norms = curvature_norms(body, points)
        # flat pieces alone set no scale of their own
        return max(float(np.quantile(norms, USUAL)) if len(norms) else 0.0, 1 / size(body))

    return memo(body, "sharpest curvature", found)


def vector_field(
    body: Surface, points: FloatArray, directions: FloatArray, kappa: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Right-hand sides (x', p') of the flow at points, L, and unit tangents: twice (..., 3) -> twice (..., 3).

    ``kappa`` (...), 1/L, are the normal curvatures along the tangents where they are known.
    """
    g = body.gradient(points)
    steep = np.sqrt(np.sum(g * g, axis=-1, keepdims=True))
    n = g / steep
    if kappa is None:
        kappa = second_form(directions, body.hessian(points)) / steep[..., 0]
    turning = -kappa[..., None] * n
    speed = speed_of(body)
    if speed is None:
        return directions, turning
    c, dc = speed.value(points)[..., None], speed.gradient(points)
    along_n = np.sum(dc * n, axis=-1, keepdims=True)
    along_u = np.sum(dc * directions, axis=-1, keepdims=True)
    return c * directions, -dc + along_n * n + along_u * directions + c * turning


def launch_spreading(
    body: Surface, points: FloatArray, directions: FloatArray, along: FloatArray, openings: FloatArray
) -> FloatArray:
    """Initial (J, J') of rays launched along a wave from its shadow line: (n, 3) x 3, (n,) -> (n, 2).

    J = b.dx/dsigma with b = n x p and sigma measured across the ray, so J(0) = 1. Differentiating b.dx along the ray
    with b.dp/dsigma = 1/R, the ``openings`` (0 of a plane wave), leaves J'(0) = c/R + (b.grad c)(p.dx/dsigma): 1/R
    without a weight, whatever the line's obliquity. ``along`` holds the tangents of the line.
    """
    spreading = np.zeros((len(points), 2))
    spreading[:, 0] = 1.0
    speed = speed_of(body)
    spreading[:, 1] = openings * (1.0 if speed is None else speed.value(points))
    if speed is not None:
        g = body.gradient(points)
        b = np.cross(g / np.linalg.norm(g, axis=-1, keepdims=True), directions)
        across = np.sum(b * along, axis=-1)
        oblique = np.divide(np.sum(directions * along, axis=-1), across, out=np.zeros_like(across), where=across != 0)
        spreading[:, 1] += np.sum(b * speed.gradient(points), axis=-1) * oblique
    return spreading
