"""Level of bodies of revolution whose profile is of conic arcs and of splines, and of their affine images.

With r = sqrt(u^2 + v^2) the level of a piece is G(r, w), a function of the meridian plane; with m = G_r/r,

    grad F = (m u, m v, G_w),  F_uu = m + (G_rr - m) u^2/r^2,  F_uv = (G_rr - m) u v/r^2,  F_uw = G_rw u/r.

Of a line or an axis-parallel conic, with zeta = w - w_c,

    G = A r^2/2 + B r + C zeta^2/2 + D zeta + E,  m = A + B/r,

smooth on the axis where B = 0. Of a spline c(s) it is the signed distance to the foot, (q - c).c' = 0, with the
curvature k of the profile and k_2 = n_r/c_r across it, both at the foot,

    G = n.(q - c),  grad G = n,  Hess G = k/(1 + k G) t t^T,  m = k_2/(1 + k_2 G),  k_2 = k on the axis.

The body has the piece that is nearest in the meridian plane: of each segment of the profile the distance counts where
the point lies between the normals at its ends, else that of the nearer end. Outside a convex edge both sides are as
near; the one whose tangent plane is farther below is taken there, the other inside an edge that is not convex. Far off,
where a corner is nearest and G has changed its sign once more, that plane stands for G.

Sources: [C76, sec. 3-3].
"""

import math
from typing import Any, NamedTuple

from creeping._typing import FloatArray
from scatterers.kernels.compiled import helper
from scatterers.kernels.tensor import AT as OF_MAP


class Layout(NamedTuple):
    """Where values stand in the flat parameters, behind those of a map.

    The axes of space that are u, v and w, the stretch of v, whether the profile is of a whole body (1) or of a piece,
    which goes on beyond its ends (0), the number of segments, and their rows.
    """

    place: int = OF_MAP.end
    stretch: int = OF_MAP.end + 3
    whole: int = OF_MAP.end + 4
    segments: int = OF_MAP.end + 5
    rows: int = OF_MAP.end + 6


class Row(NamedTuple):
    """Row: point and unit tangent (w, r) at both ends, piece, whether it is a spline, where its shape begins.

    Then the sign of the corner before.
    """

    start: int = 0
    end: int = 4
    piece: int = 8
    splined: int = 9
    shape: int = 10
    corner: int = 11
    width: int = 12


AT, ROW = Layout(), Row()


@helper
def _conic(r: float, w: float, at: int, p: FloatArray) -> tuple[float, float, float, float, float, float, float]:
    a, b, c, d = p[at], p[at + 1], p[at + 2], p[at + 3]
    zeta = w - p[at + 5]
    value = (0.5 * a * r + b) * r + (0.5 * c * zeta + d) * zeta + p[at + 4]
    return value, a * r + b, c * zeta + d, a, 0.0, c, a + b / max(r, 1e-300)


@helper
def _polynomial(s: float, at: int, p: FloatArray) -> tuple[float, float, float]:
    """Value and two derivatives of a quintic."""
    value, slope, bend = p[at + 5], 0.0, 0.0
    for k in range(4, -1, -1):
        bend = bend * s + slope
        slope = slope * s + value
        value = value * s + p[at + k]
    return value, slope, 2.0 * bend


@helper
def _spline(r: float, w: float, at: int, p: FloatArray) -> tuple[float, float, float, float, float, float, float]:
    low, high = p[at], p[at + 1]
    reach = high - low
    s = 0.5 * (low + high)
    for _ in range(12):
        cw, tw, bw = _polynomial(s, at + 2, p)
        cr, tr, br = _polynomial(s, at + 8, p)
        square = tw * tw + tr * tr
        slope = (cw - w) * tw + (cr - r) * tr
        # beyond the centre of curvature Newton's step would lead away from the foot
        bend = max(square + (cw - w) * bw + (cr - r) * br, 0.25 * square)
        step = -slope / bend
        s = min(max(s + step, low - reach), high + reach)
        if abs(step) <= 1e-15 * reach:
            break
    cw, tw, bw = _polynomial(s, at + 2, p)
    cr, tr, br = _polynomial(s, at + 8, p)
    length = math.sqrt(tw * tw + tr * tr)
    nw, nr = -tr / length, tw / length
    k = -(bw * nw + br * nr) / (length * length)
    value = nw * (w - cw) + nr * (r - cr)
    across = nr / cr if cr != 0.0 else k
    along = k / (1.0 + k * value)
    tw, tr = tw / length, tr / length
    return value, nr, nw, along * tr * tr, along * tr * tw, along * tw * tw, across / (1.0 + across * value)


@helper
def meridian(r: float, w: float, row: int, p: FloatArray) -> tuple[float, float, float, float, float, float, float]:
    """G, G_r, G_w, G_rr, G_rw, G_ww and G_r/r of a segment's piece."""
    at = int(p[row + ROW.shape])
    if p[row + ROW.splined] == 0.0:
        return _conic(r, w, at, p)
    return _spline(r, w, at, p)


@helper
def _ahead(r: float, w: float, at: int, p: FloatArray) -> float:
    """How far a point is beyond an end of a segment, along the tangent there."""
    along: float = (w - p[at]) * p[at + 2] + (r - p[at + 1]) * p[at + 3]
    return along


@helper
def _distance(r: float, w: float, row: int, p: FloatArray) -> float:
    """Distance to a segment; between the normals at its ends along grad G, G taken as the quadratic that it is."""
    w0, r0 = w - p[row + ROW.start], r - p[row + ROW.start + 1]
    w1, r1 = w - p[row + ROW.end], r - p[row + ROW.end + 1]
    if _ahead(r, w, row + ROW.start, p) >= 0.0 and _ahead(r, w, row + ROW.end, p) < 0.0:
        value, gr, gw, rr, rw, ww, _ = meridian(r, w, row, p)
        square = gr * gr + gw * gw
        if square > 0.0:
            bend = (rr * gr * gr + 2.0 * rw * gr * gw + ww * gw * gw) / square
        else:
            bend = max(abs(rr), abs(ww)) if value < 0.0 else -max(abs(rr), abs(ww))
        root = math.sqrt(max(square - 2.0 * value * bend, 0.0))
        return 2.0 * abs(value) / max(math.sqrt(square) + root, 1e-300)
    return math.sqrt(min(w0 * w0 + r0 * r0, w1 * w1 + r1 * r1))


@helper
def _plane(r: float, w: float, at: int, p: FloatArray) -> float:
    """Height above the tangent at an end of a segment."""
    height: float = (r - p[at + 1]) * p[at + 2] - (w - p[at]) * p[at + 3]
    return height


@helper
def nearest(r: float, w: float, p: FloatArray) -> int:
    """Where the row of the nearest segment begins."""
    best, count = AT.rows, int(p[AT.segments])
    if count == 1:
        return best
    least = _distance(r, w, best, p)
    for k in range(1, count):
        row = AT.rows + ROW.width * k
        distance = _distance(r, w, row, p)
        if distance < least:
            least, best = distance, row
        elif distance == least and row == best + ROW.width:
            # nearest is the corner between both
            if p[row + ROW.corner] * (_plane(r, w, row + ROW.start, p) - _plane(r, w, best + ROW.end, p)) > 0.0:
                best = row
    return best


@helper
def level(r: float, w: float, p: FloatArray) -> tuple[float, float, float, float, float, float, float]:
    """What `meridian` gives, of the nearest segment."""
    row = nearest(r, w, p)
    found = meridian(r, w, row, p)
    if p[AT.whole] == 1.0:
        if _ahead(r, w, row + ROW.start, p) < 0.0 or _ahead(r, w, row + ROW.end, p) >= 0.0:
            w0, r0, w1, r1 = w - p[row], r - p[row + 1], w - p[row + ROW.end], r - p[row + ROW.end + 1]
            end = ROW.start if w0 * w0 + r0 * r0 < w1 * w1 + r1 * r1 else ROW.end
            plane = _plane(r, w, row + end, p)
            if plane * found[0] < 0.0:
                nw, nr = -p[row + end + 3], p[row + end + 2]
                return plane, nr, nw, 0.0, 0.0, 0.0, nr / max(r, 1e-300)
    return found


def evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block, each point on the piece that is nearest."""
    iu, iv, iw = int(parameters[AT.place]), int(parameters[AT.place + 1]), int(parameters[AT.place + 2])
    stretch = parameters[AT.stretch]
    # rows of yz, xz and xy by the axis that is missing
    vw, uw, uv = 3 + iu, 3 + iv, 3 + iw
    for i in range(points.shape[1]):
        u, v, w = points[iu, i], stretch * points[iv, i], points[iw, i]
        r = math.sqrt(u * u + v * v)
        value, _, slope_w, rr, rw, ww, m = level(r, w, parameters)
        over = 1.0 / max(r, 1e-300)
        cosine, sine = u * over, v * over
        values[i] = value
        gradients[iu, i], gradients[iv, i], gradients[iw, i] = m * u, stretch * m * v, slope_w
        hessians[iu, i] = m + (rr - m) * cosine * cosine
        hessians[iv, i] = stretch * stretch * (m + (rr - m) * sine * sine)
        hessians[iw, i] = ww
        hessians[vw, i] = stretch * rw * sine
        hessians[uw, i] = rw * cosine
        hessians[uv, i] = stretch * (rr - m) * cosine * sine


# the search for the nearest segment included
evaluate.operations = 150.0  # type: ignore[attr-defined]


def numbers(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """Numbers of the nearest pieces, in the place of F; nothing else is filled."""
    iu, iv, iw = int(parameters[AT.place]), int(parameters[AT.place + 1]), int(parameters[AT.place + 2])
    for i in range(points.shape[1]):
        u, v = points[iu, i], parameters[AT.stretch] * points[iv, i]
        values[i] = parameters[nearest(math.sqrt(u * u + v * v), points[iw, i], parameters) + ROW.piece]


def value_and_gradient(x: float, y: float, z: float, parameters: FloatArray) -> Any:
    """F, F_x, F_y, F_z at a point, u = x, v = y and w = z unstretched."""
    r = math.sqrt(x * x + y * y)
    value, _, slope_w, _, _, _, m = level(r, z, parameters)
    return value, m * x, m * y, slope_w
