"""The one way in which this room's formulas are compiled.

Without fastmath, so that a simulation is the same bits whatever else runs beside it. Division by zero follows
IEEE 754: an infinite limit is no limit.
"""

import numba

compiled = numba.njit(nogil=True, error_model="numpy")
