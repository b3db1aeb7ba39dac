"""Compiled shadow lines of many incidences: the steps of `marching`, `newton`, `crossings`, `arcs`.

A line is sought on the coarsest of three meshes, and again on the next if a step has flagged it, if its length is not
certain to SETTLED, or if the incidence is so near a singular one, v < e^2 with e the mean angle between neighbouring
normals, that the mesh might miss a small loop.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned
from creeping.kernels.block import strict_options as options
from creeping.shadow.kernels.arcs import arcs_of, classify, merge, order_breaks, point_at, share_rays
from creeping.shadow.kernels.crossings import BOX, LIMIT, convex, crossings, cusps, project
from creeping.shadow.kernels.marching import incidence_at, mixed_triangles, walk
from creeping.shadow.kernels.newton import (
    FAILED,
    equalise,
    newton,
    prune,
    resample,
    share_nodes,
    spacings,
)
from creeping.shadow.status import ATTACHED, FOLLOWED, NEAR_SINGULAR, NO_RAY, OK, SINGULAR

COMPONENTS = 16
"""Curves of a line at most."""
COARSE_STEP = 0.22
"""Second step of the nodes on the mesh, in edges, from which a line is flagged: they may have changed branch."""
REACH, MORE = 0.5, 4
"""Longest step of a node, in edges, and steps more that a flagged line takes."""
APART = 0.45
"""Least distance of kept nodes, in edges."""
LOST, UNSETTLED, SETTLED = 1e-3, 1e-6, 2e-6
"""Last step of the final nodes, in body sizes, that flags a line and that sends it to the next mesh; relative error of
its length that does."""
FORBIDDEN = 1e-6
"""v below which the line crosses itself."""


@njit(**options)
def least_critical(points, d):
    """v: least |n.d| where d passes the curve of singular directions; points (m, 2, 6) are ends (n, n x a)."""
    least = np.inf
    for m in range(points.shape[0]):
        b0 = d[0] * points[m, 0, 3] + d[1] * points[m, 0, 4] + d[2] * points[m, 0, 5]
        b1 = d[0] * points[m, 1, 3] + d[1] * points[m, 1, 4] + d[2] * points[m, 1, 5]
        if (b0 > 0.0) != (b1 > 0.0):
            share = b0 / (b0 - b1)
            n0 = d[0] * points[m, 0, 0] + d[1] * points[m, 0, 1] + d[2] * points[m, 0, 2]
            n1 = d[0] * points[m, 1, 0] + d[1] * points[m, 1, 1] + d[2] * points[m, 1, 2]
            least = min(least, abs(n0 + share * (n1 - n0)))
    return least


@njit(**options)
def trace_lines(level, level_par, box, meshes, critical, directions, summary, status, launched, places):
    """Lines of incidences (n, 3) and where their rays start.

    Parameters
    ----------
    level, level_par
        The body's block evaluator.
    box : (2, 3)
        That holds the body.
    meshes : tuple of (vertices (3, n), normals (3 n,), triangles (m, 3), neighbours (m, 3), edge, turn, nodes)
        From coarse to fine; ``nodes`` is the number for the line.
    critical : (m, 2, 6)
        See `least_critical`.
    summary : (n, 7), filled
        Curves, length, relative error, shares attached, occluded, concave, v.
    status : (n,), filled
    launched : (n, rays, 8), filled
        x0, arclength, d.x0, number of the arc, spacing on it, 1 if it is closed; NaN where there is no ray.
    places : (n, rays), filled
        Curve of each ray, NO_RAY where there is none.
    """
    work = _work(meshes)
    for row in range(directions.shape[0]):
        d = directions[row]
        v = least_critical(critical, d)
        summary[row, :] = np.nan
        summary[row, 6] = v
        places[row, :] = NO_RAY
        launched[row, :, :] = np.nan
        if v < FORBIDDEN:
            status[row] = SINGULAR
            continue
        for tier in range(len(meshes)):
            mesh = meshes[tier]
            sure = _trace(level, level_par, box, mesh, d, row, summary[row], launched[row], places[row], work[tier])
            far = v > mesh[5] * mesh[5]
            if sure and far:
                break
        status[row] = OK if sure and far else (NEAR_SINGULAR if sure else FOLLOWED)


@njit(**options)
def _work(meshes):
    """Work space for each mesh."""
    return _work_of(meshes[0]), _work_of(meshes[1]), _work_of(meshes[2])


@njit(**options)
def _work_of(mesh):
    vertices, triangles, nodes = mesh[0], mesh[2], mesh[6]
    n, m = vertices.shape[1], triangles.shape[0]
    # every component has 64 nodes at least; mixed triangles of a line are far fewer than all of them
    cap = max(nodes + 72 * COMPONENTS, 8 * int(np.sqrt(m)) + 256, 1024)
    marks = np.zeros(n, np.uint8), np.empty(m + 1, np.int64), np.full(m, -1, np.int64)
    wide = 8 * (cap // 8 + 2)
    raw_starts, kept = np.empty(COMPONENTS + 1, np.int64), np.empty(wide, np.int64)
    # one piece of memory: rows then start on cache lines
    space = aligned(29, wide)
    flat = space[3:15].reshape(-1)
    lines = flat[: 3 * wide], flat[3 * wide : 6 * wide], flat[6 * wide : 9 * wide], flat[9 * wide :]
    nodal = space[15], space[16], space[17:20], space[20:23], space[23:28]
    scratch = space[28, : 18 * BLOCK].reshape(18, BLOCK)
    return np.empty(n), marks, (space[:3], raw_starts, kept), lines, nodal, scratch, np.empty((6, wide // BOX))


@njit(**options)
def _trace(level, level_par, box, mesh, d, number, summary, launched, places, work):
    """One line on one mesh; returns whether every step was sure of it."""
    vertices, normals, triangles, neighbours, edge, _, wanted = mesh
    s, (lit, found, stamp), (raw, raw_starts, kept), flat, (kappa, h, beside, slopes, plane), scratch, boxes = work
    extent = max(box[1, 0] - box[0, 0], box[1, 1] - box[0, 1], box[1, 2] - box[0, 2])
    incidence_at(normals, d, s)
    mixed = mixed_triangles(s, triangles, lit, found)
    components = walk(s, vertices, triangles, neighbours, found, mixed, stamp, number, raw, raw_starts)
    if components < 1:
        return False
    n = raw_starts[components]
    x, T = flat[0][: 3 * n].reshape(3, n), flat[1][: 3 * n].reshape(3, n)
    for axis in range(3):
        for i in range(n):
            x[axis, i] = raw[axis, i]
    # next to a small loop a longer step would end on another branch
    reach = REACH * edge
    if newton(level, level_par, d, x, reach, scratch, T, kappa) == FAILED:
        return False
    step = newton(level, level_par, d, x, reach, scratch, T, kappa)
    sure = step < COARSE_STEP * edge
    for _ in range(MORE if not sure else 0):
        step = newton(level, level_par, d, x, reach, scratch, T, kappa)
    kept_starts = np.empty(COMPONENTS + 1, np.int64)
    sure &= not prune(x, T, raw_starts, components, APART * edge, kept, kept_starts)
    lengths, counts = np.empty(COMPONENTS), np.empty(COMPONENTS, np.int64)
    share_nodes(x, T, kept, kept_starts, components, wanted, lengths, counts)
    # the longest curve first
    starts, total = np.empty(COMPONENTS + 1, np.int64), 0
    left = lengths[:components].copy()
    for c in range(components):
        total += counts[c]
    if not (total <= kappa.shape[0] and lengths[:components].sum() < 1e6 * extent):
        return False
    y, U = flat[2][: 3 * total].reshape(3, total), flat[3][: 3 * total].reshape(3, total)
    total = 0
    for c in range(components):
        best = np.argmax(left)
        left[best] = -1.0
        starts[c] = total
        first, count = kept_starts[best], kept_starts[best + 1] - kept_starts[best]
        resample(x, T, kept, first, count, lengths[best], y, total, counts[best])
        total += counts[best]
    starts[components] = total
    if newton(level, level_par, d, y, reach, scratch, U, kappa) == FAILED:
        return False
    last = newton(level, level_par, d, y, reach, scratch, U, kappa)
    if not last < LOST * extent:
        return False
    sure &= last < UNSETTLED * extent
    spacing, length, doubt = np.empty(COMPONENTS), 0.0, 0.0
    for again in range(2):
        length, doubt = 0.0, 0.0
        for c in range(components):
            size = starts[c + 1] - starts[c]
            own, error = spacings(y, U, starts[c], size, h, beside, slopes)
            if own == FAILED:
                return False
            spacing[c] = own / size
            length, doubt = length + own, doubt + error
            if again == 0:
                equalise(y, slopes, starts[c], size, own, h)
        if again == 0 and not newton(level, level_par, d, y, reach, scratch, U, kappa) < LOST * extent:
            return False
    sure &= doubt < SETTLED * length
    summary[0], summary[1], summary[2] = components, length, doubt / length
    sure &= _finish(
        level,
        level_par,
        box,
        d,
        y,
        U,
        kappa,
        starts,
        components,
        spacing,
        plane,
        boxes,
        scratch,
        summary,
        launched,
        places,
    )
    return sure


@njit(**options)
def _finish(
    level, level_par, box, d, x, T, kappa, starts, components, spacing, plane, boxes, scratch, summary, launched, places
):
    """Breaks, arcs and rays of a line with equally spaced nodes; returns whether every step was sure."""
    sure = True
    at, where = np.empty(LIMIT), np.empty(LIMIT, np.int64)
    count = 0
    for c in range(components):
        some, hidden = cusps(kappa, starts[c], starts[c + 1] - starts[c], at[count:])
        where[count : count + some] = c
        count += some
        sure &= not hidden
    extreme = project(x, T, x.shape[1], d, plane)
    owner_of_box = np.empty(x.shape[1] // BOX + 1, np.int64)
    if not convex(plane, starts, components):
        some = crossings(plane, starts, components, spacing, boxes, owner_of_box, at[count:], where[count:])
        sure &= some >= 0
        count += max(some, 0)
    number = np.empty(components, np.int64)
    for c in range(components):
        number[c] = starts[c + 1] - starts[c]
    order_breaks(at, where, count, number)
    arcs, owner = np.empty((LIMIT + COMPONENTS, 2)), np.empty(LIMIT + COMPONENTS, np.int64)
    state = np.empty(LIMIT + COMPONENTS, np.int64)
    total = arcs_of(at, where, count, starts, components, arcs, owner)
    extent = max(box[1, 0] - box[0, 0], box[1, 1] - box[0, 1], box[1, 2] - box[0, 2])
    reach = 0.01 * extent
    sure &= classify(
        level, level_par, box, d, x, T, starts, spacing, extreme, arcs, owner, total, reach, scratch, state
    )
    total = merge(arcs, owner, state, total, starts)
    summary[3:6] = 0.0
    for k in range(total):
        summary[3 + state[k]] += (arcs[k, 1] - arcs[k, 0]) * spacing[owner[k]] / summary[1]
    rays = launched.shape[0]
    given = np.empty(LIMIT + COMPONENTS, np.int64)
    filled = share_rays(arcs, owner, state, total, spacing, rays, given)
    points = np.empty((3, max(filled, 1)))
    r = 0
    for k in range(total):
        c = owner[k]
        size = starts[c + 1] - starts[c]
        long = arcs[k, 1] - arcs[k, 0]
        offset = 0.0 if long == size else 0.5
        for m in range(given[k]):
            if state[k] != ATTACHED or r == filled:
                break
            place = arcs[k, 0] + long * (m + offset) / given[k]
            point_at(x, T, starts[c], size, spacing[c], place, points, r)
            launched[r, 3], launched[r, 5] = (place % size) * spacing[c], k
            launched[r, 6], launched[r, 7] = long * spacing[c] / given[k], long == size
            places[r] = c
            r += 1
    tangents, curvature = np.empty_like(points), np.empty(points.shape[1])
    if filled:
        newton(level, level_par, d, points, reach, scratch, tangents, curvature)
    for m in range(rays):
        if m < filled:
            launched[m, 4] = 0.0
            for axis in range(3):
                launched[m, axis] = points[axis, m]
                launched[m, 4] += d[axis] * points[axis, m]
        else:
            launched[m, :] = np.nan
            places[m] = NO_RAY
    return sure
