"""Uniform B-splines in kernels: cells, weights and slopes for a block of rays, and sums over stencils.

The numpy home is `creeping.phaseflow.splines`. Weights of the B-splines of degree p at fraction t of a cell,
w_j = N_p(t + p - j), in closed form:

    p = 3   6 w = (1-t)^3, 4 - 6 t^2 + 3 t^3, mirror images
    p = 5   120 w = (1-t)^5, 26 - 50 t + 20 t^2 + 20 t^3 - 20 t^4 + 5 t^5, 66 - 60 t^2 + 30 t^4 - 10 t^5, mirror images

Loops run over a whole block on flat arrays, so that they vectorise. The sum over a stencil is explicit vector code:

    sum_ijk wu_i wv_j wa_k c[i, j, k, :]

with the angle and the components of a coefficient contiguous: rows along them are accumulated over (i, j) first and
weighted by wa last, which leaves one multiply-add per coefficient. A compiler does not find this from loops: 16 to 36
rows of run-time length cost it four times the arithmetic in bookkeeping. Tables may be float32: products over j are
then summed in float32, eight at a time, all other sums in float64, which keeps the error of a sum below that of the
stored coefficients.

Sources: [B78]; Derivations, B7.
"""

import math

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from creeping.kernels.block import BLOCK, options
from creeping.kernels.vectors import LANES, data_of, load_vector, multiply_add, spread_value, store_vector, whole


@njit(**options)
def cells_and_fractions(grid, last, cell):
    """Split grid coordinates (BLOCK,) into cells held in 0..last and, in place, fractions.

    A coordinate that is not a number gets cell 0: whatever the state, the stencil lies inside the table.
    """
    for i in range(BLOCK):
        t = grid[i]
        t = t if t > 0.0 else 0.0
        t = t if t < last else last
        c = math.floor(t)
        cell[i] = np.int64(c)
        grid[i] -= c


@njit(**options)
def weights(t, degree, w):
    """Fill w (degree + 1, BLOCK), flat, with the B-spline weights at fractions t (BLOCK,)."""
    if degree == 3:
        for i in range(BLOCK):
            a, b = t[i], 1.0 - t[i]
            w[i] = b * b * b * (1 / 6)
            w[BLOCK + i] = (4.0 - a * a * (6.0 - 3.0 * a)) * (1 / 6)
            w[2 * BLOCK + i] = (4.0 - b * b * (6.0 - 3.0 * b)) * (1 / 6)
            w[3 * BLOCK + i] = a * a * a * (1 / 6)
    else:
        for i in range(BLOCK):
            a, b = t[i], 1.0 - t[i]
            aa, bb = a * a, b * b
            w[i] = bb * bb * b * (1 / 120)
            w[BLOCK + i] = (26.0 + a * (-50.0 + a * (20.0 + a * (20.0 + a * (5.0 * a - 20.0))))) * (1 / 120)
            w[2 * BLOCK + i] = (66.0 + aa * (-60.0 + aa * (30.0 - 10.0 * a))) * (1 / 120)
            w[3 * BLOCK + i] = (66.0 + bb * (-60.0 + bb * (30.0 - 10.0 * b))) * (1 / 120)
            w[4 * BLOCK + i] = (26.0 + b * (-50.0 + b * (20.0 + b * (20.0 + b * (5.0 * b - 20.0))))) * (1 / 120)
            w[5 * BLOCK + i] = aa * aa * a * (1 / 120)


@njit(**options)
def slopes(t, w):
    """Derivatives of the quintic B-spline weights at fractions t (BLOCK,) into w (6, BLOCK), flat."""
    for i in range(BLOCK):
        a, b = t[i], 1.0 - t[i]
        aa, bb = a * a, b * b
        w[i] = -bb * bb * (1 / 24)
        w[BLOCK + i] = (-10.0 + a * (8.0 + a * (12.0 + a * (5.0 * a - 16.0)))) * (1 / 24)
        w[2 * BLOCK + i] = a * (-24.0 + aa * (24.0 - 10.0 * a)) * (1 / 24)
        w[3 * BLOCK + i] = -b * (-24.0 + bb * (24.0 - 10.0 * b)) * (1 / 24)
        w[4 * BLOCK + i] = -(-10.0 + b * (8.0 + b * (12.0 + b * (5.0 * b - 16.0)))) * (1 / 24)
        w[5 * BLOCK + i] = aa * aa * (1 / 24)


@intrinsic
def stencil_sum(typing, table, case, offset, su, sv, wu, wv, wa, place, out, out_place):
    """Write a stencil's sum to ``out`` from ``out_place`` on, 4 values, or 8 with 4 of ``case``.

    ``table`` is a C-contiguous float32 or float64 array seen as flat memory; the stencil's first coefficient starts at
    ``offset``, rows are ``sv`` and planes ``su`` values apart. Weight j lies at ``place + j BLOCK`` of its array. The
    degree is 3, or 5 with 2 of ``case``; with 1 of it the stencil is one plane: it has no axis u, and neither ``su``
    nor ``wu`` is read.
    """

    def codegen(context, builder, sig, args):
        done = builder.append_basic_block("done")
        choice = builder.switch(args[1], done)
        for number in range(8):
            block = builder.append_basic_block(f"case{number}")
            choice.add_case(whole(number), block)
            builder.position_at_end(block)
            _sum(context, builder, sig, args, 8 if number & 4 else 4, 5 if number & 2 else 3, number & 1)
            builder.branch(done)
        builder.position_at_end(done)
        return context.get_dummy_value()

    return types.void(table, types.int64, offset, su, sv, wu, wv, wa, place, out, out_place), codegen


def _sum(context, builder, sig, args, lanes, degree, flat):
    """Code of `stencil_sum` for one case."""
    rows, wu, wv, wa, out = (data_of(context, builder, sig.args[k], args[k]) for k in (0, 5, 6, 7, 9))
    single, vectors = sig.args[0].dtype == types.float32, (degree + 1) * lanes // LANES

    def weights(data):
        return [builder.load(builder.gep(data, [builder.add(args[8], whole(j * BLOCK))])) for j in range(degree + 1)]

    def mixed(one, other, places):
        return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places)))

    along_v = [builder.fptrunc(w, ir.FloatType()) if single else w for w in weights(wv)]
    sums = [None] * vectors
    for i, w_i in enumerate([None] if flat else weights(wu)):
        plane = builder.add(args[2], builder.mul(args[3], whole(i)))
        inner = [None] * vectors
        for j, w_j in enumerate(along_v):
            row = builder.add(plane, builder.mul(args[4], whole(j)))
            weight = spread_value(builder, w_j if single or flat else builder.fmul(w_i, w_j))
            into = inner if single else sums
            for k in range(vectors):
                value = load_vector(builder, rows, builder.add(row, whole(LANES * k)))
                into[k] = multiply_add(builder, into[k], weight, value)
        for k in range(vectors if single else 0):
            value = builder.fpext(inner[k], ir.VectorType(ir.DoubleType(), LANES))
            sums[k] = value if flat else multiply_add(builder, sums[k], spread_value(builder, w_i), value)
    total, along_a = None, weights(wa)
    for k in range(vectors):
        group = [spread_value(builder, w, lanes) for w in along_a[k * LANES // lanes : (k + 1) * LANES // lanes]]
        weight = group[0] if lanes == LANES else mixed(group[0], group[1], range(LANES))
        total = multiply_add(builder, total, weight, sums[k])
    if lanes < LANES:
        total = builder.fadd(mixed(total, total, range(lanes)), mixed(total, total, range(lanes, LANES)))
    store_vector(builder, total, out, args[10])
