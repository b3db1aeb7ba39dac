"""Critical points of n.q on the body: where the shadow line would cross itself.

With S the shape operator and q_T the tangential part of q, the gradient of h = n.q on Q is

    g = S q_T = P_T H q_T / |grad F|,   q_T = q - (n.q) n,   P_T = 1 - n n^T:

q turns by its own change, which is a multiple of dx and has no part along n. Apart from n = +-q/|q| it vanishes only
where K = 0 and q_T is the null direction. A critical point with h = 0 is a crossing
or an isolated point of the shadow line; a small |h| there is a near-crossing, a small loop or a gap.

Sources: Derivations, R6, R11 and R19.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.directions import first_of_equals
from creeping.geometry.incident import travel
from creeping.geometry.surface import Surface, size
from creeping.geometry.triangulation import Triangulation

SINGULAR = 1e-6
"""|n.q|/|q| at a critical point below which the incidence is refused."""
MAX_SEEDS = 160


@dataclass(frozen=True)
class CriticalPoints:
    """Critical points of n.q on the body with |n.q| < |q|.

    Attributes
    ----------
    points : (k, 3), L
    values : (k,)
        n.q/|q| there.
    """

    points: FloatArray
    values: FloatArray

    @property
    def distance(self) -> float:
        """Least |n.q|/|q|, inf if there is no critical point."""
        return float(np.min(np.abs(self.values), initial=np.inf))

    def refuse(self) -> None:
        """Raise SingularIncidenceError if the shadow line runs through a critical point."""
        if self.distance < SINGULAR:
            crossing = np.abs(self.values) < SINGULAR
            raise self.error("crosses itself", self.points[crossing])

    def error(self, trouble: str, points: FloatArray) -> SingularIncidenceError:
        """Error for the given points (k, 3), with the remedy."""
        named = ", ".join(str(tuple((np.round(p, 6) + 0.0).tolist())) for p in points[:8])
        more = f" and {len(points) - 8} more" if len(points) > 8 else ""
        return SingularIncidenceError(
            f"the shadow line {trouble} at {len(points)} points: {named}{more} "
            f"(least |n.d| at a critical point {self.distance:.1e}); perturb the direction, or move the source, by say "
            "1e-3",
            points=points,
            distance=self.distance,
        )


def incidence(body: Surface, wave: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return n.q and its gradient on the body times the body's size: (..., 3) -> (...), (..., 3)."""
    gradient = body.gradient(points)
    norm = np.linalg.norm(gradient, axis=-1, keepdims=True)
    n, q = gradient / norm, travel(wave, points)
    h = np.einsum("...i,...i->...", n, np.broadcast_to(q, n.shape))
    across = (body.hessian(points) @ (q - h[..., None] * n)[..., None])[..., 0]
    across -= np.sum(across * n, axis=-1, keepdims=True) * n
    return h, across * (size(body) / norm)


def critical_points(body: Surface, wave: FloatArray, mesh: Triangulation) -> CriticalPoints:
    """Locate the critical points of n.q, apart from n = +-q/|q|.

    Parameters
    ----------
    body, wave : Surface, (3,) or (4,)
    mesh : Triangulation
        Of the body; its vertices of locally least |g| are the starting points.

    Returns
    -------
    CriticalPoints
    """
    h, g = incidence(body, wave, mesh.vertices)
    steep = np.linalg.norm(g, axis=1)
    seeds = _seeds(mesh, h, steep)
    points = _solve(body, wave, mesh.vertices[seeds])
    h, g = incidence(body, wave, points)
    h = h / np.linalg.norm(travel(wave, points), axis=-1)
    off = np.abs(body.level(points)) / np.linalg.norm(body.gradient(points), axis=1)
    # at n = +-q/|q|, where the gradient vanishes for any body, 1 - |h| is the square of the error of the point
    found = (np.linalg.norm(g, axis=1) < 1e-8) & (off < 1e-9 * size(body)) & (np.abs(h) < 1 - 1e-8)
    order = np.flatnonzero(found)[np.argsort(np.abs(h[found]), kind="stable")]
    points, h, gap = points[order], h[order], 1e-5 * size(body)
    kept = first_of_equals(0 * order, lambda i, j: np.linalg.norm(points[i] - points[j], axis=1) <= gap)
    return CriticalPoints(points[kept], h[kept])


def _seeds(mesh: Triangulation, h: FloatArray, steep: FloatArray) -> list[int]:
    """Vertices whose |g| no neighbour undercuts, and those of least |g| and of least |g| near the line."""
    lowest = steep.copy()
    for a, b in ((0, 1), (1, 2), (2, 0)):
        for i, j in ((mesh.triangles[:, a], mesh.triangles[:, b]), (mesh.triangles[:, b], mesh.triangles[:, a])):
            np.minimum.at(lowest, i, steep[j])
    minima = np.flatnonzero(steep <= lowest)
    minima = minima[np.argsort(steep[minima])][: MAX_SEEDS // 2]
    near = np.argsort(steep + 2 * np.abs(h))[: MAX_SEEDS // 4]
    least = np.argsort(np.where(np.abs(h) < 0.99, steep, np.inf))[: MAX_SEEDS // 4]
    return np.unique(np.concatenate([minima, near, least])).tolist()  # type: ignore[no-any-return]


def _residual(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    """(g, F/|grad F|) without dimension: (..., 3) -> (..., 4)."""
    _, g = incidence(body, wave, points)
    off = body.level(points) / np.linalg.norm(body.gradient(points), axis=-1) / size(body)
    return np.concatenate([g, off[..., None]], axis=-1)


def _solve(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    """Levenberg-Marquardt steps with damping |r|^2: fast for isolated, degenerate and continuous solutions alike."""
    points = np.array(points, dtype=float)
    length = size(body)
    # third derivatives by central differences: truncation 1e-10 against rounding 1e-11
    shifts = 1e-5 * length * np.eye(3)
    active = np.arange(len(points))
    for _ in range(40):
        x = points[active]
        r = _residual(body, wave, x)
        ahead = _residual(body, wave, x[:, None] + shifts)
        J = np.swapaxes(ahead - _residual(body, wave, x[:, None] - shifts), 1, 2) / 2e-5
        Jt = np.swapaxes(J, 1, 2)
        # the floor keeps the matrix regular where a whole curve is critical
        damping = np.maximum(np.sum(r * r, axis=1), 1e-14 * np.trace(Jt @ J, axis1=1, axis2=2) + 1e-28)
        step = np.linalg.solve(Jt @ J + damping[:, None, None] * np.eye(3), -(Jt @ r[..., None]))[..., 0]
        norm = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, 0.1 / np.maximum(norm, 1e-300))[:, None]
        moved = x + length * step
        finite = np.all(np.isfinite(moved), axis=1)
        points[active[finite]] = moved[finite]
        active = active[finite & (norm > 1e-13)]
        if not len(active):
            break
    return points
