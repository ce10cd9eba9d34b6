"""How this room's formulas are compiled.

Inlined into one kernel. Products may be fused with sums and divisions turned into products, but nothing is reordered
and IEEE's infinities hold: a simulation is the same bits whatever else runs beside it, and an infinite limit is none.
"""

import math

import numba

compiled = numba.njit(nogil=True, error_model="numpy", forceinline=True, fastmath={"contract", "arcp", "nsz"})


@compiled
def sine(angle: float) -> float:
    """sin to 1e-13 + 1e-16·|angle|, in a fraction of the library's time: Taylor's series on a quarter turn."""
    half_turns = math.floor(angle * (1 / math.pi) + 0.5)
    x = (angle - half_turns * 3.141592653589793) - half_turns * 1.2246467991473532e-16
    y = x * x
    series = -1 / 1307674368000 + y * (1 / 355687428096000)
    series = 1 / 362880 + y * (-1 / 39916800 + y * (1 / 6227020800 + y * series))
    series = 1 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * series)))
    odd = half_turns - 2 * math.floor(0.5 * half_turns)
    return (1 - 2 * odd) * x * series
