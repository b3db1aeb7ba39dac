"""Beams of ports: what their angles, steps and beginnings change is less than the stated error."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.ports import sums
from creeping.geometry.surface import project

EGG = sc.Ellipsoid(1.0, 0.8, 0.6)
DENSE = ((sums, "DENSE", (0.5, 0.5, 2)),)


@pytest.fixture(scope="module")
def ports():
    """Ports (16, 3), every other one across the body from the one before."""
    rng = np.random.default_rng(3)
    there = rng.normal(size=(8, 3))
    there /= np.linalg.norm(there, axis=1, keepdims=True)
    return project(EGG, np.stack([there, 0.05 * rng.normal(size=(8, 3)) - there], axis=1).reshape(-1, 3))


@pytest.fixture(scope="module")
def coupled(ports):
    """Couplings as they are, points and slots."""

    def of(kind):
        if kind == "ports":
            return cr.coupling(EGG, ports, wavenumber=20.0)
        return cr.slot_coupling(EGG, ports, (0.3, 0.5, 0.7), wavenumber=20.0)

    return of, {kind: of(kind) for kind in ("ports", "slots")}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "changes", "share"),
    [
        ("ports", DENSE, 0.1),
        ("slots", DENSE, 0.1),
        ("ports", ((sums, "CUTS", (1.52, 1, 1)),), 1.0),
        ("ports", ((sums, "CUTS", (0.64, 1, 1)),), 1.0),
        ("ports", ((sums, "APART", 0.75),), 1.0),
        ("ports", ((sums, "APART", 1.5),), 1.0),
        ("ports", ((sums, "WIDTH", 0.7),), 1.0),
        ("ports", ((sums, "WIDTH", 1.4),), 1.0),
    ],
)
def test_what_is_free_changes_little(kind, changes, share, coupled, monkeypatch):
    of, kept = coupled
    for module, name, factor in changes:
        value = getattr(module, name)
        new = tuple(np.multiply(value, factor).tolist()) if isinstance(value, tuple) else type(value)(factor * value)
        monkeypatch.setattr(module, name, new)
    some, other = kept[kind], of(kind)
    both = (some.method == "beams") & (other.method == "beams")
    assert both.sum() > 20
    off = np.abs(other.values[both] - some.values[both])
    assert np.mean(off < share * some.error[both]) > 0.95
    assert np.median(off / np.abs(some.values[both])) < 0.02 * share
