"""Arrays without reference counts, and what is fetched in advance: for loops of some ten nanoseconds a round."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def uncounted(typing_context: Any, value: Any) -> Any:
    """Return the same array, or tuple with arrays, as one without an owner; it must not outlive what it is made from.

    Numba counts references where it hands arrays from one function to another. In a loop that calls a few, these atomic
    operations take most of the time.
    """
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind, given = signature.args[0], arguments[0]
        if isinstance(kind, types.Array):
            return _without_owner(context, builder, kind, given)
        for place, element in enumerate(kind):
            if isinstance(element, types.Array):
                array = _without_owner(context, builder, element, builder.extract_value(given, place))
                given = builder.insert_value(given, array, place)
        return given

    return value(value), generate


def _without_owner(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    structure = context.make_array(kind)(context, builder, array)
    structure.meminfo = cgutils.get_null_value(structure.meminfo.type)
    structure.parent = cgutils.get_null_value(structure.parent.type)
    return structure._getvalue()


@intrinsic
def prefetch(typing_context: Any, array: Any, row: Any) -> Any:
    """Fetch the line of the cache in which array[row] begins; changes no value, and rows out of bounds do no harm."""
    signature = types.void(array, types.intp)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array_type = signature.args[0]
        structure = context.make_array(array_type)(context, builder, arguments[0])
        first = context.get_constant(types.intp, 0)
        pointer = cgutils.get_item_pointer(context, builder, array_type, structure,
                                           [arguments[1], first][:array_type.ndim])
        byte, flag = ir.PointerType(ir.IntType(8)), ir.IntType(32)
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [byte, flag, flag, flag]), "llvm.prefetch.p0")
        read, keep, data = (ir.Constant(flag, value) for value in (0, 3, 1))
        builder.call(function, [builder.bitcast(pointer, byte), read, keep, data])
        return context.get_dummy_value()

    return signature, generate
