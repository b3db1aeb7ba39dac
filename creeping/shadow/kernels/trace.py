"""Compiled nodes of shadow lines on a mesh: from the signs of n.q at its vertices to equally spaced points.

A triangle with vertices of both signs has one edge that goes from + to - counter-clockwise: leaving by it keeps the lit
side on the left, and ends where it began, so curves come out closed and oriented. Newton steps bring the crossings
onto the line; between neighbours x_0, x_1 with chord c and tangents T the curve is a cubic of length
|c| (1 + |T_1 - T_0|^2/24), and equally spaced points of the cubics are brought onto the line again.

Between those the arclength is h = |c|/|A|, A = sum_j a_j (T_-j + T_(1+j)) the mean of the polynomial through the
tangents around; its order is the number of them. Order 12 gives the length, its difference from order 8 the estimate
of its error; that of order 4, [13 (T_0 + T_1) - (T_-1 + T_2)]/24, from 6 says whether the line is resolved.

Sources: Derivations, R6, R7, R8 and R19.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options
from creeping.shadow.kernels.newton import move, work_space

CURVES = 16
"""Curves of a line at most."""
LEAST_NODES = 64
"""Nodes of a curve at least; their number is a multiple of 8."""

_AROUND = 6
_MEANS = np.array(
    [
        np.array([548839986, -91373082, 27022635, -6409423, 995469, -73985]) / 958003200,
        np.array([68323, -9531, 1879, -191, 0, 0]) / 120960,
        np.array([802, -93, 11, 0, 0, 0]) / 1440,
        np.array([13, -1, 0, 0, 0, 0]) / 24,
    ]
)
"""a_j of orders 12, 8, 6 and 4."""


@njit(**options)
def lines_on_mesh(
    level, level_par, extent, mesh, waves, x, tangents, curvature, starts, spacing, found, certain, error
):
    """Nodes of the lines of waves (n, 4), (d, w), the longest curve of each first.

    Parameters
    ----------
    level, level_par
        The body's block evaluator.
    extent : float, L
        Longest side of the body's box.
    mesh : (vertices (3, n), normals (3, n), triangles (m, 3), neighbours (m, 3), edge, turn, nodes)
        ``nodes`` is the number for a line.
    x, tangents : (n, cap, 3), curvature : (n, cap), filled
        Nodes, T and kappa_n, as many as `starts` says.
    starts : (n, CURVES + 1), spacing : (n, CURVES), filled
        First node of each curve and their end, and the spacing.
    found, certain, error : (n,), filled
        Number of curves, 0 for none, whether every step was certain of them, and their length's relative error.
    """
    vertices, _, triangles, _, edge, _, wanted = mesh
    n, m = vertices.shape[1], triangles.shape[0]
    # triangles of a line are far fewer than all of them
    cap = 8 * int(math.sqrt(m)) + 1024
    s, marks, space = np.empty(n), np.full(m, -1), work_space()
    most = max(cap, x.shape[1])
    raw, slopes, bent, left = np.empty((cap, 3)), np.empty((cap, 3)), np.empty(cap), np.empty(most)
    work = np.empty((3, most))
    h = work[0]
    first, lengths, padded = np.empty(CURVES + 1, np.int64), np.empty(CURVES), np.empty((3, most + 2 * _AROUND))
    # a number of steps that is no constant, for which `move` would be compiled once more
    # next to a small loop a node with a longer step, in edges, would end on another branch
    reach, once = 0.5 * edge, np.int64(1)
    for row in range(waves.shape[0]):
        found[row] = 0
        wave, y, T, kappa, begin = waves[row : row + 1], x[row], tangents[row], curvature[row], starts[row]
        curves = _walk(mesh, waves[row], s, marks, row, raw, first)
        if curves < 1:
            continue
        some = first[curves]
        step = move(level, level_par, wave, raw[:some], reach, once, space, slopes, bent, left)
        # crossings that go farther, in edges, may have changed branch: the line takes more steps, and is flagged
        sure = step < 0.22 * edge
        more = once if sure else 4 * once
        if not move(level, level_par, wave, raw[:some], reach, more, space, slopes, bent, left) < math.inf:
            continue
        leans, whole = _lengths(raw, slopes, first, curves, h, lengths)
        if not whole < 1e6 * extent:
            continue
        end = _resampled(raw, slopes, first, curves, h, lengths, whole, wanted, y, begin)
        good, off, rough = end > 0, 0.0, 0.0
        for again in range(2):
            step = move(level, level_par, wave, y[:end], reach, once, space, T, kappa, left) if good else math.inf
            # by the second step of the nodes, in extents, a line goes to the next mesh, or is given up
            sure &= step < 1e-6 * extent
            good &= step < 1e-3 * extent
            if good:
                whole, off, rough = _spaced(y, T, begin, curves, padded, work, spacing[row], again == 0)
                good = whole < math.inf
        if good:
            found[row], error[row] = curves, off / whole
            # its length differs so little by orders 4 and 6, and by 8 and 12
            certain[row] = sure and not leans and rough < 2e-6 * whole and off < 1e-7 * whole


@njit(**options)
def _walk(mesh, wave, s, marks, number, crossings, first):
    """Crossings of mesh edges, curve by curve, 0.45 edges apart at least; returns the number of curves, -1 of too many.

    s (vertices,) is left with n.q, ``marks`` (triangles,) hold the number of the line that passed last.
    """
    vertices, normals, triangles, neighbours, edge, _, _ = mesh
    a, b, c, w = wave[0], wave[1], wave[2], wave[3]
    nx, ny, nz, x, y, z = normals[0], normals[1], normals[2], vertices[0], vertices[1], vertices[2]
    for i in range(s.shape[0]):
        s[i] = nx[i] * (a + w * x[i]) + ny[i] * (b + w * y[i]) + nz[i] * (c + w * z[i])
    total, curves, least = np.int64(0), 0, (0.45 * edge) ** 2
    first[0] = 0
    for begin in range(triangles.shape[0]):
        lit = (s[triangles[begin, 0]] < 0.0) + (s[triangles[begin, 1]] < 0.0) + (s[triangles[begin, 2]] < 0.0)
        if lit == 0 or lit == 3 or marks[begin] == number:
            continue
        if curves == CURVES:
            return -1
        t = begin
        while marks[t] != number:
            marks[t] = number
            e = 0
            for c in range(1, 3):
                e = c if s[triangles[t, c]] >= 0.0 and s[triangles[t, (c + 1) % 3]] < 0.0 else e
            i, j = triangles[t, e], triangles[t, (e + 1) % 3]
            share = s[i] / (s[i] - s[j])
            if total == crossings.shape[0]:
                return -1
            for k in range(3):
                crossings[total, k] = vertices[k, i] + share * (vertices[k, j] - vertices[k, i])
            if total == first[curves] or _square(crossings, total - 1, total) > least:
                total += 1
            t = neighbours[t, e]
        while total - first[curves] > 4 and _square(crossings, total - 1, first[curves]) <= least:
            total -= 1
        curves += 1
        first[curves] = total
    return curves


@njit(**options)
def _square(x, i, j):
    """Square of the distance of points i and j."""
    return (x[j, 0] - x[i, 0]) ** 2 + (x[j, 1] - x[i, 1]) ** 2 + (x[j, 2] - x[i, 2]) ** 2


@njit(**options)
def _lengths(x, tangents, first, curves, h, lengths):
    """Lengths h of the cubics, and of the curves; returns whether a chord makes over 60 degrees with T, and the sum."""
    leans, whole = False, 0.0
    for c in range(curves):
        lengths[c] = 0.0
        for i in range(first[c], first[c + 1]):
            j = i + 1 if i + 1 < first[c + 1] else first[c]
            bend = ahead = 0.0
            for k in range(3):
                bend += (tangents[j, k] - tangents[i, k]) ** 2
                ahead += (x[j, k] - x[i, k]) * tangents[i, k]
            chord = math.sqrt(_square(x, i, j))
            leans |= not ahead > 0.5 * chord
            h[i] = chord * (1.0 + bend / 24.0)
            lengths[c] += h[i]
        whole += lengths[c]
    return leans, whole


@njit(**options)
def _resampled(x, tangents, first, curves, h, lengths, whole, wanted, out, starts):
    """Put equally spaced points of the cubics into ``out``, the longest curve first.

    The curves share the number that is wanted by their lengths, which are used up. Returns how many there are, -1 if
    they are too many.
    """
    total = 0
    for c in range(curves):
        best = 0
        for b in range(curves):
            best = b if lengths[b] > lengths[best] else best
        length, begin, end = lengths[best], first[best], first[best + 1]
        lengths[best] = -1.0
        number = max(LEAST_NODES, 8 * int(wanted * length / whole / 8.0 + 0.5))
        starts[c] = total
        if total + number > out.shape[0]:
            return -1
        i, passed = begin, 0.0
        for m in range(number):
            place = length * m / number
            while passed + h[i] < place and i + 1 < end:
                passed += h[i]
                i += 1
            j = i + 1 if i + 1 < end else begin
            u = min((place - passed) / h[i], 1.0)
            v = 1.0 - u
            a, b, p, q = v * v * (1.0 + 2.0 * u), u * u * (3.0 - 2.0 * u), h[i] * u * v * v, -h[i] * u * u * v
            for k in range(3):
                out[total + m, k] = a * x[i, k] + b * x[j, k] + p * tangents[i, k] + q * tangents[j, k]
        total += number
    starts[curves] = total
    return total


@njit(**options)
def _spaced(x, tangents, starts, curves, padded, work, spacing, shift):
    """Spacings of the curves, in ``spacing``; with ``shift`` the nodes are moved along to equal arclengths.

    Returns the whole length, inf where the tangents tell none, and the sums of how far order 8 is off, and order 4 from
    order 6. padded (3, n) and work (3, n) are work space.
    """
    whole = error = rough = 0.0
    h, off, far = work[0], work[1], work[2]
    for c in range(curves):
        begin, number = starts[c], starts[c + 1] - starts[c]
        for k in range(3):
            for m in range(number):
                padded[k, m + _AROUND] = tangents[begin + m, k]
            for m in range(_AROUND):
                padded[k, m], padded[k, number + _AROUND + m] = padded[k, number + m], padded[k, _AROUND + m]
        # 1/|A|, and how far the other orders are off, in a loop that vectorises
        for m in range(number):
            twelfth = eighth = sixth = fourth = 0.0
            for k in range(3):
                twelve = eight = six = four = 0.0
                for a in range(_AROUND):
                    pair = padded[k, m + _AROUND - a] + padded[k, m + _AROUND + 1 + a]
                    twelve += _MEANS[0, a] * pair
                    eight += _MEANS[1, a] * pair
                    six += _MEANS[2, a] * pair
                    four += _MEANS[3, a] * pair
                twelfth += twelve * twelve
                eighth += eight * eight
                sixth += six * six
                fourth += four * four
            h[m] = 1.0 / math.sqrt(twelfth)
            off[m], far[m] = abs(h[m] - 1.0 / math.sqrt(eighth)), abs(1.0 / math.sqrt(sixth) - 1.0 / math.sqrt(fourth))
        length = 0.0
        for m in range(number):
            # A is of unit length but for the turn of T
            if not (h[m] < 100.0 and off[m] < 100.0 and far[m] < 100.0):
                return math.inf, math.inf, math.inf
            chord = math.sqrt(_square(x, begin + m, begin + m + 1 if m + 1 < number else begin))
            h[m] *= chord
            length += h[m]
            error += chord * off[m]
            rough += chord * far[m]
        spacing[c] = length / number
        whole += length
        passed = 0.0
        for m in range(number if shift else 0):
            along = m * spacing[c] - passed
            passed += h[m]
            for k in range(3):
                bend = (padded[k, m + _AROUND + 1] - padded[k, m + _AROUND - 1]) / (2.0 * spacing[c])
                x[begin + m, k] += along * (padded[k, m + _AROUND] + 0.5 * along * bend)
    return whole, error, rough
