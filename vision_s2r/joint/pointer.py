"""Arrays as compiled code passes them on: their data alone.

numba counts the references of every array that a function is given, by an atomic instruction each, and does not notice
that nothing comes of it where an inner function is called at every step: that was two thirds of a servo's time.
"""

from typing import Any, TypeAlias

import numba
from numba.extending import intrinsic

Pointer: TypeAlias = Any  # float64, by one index: rows of a table lie one after the other


def _pointer(context: Any, array: Any) -> Any:
    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return numba.types.CPointer(numba.types.float64)(array), lowered


# For compiled code: the numbers of a contiguous array of float64, which has to outlive it.
pointer: Any = intrinsic(_pointer)
