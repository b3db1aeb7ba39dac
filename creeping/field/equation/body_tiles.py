"""Tiles of a body of any kind: of its squares, of its facets, or of all its parts together."""

from dataclasses import replace

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.field.boundary import Boundary
from creeping.field.equation.facet_tiles import facet_tiles
from creeping.field.equation.tiles import POINTS, Tiles, tiles_of
from creeping.geometry.covering import patches_of
from creeping.geometry.creased import is_creased
from creeping.geometry.facet_patches import own_triangles
from creeping.geometry.kept import kept
from creeping.geometry.parts import inside, is_faceted, why_no_rays


def body_tiles(body: Any, wavenumber: float, boundary: Boundary, *, finest: bool = False) -> Tiles:
    """Tiles of a body for a wavenumber, 1/L, and a boundary; of facets the ``finest``, which go with other bodies'.

    Raises
    ------
    SurfaceError
        If neither squares nor triangles of its own are the body, or one of several bodies reaches into another.
    """
    if is_faceted(body):
        return facet_tiles(body, wavenumber, boundary, finest=finest)
    if why_no_rays(body):
        return _joined(body, [body_tiles(part, wavenumber, boundary, finest=True) for part in body.parts])
    facets = kept(body, "own triangles", lambda: own_triangles(body)) if is_creased(body) else None
    if facets is not None and facets.flat:
        return facet_tiles(facets, wavenumber, boundary, finest=finest)
    try:
        return tiles_of(patches_of(body), wavenumber, boundary)
    except SurfaceError:
        # of more pieces than squares cover
        if facets is None:
            raise
        return replace(facet_tiles(facets, wavenumber, boundary, finest=finest), alone=True)


def _joined(body: Any, made: list[Tiles]) -> Tiles:
    """Tiles of all parts of a body, turned and shifted; their edges keep apart."""
    shapes, edges, count = [], [], 0.0
    for tiles, turn, shift in zip(made, body.turns, body.shifts, strict=True):
        shapes.append(tiles.shapes @ turn.T + shift)
        known = (tiles.edges[:, :1] >= 0) & (np.arange(4) == 0)
        edges.append(np.where(known, tiles.edges + count, tiles.edges))
        count += tiles.edges[:, 0].max(initial=-1.0) + 1
    off, alone = max(tiles.off for tiles in made), any(tiles.alone for tiles in made)
    whole = replace(Tiles.of(np.concatenate(shapes), POINTS, np.concatenate(edges)), off=off, alone=alone)
    _checked_apart(body, whole.points, np.repeat(np.arange(len(made)), [len(tiles.points) for tiles in made]))
    return whole


def _checked_apart(body: Any, points: FloatArray, owner: IntArray) -> None:
    """Refuse bodies that reach into each other, by their nodes (n, 3)."""
    for number, part in enumerate(body.parts):
        x = points[owner != number]
        y = body.own(number, x)
        low, high = np.asarray(part.bounds, dtype=float)
        near = np.flatnonzero(np.all((y > low) & (y < high), axis=1))
        crossed = near[inside(part, y[near])] if len(near) else near
        if len(crossed):
            raise SurfaceError(
                f"bodies reach into each other: {len(crossed)} nodes of others are inside body {number + 1} (one near "
                f"{np.array2string(x[crossed[0]], precision=4)}); put them apart, or give their union as one mesh"
            )
