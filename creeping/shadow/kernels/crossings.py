"""Compiled search for the segments of plane closed curves that cross.

A part along which u does not fall, or does not rise, does not cross itself, and two of them are compared by going along
both of them in u. A curve has few such parts.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options


@njit(**options)
def crossings(seen, first, number, line, found, hits):
    """First nodes of the pairs of segments of each line that cross, into found (n, k, 2), and their numbers (n,).

    ``seen`` (m, 2) are (u, v) of the nodes; a curve (c,) is of a line and has nodes from its ``first`` on. There may be
    more pairs than there is room for.
    """
    total = 2 * seen.shape[0]
    # parts of a line one after the other in rising u: (u, v), nodes, where each starts, whether its curve rises
    x, nodes = np.empty((total, 2)), np.empty(total, np.int64)
    starts, rises = np.zeros(total + 1, np.int64), np.empty(total, np.bool_)
    # no constants, for which what is called would be compiled once more
    none = np.int64(0)
    count = none
    for c in range(number.shape[0]):
        count = _parts_of(seen, first[c], number[c], count, x, nodes, starts, rises)
        if c + 1 < number.shape[0] and line[c + 1] == line[c]:
            continue
        pairs = none
        for a in range(count):
            for b in range(a):
                pairs = _compared(x, nodes, starts, rises, a, b, found[line[c]], pairs)
        hits[line[c]] = pairs
        count = none


@njit(**options)
def _parts_of(seen, first, number, count, x, nodes, starts, rises):
    """Add the parts of a curve; returns their number."""
    # from a node at which u turns
    turn = 0
    for k in range(1, number):
        here = seen[first + k, 0]
        if (seen[first + k - 1, 0] <= here) != (here <= seen[first + (k + 1) % number, 0]):
            turn = k
    k = turn
    while k < turn + number:
        up = seen[first + k % number, 0] <= seen[first + (k + 1) % number, 0]
        begin, at = k, starts[count]
        while k < turn + number and (seen[first + k % number, 0] <= seen[first + (k + 1) % number, 0]) == up:
            k += 1
        for m in range(k - begin + 1):
            node = first + (begin + m if up else k - m) % number
            nodes[at + m], x[at + m, 0], x[at + m, 1] = node, seen[node, 0], seen[node, 1]
        rises[count] = up
        count += 1
        starts[count] = at + k - begin + 1
    return count


@njit(**options)
def _compared(x, nodes, starts, rises, a, b, found, hits):
    """Add the segments of two parts that cross; returns the number of pairs."""
    p, q, last, end = starts[a], starts[b], starts[a + 1] - 1, starts[b + 1] - 1
    while p < last and q < end:
        ends, other = x[p + 1, 0], x[q + 1, 0]
        # where both segments end at one u they may also cross the next one
        for more in range(2 if ends == other and q + 1 < end else 1):
            m = q + more
            if _left(x, p, m) != _left(x, p, m + 1) and _left(x, m, p) != _left(x, m, p + 1):
                i, j, s, t = nodes[p], nodes[p + 1], nodes[m], nodes[m + 1]
                if i != s and i != t and j != s and j != t:
                    if hits < found.shape[0]:
                        found[hits, 0], found[hits, 1] = i if rises[a] else j, s if rises[b] else t
                    hits += 1
        if ends <= other:
            p += 1
        else:
            q += 1
    return hits


@njit(**options)
def _left(x, i, m):
    """Whether point m lies on the left of the segment from i to i + 1."""
    return (x[i + 1, 0] - x[i, 0]) * (x[m, 1] - x[i, 1]) > (x[i + 1, 1] - x[i, 1]) * (x[m, 0] - x[i, 0])
