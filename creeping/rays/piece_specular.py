"""Specular points of a body with creases: those of each smooth piece that lie on it, and which of them stand clear.

A reflected ray forms over the Fresnel zone of its specular point, √(π/(k|κ| cos θᵢ)) along a principal direction of
curvature κ. Nearer than that to an edge or tip, and half as near to a joint, the point alone does not tell what the
ground gives; nor does it on a facet or a cylinder, where the zone is without end.

Sources: Derivations, F13.
"""

from dataclasses import fields

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.creased import SMOOTH, nearest_crease, pieces_of, tiles_of
from creeping.geometry.surface import size
from creeping.geometry.triangulation import Triangulation
from creeping.rays.specular import SpecularPoints, specular_points
from creeping.shadow.occlusion import occluded

SHARE = 0.05
"""Longest sides of the triangles that seed the search, in body sizes."""
INWARD = 1e-6
"""Share by which their corners are drawn to their middles: at a tip there is no normal."""
OUTWARD = 1e-7
"""Distance from the body, in its sizes, at which it is asked whether anything is in the way."""
FLAT = 1e-4
"""Curvature, in inverse body sizes, below which a piece is a facet without specular points."""


def smooth_parts(body: Any) -> tuple[tuple[int, ...], ...]:
    """Numbers of the pieces that hang together by joints and seams, part by part."""
    part = list(range(len(body.pieces)))
    for crease in body.creases:
        if crease.kind in SMOOTH:
            one, other = (part[k] for k in crease.pieces)
            part = [one if number == other else number for number in part]
    return tuple(tuple(k for k, number in enumerate(part) if number == one) for one in sorted(set(part)))


def specular_on_pieces(
    body: Any, numbers: tuple[int, ...], direction: FloatArray, observers: FloatArray
) -> list[SpecularPoints]:
    """Lit specular points on each of some pieces, of a unit direction and unit observers (m, 3)."""
    pieces, tiles, found = pieces_of(body), tiles_of(body, SHARE), []
    for number in numbers:
        corners = tiles.corners[tiles.pieces == number]
        if not len(corners) or _is_flat(pieces[number], corners.mean(axis=1), size(body)):
            continue
        corners = corners + INWARD * (corners.mean(axis=1, keepdims=True) - corners)
        vertices = corners.reshape(-1, 3)
        mesh = Triangulation(vertices, np.arange(len(vertices)).reshape(-1, 3))
        points = specular_points(pieces[number], direction, observers, mesh)
        x = points.points + OUTWARD * size(body) * points.normals
        there = np.zeros(len(x), dtype=bool)
        if len(x):
            r = observers[points.observer]
            there = (np.asarray(body.piece(points.points)) == number) & ~occluded(body, x, direction)
            there &= ~occluded(body, x, -r) & (points.normals @ direction < 0)
        found.append(some(points, there))
    return found


def stand_clear(body: Any, points: SpecularPoints, wavenumber: float) -> BoolArray:
    """Whether specular points are farther from all creases than their Fresnel zones reach (n,)."""
    if not len(points.points):
        return np.zeros(0, dtype=bool)
    bent = np.abs(points.principal).min(axis=1) * np.maximum(points.cosine, 1e-6)
    zone = np.sqrt(np.pi / (wavenumber * bent))
    sharp = nearest_crease(body, points.points, kinds=("edge", "tip"))[1]
    return np.asarray((sharp > zone) & (nearest_crease(body, points.points, kinds=("joint",))[1] > 0.5 * zone))


def _is_flat(piece: Any, x: FloatArray, scale: float) -> bool:
    hessian = np.linalg.norm(piece.hessian(x), axis=(1, 2)) / np.linalg.norm(piece.gradient(x), axis=1)
    return bool(np.max(hessian) * scale < FLAT)


def some(points: SpecularPoints, rows: BoolArray | IntArray) -> SpecularPoints:
    """Part of specular points."""
    return SpecularPoints(*(getattr(points, one.name)[rows] for one in fields(points)))


def joined(parts: list[SpecularPoints]) -> SpecularPoints:
    """All of several."""
    return SpecularPoints(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(parts[0])))
