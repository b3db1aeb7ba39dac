"""Nodes of bodies of pieces: triangles smaller where the body bends, and few points where these must be small."""

import numpy as np
import pytest

import scatterers as sc
from creeping.errors import SurfaceError
from creeping.geometry.curvature import gaussian_curvature
from creeping.geometry.piecewise import Tiles, pieces_across
from creeping.geometry.quadrature import body_nodes, node_count
from creeping.geometry.surface import size
from creeping.geometry.tile_rules import BEND, graded

ALMOND, PILL = sc.Almond(), sc.Capsule(1.0, 4.0)


def edges_of(tiles, body):
    """How many triangles have each edge."""
    grid = np.round(tiles.corners.reshape(-1, 3) / (1e-7 * size(body)))
    number = np.unique(grid, axis=0, return_inverse=True)[1].reshape(-1, 3)
    pairs = np.sort(np.stack([number, np.roll(number, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    return np.unique(pairs, axis=0, return_counts=True)[1]


@pytest.mark.parametrize("body", [ALMOND, PILL, sc.ConeSphere(1.0, 3.0)])
def test_graded_triangles_close(body):
    coarse = Tiles(*body.tiles(0.3 * size(body)))
    fine = graded(body, coarse)
    assert np.all(edges_of(fine, body) == 2)
    corners = fine.corners
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(areas * fine.normals.mean(axis=1), axis=1) > 0)
    assert np.linalg.norm(areas.sum(axis=0)) < 1e-12 * fine.areas.sum()
    # but for middles of edges along a joint, which are put onto one of its pieces
    off = np.abs(body.level(corners.reshape(-1, 3))) / size(body)
    assert np.mean(off > 1e-8) < 0.1 and off.max() < 1e-3
    # away from tips no edge turns by more
    turns = np.arccos(np.clip(np.sum(fine.normals * np.roll(fine.normals, -1, axis=1), axis=2), -1, 1))
    assert np.mean(turns > BEND) < 0.06 and len(fine.pieces) >= len(coarse.pieces)


def test_triangles_are_long_along_a_rim():
    """Of a slender capsule, whose sides are straight, only the edges round it are split."""
    needle = sc.Capsule(0.1, 4.0)
    fine = graded(needle, Tiles(*needle.tiles(0.5)))
    middle = np.abs(fine.corners[:, :, 2]).max(axis=1) < 1.5
    sides = np.linalg.norm(np.roll(fine.corners, -1, axis=1) - fine.corners, axis=2)[middle]
    assert np.median(sides.max(axis=1) / sides.min(axis=1)) > 3


@pytest.mark.parametrize("rate", [3.0, 60.0])
def test_areas_and_curvature_of_a_capsule(rate):
    nodes = body_nodes(PILL, rate)
    # few points where the body asks for small triangles
    assert len(nodes.points) == node_count(PILL, rate) and (len(nodes.points) < 5000) == (rate < 60)
    assert nodes.weights.sum() == pytest.approx(4 * np.pi + 2 * np.pi * 2, rel=1e-5)
    ball = np.abs(nodes.points[:, 2]) > 1
    assert nodes.weights[ball].sum() == pytest.approx(4 * np.pi, rel=1e-5)
    # a wave without sources has no flux through it
    q, a = rate / 2 * np.array([0.6, 0.0, 0.8]), np.array([0.8, 0.0, -0.6])
    flux = np.sum(nodes.weights * (nodes.normals @ a) * np.exp(1j * nodes.points @ q))
    assert abs(flux) < 1e-3


def test_the_almond_closes_at_any_rate():
    """Its rim has a radius of curvature of a fiftieth of its length, and its tip none."""
    for rate in (10.0, 200.0, 1000.0):
        nodes = body_nodes(ALMOND, rate)
        assert nodes.error < 1e-3
        clear = ALMOND.bounds[1, 0] - nodes.points[:, 0] > 0.02
        total = np.sum((nodes.weights * gaussian_curvature(ALMOND, nodes.points))[clear])
        # what the tip has of 4 pi is left out
        assert 1.5 * np.pi < total < 4 * np.pi
    fine = body_nodes(ALMOND, 1000.0).weights.sum()
    assert body_nodes(ALMOND, 10.0).weights.sum() == pytest.approx(fine, rel=2e-3)


def test_spacing_is_that_of_the_place():
    nodes = body_nodes(ALMOND, 100.0)
    rim, top = np.array([[-0.02, 0.0485, 0.0], [-0.02, 0.0, 0.0162]])
    apart = nodes.spacing_at(np.stack([rim, top]))
    assert apart[0] < 0.7 * apart[1] and apart[1] <= nodes.spacing
    near = [np.sort(np.linalg.norm(nodes.points - x, axis=1))[:2].max() for x in (rim, top)]
    assert np.all(np.array(near) < 1.5 * apart)


def test_pieces_that_do_not_close_are_refused(monkeypatch):
    body = sc.Capsule(0.9, 3.1)
    # half of the body is missing
    monkeypatch.setattr(sc.Capsule, "tiles", lambda self, edge: [v[: len(v) // 2] for v in TILES(self, edge)])
    with pytest.raises(SurfaceError, match="pieces do not close"):
        body_nodes(body, 5.0)


TILES = sc.Capsule.tiles


def test_pieces_are_as_wide_as_their_boxes():
    """Two halves of a ball, 2 x 2 x 1, and a cylinder between them, 2 x 2 x 2, by the corners of triangles."""
    np.testing.assert_allclose(pieces_across(PILL), [3.0, np.sqrt(12.0), 3.0], rtol=3e-3)
