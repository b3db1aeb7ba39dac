"""Vectors of LANES numbers as values in kernels: loaded, stored, added and multiplied lane by lane.

A compiler that vectorises loops has to prove first that their arrays do not overlap; in recurrences over many arrays it
does not succeed. Here the vector is explicit, and a recurrence keeps its state in registers. On machines with shorter
registers the compiler splits a vector into several.

Also here: sums over the stages of a Runge-Kutta method with constant weights, in explicit vector instructions.

    z = y + h sum_j w_j k_j,   sum_j w_j k_j at one vector

A row of the tableau has few nonzero weights; they and the places of the k_j are part of the code, and one pass over
memory that keeps the sum in registers is bounded by the loads of the k_j. A compiler does not find this from a loop
over stages: it stores and reloads z once a stage.

Sources: [HNW93].
"""

import operator
from collections.abc import Callable, Sequence

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from creeping._typing import Any

LANES = 8
_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)
_FLAGS = ("contract",)

UNROLL = 4
"""Vectors summed at a time, to hide the latency of a multiply-add; arrays are multiples of LANES * UNROLL numbers."""

_INTEGER = ir.IntType(64)
POINTER = types.CPointer(types.float64)
"""The type of the address of an array in compiled code; what is handed on so is not counted as in use."""


Rows = Callable[[], Sequence[Sequence[float]]]
"""Gives weights by rows, when the code is generated: what is loaded from a cache does not need them."""


class Vector(types.Type):  # type: ignore[misc]
    """The type of a vector in compiled code."""

    def __init__(self) -> None:
        super().__init__(name=f"float64x{LANES}")


VECTOR = Vector()


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _DOUBLES)


class _Binary(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, keywords: Any) -> Any:
        if len(args) == 2 and all(isinstance(kind, Vector) for kind in args) and not keywords:
            return signature(VECTOR, VECTOR, VECTOR)
        return None


def _define(symbol: Any, instruction: str) -> None:
    infer_global(symbol)(type(f"_{instruction}", (_Binary,), {}))

    @lower_builtin(symbol, Vector, Vector)
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, instruction)(*args, flags=_FLAGS)


for _symbol, _instruction in (
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.isub, "fsub"),
    (operator.mul, "fmul"),
    (operator.imul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define(_symbol, _instruction)


class _Unary(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, keywords: Any) -> Any:
        return signature(VECTOR, VECTOR) if len(args) == 1 and isinstance(args[0], Vector) else None


infer_global(operator.neg)(_Unary)


@lower_builtin(operator.neg, Vector)
def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


@intrinsic
def pointer(typing: Any, array: Any, start: Any) -> Any:
    """Address of an element of a flat contiguous array of floats, or that many elements behind another address.

    Functions that are given arrays count their users, around every call, and that takes as long as the arithmetic of a
    block. An address does not keep the array: its owner has to.
    """

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        return builder.gep(_data(context, builder, sig.args[0], args[0]), [index])

    return POINTER(array, start), codegen


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return array if isinstance(kind, types.CPointer) else context.make_array(kind)(context, builder, array).data


def _place(context: Any, builder: Any, kind: Any, array: Any, start: Any) -> Any:
    """Pointer to the vector that begins at an element of a flat array or behind an address."""
    data = _data(context, builder, kind, array)
    return builder.bitcast(builder.gep(data, [start]), _DOUBLES.as_pointer())


@intrinsic
def load(typing: Any, array: Any, start: Any) -> Any:
    """Elements start .. start + LANES of a flat contiguous array of floats, or behind the address of one."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        value = builder.load(_place(context, builder, sig.args[0], args[0], index))
        value.align = 8
        return value

    return VECTOR(array, start), codegen


def loads(count: int, stride: int) -> Any:
    """Make ``f(array, start)`` for kernels: a tuple of ``count`` vectors, the next ``stride`` elements behind the last.

    A kernel compiles in less time with one call than with several.
    """

    @intrinsic
    def vectors(typing: Any, array: Any, start: Any) -> Any:
        kind = types.UniTuple(VECTOR, count)

        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            index = context.cast(builder, args[1], sig.args[1], types.intp)
            values = []
            for row in range(count):
                at = builder.add(index, ir.Constant(ir.IntType(64), row * stride))
                values.append(builder.load(_place(context, builder, sig.args[0], args[0], at)))
                values[-1].align = 8
            return context.make_tuple(builder, kind, values)

        return kind(array, start), codegen

    return vectors


@intrinsic
def store(typing: Any, array: Any, start: Any, value: Any) -> Any:
    """Put a vector into a flat contiguous array of floats, or behind its address, from an element on."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        builder.store(args[2], _place(context, builder, sig.args[0], args[0], index)).align = 8
        return context.get_dummy_value()

    return types.void(array, start, value), codegen


@intrinsic
def spread(typing: Any, number: Any) -> Any:
    """Vector of one float in all lanes."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        nothing = ir.Constant(_DOUBLES, ir.Undefined)
        first = builder.insert_element(nothing, args[0], ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))

    return VECTOR(types.float64), codegen


def _each(name: str) -> Any:
    """Make a function of every lane, by the compiler's name for it."""

    @intrinsic
    def function(typing: Any, value: Any) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            kind = ir.FunctionType(_DOUBLES, [_DOUBLES])
            return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args)

        return VECTOR(value), codegen

    return function


root = _each("sqrt")
"""Square roots of a vector."""


magnitude = _each("fabs")
"""Absolute values of a vector."""


@intrinsic
def larger(typing: Any, one: Any, other: Any) -> Any:
    """The larger of each two lanes; the other's where one of them is no number."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return VECTOR(one, other), codegen


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
