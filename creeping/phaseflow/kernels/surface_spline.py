"""Compiled look-up of x(u, v) and its tangents on a chart, for bodies whose own map psi is expensive to evaluate.

x, x_u and x_v are sums over one stencil of a quintic spline: for each row i, S = sum_j wv_j c_ij and
S' = sum_j wv'_j c_ij; then x = sum_i wu_i S, x_u = sum_i wu'_i S, x_v = sum_i wu_i S'.

Sources: Derivations, B7.
"""

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from creeping.kernels.block import BLOCK, options

DEGREE = 5
LANES = 4
_double, _index = ir.DoubleType(), ir.IntType(64)
_vector = ir.VectorType(_double, LANES)


@intrinsic
def _contract(typing: Any, table: Any, offset: Any, stride: Any, weights: Any, place: Any, out: Any, at: Any) -> Any:
    """Write x, x_u, x_v (12 values) to out[at:]; weights (4, 6, BLOCK), flat: wu, wu', wv, wv'."""
    signature = types.void(table, offset, stride, weights, place, out, at)

    def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
        rows, weight, target = (context.make_array(sig.args[k])(context, builder, args[k]).data for k in (0, 3, 5))

        def spread(kind: int, j: int) -> Any:
            number = (kind * (DEGREE + 1) + j) * BLOCK
            value = builder.load(builder.gep(weight, [builder.add(args[4], ir.Constant(_index, number))]))
            empty = ir.Constant(_vector, ir.Undefined)
            single = builder.insert_element(empty, value, ir.Constant(ir.IntType(32), 0))
            return builder.shuffle_vector(single, empty, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))

        def multiply_add(total: Any, factor: Any, value: Any) -> Any:
            product = builder.fmul(factor, value, flags=("contract",))
            return product if total is None else builder.fadd(total, product, flags=("contract",))

        along, slope = [spread(2, j) for j in range(DEGREE + 1)], [spread(3, j) for j in range(DEGREE + 1)]
        sums: list[Any] = [None] * 3
        for i in range(DEGREE + 1):
            row = builder.add(args[1], builder.mul(args[2], ir.Constant(_index, i)))
            inner: list[Any] = [None] * 2
            for j in range(DEGREE + 1):
                pointer = builder.gep(rows, [builder.add(row, ir.Constant(_index, LANES * j))])
                value = builder.load(builder.bitcast(pointer, _vector.as_pointer()))
                value.align = 8
                inner = [multiply_add(inner[0], along[j], value), multiply_add(inner[1], slope[j], value)]
            sums[0] = multiply_add(sums[0], spread(0, i), inner[0])
            sums[1] = multiply_add(sums[1], spread(1, i), inner[0])
            sums[2] = multiply_add(sums[2], spread(0, i), inner[1])
        for k, total in enumerate(sums):
            address = builder.gep(target, [builder.add(args[6], ir.Constant(_index, LANES * k))])
            builder.store(total, builder.bitcast(address, _vector.as_pointer())).align = 8
        return context.get_dummy_value()

    return signature, codegen


@njit(**options)
def tangents(table, place, w, count, out):
    """x, x_u, x_v of a block's stencils into out (BLOCK, 12), flat; see `_contract` for w."""
    stride = LANES * table.shape[2]
    for i in range(count):
        _contract(table, LANES * place[i], stride, w, i, out, 12 * i)
