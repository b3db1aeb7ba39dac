"""Compiled parts of charts: sphere maps and locators, and the map of `scatterers.charts.star`.

Importing this module imports numba.

cos(pi z) and sin(pi z) by polynomials: compilers vectorise them, and only call a library's.

z = k + r with k the nearest integer, |r| <= 1/2 exactly; cos(pi z) = (-1)^k sum_j (-1)^j (pi r)^(2j)/(2j)!, the sine
likewise. The Taylor sums end where (pi/2)^m/m! < 2e-17, so rounding, some 2e-16, is all that is left.

The series are those of [AS64, sec. 4.3].

Also here: parts of compiled locators: chart variables and tangents of the cube sphere, and the polar frame.

With t = tan xi, t' = tan eta of the face (see `scatterers.charts.star`) and a common factor left out, which no
frame sees,

    s_u = (-p, du - t p, -t' p) in (a, b, c) up to signs,  p = t du/(1 + t^2 + t'^2),  du = 1 + t^2,

and s_v likewise. The frame of tangents T is T (T^T T)^(-1/2), by the closed root of a 2 x 2 matrix.

Also here: the radial map, whose parameters are those of the spline, `scatterers.kernels.tensor` says where.

Also here: compiled parts of `scatterers.charts.monge`: the locator, and the growth of charts.

A chart grows over a graph of points of the body from its centre, in the order of rho = max(|q.E1|, |q.E2|),
q = x - x0, so that it never leaps to another sheet over the same square. It ends before the first point with
n.N < ``least``, or rho > ``longest``, or rho max|kappa| > ``most`` with the largest curvature of the points passed.

Also here: where values stand in the flat parameters of an atlas of Monge charts, which its compiled locator shares.

Origin of the voxels, 1/side, their numbers along the axes, where the table of voxels begins, the least n.N and the
largest |2u - 1|; then 15 values a chart: x0, E1, E2, N, 1/w, bounds of the height. The table gives for each voxel
the place of its list of charts, which begins with its length.

Sources: Derivations, B1 to B4.
"""

import heapq
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creeping._typing import FloatArray
from scatterers.kernels.compiled import OPTIONS, helper
from scatterers.kernels.tensor import AT, DEGREE, REACH, value_and_gradient, voxel_place

_COS: tuple[float, ...] = tuple((-1) ** j * math.pi ** (2 * j) / math.factorial(2 * j) for j in range(12))
_SIN: tuple[float, ...] = tuple((-1) ** j * math.pi ** (2 * j + 1) / math.factorial(2 * j + 1) for j in range(11))


@helper
def cos_pi(z: float) -> float:
    """cos(pi z) of a number."""
    nearest = math.floor(z + 0.5)
    r = z - nearest
    r2 = r * r
    total = _COS[11]
    for j in range(10, -1, -1):
        total = total * r2 + _COS[j]
    return total * (1.0 - 2.0 * (nearest - 2.0 * math.floor(0.5 * nearest)))


@helper
def sin_pi(z: float) -> float:
    """sin(pi z) of a number."""
    nearest = math.floor(z + 0.5)
    r = z - nearest
    r2 = r * r
    total = _SIN[10]
    for j in range(9, -1, -1):
        total = total * r2 + _SIN[j]
    return total * r * (1.0 - 2.0 * (nearest - 2.0 * math.floor(0.5 * nearest)))


@helper
def cube_tangents(
    sx: float, sy: float, sz: float
) -> tuple[int, float, float, float, float, float, float, float, float]:
    """Chart number, u, v and the directions s_u and s_v at a point of the sphere, whose length is free."""
    s = (sx, sy, sz)
    size = (abs(sx), abs(sy), abs(sz))
    a = 0 if size[0] >= size[1] and size[0] >= size[2] else (1 if size[1] >= size[2] else 2)
    b, c = (a + 1) % 3, (a + 2) % 3
    sign = -1.0 if s[a] < 0 else 1.0
    tan_u, tan_v = s[b] / s[a], s[c] / size[a]
    number = 2 * a + (1 if s[a] < 0 else 0)
    u = math.atan(tan_u) / (math.pi / 2) + 0.5
    v = math.atan(tan_v) / (math.pi / 2) + 0.5
    # tangents of the cube, (0, sign du, 0) and (0, 0, dv), less their part along s
    norm2 = 1.0 + tan_u * tan_u + tan_v * tan_v
    du, dv = 1.0 + tan_u * tan_u, 1.0 + tan_v * tan_v
    p = tan_u * du / norm2
    q = tan_v * dv / norm2
    ta, tb, tc = -sign * p, sign * (du - tan_u * p), -tan_v * p
    wa, wb, wc = -sign * q, -sign * tan_u * q, dv - tan_v * q
    if a == 0:
        return number, u, v, ta, tb, tc, wa, wb, wc
    if a == 1:
        return number, u, v, tc, ta, tb, wc, wa, wb
    return number, u, v, tb, tc, ta, wb, wc, wa


@helper
def fill_frame(frame: FloatArray, i: int, tx: float, ty: float, tz: float, wx: float, wy: float, wz: float) -> None:
    """Write the polar frame of two tangents into column i of frame (6, n)."""
    g11 = tx * tx + ty * ty + tz * tz
    g12 = tx * wx + ty * wy + tz * wz
    g22 = wx * wx + wy * wy + wz * wz
    root = math.sqrt(g11 * g22 - g12 * g12)
    scale = 1.0 / (root * math.sqrt(g11 + g22 + 2 * root))
    m11, m12, m22 = (g22 + root) * scale, -g12 * scale, (g11 + root) * scale
    frame[0, i] = tx * m11 + wx * m12
    frame[1, i] = ty * m11 + wy * m12
    frame[2, i] = tz * m11 + wz * m12
    frame[3, i] = tx * m12 + wx * m22
    frame[4, i] = ty * m12 + wy * m22
    frame[5, i] = tz * m12 + wz * m22


@njit(**OPTIONS)
def _exit(y, parameters):  # type: ignore[no-untyped-def]
    """Largest r for which c + r y is in the box of the sheared grid."""
    largest = math.inf
    for axis in range(3):
        if y[axis] > 0.0:
            largest = min(largest, parameters[AT.box + 3 + axis] / y[axis])
        elif y[axis] < 0.0:
            largest = min(largest, parameters[AT.box + axis] / y[axis])
    return largest


@njit(**OPTIONS)
def _beyond(x, parameters):  # type: ignore[no-untyped-def]
    """Whether a point is beyond the grid."""
    for axis in range(3):
        g = (x[axis] - parameters[3 + axis]) * parameters[6 + axis]
        if g < 0.0 or g > parameters[axis] - 5.0:
            return True
    return False


@njit(**OPTIONS)
def _polynomial(t, start, parameters):  # type: ignore[no-untyped-def]
    """Value and derivative of a polynomial whose coefficients begin at start."""
    value, slope = parameters[start + DEGREE], 0.0
    for m in range(DEGREE - 1, -1, -1):
        slope = slope * t + value
        value = value * t + parameters[start + m]
    return value, slope


@njit(**OPTIONS)
def _spine(w, parameters):  # type: ignore[no-untyped-def]
    """Shift T(w) - w and its derivative along the spine's axis, which an x in the place of w has too."""
    per_half = parameters[AT.per_half]
    if per_half == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    t = (w[int(parameters[AT.axis])] - parameters[AT.middle]) * per_half
    if abs(t) > REACH:
        t, per_half = math.copysign(REACH, t), 0.0
    x, dx = _polynomial(t, AT.shifts, parameters)
    y, dy = _polynomial(t, AT.shifts + DEGREE + 1, parameters)
    z, dz = _polynomial(t, AT.shifts + 2 * DEGREE + 2, parameters)
    return (x, y, z), (per_half * dx, per_half * dy, per_half * dz)


@njit(**OPTIONS)
def _pulled(g, slope, parameters):  # type: ignore[no-untyped-def]
    """DT^T g."""
    axis, along = int(parameters[AT.axis]), slope[0] * g[0] + slope[1] * g[1] + slope[2] * g[2]
    x = g[0] + along if axis == 0 else g[0]
    y = g[1] + along if axis == 1 else g[1]
    return x, y, g[2] + along if axis == 2 else g[2]


@njit(**OPTIONS)
def _pushed(v, slope, parameters):  # type: ignore[no-untyped-def]
    """DT v."""
    along = v[int(parameters[AT.axis])]
    return v[0] + slope[0] * along, v[1] + slope[1] * along, v[2] + slope[2] * along


@njit(**OPTIONS)
def _at(r, y, parameters):  # type: ignore[no-untyped-def]
    """x = T(c + r y), the slope of the spine there, F and DT^T grad F."""
    w = (parameters[AT.centre] + r * y[0], parameters[AT.centre + 1] + r * y[1], parameters[AT.centre + 2] + r * y[2])
    shift, slope = _spine(w, parameters)
    x = (w[0] + shift[0], w[1] + shift[1], w[2] + shift[2])
    value, gx, gy, gz = value_and_gradient(x[0], x[1], x[2], parameters)
    return x, slope, value, _pulled((gx, gy, gz), slope, parameters)


@njit(**OPTIONS)
def _radius(y, parameters):  # type: ignore[no-untyped-def]
    """Root r of F(T(c + r y)), NaN if none is found."""
    low, high = 0.0, _exit(y, parameters)
    r = 1.0 if high > 1.0 else 0.5 * high
    for _ in range(60):
        x, _, value, g = _at(r, y, parameters)
        if _beyond(x, parameters):
            value = math.inf
        if value > 0.0:
            high = min(high, r)
        else:
            low = max(low, r)
        step = -value / (g[0] * y[0] + g[1] * y[1] + g[2] * y[2])
        # the error of so small a Newton step is below rounding
        if abs(step) <= 1e-8 * r:
            return r + step
        inside = r + step > low and r + step < high
        r = r + step if inside else 0.5 * (low + high)
    return math.nan


def forward(s, points, derivatives, parameters):  # type: ignore[no-untyped-def]
    """Points and derivatives of psi for a block."""
    a, b, c = parameters[AT.half_axes], parameters[AT.half_axes + 1], parameters[AT.half_axes + 2]
    for i in range(s.shape[1]):
        y = (a * s[0, i], b * s[1, i], c * s[2, i])
        r = _radius(y, parameters)
        # the gradient anew: at the last iterate it is off by a Newton step
        x, slope, _, g = _at(r, y, parameters)
        scale = r / (g[0] * y[0] + g[1] * y[1] + g[2] * y[2])
        gx, gy, gz = scale * a * g[0], scale * b * g[1], scale * c * g[2]
        points[0, i], points[1, i], points[2, i] = x
        column = _pushed((r * a - y[0] * gx, -y[1] * gx, -y[2] * gx), slope, parameters)
        derivatives[0, i], derivatives[3, i], derivatives[6, i] = column
        column = _pushed((-y[0] * gy, r * b - y[1] * gy, -y[2] * gy), slope, parameters)
        derivatives[1, i], derivatives[4, i], derivatives[7, i] = column
        column = _pushed((-y[0] * gz, -y[1] * gz, r * c - y[2] * gz), slope, parameters)
        derivatives[2, i], derivatives[5, i], derivatives[8, i] = column


def forward_over(value_and_gradient: Callable[..., Any], name: str) -> FunctionType:
    """`forward` over another F than a spline, whose plain Python this is.

    Its code belongs to a file that does not exist: numba must not take what it keeps for splines.
    """
    space: dict[str, Any] = dict(globals())
    space["value_and_gradient"] = njit(**OPTIONS)(value_and_gradient)
    for caller in ("_at", "_radius"):
        space[caller] = njit(**OPTIONS)(FunctionType(space[caller].py_func.__code__, space, caller))
    return FunctionType(forward.__code__.replace(co_filename=f"<{name}>"), space, "forward")


def one_cell(box: FloatArray, of_map: FloatArray) -> FloatArray:
    """Parameters of a grid of one cell, the box (2, 3), L, in which an F of another kind is known; and of its map."""
    return np.concatenate([np.full(3, 6.0), box[0], 1 / (box[1] - box[0]), of_map])


def inverse(points, s, parameters):  # type: ignore[no-untyped-def]
    """psi^-1 of a block."""
    a, b, c = parameters[AT.half_axes], parameters[AT.half_axes + 1], parameters[AT.half_axes + 2]
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        shift, _ = _spine((x, y, z), parameters)
        x = (x - shift[0] - parameters[AT.centre]) / a
        y = (y - shift[1] - parameters[AT.centre + 1]) / b
        z = (z - shift[2] - parameters[AT.centre + 2]) / c
        scale = 1.0 / math.sqrt(x * x + y * y + z * z)
        s[0, i], s[1, i], s[2, i] = scale * x, scale * y, scale * z


def locate(points, gradients, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and polar frame of points on the body.

    The frame does not see the factor r of d psi/ds, nor the length of y, so w - c serves for y.
    """
    a, b, c = parameters[AT.half_axes], parameters[AT.half_axes + 1], parameters[AT.half_axes + 2]
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        shift, slope = _spine((x, y, z), parameters)
        gx, gy, gz = _pulled((gradients[0, i], gradients[1, i], gradients[2, i]), slope, parameters)
        x -= shift[0] + parameters[AT.centre]
        y -= shift[1] + parameters[AT.centre + 1]
        z -= shift[2] + parameters[AT.centre + 2]
        chart[i], uv[0, i], uv[1, i], tx, ty, tz, wx, wy, wz = cube_tangents(x / a, y / b, z / c)
        tx, ty, tz, wx, wy, wz = a * tx, b * ty, c * tz, a * wx, b * wy, c * wz
        scale = 1.0 / (gx * x + gy * y + gz * z)
        t, w = scale * (gx * tx + gy * ty + gz * tz), scale * (gx * wx + gy * wy + gz * wz)
        tx, ty, tz = _pushed((tx - t * x, ty - t * y, tz - t * z), slope, parameters)
        wx, wy, wz = _pushed((wx - w * x, wy - w * y, wz - w * z), slope, parameters)
        fill_frame(frame, i, tx, ty, tz, wx, wy, wz)


class AtlasLayout(NamedTuple):
    """Where values stand in the parameters of an atlas, and the width of the row of a chart."""

    origin: int = 0
    per_side: int = 3
    shape: int = 4
    voxels: int = 7
    lean: int = 8
    outside: int = 9
    charts: int = 10
    width: int = 15


ATLAS = AtlasLayout()


@njit(**OPTIONS)
def _bounded(t, beyond):  # type: ignore[no-untyped-def]
    """Chart variable (1 + t)/2, held within the chart; a NaN gives 1/2."""
    t = t if t > -beyond else (-beyond if t <= -beyond else 0.0)
    return 0.5 + 0.5 * (t if t < beyond else beyond)


def locate_graph(points, gradients, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and polar frame of a block.

    Where no chart is valid, the one with the least max(|u - 1/2|, |v - 1/2|), else chart 0, with bounded u and v.
    """
    least, beyond, voxels = parameters[ATLAS.lean], parameters[ATLAS.outside], int(parameters[ATLAS.voxels])
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        nx, ny, nz = gradients[0, i], gradients[1, i], gradients[2, i]
        scale = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        cell = voxel_place(x, parameters[ATLAS.origin], parameters[ATLAS.per_side], parameters[ATLAS.shape])
        cell = cell * int(parameters[ATLAS.shape + 1])
        cell += voxel_place(y, parameters[ATLAS.origin + 1], parameters[ATLAS.per_side], parameters[ATLAS.shape + 1])
        cell = cell * int(parameters[ATLAS.shape + 2])
        cell += voxel_place(z, parameters[ATLAS.origin + 2], parameters[ATLAS.per_side], parameters[ATLAS.shape + 2])
        entry = int(parameters[voxels + cell])
        count = int(parameters[entry])
        number = int(parameters[entry + 1]) if count > 0 else 0
        best, s, t = math.inf, math.nan, math.nan
        for k in range(entry + 1, entry + 1 + count):
            row = ATLAS.charts + ATLAS.width * int(parameters[k])
            qx, qy, qz = x - parameters[row], y - parameters[row + 1], z - parameters[row + 2]
            a = qx * parameters[row + 3] + qy * parameters[row + 4] + qz * parameters[row + 5]
            b = qx * parameters[row + 6] + qy * parameters[row + 7] + qz * parameters[row + 8]
            h = qx * parameters[row + 9] + qy * parameters[row + 10] + qz * parameters[row + 11]
            a, b = a * parameters[row + 12], b * parameters[row + 12]
            lean = nx * parameters[row + 9] + ny * parameters[row + 10] + nz * parameters[row + 11]
            score = max(abs(a), abs(b))
            if not (lean >= least and h >= parameters[row + 13] and h <= parameters[row + 14]):
                # far behind every valid chart
                score += 1e3
            if score < best:
                best, s, t, number = score, a, b, int(parameters[k])
        chart[i], uv[0, i], uv[1, i] = number, _bounded(s, beyond), _bounded(t, beyond)
        # the polar frame of a chart over its tangent plane: the least rotation that takes N to n
        row = ATLAS.charts + ATLAS.width * number
        ex, ey, ez = parameters[row + 3], parameters[row + 4], parameters[row + 5]
        fx, fy, fz = parameters[row + 6], parameters[row + 7], parameters[row + 8]
        mx, my, mz = parameters[row + 9], parameters[row + 10], parameters[row + 11]
        scale = 1.0 / (1.0 + nx * mx + ny * my + nz * mz)
        mx, my, mz = mx + nx, my + ny, mz + nz
        turn = (ex * nx + ey * ny + ez * nz) * scale
        frame[0, i], frame[1, i], frame[2, i] = ex - turn * mx, ey - turn * my, ez - turn * mz
        turn = (fx * nx + fy * ny + fz * nz) * scale
        frame[3, i], frame[4, i], frame[5, i] = fx - turn * mx, fy - turn * my, fz - turn * mz


@njit(cache=True)
def grow(starts, frames, longest, points, normals, curvature, first, neighbours, gap, least, facing, most, wider):  # type: ignore[no-untyped-def]
    """Grow charts from points with numbers ``starts`` (m,) and frames (m, 3, 3), rows E1, E2, N.

    The points (n, 3) have normals (n, 3), largest curvatures (n,) and, in compressed rows, neighbours. A chart of reach
    r has half width w = r/wider and covers the points reached with rho <= w - gap and n.N >= facing, ``gap`` (n,) being
    how far others may be from a point. Returns the half widths (m,), where the covered points of each chart begin
    (m + 1,) in the third array, which lists them, and the bounds of their heights (m, 2).
    """
    n, m = len(points), len(starts)
    seen = np.full(n, -1, np.int64)
    reached, rho, leans = np.empty(n, np.int64), np.empty(n), np.empty(n)
    half, begin, heights = np.zeros(m), np.zeros(m + 1, np.int64), np.zeros((m, 2))
    covered, used = np.empty(16 * n, np.int64), 0
    for c in range(m):
        centre, frame = points[starts[c]], frames[c]
        heap = [(0.0, starts[c])]
        seen[starts[c]] = c
        reach, bent, count = 0.0, 0.0, 0
        while len(heap) > 0:
            distance, j = heapq.heappop(heap)
            reach = max(reach, distance)
            lean = normals[j, 0] * frame[2, 0] + normals[j, 1] * frame[2, 1] + normals[j, 2] * frame[2, 2]
            bent = max(bent, curvature[j])
            if not (lean >= least and reach * bent <= most and reach <= longest[c]):
                break
            reached[count], rho[count], leans[count] = j, distance, lean
            count += 1
            for k in range(first[j], first[j + 1]):
                other = neighbours[k]
                if seen[other] != c:
                    seen[other] = c
                    qx, qy = points[other, 0] - centre[0], points[other, 1] - centre[1]
                    qz = points[other, 2] - centre[2]
                    a = abs(qx * frame[0, 0] + qy * frame[0, 1] + qz * frame[0, 2])
                    b = abs(qx * frame[1, 0] + qy * frame[1, 1] + qz * frame[1, 2])
                    heapq.heappush(heap, (max(a, b), other))
        half[c] = reach / wider
        while used + count > len(covered):
            longer = np.empty(2 * len(covered), np.int64)
            # element by element: to assign one array to another takes seconds to compile
            for k in range(used):
                longer[k] = covered[k]
            covered = longer
        for k in range(count):
            j = reached[k]
            if rho[k] <= half[c]:
                h = 0.0
                for axis in range(3):
                    h += (points[j, axis] - centre[axis]) * frame[2, axis]
                heights[c, 0], heights[c, 1] = min(heights[c, 0], h), max(heights[c, 1], h)
            if rho[k] <= half[c] - gap[j] and leans[k] >= facing:
                covered[used] = j
                used += 1
        begin[c + 1] = used
    return half, begin, covered[:used], heights
