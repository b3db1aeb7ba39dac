"""Cutting curves of angles at seams and poles."""

from itertools import pairwise

import numpy as np
import pytest

from creeping.rays.isophase import split_at_seam


def test_seam_is_crossed_at_pi():
    turn = np.linspace(0, 4 * np.pi, 101)
    phi = np.angle(np.exp(1j * turn))
    pieces = split_at_seam(np.stack([1 + 0.1 * turn, phi], axis=-1), closed=False)
    assert len(pieces) == 3
    for before, after in pairwise(pieces):
        assert before[-1, 1] == pytest.approx(np.pi)
        assert after[0, 1] == pytest.approx(-np.pi)
        assert after[0, 0] == pytest.approx(before[-1, 0])
    assert max(np.abs(np.diff(piece[:, 1])).max() for piece in pieces) < 0.2


def test_passing_a_pole_leaves_a_gap():
    # a meridian over the north pole: phi = 0.3 down to theta = 0, then 0.3 - pi
    theta = np.abs(np.linspace(-1, 1, 20))
    phi = np.where(np.linspace(-1, 1, 20) < 0, 0.3, 0.3 - np.pi)
    pieces = split_at_seam(np.stack([theta, phi], axis=-1), closed=False)
    assert [len(piece) for piece in pieces] == [10, 10]
    assert all(np.ptp(piece[:, 1]) == 0 for piece in pieces)


def test_closed_curve_without_crossing_returns_to_its_start():
    angle = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    (piece,) = split_at_seam(np.stack([1 + 0.5 * np.cos(angle), 0.5 * np.sin(angle)], axis=1), closed=True)
    np.testing.assert_allclose(piece[0], piece[-1])
