"""Tiles of a body on its facets, which are flat: small triangles as they are, or squares of large ones.

A small triangle with corners c, a, b is the square x = c + u [(1 - v)(a - c) + v (b - c)], whose side u = 0 is the
corner c, with one or two nodes a side by the conical rule. Sides longer than SIDES[p] wavelengths are halved, each for
both triangles that it has. Where the normal turns by more than SHARP across a side, that is u = 1 of a tile on both
faces: triangles with several edges are parted about their middle. Large triangles are covered by squares
(`creeping.geometry.facet_patches`), cut into tiles as those of any body. What takes the fewest nodes serves.

Sources: [DR84]; Derivations, F36.
"""

from typing import Protocol

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.equation.tiles import POINTS, SIDE, VARYING, Tiles, tiles_of
from creeping.geometry.facet_patches import SHARP, facet_patches, halved, sides_of, turns_of
from creeping.geometry.patches import Patches

SIDES = {1: 0.15, 2: 0.38}
"""Longest sides of triangles, in wavelengths, by p: 10 and 8 nodes a wavelength."""
LACKS = {1: (0.06, 0.015), 2: (0.01, 0.0022)}
"""What they lack at edges (`Tiles.lacks`), by p: of cubes of 12 to 3072 irregular triangles, k = 5 and 9, against
`studies.reference.mirrored_box`, each within a factor of 1.5."""
POORER = 3.0
"""How many times as many nodes a body with edges may have in squares, whose strips along edges err a tenth as much."""
CHEAP = 4000
"""Nodes up to which squares serve in any case: of a body that is small against the wavelength it is its own shape that
currents follow."""
MOST_SQUARES = 20_000
"""Squares of a body at most: more are small triangles."""


class Faceted(Protocol):
    """A body on its facets."""

    vertices: FloatArray
    triangles: IntArray


def facet_tiles(body: Faceted, wavenumber: float, boundary: Boundary, p: int | None = None) -> Tiles:
    """Tiles of a body on its facets for a wavenumber, 1/L, and a boundary; with p = POINTS those of squares."""
    wavelength = (VARYING if boundary.varies else 1.0) * 2 * np.pi / wavenumber
    _, number = sides_of(body.triangles)
    edged = bool(np.any(turns_of(body.vertices, body.triangles, number)[0] > SHARP))
    if p is None:
        corners = body.vertices[body.triangles]
        nodes = {q: q**2 * _halves(corners, SIDES[q] * wavelength) * (POORER if edged else 1.0) for q in SIDES}
        p = min(nodes, key=lambda q: nodes[q])
        if len(corners) < MOST_SQUARES:
            squares = POINTS**2 * _parts_of(facet_patches(body), SIDE * wavelength)
            p = POINTS if squares < max(nodes[p], CHEAP) else p
    if p == POINTS:
        return tiles_of(facet_patches(body), wavenumber, boundary)
    shapes, edges = _triangles(*halved(body.vertices, body.triangles, SIDES[p] * wavelength))
    return Tiles.of(shapes, p, edges, conical=True, lacks=LACKS[p])


def _halves(corners: FloatArray, longest: float) -> float:
    """About how many triangles there are once their sides are short enough."""
    sides = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)
    # sides are halved, and a triangle is parted along the two longer ones
    halvings = np.ceil(np.log2(np.maximum(1.0, sides[:, 1:] / longest)))
    return float(np.sum(2.0 ** halvings.sum(axis=1)))


def _parts_of(patches: Patches, longest: float) -> float:
    """About how many tiles squares are cut into, strips along edges included."""
    x = patches.places
    along, across = (np.linalg.norm(x[:, a, b] - x[:, 0, 0], axis=1) for a, b in ((-1, 0), (0, -1)))
    u, v = (np.ceil(np.maximum(1.0, side / longest)) for side in (along, across))
    return float(np.sum(u * v + v * patches.edges[:, :2].sum(axis=1) + u * patches.edges[:, 2:].sum(axis=1)))


def _triangles(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray]:
    """Shapes (m, 2, 2, 3) of triangles (t, 3) and of parts of those with several edges, and `Tiles.edges`."""
    _, number = sides_of(triangles)
    sharp = (turns_of(vertices, triangles, number)[0] > SHARP)[number]
    count = sharp.sum(axis=1)
    # one edge: it is opposite to the tip
    around = (np.argmax(sharp, axis=1)[:, None] + np.arange(3)) % 3
    one = count <= 1
    whole = np.take_along_axis(triangles, around, axis=1)[one]
    tips, bases, edges = [vertices[whole[:, 0]]], [whole[:, 1:]], [_or_none(number, sharp, around[:, 0])[one]]
    several = triangles[~one]
    for side in range(3):
        tips.append(vertices[several].mean(axis=1))
        bases.append(several[:, [(side + 1) % 3, (side + 2) % 3]])
        edges.append(_or_none(number, sharp, np.full(len(triangles), side))[~one])
    tip, base, edge = (np.concatenate(lane) for lane in (tips, bases, edges))
    c, a, b = tip[:, None, None], *(vertices[base[:, k]][:, None, None] for k in (0, 1))
    u, v = np.array([0.0, 1.0])[:, None, None], np.array([0.0, 1.0])[None, :, None]
    shapes = c + u * ((1 - v) * (a - c) + v * (b - c))
    span = np.where((base[:, 0] > base[:, 1])[:, None], [1.0, 0.0], [0.0, 1.0])
    known = np.column_stack([edge, np.ones(len(edge)), span])
    return shapes, np.where(edge[:, None] >= 0, known, -1.0)


def _or_none(number: IntArray, sharp: BoolArray, side: IntArray) -> IntArray:
    """Numbers of one side of each triangle (t,) if it is an edge, else -1."""
    rows = np.arange(len(number))
    return np.where(sharp[rows, side], number[rows, side], -1)
