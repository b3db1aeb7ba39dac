"""Solutions found more than once: the first of each."""

from collections.abc import Callable

import numpy as np

from creeping._typing import BoolArray, IntArray


def first_of_equals(group: IntArray, alike: Callable[[IntArray, IntArray], BoolArray]) -> IntArray:
    """Numbers (m,), ascending, of those that are like no earlier one of their group.

    Parameters
    ----------
    group : (n,)
        What each is a solution of.
    alike : callable
        Whether two of them are one: numbers (k,), (k,) -> (k,).

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 1e-9, 1.0])
    >>> first_of_equals(np.array([0, 0, 0, 1]), lambda i, j: np.abs(x[i] - x[j]) < 1e-6)
    array([0, 1, 3])
    """
    kept = np.ones(len(group), dtype=bool)
    if not len(group):
        return np.flatnonzero(kept)
    order = np.argsort(group, kind="stable")
    _, counts = np.unique(group, return_counts=True)
    for shift in range(1, int(counts.max())):
        late, early = order[shift:], order[:-shift]
        same = group[late] == group[early]
        late, early = late[same], early[same]
        kept[late[alike(late, early)]] = False
    return np.flatnonzero(kept)
