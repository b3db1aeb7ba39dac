"""Sheets of neighbouring nodes: which goes over into which, and which can be followed."""

import numpy as np

from creeping.sweeping.between.fields import chains, links


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


def test_chains_around_a_point_must_close():
    # two sheets that change places on the way round: nodes (0, 0), (0, 1), (1, 0), (1, 1), two sheets each
    straight = np.array([2, 3, -1, -1, 6, 7, -1, -1])
    along = np.array([4, 5, 6, 7, -1, -1, -1, -1])
    turned = np.array([4, 5, 7, 6, -1, -1, -1, -1])

    def inverse(after):
        before = np.full(8, -1)
        before[after[after >= 0]] = np.flatnonzero(after >= 0)
        return before

    for first, whole in ((along, True), (turned, False)):
        both = [first, straight], [inverse(first), inverse(straight)]
        found = chains(np.array([0, 1]), *both, 0, 2)
        assert np.all(found >= 0) == whole
