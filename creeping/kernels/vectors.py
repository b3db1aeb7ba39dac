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

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

LANES = 8
_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)
POINTER = types.CPointer(types.float64)
"""The type of the address of an array in compiled code; what is handed on so is not counted as in use."""


def whole(number):
    """A whole number in compiled code."""
    return ir.Constant(ir.IntType(64), number)


def spread_value(builder, value, width=LANES):
    """Vector of equal values."""
    empty = ir.Constant(ir.VectorType(value.type, width), ir.Undefined)
    single = builder.insert_element(empty, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(single, empty, ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width))


def load_vector(builder, data, place, width=LANES):
    """Vector of the elements from a place on, at their own alignment."""
    kind = data.type.pointee
    value = builder.load(builder.bitcast(builder.gep(data, [place]), ir.VectorType(kind, width).as_pointer()))
    value.align = 4 if kind == ir.FloatType() else 8
    return value


def store_vector(builder, value, data, place):
    """Put a vector of floats to the elements from a place on."""
    builder.store(value, builder.bitcast(builder.gep(data, [place]), value.type.as_pointer())).align = 8


def multiply_add(builder, total, weight, value):
    """Total, none at first, plus weight times value."""
    product = builder.fmul(weight, value, flags=("contract",))
    return product if total is None else builder.fadd(total, product, flags=("contract",))


def data_of(context, builder, kind, array):
    """Address of an array's first element, or of what is an address already."""
    return array if isinstance(kind, types.CPointer) else context.make_array(kind)(context, builder, array).data


class Vector(types.Type):  # type: ignore[misc]
    """The type of a vector in compiled code."""

    def __init__(self):
        super().__init__(name=f"float64x{LANES}")


VECTOR = Vector()


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _DOUBLES)


class _Binary(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args, keywords):
        if len(args) == 2 and all(isinstance(kind, Vector) for kind in args) and not keywords:
            return signature(VECTOR, VECTOR, VECTOR)
        return None


def _define(symbol, instruction):
    infer_global(symbol)(type(f"_{instruction}", (_Binary,), {}))

    @lower_builtin(symbol, Vector, Vector)
    def lower(context, builder, sig, args):
        return getattr(builder, instruction)(*args, flags=("contract",))


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
    def generic(self, args, keywords):
        return signature(VECTOR, VECTOR) if len(args) == 1 and isinstance(args[0], Vector) else None


infer_global(operator.neg)(_Unary)


@lower_builtin(operator.neg, Vector)
def _negative(context, builder, sig, args):
    return builder.fneg(args[0])


@intrinsic
def pointer(typing, array, start):
    """Address of an element of a flat contiguous array of floats, or that many elements behind another address.

    Functions that are given arrays count their users, around every call, and that takes as long as the arithmetic of a
    block. An address does not keep the array: its owner has to.
    """

    def codegen(context, builder, sig, args):
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        return builder.gep(data_of(context, builder, sig.args[0], args[0]), [index])

    return POINTER(array, start), codegen


@intrinsic
def load(typing, array, start):
    """Elements start .. start + LANES of a flat contiguous array of floats, or behind the address of one."""

    def codegen(context, builder, sig, args):
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        return load_vector(builder, data_of(context, builder, sig.args[0], args[0]), index)

    return VECTOR(array, start), codegen


def loads(count, stride):
    """Make ``f(array, start)`` for kernels: a tuple of ``count`` vectors, the next ``stride`` elements behind the last.

    A kernel compiles in less time with one call than with several.
    """

    @intrinsic
    def vectors(typing, array, start):
        kind = types.UniTuple(VECTOR, count)

        def codegen(context, builder, sig, args):
            index = context.cast(builder, args[1], sig.args[1], types.intp)
            data = data_of(context, builder, sig.args[0], args[0])
            places = [builder.add(index, whole(row * stride)) for row in range(count)]
            return context.make_tuple(builder, kind, [load_vector(builder, data, at) for at in places])

        return kind(array, start), codegen

    return vectors


@intrinsic
def store(typing, array, start, value):
    """Put a vector into a flat contiguous array of floats, or behind its address, from an element on."""

    def codegen(context, builder, sig, args):
        index = context.cast(builder, args[1], sig.args[1], types.intp)
        store_vector(builder, args[2], data_of(context, builder, sig.args[0], args[0]), index)
        return context.get_dummy_value()

    return types.void(array, start, value), codegen


@intrinsic
def spread(typing, number):
    """Vector of one float in all lanes."""

    def codegen(context, builder, sig, args):
        return spread_value(builder, args[0])

    return VECTOR(types.float64), codegen


def _each(name):
    """Make a function of every lane, by the compiler's name for it."""

    @intrinsic
    def function(typing, value):
        def codegen(context, builder, sig, args):
            kind = ir.FunctionType(_DOUBLES, [_DOUBLES])
            return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args)

        return VECTOR(value), codegen

    return function


root = _each("sqrt")
"""Square roots of a vector."""


magnitude = _each("fabs")
"""Absolute values of a vector."""


@intrinsic
def larger(typing, one, other):
    """The larger of each two lanes; the other's where one of them is no number."""

    def codegen(context, builder, sig, args):
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return VECTOR(one, other), codegen


def stage_sums(rows):
    """Make ``f(row, h, k, size, y, z)`` for kernels: z = y + h sum_j w[row][j] k[j].

    ``rows`` gives the weights by rows, when the code is generated: what is loaded from a cache does not need them.
    Arrays are given by their addresses: y, z (size,), k (stages, size). Nothing is done for a row without weights.
    Four vectors are summed at a time, to hide the latency of a multiply-add: arrays are multiples of 4 LANES numbers.
    """

    @intrinsic
    def combine(typing, row, h, k, size, y, z):
        def codegen(context, builder, sig, args):
            number, step, stages, size, start, target = args
            step = spread_value(builder, step)
            done = builder.append_basic_block("done")
            choice = builder.switch(number, done)
            for case, weights in enumerate(rows()):
                if not any(weights):
                    continue
                block = builder.append_basic_block(f"row{case}")
                choice.add_case(whole(case), block)
                builder.position_at_end(block)
                with cgutils.for_range(builder, builder.udiv(size, whole(4 * LANES))) as loop:
                    first = builder.mul(loop.index, whole(4 * LANES))
                    places = [builder.add(first, whole(LANES * u)) for u in range(4)]
                    sums = [_sum(builder, weights, stages, size, place) for place in places]
                    for place, total in zip(places, sums, strict=True):
                        value = multiply_add(builder, load_vector(builder, start, place), step, total)
                        store_vector(builder, value, target, place)
                builder.branch(done)
            builder.position_at_end(done)
            return context.get_dummy_value()

        return types.void(types.int64, types.float64, POINTER, types.int64, POINTER, POINTER), codegen

    return combine


def stage_sum(rows, number):
    """Make ``f(k, size, place)`` for kernels: the vector of sum_j w[number][j] k[j] from a place on; k an address."""

    @intrinsic
    def combine(typing, k, size, place):
        def codegen(context, builder, sig, args):
            return _sum(builder, rows()[number], *args)

        return VECTOR(POINTER, types.int64, types.int64), codegen

    return combine


def _sum(builder, weights, stages, size, place):
    """Vector of the weighted sum at a place of each stage."""
    total = None
    for j, weight in enumerate(weights):
        if weight != 0:
            value = load_vector(builder, stages, builder.add(builder.mul(size, whole(j)), place))
            total = multiply_add(builder, total, ir.Constant(_DOUBLES, [float(weight)] * LANES), value)
    return total
