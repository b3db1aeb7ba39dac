"""Compiled shadow lines of many incidences: the steps of `marching`, `newton`, `crossings`, `arcs`.

A line is sought on one mesh; a step that is not certain of it says so, and so does its length if it is not certain to
SETTLED. `creeping.shadow.many` goes on to finer meshes.

Also here: compiled first steps of a shadow line: mixed triangles of a mesh, and the walk around them.

s = n.q at the vertices, q = d + w x (`creeping.geometry.incident`). A triangle with vertices of both signs has one edge
that goes from + to - counter-clockwise: leaving by it keeps the lit side on the left, and ends where it began, so
components come out closed and oriented.

Sources: Derivations, R11 and R6.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned
from creeping.kernels.block import strict_options as options
from creeping.shadow.kernels.arcs import arcs_of, classify, merge, order_breaks, share_rays
from creeping.shadow.kernels.crossings import BOX, LIMIT, convex, crossings, cusps, project
from creeping.shadow.kernels.newton import (
    FAILED,
    HALF,
    equalise,
    interpolate,
    newton,
    prune,
    resample,
    share_nodes,
    spacings,
)
from creeping.shadow.status import ATTACHED, CONCAVE, NO_RAY

CURVES, LENGTH, ERROR, SHARES = 0, 1, 2, 3
"""Components of what is known of a line: curves, length, its relative error, shares of the three states; SUMMARY."""
SUMMARY = 6
ARCLENGTH, ARC, SPACING, CLOSED, STATE = 3, 4, 5, 6, 7
"""Components of a launch point beside x0: arclength, number of its arc, spacing of its rays, 1 if the arc is a
whole curve, state of the line; LAUNCHED in all."""
LAUNCHED = 8
COMPONENTS = 16
"""Curves of a line at most."""
COARSE_STEP = 0.22
"""Second step of the nodes on the mesh, in edges, from which a line is flagged: they may have changed branch."""
REACH, MORE = 0.5, 4
"""Longest step of a node, in edges, and steps more that a flagged line takes."""
APART = 0.45
"""Least distance of kept nodes, in edges."""
LOST, UNSETTLED, SETTLED, PRECISE = 1e-3, 1e-6, 2e-6, 1e-7
"""Last step of the final nodes, in body sizes, that flags a line and that sends it to the next mesh; relative error of
its length by orders 4 and 8 that does."""

TOO_MANY = -1


@njit(**options)
def least_critical(points, wave):
    """v: least |n.q|/|q| where q is along the null direction a, K = 0; points (m, 2, 9) are ends (n, n x a, x)."""
    least = np.inf
    b, n = np.empty(2), np.empty(2)
    for m in range(points.shape[0]):
        for end in range(2):
            one = points[m, end]
            b[end] = n[end] = square = 0.0
            for k in range(3):
                q = wave[k] + wave[3] * one[6 + k]
                n[end] += q * one[k]
                b[end] += q * one[3 + k]
                square += q * q
            n[end] /= np.sqrt(square)
        if (b[0] > 0.0) != (b[1] > 0.0):
            share = b[0] / (b[0] - b[1])
            least = min(least, abs(n[0] + share * (n[1] - n[0])))
    return least


@njit(**options)
def least_criticals(points, waves, least):
    """`least_critical` of waves (n, 4) into least (n,)."""
    for row in range(waves.shape[0]):
        least[row] = least_critical(points, waves[row])


@njit(**options)
def trace_lines(level, level_par, box, mesh, waves, every, summary, certain_lines, launched, places):
    """Lines of incidences, waves (n, 4), on a mesh, and where their rays start.

    Parameters
    ----------
    level, level_par
        The body's block evaluator.
    box : (2, 3)
        That holds the body.
    mesh : (vertices (3, n), normals (3 n,), triangles (m, 3), neighbours (m, 3), edge, turn, nodes)
        ``nodes`` is the number for the line.
    every : bool
        Whether rays start from the whole line, not from its attached arcs alone.
    summary : (n, SUMMARY), filled
    certain_lines : (n,) of bool, filled
        Whether every step was certain of the line.
    launched : (n, rays, LAUNCHED), filled
        NaN where there is no ray.
    places : (n, rays), filled
        Curve of each ray, NO_RAY where there is none.
    """
    work = work_of(mesh)
    starts, spacing = np.empty(COMPONENTS + 1, np.int64), np.empty(COMPONENTS)
    for row in range(waves.shape[0]):
        wave = waves[row]
        summary[row, :] = np.nan
        places[row, :] = NO_RAY
        launched[row, :, :] = np.nan
        found, certain, components, length, error = find_nodes(
            level, level_par, box, mesh, wave, row, work, starts, spacing
        )
        if found:
            total = starts[components]
            x, T = work[3][2][: 3 * total].reshape(3, total), work[3][3][: 3 * total].reshape(3, total)
            summary[row, CURVES], summary[row, LENGTH], summary[row, ERROR] = components, length, error
            arcs, which = np.empty((LIMIT + components, 2)), np.empty((2, LIMIT + components), np.int64)
            certain &= finish(
                level, level_par, box, wave, x, T, work[4][0], starts, components, spacing, every, summary[row],
                launched[row], places[row], arcs, which,
            )  # fmt: skip
        certain_lines[row] = found and certain


@njit(**options)
def trace_nodes(level, level_par, box, mesh, wave):
    """Nodes of one line on a mesh.

    Returns
    -------
    found, certain : bool
    x, T : (3, n)
    kappa : (n,)
        kappa_n(q).
    starts : (components + 1,)
        First node of each component.
    spacing : (components,)
    length, error : float
    """
    work = work_of(mesh)
    starts, spacing = np.empty(COMPONENTS + 1, np.int64), np.empty(COMPONENTS)
    found, certain, components, length, error = find_nodes(level, level_par, box, mesh, wave, 0, work, starts, spacing)
    total = starts[components] if found else 0
    x, T = work[3][2][: 3 * total].reshape(3, total), work[3][3][: 3 * total].reshape(3, total)
    kappa = work[4][0][:total].copy()
    return found, certain, x.copy(), T.copy(), kappa, starts[: components + 1], spacing[:components], length, error


@njit(**options)
def work_of(mesh):
    """Work space for lines on a mesh."""
    vertices, triangles, nodes = mesh[0], mesh[2], mesh[6]
    n, m = vertices.shape[1], triangles.shape[0]
    # every component has 64 nodes at least; mixed triangles of a line are far fewer than all of them
    cap = max(nodes + 72 * COMPONENTS, 8 * int(np.sqrt(m)) + 256, 1024)
    marks = np.zeros(n, np.uint8), np.empty(m + 1, np.int64), np.full(m, -1, np.int64)
    wide = 8 * (cap // 8 + 4)
    raw_starts, kept = np.empty(COMPONENTS + 1, np.int64), np.empty(wide, np.int64)
    # one piece of memory: rows then start on cache lines
    space = aligned(24, wide)
    flat = space[3:15].reshape(-1)
    lines = flat[: 3 * wide], flat[3 * wide : 6 * wide], flat[6 * wide : 9 * wide], flat[9 * wide :]
    nodal = space[15], space[16], space[17:20], space[20:23]
    scratch = space[23, : 18 * BLOCK].reshape(18, BLOCK)
    return np.empty(n), marks, (space[:3], raw_starts, kept), lines, nodal, scratch


@njit(**options)
def find_nodes(level, level_par, box, mesh, wave, number, work, starts, spacing):
    """Equally spaced nodes of one line on one mesh, the longest curve first, left in the work space.

    Returns whether there are any, whether every step was certain of them, components, length and its relative error.
    """
    vertices, normals, triangles, neighbours, edge, _, wanted = mesh
    s, (lit, found, stamp), (raw, raw_starts, kept), flat, (kappa, h, beside, slopes), scratch = work
    extent = max(box[1, 0] - box[0, 0], box[1, 1] - box[0, 1], box[1, 2] - box[0, 2])
    nothing = False, False, 0, np.nan, np.nan
    incidence_at(vertices, normals, wave, s)
    mixed = mixed_triangles(s, triangles, lit, found)
    components = walk(s, vertices, triangles, neighbours, found, mixed, stamp, number, raw, raw_starts)
    if components < 1:
        return nothing
    n = raw_starts[components]
    x, T = flat[0][: 3 * n].reshape(3, n), flat[1][: 3 * n].reshape(3, n)
    for axis in range(3):
        for i in range(n):
            x[axis, i] = raw[axis, i]
    # next to a small loop a longer step would end on another branch
    reach = REACH * edge
    if newton(level, level_par, wave, x, reach, scratch, T, kappa) == FAILED:
        return nothing
    step = newton(level, level_par, wave, x, reach, scratch, T, kappa)
    certain = step < COARSE_STEP * edge
    for _ in range(MORE if not certain else 0):
        step = newton(level, level_par, wave, x, reach, scratch, T, kappa)
    kept_starts = np.empty(COMPONENTS + 1, np.int64)
    certain &= not prune(x, T, raw_starts, components, APART * edge, kept, kept_starts)
    lengths, counts = np.empty(COMPONENTS), np.empty(COMPONENTS, np.int64)
    share_nodes(x, T, kept, kept_starts, components, wanted, lengths, counts)
    # the longest curve first
    total = 0
    left = lengths[:components].copy()
    for c in range(components):
        total += counts[c]
    if not (total + 2 * HALF <= kappa.shape[0] and lengths[:components].sum() < 1e6 * extent):
        return nothing
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
    if newton(level, level_par, wave, y, reach, scratch, U, kappa) == FAILED:
        return nothing
    last = newton(level, level_par, wave, y, reach, scratch, U, kappa)
    if not last < LOST * extent:
        return nothing
    certain &= last < UNSETTLED * extent
    length, error, rough = 0.0, 0.0, 0.0
    for again in range(2):
        length, error, rough = 0.0, 0.0, 0.0
        for c in range(components):
            size = starts[c + 1] - starts[c]
            own, off, coarse = spacings(y, U, starts[c], size, h, beside, slopes)
            if own == FAILED:
                return nothing
            spacing[c] = own / size
            length, error, rough = length + spacing[c] * size, error + off, rough + coarse
            if again == 0:
                equalise(y, slopes, starts[c], size, own, h)
        if again == 0 and not newton(level, level_par, wave, y, reach, scratch, U, kappa) < LOST * extent:
            return nothing
    certain &= rough < SETTLED * length and error < PRECISE * length
    return True, certain, components, length, error / length


@njit(**options)
def finish(
    level, level_par, box, wave, x, T, kappa, starts, components, spacing, every, summary, launched, places, arcs, which
):
    """Arcs and rays of a line with equally spaced nodes, by `find_breaks` and `share_line`; whether it is certain."""
    at, where = np.empty(LIMIT), np.empty(LIMIT, np.int64)
    certain, count, extreme = find_breaks(box, wave, x, T, kappa, starts, components, spacing, at, where)
    # two kernels, which two processes can compile
    return (
        certain
        & share_line(
            level, level_par, box, wave, x, starts, components, spacing, extreme, at, where, count, every, summary,
            launched, places, arcs, which,
        )[0]
    )  # fmt: skip


@njit(**options)
def find_breaks(box, wave, x, T, kappa, starts, components, spacing, at, where):
    """Where the state of a line may change: cusps and crossings of its picture seen along q.

    ``at`` and ``where`` (LIMIT) get their places and components, in order; returns whether every step was certain,
    how many they are, and the four extreme nodes of the picture.
    """
    certain = True
    n = starts[components]
    plane, boxes, owner_of_box = np.empty((5, n)), np.empty((6, n // BOX + 1)), np.empty(n // BOX + 1, np.int64)
    count = 0
    for c in range(components):
        some, hidden = cusps(kappa, starts[c], starts[c + 1] - starts[c], at[count:])
        where[count : count + some] = c
        count += some
        certain &= not hidden
    extreme = project(x, T, n, wave, box, plane)
    if not convex(plane, starts, components):
        some = crossings(plane, starts, components, spacing, boxes, owner_of_box, at[count:], where[count:])
        certain &= some >= 0
        count += max(some, 0)
    number = np.empty(components, np.int64)
    for c in range(components):
        number[c] = starts[c + 1] - starts[c]
    order_breaks(at, where, count, number)
    return certain, count, extreme


@njit(**options)
def share_line(
    level, level_par, box, wave, x, starts, components, spacing, extreme, at, where, count, every, summary, launched,
    places, arcs, which,
):  # fmt: skip
    """Arcs between the breaks of a line, their states, and its rays.

    arcs (LIMIT + components, 2) gets their ends, as numbers of nodes with fractions, and ``which`` (2, the same) their
    component and state. Shares and rays are filled in; returns whether every state is certain, and the number of arcs.
    """
    owner, state = which[0], which[1]
    scratch = aligned(18, BLOCK)
    total = arcs_of(at, where, count, starts, components, arcs, owner)
    extent = max(box[1, 0] - box[0, 0], box[1, 1] - box[0, 1], box[1, 2] - box[0, 2])
    reach = 0.01 * extent
    certain = classify(level, level_par, box, wave, x, starts, extreme, arcs, owner, total, reach, scratch, state)
    total = merge(arcs, owner, state, total, starts)
    summary[SHARES : SHARES + 3] = 0.0
    for k in range(total):
        summary[SHARES + state[k]] += (arcs[k, 1] - arcs[k, 0]) * spacing[owner[k]] / summary[LENGTH]
    if every:
        whole, bearing, open_ = np.zeros((components, 2)), np.arange(components), np.full(components, ATTACHED)
        for c in range(components):
            whole[c, 1] = starts[c + 1] - starts[c]
        filled = _share(whole, bearing, open_, components, starts, spacing, x, launched, places)
    else:
        filled = _share(arcs, owner, state, total, starts, spacing, x, launched, places)
    points, tangents, curvature = np.empty((3, filled)), np.empty((3, filled)), np.empty(filled)
    for m in range(filled):
        for axis in range(3):
            points[axis, m] = launched[m, axis]
    if filled:
        newton(level, level_par, wave, points, reach, scratch, tangents, curvature)
    for m in range(filled):
        c = places[m]
        place = launched[m, ARCLENGTH] / spacing[c]
        for axis in range(3):
            launched[m, axis] = points[axis, m]
        if every:
            # rounding may leave a place between two arcs: a concave point launches no creeping ray
            launched[m, STATE] = CONCAVE
        for k in range(total if every else 0):
            if owner[k] == c and (place - arcs[k, 0]) % (starts[c + 1] - starts[c]) < arcs[k, 1] - arcs[k, 0]:
                launched[m, STATE] = state[k]
    return certain, total


@njit(**options)
def _share(arcs, owner, state, total, starts, spacing, x, launched, places):
    """Share the rays among the arcs that launch, evenly spaced on each; returns how many there are."""
    given, w = np.empty(total, np.int64), np.empty(2 * HALF)
    filled = share_rays(arcs, owner, state, total, spacing, launched.shape[0], given)
    point = np.empty((3, 1))
    r = 0
    for k in range(total):
        c = owner[k]
        size = starts[c + 1] - starts[c]
        long = arcs[k, 1] - arcs[k, 0]
        # half a spacing from the ends of an arc, where kappa_n or the illumination stops
        offset = 0.0 if long == size else 0.5
        for m in range(given[k]):
            if state[k] != ATTACHED or r == filled:
                break
            place = (arcs[k, 0] + long * (m + offset) / given[k]) % size
            interpolate(x, starts[c], size, place, w, point, 0)
            launched[r, 0], launched[r, 1], launched[r, 2] = point[0, 0], point[1, 0], point[2, 0]
            launched[r, ARCLENGTH], launched[r, ARC] = place * spacing[c], k
            launched[r, SPACING], launched[r, CLOSED] = long * spacing[c] / given[k], long == size
            launched[r, STATE] = ATTACHED
            places[r] = c
            r += 1
    return filled


@njit(**options)
def incidence_at(vertices, normals, wave, s):
    """Fill s (n,) with n.q from vertices (3, n) and normals (3, n), flat, and return nothing."""
    n = s.shape[0]
    dx, dy, dz, w = wave[0], wave[1], wave[2], wave[3]
    x, y, z = vertices[0], vertices[1], vertices[2]
    for i in range(n):
        s[i] = normals[i] * (dx + w * x[i]) + normals[n + i] * (dy + w * y[i]) + normals[2 * n + i] * (dz + w * z[i])


@njit(**options)
def mixed_triangles(s, triangles, lit, found):
    """List triangles with vertices of both signs in ``found``; returns their number. lit (n,) is work space."""
    for i in range(s.shape[0]):
        lit[i] = s[i] < 0.0
    count = 0
    for t in range(triangles.shape[0]):
        some = lit[triangles[t, 0]] + lit[triangles[t, 1]] + lit[triangles[t, 2]]
        found[count] = t
        # no branch: about one triangle in thirty is mixed, at places that cannot be predicted
        count += (some == 1) | (some == 2)
    return count


@njit(**options)
def walk(s, vertices, triangles, neighbours, found, count, stamp, number, nodes, starts):
    """Walk all components; nodes (3, cap) on the crossed edges, ``starts`` of the components and their end.

    ``stamp`` (triangles,) holds the number of the incidence that passed last. Returns the components, or TOO_MANY.
    """
    total, components, cap = 0, 0, nodes.shape[1]
    starts[0] = 0
    for k in range(count):
        first = found[k]
        if stamp[first] == number:
            continue
        if components + 1 == starts.shape[0]:
            return TOO_MANY
        t = first
        while stamp[t] != number:
            stamp[t] = number
            edge = 0
            for e in range(3):
                if s[triangles[t, e]] >= 0.0 and s[triangles[t, (e + 1) % 3]] < 0.0:
                    edge = e
            i, j = triangles[t, edge], triangles[t, (edge + 1) % 3]
            share = s[i] / (s[i] - s[j])
            if total == cap:
                return TOO_MANY
            for axis in range(3):
                nodes[axis, total] = vertices[axis, i] + share * (vertices[axis, j] - vertices[axis, i])
            total += 1
            t = neighbours[t, edge]
        components += 1
        starts[components] = total
    return components
