"""Two things that numba has no word for: a table seen in a stretch of numbers, and a look ahead into memory.

numba's own ``reshape`` is a call that the compiler cannot see through: for the state of one series it takes as long as
a short step, and hides from the compiler how long rows are.
"""

import functools


def matrix(flat, rows, columns):
    """Return the view (rows, columns) of so many numbers; compiled, its sizes stay known to the compiler."""
    return flat.reshape(rows, columns)


def fetch(table, row):
    """Let the processor fetch a row of a table into its cache, while it computes on others; changes nothing."""


@functools.cache
def bind() -> None:
    """Teach numba both."""
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.extending import lower_builtin, type_callable
    from numba.np import arrayobj

    @type_callable(matrix)
    def type_matrix(context):
        return lambda flat, rows, columns: types.Array(flat.dtype, 2, "C")(flat, types.intp, types.intp)

    @type_callable(fetch)
    def type_fetch(context):
        return lambda table, row: types.none(table, types.intp)

    @lower_builtin(matrix, types.Array, types.intp, types.intp)
    def fold(context, builder, signature, values):
        old = arrayobj.make_array(signature.args[0])(context, builder, values[0])
        new, size = arrayobj.make_array(signature.return_type)(context, builder), old.itemsize
        strides = builder.mul(values[2], size), size
        arrayobj.populate_array(new, old.data, values[1:], strides, size, meminfo=None)
        return new._getvalue()

    @lower_builtin(fetch, types.Array, types.intp)
    def fetch_line(context, builder, signature, values):
        table = arrayobj.make_array(signature.args[0])(context, builder, values[0])
        number, byte = ir.IntType(32), ir.IntType(8).as_pointer()
        first = cgutils.unpack_tuple(builder, table.strides)[0]
        place = builder.gep(builder.bitcast(table.data, byte), [builder.mul(values[1], first)])
        prefetch = builder.module.declare_intrinsic(
            "llvm.prefetch", [byte], ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        )
        builder.call(prefetch, [place, number(0), number(3), number(1)])
        return context.get_dummy_value()
