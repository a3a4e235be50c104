"""Eight series in one processor register: a number type whose arithmetic is that of each of its lanes, bit for bit.

A kernel compiled for arrays of `Lanes` in place of arrays of float64 is the same source and does the same operations in
the same order, on eight series at once. Where the lanes disagree about a branch it goes the way of "no" and counts a
disagreement: whoever runs it looks at `disagreements` before and after, and takes those samples one series at a time.
"""

from __future__ import annotations

import functools
import math
import operator

from .elementary import exp, log

LANES = 8


def interleave(flat):
    """Return the view (m,) of `Lanes` of 8 m numbers (compiled code only)."""
    raise NotImplementedError


def finite(value) -> bool:
    """Say whether the numbers of all lanes are finite (compiled code only)."""
    raise NotImplementedError


def disagreements() -> int:
    """Return how often lanes have disagreed so far, in all threads (compiled code only)."""
    raise NotImplementedError


@functools.cache
def bind() -> None:
    """Teach numba the type and everything that kernels do with numbers."""
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.core.typeconv import Conversion
    from numba.extending import lower_builtin, lower_cast, models, register_model, type_callable
    from numba.np import arrayobj

    double, bit = ir.DoubleType(), ir.IntType(1)
    vector, bits = ir.VectorType(double, LANES), ir.VectorType(bit, LANES)

    class LanesType(types.Type):
        def can_convert_from(self, context, other):
            return Conversion.promote if isinstance(other, types.Float | types.Integer) else None

        def unify(self, context, other):
            return self if isinstance(other, types.Float | types.Integer) else None

    class MaskType(types.Type):
        def can_convert_to(self, context, other):
            return Conversion.safe if other == types.boolean else None

        def unify(self, context, other):
            return other if other == types.boolean else None

    lanes, mask = LanesType("Lanes"), MaskType("Mask")

    @register_model(LanesType)
    class LanesModel(models.PrimitiveModel):
        def __init__(self, manager, kind):
            super().__init__(manager, kind, vector)

        def load_from_data_pointer(self, builder, ptr, align=None):
            return builder.load(ptr, align=8)

    @register_model(MaskType)
    class MaskModel(models.PrimitiveModel):
        def __init__(self, manager, kind):
            super().__init__(manager, kind, bits)

    # --- numbers into lanes, and what lanes agree on

    def spread(builder, value):
        first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), zeros)

    @lower_cast(types.Float, LanesType)
    @lower_cast(types.Integer, LanesType)
    def cast_number(context, builder, source, target, value):
        return spread(builder, context.cast(builder, value, source, types.float64))

    def counter(builder):
        name, module = "driftwise_lanes_disagreements", builder.module
        if name not in module.globals:
            found = cgutils.add_global_variable(module, ir.IntType(64), name)
            found.linkage, found.initializer = "linkonce_odr", ir.Constant(ir.IntType(64), 0)
        return module.globals[name]

    def truth(builder, value):
        packed = builder.bitcast(value, ir.IntType(LANES))
        yes = builder.icmp_unsigned("==", packed, ir.Constant(packed.type, 2**LANES - 1))
        no = builder.icmp_unsigned("==", packed, ir.Constant(packed.type, 0))
        with builder.if_then(builder.not_(builder.or_(yes, no)), likely=False):
            builder.atomic_rmw("add", counter(builder), ir.Constant(ir.IntType(64), 1), "monotonic")
        return yes

    @lower_cast(MaskType, types.Boolean)
    def cast_mask(context, builder, source, target, value):
        return truth(builder, value)

    @type_callable(bool)
    def type_bool(context):
        return lambda value: types.boolean(mask) if value == mask else None

    @type_callable(operator.not_)
    def type_not(context):
        return lambda value: types.boolean(mask) if value == mask else None

    @lower_builtin(bool, MaskType)
    def lower_bool(context, builder, signature, values):
        return truth(builder, values[0])

    @lower_builtin(operator.not_, MaskType)
    def lower_not(context, builder, signature, values):
        return builder.not_(truth(builder, values[0]))

    @type_callable(finite)
    def type_finite(context):
        return lambda value: types.boolean(lanes) if value == lanes else None

    @lower_builtin(finite, LanesType)
    def lower_finite(context, builder, signature, values):
        same = builder.fcmp_ordered("==", *2 * [builder.fsub(values[0], values[0])])
        packed = builder.bitcast(same, ir.IntType(LANES))
        return builder.icmp_unsigned("==", packed, ir.Constant(packed.type, 2**LANES - 1))

    @type_callable(disagreements)
    def type_disagreements(context):
        return lambda: types.int64()

    @lower_builtin(disagreements)
    def lower_disagreements(context, builder, signature, values):
        return builder.load_atomic(counter(builder), "monotonic", 8)

    # --- arithmetic

    def is_number(kind):
        return kind == lanes or isinstance(kind, types.Float | types.Integer)

    def binary(function, result, build):
        @type_callable(function)
        def type_binary(context):
            def resolve(a, b):
                if lanes in (a, b) and is_number(a) and is_number(b):
                    return result(lanes, lanes)

            return resolve

        @lower_builtin(function, LanesType, LanesType)
        def lower_binary(context, builder, signature, values):
            return build(builder, *values)

    def unary(function, build):
        @type_callable(function)
        def type_unary(context):
            return lambda a: lanes(lanes) if a == lanes else None

        @lower_builtin(function, LanesType)
        def lower_unary(context, builder, signature, values):
            return build(builder, values[0])

    for name in ("add", "sub", "mul", "truediv"):
        build = getattr(ir.IRBuilder, "fdiv" if name == "truediv" else f"f{name}")
        binary(getattr(operator, name), lanes, build)
        binary(getattr(operator, f"i{name}"), lanes, build)
    for name, sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "=="}.items():
        binary(getattr(operator, name), mask, lambda b, x, y, sign=sign: b.fcmp_ordered(sign, x, y))
    binary(operator.ne, mask, lambda b, x, y: b.fcmp_unordered("!=", x, y))
    binary(max, lanes, lambda b, x, y: b.select(b.fcmp_ordered(">", y, x), y, x))
    binary(min, lanes, lambda b, x, y: b.select(b.fcmp_ordered("<", y, x), y, x))

    def intrinsic(name):
        def build(builder, value):
            kind = ir.FunctionType(vector, [vector])
            return builder.call(
                cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), [value]
            )

        return build

    def one_by_one(function):
        @type_callable(function)
        def type_one_by_one(context):
            return lambda a: lanes(lanes) if a == lanes else None

        @lower_builtin(function, LanesType)
        def lower_one_by_one(context, builder, signature, values):
            kind = context.typing_context.resolve_value_type(function)
            single = context.get_function(kind, kind.get_call_type(context.typing_context, (types.float64,), {}))
            value = values[0]
            for lane in range(LANES):
                at = ir.Constant(ir.IntType(32), lane)
                value = builder.insert_element(value, single(builder, [builder.extract_element(value, at)]), at)
            return value

    unary(abs, intrinsic("fabs"))
    unary(math.sqrt, intrinsic("sqrt"))
    unary(operator.neg, lambda b, x: b.fneg(x))
    one_by_one(log)
    one_by_one(exp)

    @type_callable(operator.pow)
    def type_pow(context):
        def resolve(a, b):
            if a == lanes and isinstance(b, types.IntegerLiteral) and b.literal_value == 2:
                return lanes(lanes, b)

        return resolve

    @lower_builtin(operator.pow, LanesType, types.IntegerLiteral)
    def lower_square(context, builder, signature, values):
        return builder.fmul(values[0], values[0])

    # --- arrays

    @type_callable(interleave)
    def type_interleave(context):
        return lambda flat: types.Array(lanes, 1, "C")(flat)

    @lower_builtin(interleave, types.Array)
    def lower_interleave(context, builder, signature, values):
        old = arrayobj.make_array(signature.args[0])(context, builder, values[0])
        new = arrayobj.make_array(signature.return_type)(context, builder)
        size = ir.Constant(old.itemsize.type, 8 * LANES)
        count = builder.udiv(cgutils.unpack_tuple(builder, old.shape)[0], ir.Constant(size.type, LANES))
        data = builder.bitcast(old.data, new.data.type)
        arrayobj.populate_array(new, data, (count,), (size,), size, meminfo=None)
        return new._getvalue()
