"""Angles in turns against numpy's."""

import numpy as np
import pytest

from creeping.kernels.exponential import cosine_sine, turns
from scatterers.kernels.charts import turns as bodies_turns

ANGLES = np.concatenate([np.random.default_rng(0).uniform(-0.5, 0.5, 3000), np.arange(-8, 9) / 16])


def apart(one, other):
    """Distance of angles in turns, any number of turns apart."""
    return np.abs((np.asarray(one) - other + 0.5) % 1.0 - 0.5)


@pytest.mark.parametrize("angle_of", [turns, bodies_turns])
def test_angle_of_a_vector(angle_of):
    across, along = 3.7 * np.sin(2 * np.pi * ANGLES), 3.7 * np.cos(2 * np.pi * ANGLES)
    plain = getattr(angle_of, "py_func", angle_of)
    found = np.array([plain(float(a), float(b)) for a, b in zip(across, along, strict=True)])
    assert apart(found, np.arctan2(across, along) / (2 * np.pi)).max() < 3e-16
    low, high = (0.0, 1.0) if angle_of is turns else (-0.5, 0.5)
    assert found.min() >= low and found.max() <= high and plain(0.0, 0.0) == 0.0


def test_cosine_and_sine():
    for shift in (0.0, 3.0, -100.0):
        found = np.array([cosine_sine.py_func(float(t)) for t in ANGLES + shift])
        exact = np.stack([np.cos(2 * np.pi * ANGLES), np.sin(2 * np.pi * ANGLES)], axis=1)
        assert np.abs(found - exact).max() < 3e-15 * (1 + 2 * abs(shift))
