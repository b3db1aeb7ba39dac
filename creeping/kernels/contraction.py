"""Contraction of a spline's stencil in explicit vector instructions.

sum_ijk wu_i wv_j wa_k c[i, j, k, :] with the angle and the components of a coefficient contiguous: rows along them are
accumulated over (i, j) first and weighted by wa last, which leaves one multiply-add per coefficient. A compiler does
not find this from loops: 16 to 36 rows of run-time length cost it four times the arithmetic in bookkeeping.
Tables may be float32: products over j are then summed in float32, eight at a time, all other sums in float64, which
keeps the error of a sum below that of the stored coefficients.

Sources: Derivations, B7.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

WIDTH = 8
_double, _index = ir.DoubleType(), ir.IntType(64)
_wide = ir.VectorType(_double, WIDTH)


def contraction(degree: int, lanes: int, *, flat: bool = False) -> Any:
    """Make ``f(table, offset, stride_u, stride_v, wu, wv, wa, place, step, out, out_place)`` for kernels.

    ``table`` is a C-contiguous float32 or float64 array seen as flat memory; the stencil's first coefficient starts at
    ``offset``, rows are ``stride_v`` and planes ``stride_u`` values apart. Weight j lies at ``place + j * step`` of
    its array. Writes ``lanes`` (4 or 8) values to ``out`` from ``out_place`` on.

    Flat, the stencil is one plane: it has no axis u, and neither ``stride_u`` nor ``wu`` is read.
    """
    points = degree + 1
    vectors = points * lanes // WIDTH

    @intrinsic
    def contract(
        typing: Any,
        table: Any,
        offset: Any,
        su: Any,
        sv: Any,
        wu: Any,
        wv: Any,
        wa: Any,
        place: Any,
        step: Any,
        out: Any,
        out_place: Any,
    ) -> Any:
        signature = types.void(table, offset, su, sv, wu, wv, wa, place, step, out, out_place)
        single = table.dtype == types.float32
        narrow = ir.FloatType() if single else _double

        def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
            data = [context.make_array(sig.args[k])(context, builder, args[k]).data for k in (0, 4, 5, 6, 9)]
            rows, weight_u, weight_v, weight_a, target = data
            start, stride_u, stride_v = args[1:4]

            def weights(pointer: Any) -> list[Any]:
                places = [builder.add(args[7], builder.mul(args[8], ir.Constant(_index, j))) for j in range(points)]
                return [builder.load(builder.gep(pointer, [at])) for at in places]

            def multiply_add(total: Any, weight: Any, value: Any) -> Any:
                product = builder.fmul(weight, value, flags=("contract",))
                return product if total is None else builder.fadd(total, product, flags=("contract",))

            along_v = [builder.fptrunc(w, narrow) if single else w for w in weights(weight_v)]
            sums: list[Any] = [None] * vectors
            for i, w_i in enumerate([None] if flat else weights(weight_u)):
                plane = builder.add(start, builder.mul(stride_u, ir.Constant(_index, i)))
                inner: list[Any] = [None] * vectors
                for j, w_j in enumerate(along_v):
                    row = builder.add(plane, builder.mul(stride_v, ir.Constant(_index, j)))
                    weight = _spread(builder, w_j if single or flat else builder.fmul(w_i, w_j))
                    into = inner if single else sums
                    for k in range(vectors):
                        value = _load(builder, builder.gep(rows, [builder.add(row, ir.Constant(_index, WIDTH * k))]))
                        into[k] = multiply_add(into[k], weight, value)
                if single and flat:
                    sums = [builder.fpext(part, _wide) for part in inner]
                elif single:
                    weight = _spread(builder, w_i)
                    sums = [
                        multiply_add(total, weight, builder.fpext(part, _wide))
                        for total, part in zip(sums, inner, strict=True)
                    ]
            along_a = weights(weight_a)
            total = None
            for k in range(vectors):
                group = along_a[k * WIDTH // lanes : (k + 1) * WIDTH // lanes]
                total = multiply_add(total, _grouped(builder, group), sums[k])
            if lanes < WIDTH:
                total = builder.fadd(_part(builder, total, 0, lanes), _part(builder, total, lanes, lanes))
            address = builder.gep(target, [args[10]])
            stored = builder.store(total, builder.bitcast(address, ir.VectorType(_double, lanes).as_pointer()))
            stored.align = 8
            return context.get_dummy_value()

        return signature, codegen

    return contract


def _load(builder: ir.IRBuilder, pointer: Any) -> Any:
    """Vector of WIDTH values of the pointer's type, at its own alignment."""
    kind = pointer.type.pointee
    value = builder.load(builder.bitcast(pointer, ir.VectorType(kind, WIDTH).as_pointer()))
    value.align = 4 if kind == ir.FloatType() else 8
    return value


def _spread(builder: ir.IRBuilder, value: Any, width: int = WIDTH) -> Any:
    """Vector of equal values."""
    kind = ir.VectorType(value.type, width)
    empty = ir.Constant(kind, ir.Undefined)
    single = builder.insert_element(empty, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(single, empty, ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width))


def _grouped(builder: ir.IRBuilder, values: list[Any]) -> Any:
    """Vector of WIDTH values of which each of ``values`` takes an equal share."""
    if len(values) == 1:
        return _spread(builder, values[0])
    first, second = (_spread(builder, value, WIDTH // 2) for value in values)
    return builder.shuffle_vector(first, second, _mask(range(WIDTH)))


def _part(builder: ir.IRBuilder, vector: Any, first: int, count: int) -> Any:
    return builder.shuffle_vector(vector, ir.Constant(_wide, ir.Undefined), _mask(range(first, first + count)))


def _mask(places: range) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places))
