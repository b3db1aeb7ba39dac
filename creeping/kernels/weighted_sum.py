"""Sums z = y + sum_r w_r k_r over the stages of a Runge-Kutta method, in explicit vector instructions.

A row of the tableau has few nonzero weights, and one pass over memory that keeps the sum in a register is bounded by
the loads of the k_r. A compiler does not find this from a loop over stages: it stores and reloads z once a stage.

Sources: [HNW93].
"""

from functools import cache

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from creeping._typing import Any

WIDTH = 8
"""Values of one vector."""
UNROLL = 4
"""Vectors summed at a time, to hide the latency of a multiply-add; blocks are multiples of WIDTH * UNROLL values."""


@cache
def combination(terms: int) -> Any:
    """Make ``f(weights, index, k, y, z)`` for kernels: z = y + sum over ``terms`` of weights[r] k[index[r]].

    ``k`` (stages, lanes, block) is C-contiguous, ``y`` and ``z`` (lanes, block) too, float64.
    """
    vector = ir.VectorType(ir.DoubleType(), WIDTH)

    @intrinsic
    def combine(typing: Any, weights: Any, index: Any, k: Any, y: Any, z: Any) -> Any:
        signature = types.void(weights, index, k, y, z)

        def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
            arrays = [
                context.make_array(kind)(context, builder, value) for kind, value in zip(sig.args, args, strict=True)
            ]
            size = arrays[3].nitems
            integer = ir.IntType(64)

            def loaded(pointer: Any, offset: Any) -> Any:
                return builder.load(builder.gep(pointer, [offset]))

            def spread(value: Any) -> Any:
                single = builder.insert_element(
                    ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
                )
                mask = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
                return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), mask)

            factors, rows = [], []
            for r in range(terms):
                place = ir.Constant(integer, r)
                factors.append(spread(loaded(arrays[0].data, place)))
                rows.append(builder.gep(arrays[2].data, [builder.mul(loaded(arrays[1].data, place), size)]))
            with cgutils.for_range(builder, builder.udiv(size, ir.Constant(integer, UNROLL * WIDTH))) as loop:
                first = builder.mul(loop.index, ir.Constant(integer, UNROLL * WIDTH))
                starts = [builder.add(first, ir.Constant(integer, WIDTH * u)) for u in range(UNROLL)]

                def at(pointer: Any, start: Any) -> Any:
                    return builder.bitcast(builder.gep(pointer, [start]), vector.as_pointer())

                def vector_at(pointer: Any, start: Any) -> Any:
                    value = builder.load(at(pointer, start))
                    value.align = 8
                    return value

                totals = [vector_at(arrays[3].data, start) for start in starts]
                for factor, row in zip(factors, rows, strict=True):
                    for u, start in enumerate(starts):
                        product = builder.fmul(factor, vector_at(row, start), flags=("contract",))
                        totals[u] = builder.fadd(totals[u], product, flags=("contract",))
                for total, start in zip(totals, starts, strict=True):
                    builder.store(total, at(arrays[4].data, start)).align = 8
            return context.get_dummy_value()

        return signature, codegen

    return combine
