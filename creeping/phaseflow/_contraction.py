"""Sum of a tensor-product spline's stencil in explicit vector instructions.

sum_ijk wu_i wv_j wa_k c[i, j, k, :] with all lanes of a coefficient in one vector: rows along the angle are accumulated
over (i, j) first and weighted by wa last, which leaves one multiply-add per coefficient. A compiler does not find this
from loops: 16 to 36 rows of run-time length cost it four times the arithmetic in bookkeeping.
The twin in plain numpy is `creeping.phaseflow.splines.evaluate`.
"""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from creeping._typing import Any


def contraction(degree: int, lanes: int) -> Any:
    """Make ``f(table, offset, stride_u, stride_v, wu, wv, wa, out)`` for kernels.

    ``table`` is a C-contiguous float64 array seen as flat memory; the stencil's first coefficient starts at ``offset``,
    rows are ``stride_v`` and planes ``stride_u`` values apart. Writes ``lanes`` values to ``out``.
    """
    points = degree + 1
    vector = ir.VectorType(ir.DoubleType(), lanes)

    @intrinsic  # type: ignore[untyped-decorator]
    def contract(typing: Any, table: Any, offset: Any, su: Any, sv: Any, wu: Any, wv: Any, wa: Any, out: Any) -> Any:
        signature = types.void(table, offset, su, sv, wu, wv, wa, out)

        def codegen(context: Any, builder: ir.IRBuilder, sig: Any, args: Any) -> Any:
            data = [context.make_array(sig.args[k])(context, builder, args[k]).data for k in (0, 4, 5, 6, 7)]
            rows, weight_u, weight_v, weight_a, target = data
            start, stride_u, stride_v = args[1:4]

            def scalar(pointer: Any, index: int) -> Any:
                return builder.load(builder.gep(pointer, [ir.Constant(ir.IntType(64), index)]))

            def spread(value: Any) -> Any:
                zero = ir.Constant(ir.IntType(32), 0)
                single = builder.insert_element(ir.Constant(vector, ir.Undefined), value, zero)
                mask = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
                return builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined), mask)

            def multiply_add(total: Any, weight: Any, value: Any) -> Any:
                product = builder.fmul(weight, value, flags=("contract",))
                return product if total is None else builder.fadd(total, product, flags=("contract",))

            along_v = [scalar(weight_v, j) for j in range(points)]
            sums: list[Any] = [None] * points
            for i in range(points):
                plane = builder.add(start, builder.mul(stride_u, ir.Constant(ir.IntType(64), i)))
                w_i = scalar(weight_u, i)
                for j in range(points):
                    row = builder.add(plane, builder.mul(stride_v, ir.Constant(ir.IntType(64), j)))
                    pointer = builder.bitcast(builder.gep(rows, [row]), vector.as_pointer())
                    weight = spread(builder.fmul(w_i, along_v[j]))
                    for k in range(points):
                        value = builder.load(builder.gep(pointer, [ir.Constant(ir.IntType(64), k)]))
                        value.align = 8
                        sums[k] = multiply_add(sums[k], weight, value)
            total = None
            for k in range(points):
                total = multiply_add(total, spread(scalar(weight_a, k)), sums[k])
            stored = builder.store(total, builder.bitcast(target, vector.as_pointer()))
            stored.align = 8
            return context.get_dummy_value()

        return signature, codegen

    return contract
