"""Compiled quintic tensor-product B-spline: 8 doubles along the contiguous z to a vector, 6 of them with a weight.

For each a: S_p = sum_b w^(p)_b C[a, b, :] for p = 0..order; then T_op = sum_a w^(o)_a S_p with o + p <= order; the
derivatives are T_op . w^(q), q = order - o - p at most. Weights are Horner sums of constant vectors (`POWERS`), so a
point costs 36 loads and, for order 2, 144 multiply-adds before the ten dot products. Importing this module imports
numba.

Also here: constants that the quintic spline and the radial map over it share.

Also here: the compiled normal equations of a least-squares fit; see `scatterers.fits.solver`.

Also here: compiled level of a body of pieces, each a quintic tensor-product B-spline; see `scatterers.fits.selection`.

Voxels have programs in postfix order: the number of a piece asks for its F, -1 takes the larger of the last two values,
-2 the smaller; -3 takes the last one where a.x > b, else the one before, a (3) and b standing behind it.

Parameters: origin of the voxels (3), 1/side, their numbers along the axes (3), where the table of voxels begins, where
that of the pieces does; the table gives for each voxel the place of its program, which stands behind its length; that
of the pieces gives the place of the parameters of each spline.

Sources: [B78]; Derivations, B7 and B6.
"""

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from scatterers.kernels.compiled import OPTIONS

LANES = 8
# w_j(t) = sum_m POWERS[m, j] t^m
POWERS = (
    np.array(
        [
            [1, 26, 66, 26, 1, 0],
            [-5, -50, 0, 50, 5, 0],
            [10, 20, -60, 20, 10, 0],
            [-10, 20, 0, -20, 10, 0],
            [5, -20, 30, -20, 5, 0],
            [-1, 5, -10, 10, -5, 1],
        ]
    )
    / 120
)
# degree of the spine's polynomials
DEGREE = 6
# how far the polynomials go, in halves of the range they are fitted to: slanted tips pass between the grid's edges
REACH = 1.5
# lanes that the kernels load beyond the last row
OVERREAD = 2


class Layout(NamedTuple):
    """Where values stand in the flat parameters: shape, origin and 1/spacing of the grid first, then those of a map.

    Of a radial map the centre, half axes, axis of the spine with the middle and 1/half of its range (0 for no spine),
    shifts along x, y and z, and the box of the sheared grid about the centre; at the end the coefficients begin.
    """

    centre: int = 9
    half_axes: int = 12
    axis: int = 15
    middle: int = 16
    per_half: int = 17
    shifts: int = 18
    box: int = 18 + 3 * (DEGREE + 1)
    end: int = 24 + 3 * (DEGREE + 1)


AT = Layout()


_double, _index, _lane = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_vector = ir.VectorType(_double, LANES)


def _shuffle(builder: ir.IRBuilder, a: Any, b: Any, lanes: list[int]) -> Any:
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_lane, len(lanes)), lanes))


def _spread(builder: ir.IRBuilder, value: Any) -> Any:
    nothing = ir.Constant(_vector, ir.Undefined)
    single = builder.insert_element(nothing, value, ir.Constant(_lane, 0))
    return _shuffle(builder, single, nothing, [0] * LANES)


def _multiply_add(builder: ir.IRBuilder, total: Any, weight: Any, value: Any) -> Any:
    product = builder.fmul(weight, value, flags=("contract",))
    return product if total is None else builder.fadd(total, product, flags=("contract",))


def _weights(builder: ir.IRBuilder, t: Any, order: int) -> list[Any]:
    """Vectors of the weights and their derivatives at fraction t, two lanes zero."""
    spread, powers, found = _spread(builder, t), POWERS, []
    for _ in range(order + 1):
        rows = [ir.Constant(_vector, [float(v) for v in row] + [0.0] * (LANES - 6)) for row in powers]
        total = rows[-1]
        for row in rows[-2::-1]:
            total = builder.fadd(builder.fmul(total, spread, flags=("contract",)), row, flags=("contract",))
        found.append(total)
        powers = powers[1:] * np.arange(1, len(powers))[:, None]
    return found


def _sums(builder: ir.IRBuilder, vectors: list[Any]) -> Any:
    """Vector of the sums over the lanes of each of up to 8 vectors, by a tree of shuffles."""
    while len(vectors) < LANES:
        vectors = [*vectors, vectors[0]]
    width = 1
    while len(vectors) > 1:
        # pairs of partial sums: the lanes whose bit `width` is 0 of both, plus those whose bit is 1
        low = [i for i in range(LANES) if not i & width]
        lanes = [
            i for k in range(0, LANES // 2, width) for i in low[k : k + width] + [LANES + v for v in low[k : k + width]]
        ]
        pairs = zip(vectors[::2], vectors[1::2], strict=True)
        vectors = [
            builder.fadd(_shuffle(builder, a, b, lanes), _shuffle(builder, a, b, [i + width for i in lanes]))
            for a, b in pairs
        ]
        width *= 2
    return vectors[0]


def _contraction(order: int) -> Any:
    """Make ``f(table, start, stride_x, stride_y, tx, ty, tz)`` -> derivatives up to the order, in cells."""
    # along x, y and z
    wanted = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    wanted += [(2, 0, 0), (0, 2, 0), (0, 0, 2), (0, 1, 1), (1, 0, 1), (1, 1, 0)] if order == 2 else []
    result = types.UniTuple(types.float64, len(wanted))

    @intrinsic  # type: ignore[untyped-decorator]
    def contract(typing: Any, table: Any, start: Any, sx: Any, sy: Any, tx: Any, ty: Any, tz: Any) -> Any:
        signature = result(table, start, sx, sy, tx, ty, tz)

        def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
            rows = context.make_array(sig.args[0])(context, builder, args[0]).data
            first, stride_x, stride_y = args[1:4]
            wx, wy, wz = (_weights(builder, t, order) for t in args[4:])

            def lane(vector: Any, index: int) -> Any:
                return _spread(builder, builder.extract_element(vector, ir.Constant(_lane, index)))

            along_y = [[lane(w, b) for b in range(6)] for w in wy]
            sums: dict[tuple[int, int], Any] = {}
            for a in range(6):
                plane = builder.add(first, builder.mul(stride_x, ir.Constant(_index, a)))
                inner: list[Any] = [None] * (order + 1)
                for b in range(6):
                    row = builder.add(plane, builder.mul(stride_y, ir.Constant(_index, b)))
                    value = builder.load(builder.bitcast(builder.gep(rows, [row]), _vector.as_pointer()))
                    value.align = 8
                    for p in range(order + 1):
                        inner[p] = _multiply_add(builder, inner[p], along_y[p][b], value)
                for o in range(order + 1):
                    weight = lane(wx[o], a)
                    for p in range(order + 1 - o):
                        sums[o, p] = _multiply_add(builder, sums.get((o, p)), weight, inner[p])
            products = [builder.fmul(sums[o, p], wz[q]) for o, p, q in wanted]
            found = []
            for begin in range(0, len(products), LANES):
                part = products[begin : begin + LANES]
                total = _sums(builder, part)
                found += [builder.extract_element(total, ir.Constant(_lane, i)) for i in range(len(part))]
            return context.make_tuple(builder, sig.return_type, found)

        return signature, codegen

    return contract


contract_first = _contraction(1)


_contract_second = _contraction(2)


@intrinsic  # type: ignore[untyped-decorator]
def scatter(typing: Any, table: Any, start: Any, sx: Any, sy: Any, tx: Any, ty: Any, tz: Any, r: Any) -> Any:
    """Adjoint of `contract_first`: add r[0] w_a w_b w_c + r[1] w_a' w_b w_c + ... to a stencil of the table, in cells.

    The two lanes beyond a row get a zero added.
    """
    signature = types.void(table, start, sx, sy, tx, ty, tz, r)

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
        rows = context.make_array(sig.args[0])(context, builder, args[0]).data
        first, stride_x, stride_y = args[1:4]
        (wx, dx), (wy, dy), (wz, dz) = (_weights(builder, t, 1) for t in args[4:7])
        value, slope_x, slope_y, slope_z = (_spread(builder, builder.extract_value(args[7], k)) for k in range(4))

        def lane(vector: Any, index: int) -> Any:
            return _spread(builder, builder.extract_element(vector, ir.Constant(_lane, index)))

        along = _multiply_add(builder, builder.fmul(value, wx), slope_x, dx)
        across_y, across_z = builder.fmul(slope_y, wx), builder.fmul(slope_z, wx)
        for a in range(6):
            plane = builder.add(first, builder.mul(stride_x, ir.Constant(_index, a)))
            p = _multiply_add(builder, builder.fmul(lane(along, a), wy), lane(across_y, a), dy)
            q = builder.fmul(lane(across_z, a), wy)
            for b in range(6):
                row = builder.add(plane, builder.mul(stride_y, ir.Constant(_index, b)))
                place = builder.bitcast(builder.gep(rows, [row]), _vector.as_pointer())
                total = builder.load(place)
                total.align = 8
                total = _multiply_add(builder, _multiply_add(builder, total, lane(p, b), wz), lane(q, b), dz)
                builder.store(total, place).align = 8
        return context.get_dummy_value()

    return signature, codegen


@njit(**OPTIONS)
def _cell(x, origin, per_length, cells):  # type: ignore[no-untyped-def]
    """Cell inside the grid, whatever x is, and the bounded fraction, which is NaN where x is."""
    g = (x - origin) * per_length
    # comparisons with NaN are false, so a NaN lands in cell 0 and no undefined cast is made
    inside = g if g > 0.0 else 0.0
    cell = int(inside if inside < cells - 1.0 else cells - 1.0)
    t = g - cell
    # the polynomial of the last cell is continued by one cell
    t = -1.0 if t < -1.0 else t
    return cell, 2.0 if t > 2.0 else t


@njit(**OPTIONS)
def _stencil(x, y, z, parameters):  # type: ignore[no-untyped-def]
    """Where the stencil of a point starts, its strides and the three fractions."""
    i, tx = _cell(x, parameters[3], parameters[6], parameters[0] - 5.0)
    j, ty = _cell(y, parameters[4], parameters[7], parameters[1] - 5.0)
    k, tz = _cell(z, parameters[5], parameters[8], parameters[2] - 5.0)
    stride_y = int(parameters[2])
    stride_x = int(parameters[1]) * stride_y
    return AT.end + i * stride_x + j * stride_y + k, stride_x, stride_y, tx, ty, tz


@njit(**OPTIONS)
def value_and_gradient(x, y, z, parameters):  # type: ignore[no-untyped-def]
    """F, F_x, F_y, F_z at a point."""
    start, stride_x, stride_y, tx, ty, tz = _stencil(x, y, z, parameters)
    f, fx, fy, fz = contract_first(parameters, start, stride_x, stride_y, tx, ty, tz)
    return f, fx * parameters[6], fy * parameters[7], fz * parameters[8]


@njit(**OPTIONS)
def second_derivatives(x, y, z, parameters):  # type: ignore[no-untyped-def]
    """F, F_x, F_y, F_z, F_xx, F_yy, F_zz, F_yz, F_xz, F_xy at a point."""
    px, py, pz = parameters[6], parameters[7], parameters[8]
    start, stride_x, stride_y, tx, ty, tz = _stencil(x, y, z, parameters)
    f, fx, fy, fz, xx, yy, zz, yz, xz, xy = _contract_second(parameters, start, stride_x, stride_y, tx, ty, tz)
    xx, yy, zz, yz, xz, xy = xx * px * px, yy * py * py, zz * pz * pz, yz * py * pz, xz * px * pz, xy * px * py
    return f, fx * px, fy * py, fz * pz, xx, yy, zz, yz, xz, xy


def evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block."""
    for i in range(points.shape[1]):
        found = second_derivatives(points[0, i], points[1, i], points[2, i], parameters)
        values[i] = found[0]
        for k in range(3):
            gradients[k, i] = found[1 + k]
        for k in range(6):
            hessians[k, i] = found[4 + k]


# 216 coefficients into ten sums, axis by axis: what the compiler makes of it takes as long as so many operations
evaluate.operations = 1250.0  # type: ignore[attr-defined]


@njit(cache=True, nogil=True, **OPTIONS)
def accumulate(places, values, slopes, weights, shape, c, out):  # type: ignore[no-untyped-def]
    """Add A^T W (b - A c) to out; returns (b - A c)^T W (b - A c).

    Rows of A are f and its three slopes at places (m, 3) in cells, where the six coefficients of an axis begin at
    floor(place); b are values (m,) and slopes (m, 3), W the weights of values and of slopes. Coefficients c and out
    are flat, C-ordered of the shape, with `OVERREAD` numbers behind.
    """
    stride_y = shape[2]
    stride_x = shape[1] * stride_y
    total = 0.0
    for i in range(places.shape[0]):
        i0, i1, i2 = int(places[i, 0]), int(places[i, 1]), int(places[i, 2])
        tx, ty, tz = places[i, 0] - i0, places[i, 1] - i1, places[i, 2] - i2
        start = i0 * stride_x + i1 * stride_y + i2
        f, fx, fy, fz = contract_first(c, start, stride_x, stride_y, tx, ty, tz)
        r, rx, ry, rz = values[i] - f, slopes[i, 0] - fx, slopes[i, 1] - fy, slopes[i, 2] - fz
        total += weights[0] * r * r + weights[1] * (rx * rx + ry * ry + rz * rz)
        residual = (weights[0] * r, weights[1] * rx, weights[1] * ry, weights[1] * rz)
        scatter(out, start, stride_x, stride_y, tx, ty, tz, residual)
    return total


@njit(cache=True, nogil=True, **OPTIONS)
def solve(factor, x):  # type: ignore[no-untyped-def]
    """Solve L L^T y = x along the first axis of x (n, m), in place; bands of L (3, n) by columns, diagonal first."""
    n, m = x.shape
    for i in range(n):
        near = factor[1, i - 1] if i > 0 else 0.0
        far = factor[2, i - 2] if i > 1 else 0.0
        scale, row, before, second = 1.0 / factor[0, i], x[i], x[max(i - 1, 0)], x[max(i - 2, 0)]
        for k in range(m):
            row[k] = (row[k] - near * before[k] - far * second[k]) * scale
    for i in range(n - 1, -1, -1):
        near = factor[1, i] if i < n - 1 else 0.0
        far = factor[2, i] if i < n - 2 else 0.0
        scale, row, before, second = 1.0 / factor[0, i], x[i], x[min(i + 1, n - 1)], x[min(i + 2, n - 1)]
        for k in range(m):
            row[k] = (row[k] - near * before[k] - far * second[k]) * scale


class Token(IntEnum):
    """What a program takes of the last two values."""

    LARGER = -1
    SMALLER = -2
    BESIDES = -3
    """The last one on one side of a plane."""


MOST_PIECES = 8
"""Values that a program holds at a time."""
TABLES = 9
"""Parameters before the tables."""


@njit(**OPTIONS)
def voxel_place(x, origin, per_side, count):  # type: ignore[no-untyped-def]
    """Voxel along one axis, the nearest for a point outside."""
    # comparisons with NaN are false, so a NaN lands in voxel 0 and no undefined cast is made
    g = (x - origin) * per_side
    g = g if g > 0.0 else 0.0
    return int(g if g < count - 1.0 else count - 1.0)


@njit(**OPTIONS)
def chosen(x, y, z, parameters):  # type: ignore[no-untyped-def]
    """Number of the piece whose F is that of the body at a point."""
    cell = voxel_place(x, parameters[0], parameters[3], parameters[4])
    cell = cell * int(parameters[5]) + voxel_place(y, parameters[1], parameters[3], parameters[5])
    cell = cell * int(parameters[6]) + voxel_place(z, parameters[2], parameters[3], parameters[6])
    entry = int(parameters[int(parameters[7]) + cell])
    length, number = int(parameters[entry]), int(parameters[entry + 1])
    if length == 1:
        return number
    pieces, height = int(parameters[8]), 0
    values, numbers = np.empty(MOST_PIECES), np.empty(MOST_PIECES, np.int64)
    k, end = entry + 1, entry + 1 + length
    while k < end:
        token = int(parameters[k])
        k += 1
        if token >= 0:
            own = parameters[int(parameters[pieces + token]) :]
            values[height], numbers[height] = value_and_gradient(x, y, z, own)[0], token
            height += 1
            continue
        height -= 1
        if token == Token.BESIDES:
            last = parameters[k] * x + parameters[k + 1] * y + parameters[k + 2] * z > parameters[k + 3]
            k += 4
        else:
            last = (values[height] > values[height - 1]) == (token == Token.LARGER)
        if last:
            values[height - 1], numbers[height - 1] = values[height], numbers[height]
    return numbers[0]


def evaluate_pieces(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block of points."""
    pieces = int(parameters[8])
    for i in range(points.shape[1]):
        x = points[0, i], points[1, i], points[2, i]
        number = chosen(*x, parameters)
        found = second_derivatives(*x, parameters[int(parameters[pieces + number]) :])
        values[i] = found[0]
        for k in range(3):
            gradients[k, i] = found[1 + k]
        for k in range(6):
            hessians[k, i] = found[4 + k]


evaluate_pieces.operations = 1400.0  # type: ignore[attr-defined]


@njit(cache=True)
def piece_numbers(points, found, parameters):  # type: ignore[no-untyped-def]
    """Fill the numbers of the pieces at points (n, 3)."""
    for i in range(len(points)):
        found[i] = chosen(points[i, 0], points[i, 1], points[i, 2], parameters)
