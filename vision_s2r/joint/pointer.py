"""Arrays as compiled code passes them on: their data alone.

numba counts the references of every array that a function is given, by an atomic instruction each, and does not notice
that nothing comes of it where an inner function is called at every step: that was two thirds of a servo's time.
"""

from typing import Any, TypeAlias

import numba
from numba.core.errors import RequireLiteralValue
from numba.extending import intrinsic

Pointer: TypeAlias = Any  # float64, by one index: rows of a table lie one after the other


def _pointer(context: Any, array: Any) -> Any:
    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return numba.types.CPointer(numba.types.float64)(array), lowered


# For compiled code: the numbers of a contiguous array of float64, which has to outlive it.
pointer: Any = intrinsic(_pointer)


def _shifted(context: Any, data: Any, count: Any) -> Any:
    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.gep(arguments[0], [arguments[1]])

    return data(data, numba.types.intp), lowered


# The numbers from so many behind the first on.
shifted: Any = intrinsic(_shifted)


def _numbers(context: Any, data: Any, count: Any) -> Any:
    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places = (builder.gep(arguments[0], [context.get_constant(numba.types.intp, k)]) for k in range(size))
        return context.make_tuple(builder, signature.return_type, [builder.load(place) for place in places])

    if not isinstance(count, numba.types.IntegerLiteral):
        raise RequireLiteralValue("a tuple is as long as it is compiled for")
    size = int(count.literal_value)
    return numba.types.UniTuple(data.dtype, size)(data, count), lowered


# The first numbers as a tuple, each read where it is used: `to_fixed_tuple` copies a machine once for each of them.
numbers: Any = intrinsic(_numbers)
