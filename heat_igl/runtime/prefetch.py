"""What compiled kernels need to read large tables fast: arrays that are not counted, and rows fetched ahead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numba
import numba.extending
from llvmlite import ir

__all__ = ["prefetch", "uncounted"]


def _uncounted(_: Any, kind: Any) -> Any:
    def without_owner(context: Any, builder: Any, kind: Any, given: Any) -> Any:
        is_tuple, is_array = (isinstance(kind, one) for one in (numba.types.BaseTuple, numba.types.Array))
        if is_tuple:
            members = [builder.extract_value(given, i) for i in range(len(kind))]
            members = [without_owner(context, builder, *member) for member in zip(kind, members, strict=True)]
            return context.make_tuple(builder, kind, members)
        if not is_array:
            return given
        view = context.make_array(kind)(context, builder, given)
        view.meminfo, view.parent = view.meminfo.type(None), view.parent.type(None)
        return view._getvalue()

    def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        return without_owner(context, builder, kind, arguments[0])

    return kind(kind), code


def _prefetch(_: Any, rows: Any, i: Any) -> Any:
    def code(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        array = context.make_array(rows)(context, builder, arguments[0])
        row_size = builder.extract_value(array.strides, 0)
        index = context.cast(builder, arguments[1], i, numba.types.intp)
        address = builder.add(builder.ptrtoint(array.data, row_size.type), builder.mul(index, row_size))
        pointer, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer, word, word, word])
        prefetch = builder.module.declare_intrinsic("llvm.prefetch", [pointer], kind)
        # To be read, of use again, data.
        builder.call(prefetch, [builder.inttoptr(address, pointer), word(0), word(3), word(1)])
        return context.get_dummy_value()

    return numba.types.none(rows, i), code


# (arrays): the same array, or tuple of arrays, without a count of references; for those that the caller keeps. Numba
# counts at every use of a tuple's member, by atomic additions that hold up the reading of memory around them.
uncounted = cast("Callable[[Any], Any]", numba.extending.intrinsic(_uncounted))
# (array, i): begin to fetch row i, of up to 64 bytes, while other work is done. i need not be a row: nothing is read.
prefetch = cast("Callable[[Any, Any], None]", numba.extending.intrinsic(_prefetch))
