"""How the generators' own code is compiled."""

from numba import njit

helper = njit(  # type: ignore[call-overload]  # its stubs lack these
    no_cpython_wrapper=True,  # compiled code calls these, Python does not
    no_cfunc_wrapper=True,
)
