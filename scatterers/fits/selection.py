"""Which piece bounds a body where: voxels that say how F of the body follows from those of the pieces near them.

Points of all pieces, closer to each other than a voxel, say which pieces bound the body in a voxel and the next ones.
What two of them make of each other there is read off F of the one at points of the other: F < 0, the body is what both
have inside, as at a convex edge and between the two sides of a thin part, and F of the body is the larger; F > 0, what
either has, and it is the smaller; F = 0, they are parts of one smooth surface. So are pieces with a joint or seam near
the voxel, and those with like normals that a chain of such joins, whatever F of the one is at the other: a fillet soon
leaves the plane that it meets. Parts of one surface are parted by the planes through their creases there, and where
they have none the nearer one stands for both. Of three and more the pairs make a tree: if pieces fall into groups that
are all joined by "the larger", that comes last, and so on within the groups. Voxels far off follow the next ones with
points.

Also here: which pieces make one smooth surface near a point, and the planes through their joints that part them.

Sources: Derivations, B13.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.body import Crease, normals_of
from scatterers.fits.tensor import TensorSpline, side_of_cells
from scatterers.kernels.compiled import Compiled, evaluated
from scatterers.kernels.tensor import AT, MOST_PIECES, TABLES, Token

MARGIN = 3
"""Voxels about the body."""


Program = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class PieceSpace:
    """F of a body of pieces.

    Attributes
    ----------
    splines : sequence of TensorSpline
        F of each piece.
    table : (k,)
        Header, table of voxels and programs, as `scatterers.kernels.tensor` takes them, without the splines; empty for
        one piece that is the whole body.
    """

    splines: Sequence[TensorSpline]
    table: FloatArray

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled level."""
        from scatterers.kernels.tensor import evaluate_pieces

        return Compiled(evaluate_pieces, "level", self.parameters) if len(self.table) else self.splines[0].compiled

    @cached_property
    def parameters(self) -> FloatArray:
        """Parameters of the compiled level."""
        flat = [spline.flat(np.zeros(AT.end - AT.centre)) for spline in self.splines]
        table = self.table.copy()
        table[8] = len(table)
        places = len(table) + len(flat) + np.cumsum([0, *(len(part) for part in flat[:-1])])
        return np.concatenate([table, places, *flat])

    def numbers(self, points: FloatArray) -> IntArray:
        """Pieces whose F is that of the body: (..., 3) -> (...)."""
        from scatterers.kernels.tensor import piece_numbers

        columns = np.ascontiguousarray(points, dtype=float).reshape(-1, 3)
        found = np.zeros(len(columns), np.int64)
        if len(self.table):
            piece_numbers(columns, found, self.parameters)
        return found.reshape(np.shape(points)[:-1])

    def check(self) -> None:
        """Refuse tables that would lead kernels beyond them.

        Raises
        ------
        ValueError
        """
        table, count = self.table, len(self.splines)
        shape = table[4:7]
        # written so that what is no number fails
        sound = len(table) > TABLES and bool(np.all(np.isfinite(table))) and table[3] > 0
        sound = sound and bool(np.all((shape >= 1) & (shape < 1e6))) and TABLES + np.prod(shape) < len(table)
        if sound:
            cells = int(np.prod(shape.astype(np.int64)))
            tail = TABLES + cells
            places = np.unique(table[TABLES:tail]).astype(np.int64)
            sound = bool(np.all((places >= tail) & (places < len(table)))) and table[7] == TABLES
            ends = places + 1 + table[places].clip(0, len(table)).astype(np.int64) if sound else places
            sound = sound and bool(np.all((table[places] >= 1) & (ends <= len(table))))
            sound = sound and all(_sound(table[a + 1 : b], count) for a, b in zip(places, ends, strict=True))
        if not sound:
            raise ValueError("the table of the pieces is damaged")


def _sound(program: FloatArray, count: int) -> bool:
    """Whether a program takes known pieces only and leaves one value."""
    height, k = 0, 0
    while k < len(program):
        token = program[k]
        if token != round(token) or not Token.BESIDES <= token < count:
            return False
        height += 1 if token >= 0 else -1
        k += 5 if token == Token.BESIDES else 1
        if not 1 <= height <= MOST_PIECES:
            return False
    return height == 1 and k == len(program)


def voxel_side(box: FloatArray) -> float:
    """Side of the voxels about a body in its box (2, 3), L."""
    return side_of_cells(box[1] - box[0], 2 * MARGIN, 500_000)


def piece_space(
    splines: Sequence[TensorSpline], points: FloatArray, owner: IntArray, creases: Sequence[Crease] = ()
) -> PieceSpace:
    """Choose among splines by points (n, 3), L, of the whole body and the numbers (n,) of the pieces they lie on.

    Points are to be less than a `voxel_side` apart. Of creases the smooth ones matter: joints and seams.
    """
    from scipy.spatial import cKDTree

    box = np.stack([points.min(axis=0), points.max(axis=0)])
    side = voxel_side(box)
    origin = box[0] - MARGIN * side
    shape = np.ceil((box[1] - box[0]) / side).astype(np.int64) + 2 * MARGIN
    voxel, piece, at = _near(points, owner, origin, side, shape)
    occupied, row = np.unique(voxel, return_inverse=True)
    middles = origin + side * (np.stack(np.unravel_index(occupied, shape), axis=1) + 0.5)
    nearest = owner[cKDTree(points).query(middles)[1]]
    pairs = _pairs(row.ravel(), piece, at)
    # |F| in voxels, in the mean, below which two are parts of one smooth surface
    signs = _signs(splines, points, pairs, 0.03 * side)
    programs: list[Program] = [(int(number),) for number in nearest]
    known: dict[tuple[Any, ...], Program] = {}
    planes = JointPlanes(splines, creases, points, owner)
    beside = planes.near(middles, signs, 3 * side)
    smooth = of_one_surface(splines, middles, signs, beside)
    for where, among in signs.items():
        together = tuple(sorted((among | smooth[where]).items()))
        key = int(nearest[where]), together, tuple(sorted(beside[where].items()))
        if key not in known:
            known[key] = _program(*key)
        programs[where] = known[key]
    # row of the nearest of the voxels with points, whose numbers rise, for every voxel
    from scipy.ndimage import distance_transform_edt

    row = np.full(shape, -1)
    row.ravel()[occupied] = np.arange(len(occupied))
    # a tree is slow in the middle of a ball or box, from where much is about as far
    near = distance_transform_edt(row < 0, return_distances=False, return_indices=True)
    return PieceSpace(splines, _table(origin, side, shape, programs, np.asarray(row[tuple(near)].ravel())))


def _near(
    points: FloatArray, owner: IntArray, origin: FloatArray, side: float, shape: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Voxel, piece and number of a point for each piece with a point in a voxel or next to it; a few points each."""
    place = np.clip(((points - origin) / side).astype(np.int64), 1, shape - 2)
    # points of one piece in one voxel are alike
    code = np.ravel_multi_index(tuple(place.T), tuple(shape)) * (int(owner.max()) + 1) + owner
    _, first = np.unique(code, return_index=True)
    shifts = np.stack(np.meshgrid(*3 * [[-1, 0, 1]], indexing="ij"), axis=-1).reshape(-1, 3)
    around = place[first][:, None] + shifts
    voxel = np.ravel_multi_index(tuple(np.moveaxis(around, -1, 0)), tuple(shape)).ravel()
    at = np.repeat(first, len(shifts))
    return voxel, owner[at], at


def _pairs(row: IntArray, piece: IntArray, at: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Rows of voxels, pieces i and j, and a point of j, for all ordered pairs of pieces in a voxel."""
    order = np.lexsort((piece, row))
    row, piece, at = row[order], piece[order], at[order]
    # the pieces of each voxel once, and all of its points
    new = np.concatenate([[True], (np.diff(row) != 0) | (np.diff(piece) != 0)])
    rows, pieces = row[new], piece[new]
    begin = np.searchsorted(rows, row, side="left")
    count = np.searchsorted(rows, row, side="right") - begin
    point = np.repeat(np.arange(len(row)), count)
    first = np.repeat(begin - np.concatenate([[0], np.cumsum(count)[:-1]]), count) + np.arange(len(point))
    differ = pieces[first] != piece[point]
    point, first = point[differ], first[differ]
    return row[point], pieces[first], piece[point], at[point]


def _signs(
    splines: Sequence[TensorSpline],
    points: FloatArray,
    pairs: tuple[IntArray, IntArray, IntArray, IntArray],
    close: float,
) -> dict[int, dict[tuple[int, int], int]]:
    """For voxels (row) and pairs of pieces i < j in them: 1 for the larger, -1 for the smaller, 0 for one surface."""
    row, one, other, at = pairs
    if not len(row):
        return {}
    value = np.empty(len(row))
    for number in np.unique(one):
        mine = one == number
        level, gradient, _ = evaluated(splines[number].compiled, points[at[mine]])
        value[mine] = level / np.linalg.norm(gradient, axis=1)
    low, high = np.minimum(one, other), np.maximum(one, other)
    found, inverse, count = np.unique(
        np.column_stack([row, low, high]), axis=0, return_inverse=True, return_counts=True
    )
    mean = np.bincount(inverse.ravel(), value) / count
    sign = np.where(np.abs(mean) < close, 0, -np.sign(mean)).astype(int)
    signs: dict[int, dict[tuple[int, int], int]] = {}
    for (where, i, j), s in zip(found.tolist(), sign.tolist(), strict=True):
        signs.setdefault(where, {})[i, j] = s
    return signs


def _program(
    nearest: int,
    among: tuple[tuple[tuple[int, int], int], ...],
    beside: tuple[tuple[tuple[int, int], tuple[float, ...]], ...],
) -> Program:
    """F of the body from those of pieces in postfix order: numbers of pieces, and tokens."""
    signs, planes = dict(among), dict(beside)
    pieces = sorted({number for pair in signs for number in pair}, key=lambda number: (number != nearest, number))
    # of one smooth surface the first stands for all, but beyond the planes that part them
    kept: list[int] = []
    leaves: dict[int, Program] = {}
    chained: set[int] = set()
    for number in pieces:
        if number in chained:
            continue
        same = [k for k in pieces if k != number and not signs[min(number, k), max(number, k)]]
        if any(k in kept for k in same):
            continue
        if len(kept) >= MOST_PIECES // 2:
            break
        kept.append(number)
        leaves[number] = _chain(number, [k for k in pieces if k not in kept and k not in chained], planes, chained)

    def joined(members: list[int]) -> Program:
        if len(members) == 1:
            return leaves[members[0]]
        for sign, last in ((-1, Token.LARGER), (1, Token.SMALLER)):
            # groups that hang together by the other sign come first
            groups: list[set[int]] = []
            for number in members:
                near = [g for g in groups if any(signs[min(number, k), max(number, k)] == sign for k in g)]
                groups = [g for g in groups if g not in near] + [{number}.union(*near)]
            if len(groups) > 1:
                parts = [joined([k for k in members if k in g]) for g in groups]
                program = parts[0]
                for part in parts[1:]:
                    program = (*program, *part, last)
                return program
        # no tree: the pairs with the nearest one decide
        program = leaves[members[0]]
        for number in members[1:]:
            sign = signs[min(members[0], number), max(members[0], number)]
            program = (*program, *leaves[number], Token.LARGER if sign > 0 else Token.SMALLER)
        return program

    return joined(kept)


def _chain(
    number: int, others: list[int], planes: Mapping[tuple[int, int], tuple[float, ...]], chained: set[int]
) -> Program:
    """A piece and its smooth neighbours, each beyond the plane through its joint with the one before; they are noted.

    Where four meet in a point, the last is beyond one plane of its neighbour, within what is beyond another: chains are
    nested, the longest outermost. Six neighbours are told apart at most.
    """
    before: dict[int, list[int]] = {number: []}
    ends = [number]
    while ends:
        k = ends.pop(0)
        for other in others:
            if (min(k, other), max(k, other)) in planes and other not in before and len(chained) < 6:
                before[k].append(other)
                before[other] = []
                chained.add(other)
                ends.append(other)

    def nested(k: int) -> Program:
        program: Program = (k,)
        parts = sorted(((nested(other), other) for other in before[k]), key=lambda part: len(part[0]))
        for part, other in parts:
            turn = 1.0 if k < other else -1.0
            plane = planes[min(k, other), max(k, other)]
            program = (*program, *part, Token.BESIDES, *(turn * value for value in plane))
        return program

    return nested(number)


def _table(origin: FloatArray, side: float, shape: IntArray, programs: list[Program], nearest: IntArray) -> FloatArray:
    """Header, table of voxels and their programs, each behind its length; alike ones are kept once."""
    cells = int(np.prod(shape))
    known: dict[Program, int] = {}
    tail: list[float] = []
    places = np.empty(len(programs))
    for k, program in enumerate(programs):
        if program not in known:
            known[program] = TABLES + cells + len(tail)
            tail += [len(program), *program]
        places[k] = known[program]
    header = [*origin, 1 / side, *shape, TABLES, 0.0]
    return np.concatenate([np.array(header, dtype=float), places[nearest], np.array(tail, dtype=float)])


def of_one_surface(
    splines: Sequence[TensorSpline],
    points: FloatArray,
    signs: Mapping[int, Mapping[tuple[int, int], int]],
    joined: Mapping[int, Collection[tuple[int, int]]],
) -> dict[int, dict[tuple[int, int], int]]:
    """0 for pairs of pieces that joints near a point join, and for alike ones that a chain of joints does.

    Points (n, 3), L; pairs of pieces by the numbers of the points that they are near to, and those that are joined.
    """
    found = {where: dict.fromkeys(pairs, 0) for where, pairs in joined.items()}
    chained = []
    for where, pairs in joined.items():
        if len(pairs) < 2:
            continue
        groups: list[set[int]] = []
        for pair in pairs:
            near = [group for group in groups if not group.isdisjoint(pair)]
            groups = [group for group in groups if group not in near] + [set(pair).union(*near)]
        for i, j in signs[where]:
            if (i, j) not in found[where] and any(i in group and j in group for group in groups):
                chained.append((where, i, j))
    if not chained:
        return found
    at, first, second = np.array(chained).T
    # across a sharp nose they oppose each other
    alike = np.sum(normals_of(splines, points[at], first) * normals_of(splines, points[at], second), axis=1) > 0.5
    for where, i, j in np.array(chained)[alike].tolist():
        found[where][i, j] = 0
    return found


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _osculating(curve: Crease, across: FloatArray) -> FloatArray:
    """Normals (k, 3) of planes through the segments of a joint and its bend there, which it leaves last.

    Where it is straight, has a kink, or its plane nearly touches the body, it is the plane ``across``.
    """
    along = np.diff(curve.points, axis=0)
    if len(along) < 3:
        return across
    if curve.closed:
        before, after = np.roll(along, 1, axis=0), np.roll(along, -1, axis=0)
    else:
        inner = np.clip(np.arange(len(along)), 1, len(along) - 2)
        before, after = along[inner - 1], along[inner + 1]
    bend = _unit(after) - _unit(before)
    normal = np.cross(_unit(along), bend)
    turn = np.linalg.norm(normal, axis=1)
    normal = _unit(normal) * np.copysign(1.0, np.sum(normal * across, axis=1))[:, None]
    # not straight, radians over three segments, no kink, and by its cosine not nearly touching the body
    sound = (turn > 1e-3) & (turn < 0.8) & (np.sum(normal * across, axis=1) > 0.5)
    return np.where(sound[:, None], normal, across)


class JointPlanes:
    """Planes through joints and seams, by which the two pieces of one smooth surface are told apart.

    Of a seam the plane is at right angles to the body, of a joint that in which it bends.
    a.x > b is the side of the piece with the larger number: which way a crease runs says nothing of that, points of
    both pieces next to it do.
    """

    def __init__(
        self, splines: Sequence[TensorSpline], creases: Sequence[Crease], points: FloatArray, owner: IntArray
    ) -> None:
        from scipy.spatial import cKDTree

        trees: dict[int, Any] = {}
        self._of: dict[tuple[int, int], tuple[Any, FloatArray, FloatArray]] = {}
        for pair in {crease.pieces for crease in creases if crease.kind in ("joint", "seam")}:
            curves = [c for c in creases if c.pieces == pair and c.kind in ("joint", "seam")]
            for number in pair:
                if number not in trees and np.any(owner == number):
                    trees[number] = cKDTree(points[owner == number])
            if not all(number in trees for number in pair):
                continue
            first, second = sorted(pair)
            places, planes = [], []
            for curve in curves:
                x, along = 0.5 * (curve.points[1:] + curve.points[:-1]), np.diff(curve.points, axis=0)
                n = sum(_unit(splines[number].gradient(x)) for number in pair)
                across = _unit(np.cross(n, along))
                if curve.kind == "joint":
                    across = _osculating(curve, across)
                ways = [trees[number].data[trees[number].query(x)[1]] for number in (first, second)]
                places.append(x)
                planes.append(np.copysign(1.0, np.sum(across * (ways[1] - ways[0]))) * across)
            x = np.concatenate(places)
            self._of[first, second] = cKDTree(x), x, np.concatenate(planes)

    def near(
        self, points: FloatArray, pairs: Mapping[int, Collection[tuple[int, int]]], reach: float
    ) -> dict[int, dict[tuple[int, int], tuple[float, ...]]]:
        """a (3) and b of the plane a.x = b nearest to points (n, 3), for each pair near a point that has one.

        Pairs by the numbers of the points that they are near to, and so the planes.
        """
        found: dict[int, dict[tuple[int, int], tuple[float, ...]]] = {where: {} for where in pairs}
        rows: dict[tuple[int, int], list[int]] = {}
        for where, some in pairs.items():
            for pair in some:
                if pair in self._of:
                    rows.setdefault(pair, []).append(where)
        for pair, at in rows.items():
            tree, x, across = self._of[pair]
            distance, nearest = tree.query(points[at])
            planes = np.column_stack([across, np.sum(across * x, axis=1)])[nearest]
            for where, plane, off in zip(at, planes.tolist(), distance.tolist(), strict=True):
                if off < reach:
                    found[where][pair] = tuple(plane)
        return found
