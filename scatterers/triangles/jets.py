"""Osculating jets: normals and curvatures at the vertices of a mesh, without any use of its triangles' shapes.

In a frame (e1, e2, n) at a vertex the surface is w = h(u, v) = sum c_ab u^a v^b, 1 <= a + b <= d, fitted by weighted
least squares to the nearest vertices of the same sheet [CP05]; the jet of degree d errs by O(e^d) in the normal and
O(e^(d-1)) in the curvatures; Derivations, B5. With W^2 = 1 + h_u^2 + h_v^2, and signs such that a convex body has
kappa > 0,

    n = (-h_u, -h_v, 1) / W,    K = (h_uu h_vv - h_uv^2) / W^4,
    H = -((1 + h_v^2) h_uu - 2 h_u h_v h_uv + (1 + h_u^2) h_vv) / (2 W^3),    kappa = H +- sqrt(H^2 - K).

Also here: points between the vertices of a mesh and distances from it, from the jets at its vertices.

Of the three jets w = h_i(u, v) the mean of (w_i - h_i(u_i, v_i))/W_i is nearly the distance from the body; its zero
nearest to a triangle's centroid is found by Newton steps. By degree 6 these points are off by O(e^7). The distance of a
point from the body is that from the jet of the nearest vertex.

Sources: Derivations, B5.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray

NEIGHBOURS = 56
"""Twice the terms of degree 6: enough to show in the residual what the jet misses."""
FEWEST = 36
"""Neighbours below which a jet of degree 6 is not fitted."""
SHARE = 5000
"""Vertices, triangles or points treated at a time."""
# powers of u and v in the order of `Jets.coefficients`
POWERS = [(d - b, b) for d in range(1, 7) for b in range(d + 1)]


@dataclass(frozen=True, eq=False)
class Jets:
    """Jets of degree 6 at n vertices, and what lower degrees say.

    Attributes
    ----------
    fitted : (n,) bool
        False where fewer than 36 vertices of the same sheet are near: there the normal is that of the triangles,
        the curvatures and coefficients are 0, the tilt is 1 and the residuals are the mean edge.
    normals : (n, 3)
        Outward unit normals.
    principal : (n, 2), 1/L
        Principal curvatures, the larger first; positive where the body is convex.
    principal4 : (n, 2), 1/L
        The same by degree 4.
    residuals : (n, 3), L
        Weighted rms distance of the neighbours from the jets of degree 2, 4 and 6.
    tilt : (n,)
        Distance of the unit normals of degree 4 and 6.
    frames : (n, 3, 3)
        Rows e1, e2, n of the jets.
    radii : (n,), L
        Distance of the farthest neighbour, the unit of u, v, w in ``coefficients``.
    coefficients : (n, 27)
        Of u, v, uu, uv, vv, uuu, ...: by degree, powers of u falling.
    """

    fitted: BoolArray
    normals: FloatArray
    principal: FloatArray
    principal4: FloatArray
    residuals: FloatArray
    tilt: FloatArray
    frames: FloatArray
    radii: FloatArray
    coefficients: FloatArray

    def __repr__(self) -> str:
        return (
            f"Jets({len(self.normals)} vertices, tilt up to {self.tilt.max():.2g}, {np.sum(~self.fitted)} not fitted)"
        )

    @property
    def gaussian(self) -> FloatArray:
        """Gaussian curvature K (n,), 1/L^2."""
        return self.principal[:, 0] * self.principal[:, 1]

    @property
    def mean(self) -> FloatArray:
        """Mean curvature H (n,), 1/L."""
        return 0.5 * (self.principal[:, 0] + self.principal[:, 1])


def osculating_jets(vertices: FloatArray, triangles: IntArray) -> Jets:
    """Fit jets at all vertices.

    Parameters
    ----------
    vertices : (n, 3), L
    triangles : (m, 3)
        Counter-clockwise seen from outside; they give first normals, and the mean edge, only.

    Examples
    --------
    >>> import numpy as np
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=3)
    >>> jets = osculating_jets(ball.vertices, ball.faces)
    >>> bool(np.all(abs(jets.gaussian - 1) < 1e-3))
    True
    """
    vertices = np.ascontiguousarray(vertices, dtype=float)
    guess = angle_weighted_normals(vertices, triangles)
    near, counts = _neighbours(vertices, guess)
    corners = vertices[triangles]
    edge = float(np.mean(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)))
    # frames, radii, coefficients, residuals and coefficients of degree 4, as `Jets` has them
    # terms of degree 2, 4 and 6, and less
    degrees = (5, 14, 27)
    n, terms = len(vertices), len(POWERS)
    frames, radii, residuals = _frames(guess), np.empty(n), np.empty((n, 3))
    coefficients, lower = np.zeros((n, terms)), np.zeros((n, terms))
    count, times = np.minimum(counts, NEIGHBOURS), np.where(counts > 0, 0, 2)
    # rows below the data bound combinations of terms, of size 1, that the points leave open: of none of slopes and
    # curvatures
    ridge = 2e-4 * np.diag(np.arange(terms) >= degrees[0])
    while len(waiting := np.flatnonzero(times < 2)):
        k = waiting[count[waiting] == count[waiting[0]]][:SHARE]
        away = vertices[near[k, : count[k[0]]]] - vertices[k][:, None]
        square = np.sum(away**2, axis=2)
        radius = np.sqrt(square.max(axis=1))[:, None]
        weight = np.exp(-2 * square / radius**2)
        u, v, w = np.einsum("nij,nkj->ink", frames[k], away) / radius
        up, vp = _powers(u), _powers(v)
        columns = np.stack([weight * up[a] * vp[b] for a, b in POWERS], axis=2)
        height = weight * w
        whole = np.concatenate([columns, np.broadcast_to(ridge, (len(k), terms, terms))], axis=1)
        right = np.pad(height, ((0, 0), (0, terms)))[..., None]
        triangle = np.asarray(np.linalg.qr(np.concatenate([whole, right], axis=2), mode="r"))
        new = np.abs(np.einsum("njj->nj", triangle)[:, :terms]) / np.linalg.norm(whole, axis=1)
        # hardly anything of a column is new against its predecessors
        weak = (new.min(axis=1) < 0.02) & (count[k] < counts[k])
        count[k[weak]] = np.minimum(count[k[weak]] * 5 // 4, counts[k[weak]])
        times[k] = np.where(weak, 0, times[k] + 1)
        done, triangle = k[~weak], triangle[~weak]
        # the leading columns are those of the lower degrees
        for d, t in enumerate(degrees):
            found = np.linalg.solve(triangle[:, :t, :t], triangle[:, :t, terms:])
            left = height[~weak] - (columns[~weak, :, :t] @ found)[..., 0]
            residuals[done, d] = np.linalg.norm(left, axis=1) / np.linalg.norm(weight[~weak], axis=1)
            (coefficients if t == terms else lower)[done, :t] = found[..., 0]
        radii[done] = radius[~weak, 0]
        residuals[done] *= radii[done, None]
        first = done[times[done] == 1]
        frames[first] = _frames(_curvatures(frames[first], radii[first], coefficients[first])[0])
    fitted = counts > 0
    radii[~fitted], residuals[~fitted] = edge, edge
    normals, principal = _curvatures(frames, radii, coefficients)
    normals4, principal4 = _curvatures(frames, radii, lower)
    tilt = np.where(fitted, np.linalg.norm(normals4 - normals, axis=1), 1.0)
    return Jets(fitted, normals, principal, principal4, residuals, tilt, frames, radii, coefficients)


def _frames(normals: FloatArray) -> FloatArray:
    """Right-handed orthonormal rows (n, 3, 3), the last one the normal (n, 3).

    [Duff et al., Building an orthonormal basis, revisited, JCGT 6 (2017)]: no division by zero anywhere.
    """
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    rows = [(1 + sign * x * x * a, sign * x * y * a, -sign * x), (x * y * a, sign + y * y * a, -y), (x, y, z)]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def angle_weighted_normals(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Outward unit normals (n, 3): face normals weighted by the angles at the vertex [TW98].

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> angle_weighted_normals(corners, faces)[0].round(6)
    array([-0.57735, -0.57735, -0.57735])
    """
    corners = vertices[triangles]
    ahead = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(ahead, axis=-1)
    normal = np.cross(ahead[:, 0], -ahead[:, 2])
    area = np.linalg.norm(normal, axis=-1, keepdims=True)
    # triangles without area have no say
    normal = np.divide(normal, area, out=np.zeros_like(normal), where=area > 0)
    cosine = -np.sum(ahead * np.roll(ahead, 1, axis=1), axis=-1) / np.maximum(
        length * np.roll(length, 1, axis=1), 1e-300
    )
    angle = np.arccos(np.clip(cosine, -1, 1))
    total = np.stack(
        [np.bincount(triangles.ravel(), (angle * normal[:, k, None]).ravel(), len(vertices)) for k in range(3)], axis=1
    )
    size = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(size > 0, total / np.where(size > 0, size, 1.0), [0.0, 0.0, 1.0])


def _neighbours(vertices: FloatArray, normals: FloatArray) -> tuple[IntArray, IntArray]:
    """Nearest vertices (n, 112) whose normals agree, nearest first, and how many (n,); 0 if too few."""
    from scipy.spatial import cKDTree

    # twice as many where the usual ones leave terms open, as on long triangles
    most = 2 * NEIGHBOURS
    tree, n = cKDTree(vertices), len(vertices)
    near, counts = np.zeros((n, most), np.int64), np.zeros(n, np.int64)
    waiting, asked = np.arange(n), most + 8
    for _ in range(3):
        asked = min(asked, n)
        for start in range(0, len(waiting), SHARE):
            some = waiting[start : start + SHARE]
            found = tree.query(vertices[some], asked)[1].reshape(len(some), asked)
            cosine = np.einsum("ijk,ik->ij", normals[found], normals[some])
            good = (cosine > 0.3) & (found != some[:, None])
            # stable: the good ones first, in order of distance
            order = np.argsort(~good, axis=1, kind="stable")[:, :most]
            near[some, : order.shape[1]] = np.take_along_axis(found, order, axis=1)
            counts[some] = np.minimum(good.sum(axis=1), most)
        waiting = waiting[counts[waiting] < NEIGHBOURS]
        if not len(waiting) or asked == n:
            break
        # three times the radius; what is still short then lies on a thin or tiny part
        asked *= 3
    counts[counts < FEWEST] = 0
    return near, counts


def _curvatures(frames: FloatArray, radii: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normals (n, 3) and principal curvatures (n, 2) at the origin of the jets."""
    u, v, uu, uv, vv = coefficients[:, :5].T
    uu, uv, vv = 2 * uu / radii, uv / radii, 2 * vv / radii
    square = 1 + u**2 + v**2
    direction = np.stack([-u, -v, np.ones_like(u)], axis=1) / np.sqrt(square)[:, None]
    gaussian = (uu * vv - uv**2) / square**2
    mean = -((1 + v**2) * uu - 2 * u * v * uv + (1 + u**2) * vv) / (2 * square**1.5)
    root = np.sqrt(np.maximum(mean**2 - gaussian, 0))
    return np.einsum("ij,ijk->ik", direction, frames), np.stack([mean + root, mean - root], axis=1)


def centroids(vertices: FloatArray, triangles: IntArray, jets: Jets) -> tuple[FloatArray, FloatArray]:
    """Points (m, 3) and outward unit normals (m, 3) at the middles of the triangles whose corners all have jets."""
    triangles = triangles[np.all(jets.fitted[triangles], axis=1)]
    points, normals = np.empty((len(triangles), 3)), np.empty((len(triangles), 3))
    for start in range(0, len(triangles), SHARE):
        some = triangles[start : start + SHARE]
        at = vertices[some].mean(axis=1)
        for _ in range(3):
            value, gradient = _distance(vertices, jets, some, at)
            at = at - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
        gradient = _distance(vertices, jets, some, at)[1]
        points[start : start + SHARE] = at
        normals[start : start + SHARE] = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    return points, normals


def signed_distance(vertices: FloatArray, jets: Jets, at: FloatArray) -> FloatArray:
    """Distance (n,) of points (n, 3) from the body, positive outside; NaN where the nearest vertex' jet does not tell.

    The foot (u, v, h) nearest to (u0, v0, w0) by Newton steps on (u - u0) + (h - w0) h_u = 0 and its twin in v.
    """
    from scipy.spatial import cKDTree

    nearest = cKDTree(vertices).query(at)[1]
    out = np.empty(len(at))
    for start in range(0, len(at), SHARE):
        some = slice(start, start + SHARE)
        out[some] = _foot(vertices, jets, nearest[some], at[some])
    return out


def _foot(vertices: FloatArray, jets: Jets, i: IntArray, at: FloatArray) -> FloatArray:
    u0, v0, w0 = np.einsum("nij,nj->in", jets.frames[i], at - vertices[i]) / jets.radii[i]
    u, v = np.zeros_like(u0), np.zeros_like(v0)
    for _ in range(8):
        h, hu, hv, huu, huv, hvv = _jet(jets, i, u, v)
        gap = h - w0
        a, b, c = 1 + hu * hu + gap * huu, hu * hv + gap * huv, 1 + hv * hv + gap * hvv
        p, q = u - u0 + gap * hu, v - v0 + gap * hv
        with np.errstate(all="ignore"):
            determinant = a * c - b * b
            du, dv = (c * p - b * q) / determinant, (a * q - b * p) / determinant
        # beyond a centre of curvature the foot is no minimum
        lost = ~((determinant > 0.05) & (a > 0))
        u, v = np.where(lost, np.nan, np.clip(u - du, -1, 1)), np.where(lost, np.nan, np.clip(v - dv, -1, 1))
    h, hu, hv, *_ = _jet(jets, i, u, v)
    away = np.stack([u0 - u, v0 - v, w0 - h])
    known = (np.hypot(du, dv) < 1e-9) & jets.fitted[i]
    sign = np.sign(away[2] - away[0] * hu - away[1] * hv)
    return np.where(known, sign * np.linalg.norm(away, axis=0) * jets.radii[i], np.nan)


def _jet(jets: Jets, i: IntArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, ...]:
    """h and its derivatives u, v, uu, uv, vv of the jets at vertices i, in units of the radii."""
    up, vp = _powers(u), _powers(v)
    h, hu, hv, huu, huv, hvv = (np.zeros_like(u) for _ in range(6))
    for (a, b), c in zip(POWERS, jets.coefficients[i].T, strict=True):
        h += c * up[a] * vp[b]
        if a:
            hu += c * a * up[a - 1] * vp[b]
        if b:
            hv += c * b * up[a] * vp[b - 1]
        if a > 1:
            huu += c * a * (a - 1) * up[a - 2] * vp[b]
        if a and b:
            huv += c * a * b * up[a - 1] * vp[b - 1]
        if b > 1:
            hvv += c * b * (b - 1) * up[a] * vp[b - 2]
    return h, hu, hv, huu, huv, hvv


def _distance(vertices: FloatArray, jets: Jets, triangles: IntArray, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the three jets' heights over the body, and its gradient."""
    value, gradient = np.zeros(len(at)), np.zeros((len(at), 3))
    for corner in range(3):
        i = triangles[:, corner]
        radius, frame = jets.radii[i], jets.frames[i]
        u, v, w = np.einsum("nij,nj->in", frame, at - vertices[i]) / radius
        h, hu, hv, *_ = _jet(jets, i, u, v)
        scale = 1 / np.sqrt(1 + hu * hu + hv * hv)
        value += radius * (w - h) * scale / 3
        # the change of the scale counts for little where the height is nearly zero
        gradient += np.einsum("ni,nij->nj", np.stack([-hu, -hv, np.ones_like(hu)], axis=1), frame) * scale[:, None] / 3
    return value, gradient


def _powers(u: FloatArray) -> list[FloatArray]:
    found = [np.ones_like(u)]
    for _ in range(6):
        found.append(found[-1] * u)
    return found
