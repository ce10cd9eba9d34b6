"""How this room's formulas are compiled.

Inlined into one kernel. Products may be fused with sums and divisions turned into products, but nothing is reordered
and IEEE's infinities hold: a simulation is the same bits whatever else runs beside it, and an infinite limit is none.
"""

import math
from typing import Any

import numba
import numpy as np
from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering


class _Part(JITCodeLibrary):
    """Code that kernels take in and nobody else calls: no machine code is made of it, which is a third of the time."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _Known(LoweringPass):
    """Lets other compiled code call what was lowered."""

    _name = "known_to_compiled_code"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        known = state.cr.fndesc
        # numba knows functions by what Python would call
        nowhere = make_function(known.lookup_module(), known.qualname, "", 0, state.cr.env, (state.library,))
        state.targetctx.insert_user_function(nowhere, known, [state.library])
        state.cr = state.cr._replace(cfunc=nowhere)
        return True


class _Inlined(CompilerBase):
    """numba's own steps but the last: what is lowered and optimized is left to the kernels."""

    def define_pipelines(self) -> list[Any]:
        self.state.library = _Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.flags.no_compile = True
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_Known, NativeLowering)
        passes.finalize()
        return [passes]


compiled = numba.njit(  # type: ignore[call-overload]  # its stubs lack the last two
    pipeline_class=_Inlined,
    nogil=True,
    error_model="numpy",
    fastmath={"contract", "arcp", "nsz"},
    forceinline=True,
    no_cpython_wrapper=True,  # compiled code calls these, Python does not
    no_cfunc_wrapper=True,
)


@compiled
def sine(angle: float) -> float:
    """sin to 1e-13 + 1e-16·|angle|, sooner than the library's: a step waits for it.

    Taylor's series on a quarter turn either way, in pairs that do not wait for each other.
    """
    half_turns = np.rint(angle * (1 / math.pi))
    x = (angle - half_turns * 3.141592653589793) - half_turns * 1.2246467991473532e-16
    y = x * x
    y2 = y * y
    y4 = y2 * y2
    low = (1 - y * (1 / 6)) + y2 * (1 / 120 - y * (1 / 5040))
    high = (1 / 362880 - y * (1 / 39916800)) + y2 * (1 / 6227020800 - y * (1 / 1307674368000))
    series = low + y4 * (high + y4 * (1 / 355687428096000))
    odd = half_turns - 2 * np.floor(0.5 * half_turns)
    return (1 - 2 * odd) * x * series
