"""Sums over the stages of a Runge-Kutta method with constant weights, in explicit vector instructions.

    z = y + h sum_j w_j k_j,   sum_j w_j k_j at one vector

A row of the tableau has few nonzero weights; they and the places of the k_j are part of the code, and one pass over
memory that keeps the sum in registers is bounded by the loads of the k_j. A compiler does not find this from a loop
over stages: it stores and reloads z once a stage.

Sources: [HNW93].
"""

from collections.abc import Callable, Sequence

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from creeping._typing import Any
from creeping.kernels.vectors import LANES, POINTER, VECTOR

UNROLL = 4
"""Vectors summed at a time, to hide the latency of a multiply-add; arrays are multiples of LANES * UNROLL numbers."""

_INTEGER = ir.IntType(64)
_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)

Rows = Callable[[], Sequence[Sequence[float]]]
"""Gives weights by rows, when the code is generated: what is loaded from a cache does not need them."""


def stage_sums(rows: Rows) -> Any:
    """Make ``f(row, h, k, size, y, z)`` for kernels: z = y + h sum_j w[row][j] k[j].

    Arrays are given by their addresses: y, z (size,), k (stages, size). Nothing is done for a row without weights.
    """

    @intrinsic
    def combine(typing: Any, row: Any, h: Any, k: Any, size: Any, y: Any, z: Any) -> Any:
        def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
            number, step, stages, size, start, target = args
            step = _spread(builder, step)
            done = builder.append_basic_block("done")
            choice = builder.switch(number, done)
            for case, weights in enumerate(rows()):
                if not any(weights):
                    continue
                block = builder.append_basic_block(f"row{case}")
                choice.add_case(ir.Constant(_INTEGER, case), block)
                builder.position_at_end(block)
                with cgutils.for_range(builder, builder.udiv(size, ir.Constant(_INTEGER, UNROLL * LANES))) as loop:
                    first = builder.mul(loop.index, ir.Constant(_INTEGER, UNROLL * LANES))
                    places = [builder.add(first, ir.Constant(_INTEGER, LANES * u)) for u in range(UNROLL)]
                    sums = [_sum(builder, weights, stages, size, place) for place in places]
                    for place, total in zip(places, sums, strict=True):
                        product = builder.fmul(step, total, flags=("contract",))
                        value = builder.fadd(_load(builder, start, place), product, flags=("contract",))
                        builder.store(value, _at(builder, target, place)).align = 8
                builder.branch(done)
            builder.position_at_end(done)
            return context.get_dummy_value()

        return types.void(types.int64, types.float64, POINTER, types.int64, POINTER, POINTER), codegen

    return combine


def stage_sum(rows: Rows, number: int) -> Any:
    """Make ``f(k, size, place)`` for kernels: the vector of sum_j w[number][j] k[j] from a place on; k an address."""

    @intrinsic
    def combine(typing: Any, k: Any, size: Any, place: Any) -> Any:
        def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
            return _sum(builder, rows()[number], *args)

        return VECTOR(POINTER, types.int64, types.int64), codegen

    return combine


def _sum(builder: ir.IRBuilder, weights: Sequence[float], stages: Any, size: Any, place: Any) -> Any:
    """Vector of the weighted sum at a place of each stage."""
    total = None
    for j, weight in enumerate(weights):
        if weight == 0:
            continue
        value = _load(builder, stages, builder.add(builder.mul(size, ir.Constant(_INTEGER, j)), place))
        product = builder.fmul(ir.Constant(_DOUBLES, [float(weight)] * LANES), value, flags=("contract",))
        total = product if total is None else builder.fadd(total, product, flags=("contract",))
    return total


def _at(builder: ir.IRBuilder, pointer: Any, place: Any) -> Any:
    return builder.bitcast(builder.gep(pointer, [place]), _DOUBLES.as_pointer())


def _load(builder: ir.IRBuilder, pointer: Any, place: Any) -> Any:
    value = builder.load(_at(builder, pointer, place))
    value.align = 8
    return value


def _spread(builder: ir.IRBuilder, number: Any) -> Any:
    nothing = ir.Constant(_DOUBLES, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))
