"""Beams of ports: what their angles, steps and widths change is far less than the stated error."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.ports import beams
from creeping.geometry.surface import project

EGG = sc.Ellipsoid(1.0, 0.8, 0.6)


@pytest.fixture(scope="module")
def ports():
    """Ports (16, 3), every other one across the body from the one before."""
    rng = np.random.default_rng(3)
    there = rng.normal(size=(8, 3))
    there /= np.linalg.norm(there, axis=1, keepdims=True)
    return project(EGG, np.stack([there, 0.05 * rng.normal(size=(8, 3)) - there], axis=1).reshape(-1, 3))


@pytest.mark.parametrize("kind", ["ports", "slots"])
def test_denser_beams_give_the_same(kind, ports, monkeypatch):
    def coupled():
        if kind == "ports":
            return cr.coupling(EGG, ports, wavenumber=20.0)
        return cr.slot_coupling(EGG, ports, (0.3, 0.5, 0.7), wavenumber=20.0)

    some = coupled()
    for name, value in (("APART", beams.APART / 2), ("STEP", beams.STEP / 2), ("FEWEST", 2 * beams.FEWEST)):
        monkeypatch.setattr(beams, name, value)
    dense = coupled()
    both = (some.method == "beams") & (dense.method == "beams")
    assert both.sum() > 20
    off = np.abs(dense.values[both] - some.values[both])
    assert np.max(off / some.error[both]) < 0.1
    assert np.median(off / np.abs(some.values[both])) < 1e-3
