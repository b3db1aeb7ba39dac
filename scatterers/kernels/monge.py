"""Compiled parts of `scatterers.charts.monge`: the locator, and the growth of charts; importing it imports numba.

A chart grows over a graph of points of the body from its centre, in the order of rho = max(|q.E1|, |q.E2|),
q = x - x0, so that it never leaps to another sheet over the same square. It ends before the first point with
n.N < ``least``, or rho > ``longest``, or rho max|kappa| > ``most`` with the largest curvature of the points passed.

Also here: where values stand in the flat parameters of an atlas of Monge charts, which its compiled locator shares.

Origin of the voxels, 1/side, their numbers along the axes, where the table of voxels begins, the least n.N and the
largest |2u - 1|; then `CHART` values a chart: x0, E1, E2, N, 1/w, bounds of the height. The table gives for each voxel
the place of its list of charts, which begins with its length.

Sources: Derivations, B3.
"""

import heapq
import math

import numpy as np
from numba import njit

from scatterers.kernels.compiled import OPTIONS
from scatterers.kernels.tensor import voxel_place

ORIGIN, PER_SIDE, SHAPE, VOXELS, LEAN, OUTSIDE = 0, 3, 4, 7, 8, 9
FIRST = 10
CHART = 15
# added to the score of a chart that is not valid
BEHIND = 1e3


@njit(**OPTIONS)
def _bounded(t, beyond):  # type: ignore[no-untyped-def]
    """Chart variable (1 + t)/2, held within the chart; a NaN gives 1/2."""
    t = t if t > -beyond else (-beyond if t <= -beyond else 0.0)
    return 0.5 + 0.5 * (t if t < beyond else beyond)


def locate(points, gradients, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and polar frame of a block.

    Where no chart is valid, the one with the least max(|u - 1/2|, |v - 1/2|), else chart 0, with bounded u and v.
    """
    least, beyond, voxels = parameters[LEAN], parameters[OUTSIDE], int(parameters[VOXELS])
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        nx, ny, nz = gradients[0, i], gradients[1, i], gradients[2, i]
        scale = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        cell = voxel_place(x, parameters[ORIGIN], parameters[PER_SIDE], parameters[SHAPE])
        cell = cell * int(parameters[SHAPE + 1])
        cell += voxel_place(y, parameters[ORIGIN + 1], parameters[PER_SIDE], parameters[SHAPE + 1])
        cell = cell * int(parameters[SHAPE + 2])
        cell += voxel_place(z, parameters[ORIGIN + 2], parameters[PER_SIDE], parameters[SHAPE + 2])
        entry = int(parameters[voxels + cell])
        count = int(parameters[entry])
        number = int(parameters[entry + 1]) if count > 0 else 0
        best, s, t = math.inf, math.nan, math.nan
        for k in range(entry + 1, entry + 1 + count):
            row = FIRST + CHART * int(parameters[k])
            qx, qy, qz = x - parameters[row], y - parameters[row + 1], z - parameters[row + 2]
            a = qx * parameters[row + 3] + qy * parameters[row + 4] + qz * parameters[row + 5]
            b = qx * parameters[row + 6] + qy * parameters[row + 7] + qz * parameters[row + 8]
            h = qx * parameters[row + 9] + qy * parameters[row + 10] + qz * parameters[row + 11]
            a, b = a * parameters[row + 12], b * parameters[row + 12]
            lean = nx * parameters[row + 9] + ny * parameters[row + 10] + nz * parameters[row + 11]
            score = max(abs(a), abs(b))
            if not (lean >= least and h >= parameters[row + 13] and h <= parameters[row + 14]):
                # behind every valid chart
                score += BEHIND
            if score < best:
                best, s, t, number = score, a, b, int(parameters[k])
        chart[i], uv[0, i], uv[1, i] = number, _bounded(s, beyond), _bounded(t, beyond)
        # the polar frame of a chart over its tangent plane: the least rotation that takes N to n
        row = FIRST + CHART * number
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
