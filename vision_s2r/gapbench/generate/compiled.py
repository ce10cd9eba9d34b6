"""How the generators' own code is compiled."""

from numba import njit

helper = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)  # for what compiled code calls, and Python does not
