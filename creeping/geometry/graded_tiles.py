"""Triangles of a body of smooth pieces, smaller where the body bends and towards its tips.

An edge between whose ends the normal turns by more than BEND, or that ends in a tip, is split in the middle, which is
put onto its piece, and the triangles on both sides of it with it, so that no gap opens between them:

    one edge split: 2 triangles,   two: 3,   three: 4

Along a rim triangles may be ASPECT times as long as across it: windows of sums over nodes are round.
"""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.creased import Tiles, pieces_of
from creeping.geometry.surface import normal, project, size

BEND = 0.6
"""Largest angle between the normals at the ends of an edge, radians."""
ASPECT = 2.0
"""What an edge may be longer than one across the bend, by the most bent of its triangles."""
ROUNDS = 4
"""Times that an edge is split at most: at a tip the normal turns on any length."""
SAME = 1e-9
"""Distance of corners that are one, in body sizes."""
SPLITS = {
    1: ((0, 3, 2), (3, 1, 2)),
    3: ((3, 1, 4), (0, 3, 2), (3, 4, 2)),
    7: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
}
"""Triangles for corners 0, 1, 2 and middles 3, 4, 5 of the edges 01, 12, 20, where 01, 01 and 12, or all are split."""


def graded(body: Any, tiles: Tiles) -> Tiles:
    """Triangles whose edges turn by no more than BEND and end in no tip, or have been split ROUNDS times.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.Capsule(1.0, 4.0)
    >>> coarse = Tiles(*body.tiles(1.5))
    >>> fine = graded(body, coarse)
    >>> sharper = 2 * 4 * np.pi - coarse.areas.sum() > 3 * (2 * 4 * np.pi - fine.areas.sum())
    >>> len(coarse.pieces) < len(fine.pieces), bool(sharper)
    (True, True)
    """
    for _ in range(ROUNDS):
        edges, first = _edges(body, tiles)
        following = Tiles(np.roll(tiles.corners, -1, axis=1), np.roll(tiles.normals, -1, axis=1), tiles.pieces)
        angles = np.arccos(np.clip(np.sum(tiles.normals * following.normals, axis=2), -1.0, 1.0))
        lengths = np.linalg.norm(following.corners - tiles.corners, axis=2)
        curvature = np.max(angles / lengths, axis=1, keepdims=True)
        worst = np.zeros(len(first))
        np.maximum.at(worst, edges.ravel(), np.maximum(angles, lengths * curvature / ASPECT).ravel())
        turned = worst > BEND
        turned[edges[_at_tips(body, tiles)]] = True
        if not np.any(turned):
            break
        tiles = _split(body, tiles, edges, first, turned)
    return tiles


def _edges(body: Any, tiles: Tiles) -> tuple[IntArray, IntArray]:
    """Numbers of the edges 01, 12, 20 of each triangle (m, 3), and where among these 3m each edge is first."""
    grid = np.round(tiles.corners.reshape(-1, 3) / (SAME * size(body))).astype(np.int64)
    corners = np.unique(grid, axis=0, return_inverse=True)[1].reshape(-1, 3)
    pairs = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, first, edges = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    return edges.reshape(-1, 3), first


def _at_tips(body: Any, tiles: Tiles) -> BoolArray:
    """Whether the edges 01, 12, 20 of each triangle end in a tip (m, 3)."""
    at = np.zeros(tiles.corners.shape[:2], dtype=bool)
    for crease in body.creases:
        if crease.kind == "tip":
            tip = np.ravel(np.asarray(crease.points, dtype=float))[:3]
            at |= np.linalg.norm(tiles.corners - tip, axis=2) < SAME * size(body)
    return at | np.roll(at, -1, axis=1)


def _split(body: Any, tiles: Tiles, edges: IntArray, first: IntArray, turned: BoolArray) -> Tiles:
    """Triangles with the ``turned`` of their edges split."""
    ends = tiles.corners, np.roll(tiles.corners, -1, axis=1)
    middles = (0.5 * (ends[0] + ends[1])).reshape(-1, 3)[first]
    owners = tiles.pieces[first // 3]
    pieces = pieces_of(body)
    for number in np.unique(owners[turned]):
        mine = turned & (owners == number)
        middles[mine] = project(pieces[number], middles[mine])
    marks = turned[edges]
    parts = [Tiles(*(values[~np.any(marks, axis=1)] for values in tiles))]
    for which in range(1, 8):
        wanted = np.array([which & 1, which & 2, which & 4], dtype=bool)
        these = np.flatnonzero(np.all(marks == wanted, axis=1))
        if not len(these):
            continue
        # turned so that the edges that are split come first
        shift = next(s for s in range(3) if sum(int(wanted[(i + s) % 3]) << i for i in range(3)) in SPLITS)
        order = (np.arange(3) + shift) % 3
        split = SPLITS[sum(int(wanted[order[i]]) << i for i in range(3))]
        points = np.concatenate([tiles.corners[these][:, order], middles[edges[these][:, order]]], axis=1)
        mine = tiles.pieces[these]
        added = _normals(pieces, points[:, 3:].reshape(-1, 3), np.repeat(mine, 3)).reshape(-1, 3, 3)
        sides = np.concatenate([tiles.normals[these][:, order], added], axis=1)
        parts += [Tiles(points[:, corners], sides[:, corners], mine) for corners in map(list, split)]
    return Tiles(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _normals(pieces: Any, points: FloatArray, owners: IntArray) -> FloatArray:
    """Normals at points (n, 3) of the pieces with these numbers."""
    out = np.empty_like(points)
    for number in np.unique(owners):
        mine = owners == number
        out[mine] = normal(pieces[number], points[mine])
    return out
