"""Sheets of neighbouring nodes: which goes over into which, and which can be followed."""

import numpy as np

from creeping.sweeping.between import chains, links


def made(keys, labels=None):
    """Sheets of nodes from their keys, one list for each node."""
    count = np.array([len(one) for one in keys])
    key = np.array([[x, 0.0, 0.0, 0.0] for one in keys for x in one]).reshape(-1, 4)
    label = np.zeros(len(key), dtype=int) if labels is None else np.array([n for one in labels for n in one])
    pairs = np.stack([np.arange(len(keys) - 1), np.arange(1, len(keys))], axis=1)
    return links(np.cumsum(count) - count, count, label, key, pairs, 0.1)


def test_sheets_that_cross_by_label_are_told_by_it():
    after, before = made([[0.0, 0.1], [0.1, 0.0]], [[0, 1], [0, 1]])
    assert after.tolist() == [2, 3, -1, -1] and before.tolist() == [-1, -1, 0, 1]


def test_the_nearest_both_ways_is_taken_and_none_twice():
    after, _ = made([[0.0, 0.3], [0.25]])
    assert after.tolist() == [-1, 2, -1]


def test_a_chain_is_followed_both_ways_until_a_sheet_ends():
    after, before = made([[0.0], [0.1, 3.0], [0.2, 3.1], [0.3, 3.2], [0.4, 3.3], [0.5]])
    # the second sheet of the third node has none at the ends
    assert chains(np.array([3, 4]), after, before).tolist() == [[0, 1, 3, 5, 7, 9], [-1, 2, 4, 6, 8, -1]]
