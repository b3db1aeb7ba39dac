"""Tiles of a body of any kind: of its squares, of its facets, or of all its parts together.

Also here: tiles of a body on its facets, which are flat: squares of large ones, or small triangles as they are.

Large triangles are covered by squares (`creeping.geometry.patches`), cut into tiles as those of any body. A small
triangle with corners c, a, b is the square x = c + u [(1 - v)(a - c) + v (b - c)], whose side u = 0 is the corner c,
with one or two nodes a side by the conical rule. Sides that are too long are halved, each for both triangles that it
has. Where the normal turns by more than SHARP across a side, that is u = 1 of a tile on both faces: triangles with
several edges are parted about their middle.

Sources: [DR84]; Derivations, F36.
"""

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.field.boundary import Boundary
from creeping.field.equation.parting import CUT, SIDE, VARYING, WIDE, WIDE_CUT, tiles_for, tiles_of
from creeping.field.equation.tiles import POINTS, Tiles
from creeping.geometry.covering import patches_of
from creeping.geometry.patches import SHARP, Patches, chordal, facet_patches, halved, own_triangles, sides_of, turns_of
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.plane_faces import with_whole_faces
from creeping.geometry.surface import inside, is_faceted, memo, why_no_rays

CHEAP = 4000
"""Nodes up to which those of five a side serve: of a body that is small against the wavelength it is its own shape that
currents follow."""
FEW = 2
"""Nodes a side of the squares that stated 83 of 100 errors of a plate with two holes, k = 5: the others stand 95."""
MOST_SQUARES = 20_000
"""Triangles up to which squares are thought of: more are small."""


def body_tiles(
    body: Any, wavenumber: float, boundary: Boundary, *, finest: bool = False, coarse: bool = False
) -> Tiles:
    """Tiles of a body for a wavenumber, 1/L, and a boundary; of facets the ``finest``, which go with other bodies'.

    ``coarse`` ones have half the nodes or fewer, for fields within a per cent or so of the largest amplitude.

    Raises
    ------
    SurfaceError
        If neither squares nor triangles of its own are the body, or one of several bodies reaches into another.
    """
    if is_faceted(body):
        return facet_tiles(body, wavenumber, boundary, finest=finest, coarse=coarse)
    if why_no_rays(body):
        made = [body_tiles(part, wavenumber, boundary, finest=True, coarse=coarse) for part in body.parts]
        return _joined(body, made)
    facets = memo(body, "own triangles", lambda: own_triangles(body)) if is_piecewise(body) else None
    if facets is not None and facets.flat:
        return facet_tiles(facets, wavenumber, boundary, finest=finest, coarse=coarse)
    try:
        return tiles_of(patches_of(body), wavenumber, boundary, coarse=coarse)
    except SurfaceError:
        # of more pieces than squares cover
        if facets is None:
            raise
        return replace(facet_tiles(facets, wavenumber, boundary, finest=finest, coarse=coarse), alone=True)


def _joined(body: Any, made: list[Tiles]) -> Tiles:
    """Tiles of all parts of a body, turned and shifted; their edges keep apart."""
    shapes, edges, count = [], [], 0.0
    for tiles, turn, shift in zip(made, body.turns, body.shifts, strict=True):
        shapes.append(tiles.shapes @ turn.T + shift)
        known = (tiles.edges[:, :1] >= 0) & (np.arange(4) == 0)
        edges.append(np.where(known, tiles.edges + count, tiles.edges))
        count += tiles.edges[:, 0].max(initial=-1.0) + 1
    off, alone = max(tiles.off for tiles in made), any(tiles.alone for tiles in made)
    whole = replace(Tiles.of(np.concatenate(shapes), made[0].p, np.concatenate(edges)), off=off, alone=alone)
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


class Rule(NamedTuple):
    """How a body is cut into tiles.

    Attributes
    ----------
    squares : bool
        Whether into squares, else into triangles.
    p : int
        Nodes along a side.
    side : float
        Longest sides, in wavelengths.
    lacks : (float, float)
        What tiles lack at edges, as `Tiles.lacks`: of cubes of 12 to 3072 irregular triangles, k = 5 and 9, against
        `tests.reference.mirrored_box`, each within a factor of 1.5; of five nodes it is read off.
    poorer : float
        What a node of it is worth on a body with edges: fields there err by 0.8 and 0.3 % of the largest with
        triangles of one and two nodes, by 0.25, 0.06 and 0.01 % with squares.
    cut : float
        Width of the tile next to an edge, over that of the one it is cut from.
    """

    squares: bool
    p: int
    side: float
    lacks: tuple[float, float]
    poorer: float
    cut: float = CUT


FINEST = Rule(True, POINTS, SIDE, (0.0, 0.0), 1.0)
"""Of bodies for which nodes cost nothing, and beside bodies of other kinds."""


WIDER = 1.5
"""Sides of coarse tiles over those of others."""
RULES = (
    Rule(False, 1, 0.15, (0.06, 0.015), 3.0),
    Rule(False, 2, 0.38, (0.01, 0.0022), 2.0),
    Rule(True, 2, 0.38, (0.085, 0.032), 1.5),
    Rule(True, 3, 0.55, (0.01, 0.004), 1.0),
    FINEST,
)
COARSE = Rule(True, POINTS - 1, WIDE, (0.0, 0.0), 1.0, WIDE_CUT)
COARSE_RULES = (*(rule._replace(side=WIDER * rule.side) for rule in RULES[:-1]), COARSE)


class Faceted(Protocol):
    """A body on its facets."""

    @property
    def vertices(self) -> FloatArray:
        """Corners (n, 3), L."""
        ...

    @property
    def triangles(self) -> IntArray:
        """Numbers of their corners (t, 3), counter-clockwise seen from outside."""
        ...

    @property
    def tessellated(self) -> bool:
        """Whether they stand for curved faces."""
        ...


def facet_tiles(
    body: Faceted, wavenumber: float, boundary: Boundary, *, finest: bool = False, coarse: bool = False
) -> Tiles:
    """Tiles of a body on its facets for a wavenumber, 1/L, and a boundary: of the rule with the fewest nodes.

    Of the triangles as they are, or of others for the same flat faces.
    """
    wavelength = (VARYING if boundary.varies else 1.0) * 2 * np.pi / wavenumber
    rules = COARSE_RULES if coarse else RULES
    rules = rules[-1:] if finest else rules
    whole = memo(body, "whole faces", lambda: with_whole_faces(body))
    cost, rule = _chosen(body, wavelength, rules)
    # large faces by squares of more than two nodes: what those lack at holes is more than at edges of cubes
    squares = tuple(rule for rule in rules if rule.squares and rule.p > FEW)
    if whole is not None:
        other, fewest = _chosen(whole, wavelength, squares)
        if other <= cost:
            body, rule = whole, fewest
    if rule.squares:
        k = 2 * np.pi / wavelength
        made = tiles_for(_patches(body), k, side=rule.side, p=rule.p, cut=rule.cut, lacks=rule.lacks)
    else:
        mesh = halved(body.vertices, body.triangles, rule.side * wavelength)
        shapes, edges = _triangles(mesh.vertices, mesh.triangles)
        made = Tiles.of(shapes, rule.p, edges, conical=True, lacks=rule.lacks)
    return replace(made, off=chordal(body.vertices, body.triangles)) if body.tessellated else made


def _patches(body: Faceted) -> Patches:
    """Squares of a body, cached."""
    return memo(body, "facet patches", lambda: facet_patches(body))


def _chosen(body: Faceted, wavelength: float, rules: tuple[Rule, ...]) -> tuple[float, Rule]:
    """The rule of some that takes the fewest nodes, each as much as it is worth, and their number, so weighted."""
    corners = body.vertices[body.triangles]
    _, number = sides_of(body.triangles)
    edged = bool(np.any(turns_of(body.vertices, body.triangles, number)[0] > SHARP))
    patches = _patches(body) if len(corners) < MOST_SQUARES else None
    nodes: dict[Rule, float] = {}
    for rule in rules:
        if not rule.squares:
            nodes[rule] = rule.p**2 * _halves(corners, rule.side * wavelength)
        elif patches is not None:
            nodes[rule] = rule.p**2 * _parts_of(patches, rule.side * wavelength)
    if not nodes:
        return np.inf, rules[-1]
    if nodes.get(rules[-1], np.inf) < CHEAP:
        return nodes[rules[-1]], rules[-1]
    return min(
        ((count * (rule.poorer if edged else 1.0), rule) for rule, count in nodes.items()), key=lambda one: one[0]
    )


def _halves(corners: FloatArray, longest: float) -> float:
    """About how many triangles there are once their sides are short enough."""
    sides = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)
    # sides are halved: along the longest, across it by the shortest, and a thin one into two rows
    least, _, most = np.ceil(np.log2(np.maximum(1.0, sides / longest))).T
    return float(np.sum(2.0 ** (most + least + (least < most))))


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
