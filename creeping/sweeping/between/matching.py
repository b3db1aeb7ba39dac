"""Which sheet of a node is which of its neighbour: sheets that are nearest to each other, both ways.

A sheet has a chain if it can be followed over all nodes of a stencil; in two dimensions along the first axis and then
the second, and to the same sheet the other way round.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray

NEAR = 12.0
"""Largest distance of neighbouring sheets, in body sizes and steps of the lattice."""


def links(
    begin: IntArray, count: IntArray, label: IntArray, key: FloatArray, pairs: IntArray, step: float
) -> tuple[IntArray, IntArray]:
    """What each sheet goes over into at the next node, and the inverse: (sheets,) each, -1 where there is none.

    Parameters
    ----------
    begin, count : (nodes,)
        First sheet of each node, and how many there are.
    label : (sheets,)
        Only sheets of one label are alike.
    key : (sheets, 4)
    pairs : (pairs, 2)
        Nodes and their next ones.
    step : float
        Angle between neighbouring nodes.
    """
    after, before = np.full(len(label), -1), np.full(len(label), -1)
    first, second = pairs.T
    # every sheet of the first node with every one of the second
    sizes = count[first] * count[second]
    pair = np.repeat(np.arange(len(pairs)), sizes)
    number = np.arange(len(pair)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    across = np.maximum(count[second][pair], 1)
    one, two = begin[first][pair] + number // across, begin[second][pair] + number % across
    alike = label[one] == label[two]
    one, two = one[alike], two[alike]
    apart = np.linalg.norm(key[one] - key[two], axis=1)
    near = apart < NEAR * step
    one, two, apart = one[near], two[near], apart[near]
    nearest = _is_least(one, apart) & _is_least(two, apart)
    after[one[nearest]], before[two[nearest]] = two[nearest], one[nearest]
    return after, before


def _is_least(group: IntArray, value: FloatArray) -> BoolArray:
    """Whether a value is the least of its group (n,)."""
    order = np.lexsort((value, group))
    least = np.zeros(len(group), dtype=bool)
    first = np.ones(len(group), dtype=bool)
    first[1:] = group[order][1:] != group[order][:-1]
    least[order[first]] = True
    return least


def chains(start: IntArray, after: list[IntArray], before: list[IntArray], base: int, count: int) -> IntArray:
    """Sheets at the nodes of the stencils around those of ``start``: (n, count^dimensions), -1 where one is lost.

    Parameters
    ----------
    start : (n,)
        Sheets of the node at place ``base`` along each axis.
    after, before : list of (sheets,)
        Of `links`, for each axis.
    base, count : int
        Places along an axis: that of the start, and how many.
    """
    found = start[:, None]
    for one, other in zip(after, before, strict=True):
        found = _along(found, one, other, base, count)
    if len(after) == 2:
        crossed = start[:, None]
        for one, other in zip(after[::-1], before[::-1], strict=True):
            crossed = _along(crossed, one, other, base, count)
        turned = crossed.reshape(len(start), count, count).swapaxes(1, 2).reshape(found.shape)
        found = np.where(found == turned, found, -1)
    return found


def _along(sheets: IntArray, after: IntArray, before: IntArray, base: int, count: int) -> IntArray:
    """Each sheet (n, m) followed along one axis: (n, m count)."""
    out = np.empty((*sheets.shape, count), dtype=np.int64)
    out[..., base] = sheets
    for place in range(base + 1, count):
        out[..., place] = np.where(out[..., place - 1] >= 0, after[out[..., place - 1]], -1)
    for place in range(base - 1, -1, -1):
        out[..., place] = np.where(out[..., place + 1] >= 0, before[out[..., place + 1]], -1)
    return out.reshape(len(sheets), sheets.shape[1] * count)
