"""Numbers side by side: one each of LANES bodies, in one register of the processor.

Compiled code reckons with `Lanes` as it does with a float: operators, `abs`, `min`, `max` and `math.sqrt` act on each
lane alone. A comparison makes a `Mask`, a truth a lane, and `where` takes the place of a branch. Nothing but
`any_of` and `bits` looks across lanes, so that a body's motion is the same bits whatever its neighbours are.
"""

import math
import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

LANES = 8  # one register where there is AVX-512, and two of AVX2
BYTES = 8 * LANES  # of a float64 each; arrays of lanes begin at a multiple of it

_DOUBLES = ir.VectorType(ir.DoubleType(), LANES)
_TRUTHS = ir.VectorType(ir.IntType(1), LANES)

if TYPE_CHECKING:
    Lanes = Any
    Mask = Any
else:

    class Lanes(types.Type):
        """A float64 a lane; a plain number stands for the same in every lane."""

        def __init__(self) -> None:
            super().__init__(name=f"Lanes({LANES})")

        def can_convert_from(self, _context: Any, other: types.Type) -> Conversion | None:
            return Conversion.safe if isinstance(other, types.Number) else None

        def unify(self, _context: Any, other: types.Type) -> types.Type | None:
            return self if isinstance(other, types.Number) else None

    class Mask(types.Type):
        """A truth a lane."""

        def __init__(self) -> None:
            super().__init__(name=f"Mask({LANES})")


_LANES, _MASK = Lanes(), Mask()
_in_compiled: Any = intrinsic  # a function of types that compiled code calls with values


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: types.Type) -> None:
        super().__init__(manager, fe_type, _DOUBLES)


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: types.Type) -> None:
        super().__init__(manager, fe_type, _TRUTHS)


@lower_cast(types.Number, Lanes)
def _in_every_lane(context: Any, builder: ir.IRBuilder, source: types.Type, _target: types.Type, value: Any) -> Any:
    number = context.cast(builder, value, source, types.float64)
    first = builder.insert_element(ir.Constant(_DOUBLES, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(_DOUBLES, ir.Undefined), zeros)


_Emit = Callable[..., Any]  # from a builder and values to a value


def _define(function: Any, of: types.Type, count: int, result: types.Type, emit: _Emit) -> None:
    """Let compiled code call a function of `count` lanes or masks; numbers beside lanes are spread."""
    given = tuple([of] * count)

    @infer_global(function)
    class _Template(AbstractTemplate):
        def generic(self, args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Any:
            spreads = [a == of or (of == _LANES and isinstance(a, types.Number)) for a in args]
            if kws or len(args) != count or of not in args or not all(spreads):
                return None
            return signature(result, *given)

    @lower_builtin(function, *given)
    def _lower(_context: Any, builder: ir.IRBuilder, _signature: Any, args: list[Any]) -> Any:
        return emit(builder, *args)


def _llvm(name: str) -> _Emit:
    """An operation of LLVM's on each lane."""

    def emit(builder: ir.IRBuilder, *args: Any) -> Any:
        kind = ir.FunctionType(_DOUBLES, [_DOUBLES] * len(args))
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), args)

    return emit


def _extreme(comparison: str) -> _Emit:
    """The second where it compares so with the first, as Python's own `max` and `min` do."""
    return lambda b, x, y: b.select(b.fcmp_ordered(comparison, y, x), y, x)


for _operators, _emit in (
    ((operator.add, operator.iadd), lambda b, x, y: b.fadd(x, y)),
    ((operator.sub, operator.isub), lambda b, x, y: b.fsub(x, y)),
    ((operator.mul, operator.imul), lambda b, x, y: b.fmul(x, y)),
    ((operator.truediv, operator.itruediv), lambda b, x, y: b.fdiv(x, y)),
    ((max,), _extreme(">")),
    ((min,), _extreme("<")),
):
    for _operator in _operators:
        _define(_operator, _LANES, 2, _LANES, _emit)
for _operator, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _define(_operator, _LANES, 2, _MASK, lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y))
_define(operator.neg, _LANES, 1, _LANES, lambda b, x: b.fneg(x))
for _function, _name in ((abs, "fabs"), (math.sqrt, "sqrt"), (math.sin, "sin"), (math.cos, "cos"), (math.log2, "log2")):
    _define(_function, _LANES, 1, _LANES, _llvm(_name))
for _operators, _emit in (
    ((operator.and_, operator.iand), lambda b, x, y: b.and_(x, y)),
    ((operator.or_, operator.ior), lambda b, x, y: b.or_(x, y)),
    ((operator.xor, operator.ixor), lambda b, x, y: b.xor(x, y)),
):
    for _operator in _operators:
        _define(_operator, _MASK, 2, _MASK, _emit)
_define(operator.invert, _MASK, 1, _MASK, lambda b, x: b.not_(x))


@_in_compiled
def bits(_context: Any, mask: types.Type) -> Any:
    """A mask as an integer, lane k its bit k."""

    def emit(_context: Any, builder: ir.IRBuilder, _signature: Any, args: list[Any]) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(64))

    return types.int64(mask), emit


@_in_compiled
def any_of(_context: Any, mask: types.Type) -> Any:
    """Whether a mask holds in any lane."""

    def emit(_context: Any, builder: ir.IRBuilder, _signature: Any, args: list[Any]) -> Any:
        whole = builder.bitcast(args[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", whole, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(mask), emit


@_in_compiled
def everywhere(_context: Any, value: types.Type) -> Any:
    """The same in every lane: lanes of a number, a mask of a truth."""
    if not isinstance(value, types.Boolean):
        return _LANES(_LANES), lambda _context, _builder, _signature, args: args[0]

    def emit(_context: Any, builder: ir.IRBuilder, _signature: Any, args: list[Any]) -> Any:
        return builder.select(args[0], ir.Constant(_TRUTHS, [1] * LANES), ir.Constant(_TRUTHS, [0] * LANES))

    return _MASK(types.boolean), emit


@_in_compiled
def where(_context: Any, mask: types.Type, yes: types.Type, no: types.Type) -> Any:
    """Of each lane `yes` where the mask holds, else `no`: lanes, numbers, or tuples of these, however deep."""
    result = _as_lanes(yes)
    if result != _as_lanes(no):
        return None

    def emit(_context: Any, builder: ir.IRBuilder, _signature: Any, args: list[Any]) -> Any:
        return _selected(builder, *args)

    return result(mask, result, result), emit


def _as_lanes(given: Any) -> types.Type:
    """The type of lanes, or of tuples of them, that holds this one."""
    if isinstance(given, types.BaseTuple):
        return types.Tuple([_as_lanes(each) for each in given.types])  # type: ignore[attr-defined]
    return _LANES


def _selected(builder: ir.IRBuilder, mask: Any, yes: Any, no: Any) -> Any:
    """`where` of values, or of each element of tuples."""
    if yes.type == _DOUBLES:
        return builder.select(mask, yes, no)
    out = ir.Constant(yes.type, ir.Undefined)
    for k in range(len(yes.type.elements)):
        each = _selected(builder, mask, builder.extract_value(yes, k), builder.extract_value(no, k))
        out = builder.insert_value(out, each, k)
    return out


@_in_compiled
def in_lanes(_context: Any, array: Any) -> Any:
    """A float64 array [..., LANES] made by `zeros` as one of Lanes [...], of the same memory."""
    result: Any = types.Array(_LANES, array.ndim - 1, "C")

    def emit(context: Any, builder: ir.IRBuilder, _signature: Any, args: list[Any]) -> Any:
        plain = context.make_array(array)(context, builder, args[0])
        lanes = context.make_array(result)(context, builder)
        shape = cgutils.unpack_tuple(builder, plain.shape, array.ndim)[:-1]
        strides = cgutils.unpack_tuple(builder, plain.strides, array.ndim)[:-1]
        count = ir.Constant(ir.IntType(64), 1)
        for each in shape:
            count = builder.mul(count, each)
        lanes.data = builder.bitcast(plain.data, lanes.data.type)
        lanes.shape, lanes.strides = (cgutils.pack_array(builder, x, ir.IntType(64)) for x in (shape, strides))
        lanes.nitems, lanes.itemsize = count, ir.Constant(ir.IntType(64), BYTES)
        lanes.meminfo = ir.Constant(lanes.meminfo.type, None)
        lanes.parent = ir.Constant(lanes.parent.type, None)
        return lanes._getvalue()

    return result(array), emit


@_in_compiled
def align_stack(_context: Any) -> Any:
    """Lets the calling function keep lanes on its stack where none lies across two lines of the cache."""

    def emit(context: Any, builder: ir.IRBuilder, _signature: Any, _args: list[Any]) -> Any:
        builder.function.attributes.add("nounwind")  # llvmlite writes an alignment only beside another attribute
        builder.function.attributes.alignstack = BYTES
        return context.get_dummy_value()

    return types.none(), emit


def zeros(*shape: int) -> np.ndarray:
    """Zeros [*shape, LANES] where lanes may lie."""
    size = math.prod(shape) * LANES
    flat = np.zeros(size + LANES)
    first = -flat.__array_interface__["data"][0] % BYTES // 8
    return flat[first : first + size].reshape(*shape, LANES)
