"""Slots of an ellipsoid against dipoles inside it: torsion and curvatures that vary (the rest: test_coupling)."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.directions import tangent_frames
from creeping.geometry.surface import normal
from tests.reference import stored

BODY, K = sc.Ellipsoid(0.75, 0.9, 1.15), 12.0


@pytest.fixture(scope="module")
def exact():
    """The port, other points by their distance, two tangents there, and fields (points, source axes, 3)."""
    kept = stored.read("ellipsoid_slots")
    order = np.argsort(-kept["points"] @ kept["ports"][0])
    return kept["ports"], kept["points"][order], kept["tangents"], kept["values"][order, 0]


def found(ports, points, source, here):
    """Couplings of slots: at the port along one tangent, at points along one of theirs."""
    return cr.slot_coupling(BODY, np.concatenate([ports, points]), np.concatenate([source, here]), wavenumber=K)


@pytest.mark.slow
def test_ellipsoid_against_dipoles_inside(exact):
    """The reference errs by some parts of a thousand of the largest component."""
    ports, points, there, values = exact
    points, values = points[::3], values[::3]
    here = np.stack(tangent_frames(normal(BODY, points)), axis=1)
    want = np.einsum("nac,nrc->arn", values, here)
    each = [found(ports, points, there[:, a], here[:, a]) for a in (0, 1)]
    off = np.abs([one[0, 1:] - want[a, a] for a, one in enumerate(each)])
    share = off / np.sqrt(np.sum(np.abs(want) ** 2, axis=(0, 1)))
    fine = np.array([one.ok[0, 1:] for one in each])
    rays = fine & np.array([one.method[0, 1:] == "rays" for one in each])
    assert fine.mean() > 0.95
    assert np.median(share[rays]) < 0.015 and np.median(share[fine]) < 0.03
    assert np.quantile(share[rays], 0.95) < 0.05
    assert np.mean((off < [one.error[0, 1:] for one in each])[fine]) > 0.95


@pytest.mark.slow
def test_torsion_turns_the_field(exact):
    """Across the path at one end and along it at the other: what the torsion brings, and nothing on a sphere."""
    ports, points, there, values = exact
    points, values = points[:13], values[:13]
    paths = cr.coupling(BODY, np.concatenate([ports, points]), wavenumber=K)
    first = [paths.paths(0, 1 + n) for n in range(13)]
    along = np.array([path.arrival[0] for path in first])
    across = np.array([np.cross(normal(BODY, ports[0]), path.departure[0]) for path in first]) @ there[0].T
    each = [found(ports, points, there[:, a], along) for a in (0, 1)]
    rays = np.all([one.method[0, 1:] == "rays" for one in each], axis=0)
    size = np.linalg.norm(values, axis=(1, 2))
    mine = np.sum(across.T * np.array([one[0, 1:] for one in each]), axis=0)[rays] / size[rays]
    its = np.einsum("na,nac,nc->n", across, values, along)[rays] / size[rays]
    strong = np.abs(its) > 0.03
    assert strong.sum() >= 5
    assert np.median(np.abs(mine - its)[strong] / np.abs(its)[strong]) < 0.5
    assert np.sqrt(np.mean(np.abs(mine - its) ** 2)) < 0.6 * np.sqrt(np.mean(np.abs(its) ** 2))
