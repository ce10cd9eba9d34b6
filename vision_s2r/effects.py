"""The shared vocabulary: effects, the named, bounded, physical departures of the real from the simulated.

An effect declares itself: its name, which of the five sources of the reality gap it belongs to, and its
parameters with units, physical bounds and the value at which it vanishes. Joints, cameras and contacts each
subclass `Effect` with what it does to them, and keep their effects in a `Registry`. Applying, randomizing,
identifying and diagnosing are verbs built on this elsewhere; what one of them needs of an effect beyond this is
a record in its `Records`, one file an effect.

Effects of other packages are modules that they install as entry points in the group `vision_s2r.effects`, under
names that begin with the kind ("joint.air_drag"). Such a module registers the effect and its records.
"""

import inspect
import math
import sys
from collections.abc import ItemsView, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any, ClassVar, Generic, Literal, TypeVar

from vision_s2r.errors import UserError, nearest

Source = Literal["dynamics", "actuator", "camera", "appearance", "contact"]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    `low` and `high` are its physical bounds, inclusive. `neutral` is the value at which the effect vanishes: it
    may lie outside the bounds (an infinite full well has no shot noise), and is None for a parameter that
    switches nothing by itself (a direction). `moderate` is a plainly visible setting, the start of a search or
    the example in a table; one in pixels is meant for a picture of 128. `scale` says in which measure equal
    steps matter equally, for drawing and for fitting. One that is `optional` is neutral where it is not given, and
    does not switch its effect.
    """

    name: str
    unit: str  # "" for a pure number
    low: float
    high: float
    neutral: float | None
    moderate: float
    scale: Literal["linear", "log"] = "linear"
    optional: bool = False

    def __post_init__(self) -> None:
        if not self.low <= self.moderate <= self.high or (self.scale == "log" and self.low <= 0):
            raise ValueError(f"parameter '{self.name}' contradicts itself: {self}")

    def check(self, value: object, where: str) -> float:
        """`value` as a float, neutral or within the bounds; else UserError, which begins with `where`."""
        if isinstance(value, int) and abs(value) > sys.float_info.max:
            value = math.nan
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise UserError(f"{where}: {self.name} is {value!r}, expected a number")
        if value != self.neutral and not self.low <= value <= self.high:
            unit = f" {self.unit}" if self.unit else ""
            raise UserError(
                f"{where}: {self.name} is {value:g}, expected {self.low:g} to {self.high:g}{unit}"
                + ("" if self.neutral is None else f" (or {self.neutral:g}, neutral)")
            )
        return float(value)


class Effect:
    """A departure of the real from the simulated. Subclasses say what it does, in one file each."""

    name: ClassVar[str]
    source: ClassVar[Source]
    parameters: ClassVar[tuple[Parameter, ...]]

    def parameter(self, name: str) -> Parameter:
        """The parameter called `name`; UserError with the nearest name where there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise UserError(f"{self.name} has no parameter '{name}': {nearest(name, [p.name for p in self.parameters])}")

    def check(self, values: Mapping[str, object], where: str = "") -> dict[str, float]:
        """All parameters as floats, in declared order; UserError for a name, gap or value that cannot be."""
        for name in values:
            self.parameter(name)
        missing = [p.name for p in self.parameters if p.name not in values and not p.optional]
        if missing:
            raise UserError(f"{where or self.name}: missing {', '.join(missing)}")
        return {p.name: p.check(values.get(p.name, p.neutral), where or self.name) for p in self.parameters}

    def is_neutral(self, values: Mapping[str, Any]) -> Any:
        """Whether the effect vanishes: every parameter that has a neutral value, and is not optional, is at it.

        `values` are floats, or arrays or tensors of one shape; then so is the answer. An effect none of whose
        parameters has a neutral value (it replaces a nominal one) never vanishes.
        """
        switches = [values[p.name] == p.neutral for p in self.parameters if not (p.neutral is None or p.optional)]
        neutral = switches[0] if switches else False
        for switch in switches[1:]:
            neutral = neutral & switch
        return neutral

    @property
    def one_sided(self) -> bool:
        """Whether it can only grow from nothing: what switches it may be no less than neutral."""
        switches = [p for p in self.parameters if not (p.neutral is None or p.optional)]
        return bool(switches) and all(p.neutral == p.low for p in switches)

    def moderate(self) -> dict[str, float]:
        """The effect at a plainly visible setting."""
        return {p.name: p.moderate for p in self.parameters}


def summary(effect: Effect) -> str:
    """The first sentence about an effect."""
    return (effect.__doc__ or effect.name).strip().splitlines()[0]


def unqualified(name: str) -> str:
    """The effect's own name, where `name` is that of an effect of one part: albedo, of "2.albedo"."""
    return name.rpartition(".")[2]


E = TypeVar("E", bound=Effect)
R = TypeVar("R")
GROUP = "vision_s2r.effects"  # of entry points
KINDS = ("joint", "camera", "contact", "arm")


class Registry(Generic[E]):
    """The effects of one kind (joint, camera, contact) by name, in the order of registration."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._effects: dict[str, E] = {}
        self._closed = ""

    def load_installed(self) -> None:
        """Import what other packages install for this kind, which registers it."""
        for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
            kind = entry.name.partition(".")[0]
            if kind not in KINDS:
                raise UserError(f"entry point '{entry.name}' in {GROUP}: {nearest(kind, KINDS)}, then a dot and a name")
            if kind == self.kind:
                entry.load()

    def close(self, why: str) -> None:
        """Let no more effects in."""
        self._closed = why

    def register(self, effect: type[E]) -> type[E]:
        """Class decorator: an instance of the class joins the registry."""
        if self._closed:
            raise RuntimeError(f"{self.kind} effect '{effect.name}' comes too late: {self._closed}")
        if inspect.isabstract(effect) or effect.name in self._effects:
            raise ValueError(f"{self.kind} effect '{effect.name}' is abstract or registered twice")
        self._effects[effect.name] = effect()
        return effect

    def __or__(self, other: "Registry[Any]") -> "Registry[Any]":
        """The effects of both, these first."""
        both: Registry[Any] = Registry(self.kind)
        both._effects = {**self._effects, **other._effects}
        return both

    def __getitem__(self, name: str) -> E:
        """The effect of this name, which may be that of one part."""
        if name not in self:
            raise UserError(f"no {self.kind} effect is called '{name}': {nearest(name, self._effects)}")
        return self._effects[unqualified(name)]

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and unqualified(name) in self._effects

    def __iter__(self) -> Iterator[E]:
        return iter(self._effects.values())

    def __len__(self) -> int:
        return len(self._effects)


class Records(Generic[R]):
    """What a verb needs to know of each effect of one kind: one record an effect."""

    def __init__(self, kind: str, verb: str) -> None:
        self.kind, self.verb = kind, verb
        self._records: dict[str, R] = {}

    def register(self, effect: str, record: R) -> None:
        """The record of the effect of this name."""
        if effect in self._records:
            raise ValueError(f"{self.verb} {self.kind} effect '{effect}' is registered twice")
        self._records[effect] = record

    def __getitem__(self, effect: str) -> R:
        """The record of the effect of this name, which may be that of one part."""
        if effect not in self:
            raise UserError(f"{self.kind} effect '{effect}' has no record for {self.verb}")
        return self._records[unqualified(effect)]

    def __contains__(self, effect: object) -> bool:
        return isinstance(effect, str) and unqualified(effect) in self._records

    def __iter__(self) -> Iterator[str]:
        return iter(self._records)

    def items(self) -> ItemsView[str, R]:
        """Names and records."""
        return self._records.items()
