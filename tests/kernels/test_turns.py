"""Angles in turns against numpy's."""

import numpy as np

from creeping.kernels.exponential import cosine_sine, turns

ANGLES = np.concatenate([np.random.default_rng(0).uniform(-0.5, 0.5, 3000), np.arange(-8, 9) / 16])


def apart(one, other):
    """Distance of angles in turns, any number of turns apart."""
    return np.abs((np.asarray(one) - other + 0.5) % 1.0 - 0.5)


def test_angle_of_a_vector():
    across, along = 3.7 * np.sin(2 * np.pi * ANGLES), 3.7 * np.cos(2 * np.pi * ANGLES)
    plain = turns.py_func
    found = np.array([plain(float(a), float(b)) for a, b in zip(across, along, strict=True)])
    assert apart(found, np.arctan2(across, along) / (2 * np.pi)).max() < 3e-16
    assert found.min() >= 0.0 and found.max() <= 1.0 and plain(0.0, 0.0) == 0.0


def test_cosine_and_sine():
    for shift in (0.0, 3.0, -100.0):
        found = np.array([cosine_sine.py_func(float(t)) for t in ANGLES + shift])
        exact = np.stack([np.cos(2 * np.pi * ANGLES), np.sin(2 * np.pi * ANGLES)], axis=1)
        assert np.abs(found - exact).max() < 3e-15 * (1 + 2 * abs(shift))
