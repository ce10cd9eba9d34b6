"""Ranges: what one number is drawn from, and how an effect is drawn."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import InitVar, dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np

from vision_s2r.effects import Effect, Registry
from vision_s2r.errors import UserError

Scale = Literal["linear", "log"]
A = TypeVar("A")  # a numpy array or a torch tensor


@dataclass(frozen=True)
class Range:
    """What one number is drawn from: `low` to `high`, both included; a fixed number where they are the same.

    Raises UserError, which begins with `where`, unless low <= high.
    """

    low: float
    high: float
    where: InitVar[str] = field(default="range", kw_only=True)

    def __post_init__(self, where: str) -> None:
        if not self.low <= self.high:
            raise UserError(f"{where} is [{self.low:g}, {self.high:g}], expected low before high")

    def __iter__(self) -> Iterator[float]:
        """To unpack: `low, high = range`."""
        return iter((self.low, self.high))

    def at(self, unit: A, scale: Scale = "linear") -> A:
        """Values for numbers `unit` in [0, 1], of its shape: 0 is low and 1 is high.

        Uniform numbers become uniform or, on the log scale (which begins above 0), log-uniform values.
        """
        share: Any = unit
        if self.low == self.high:  # which may be infinite
            return share * 0 + self.low
        if scale == "log":
            return (self.low * (self.high / self.low) ** share).clip(self.low, self.high)
        return (self.low + (self.high - self.low) * share).clip(self.low, self.high)

    def position(self, value: float, scale: Scale = "linear") -> float:
        """The inverse of `at`: where between low (0) and high (1) a finite value lies, or beyond them.

        The range must not be a point.
        """
        if scale == "log":
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def holds(self, values: np.ndarray) -> np.ndarray:
        """Which values lie in the range: bool, of their shape."""
        return (self.low <= values) & (values <= self.high)

    def uniform(self, rng: np.random.Generator, size: int | None = None) -> Any:
        """Uniform in the range: a float, or an array [size]."""
        return rng.uniform(self.low, self.high, size)

    def integer(self, rng: np.random.Generator) -> int:
        """A whole number of the range, uniform; low and high are whole."""
        return int(rng.integers(int(self.low), int(self.high) + 1))


@dataclass(frozen=True)
class EffectRange:
    """How an effect is drawn: with what probability it is on, and the range of each parameter."""

    probability: float
    ranges: dict[str, Range]


def effect_ranges(effects: Mapping[str, Mapping[str, Any]], registry: Registry[Any]) -> dict[str, EffectRange]:
    """The `effects` of a configuration, checked and typed; UserError where they cannot be.

    By effect: `probability` (1 if left out) and each of its parameters, a number or [low, high].
    """
    if not isinstance(effects, Mapping):
        raise UserError(f"effects is {effects!r}, expected effects by name")
    return {str(name): _effect_range(registry[str(name)], given) for name, given in effects.items()}


def _effect_range(effect: Effect, given: Mapping[str, Any]) -> EffectRange:
    name = effect.name
    if not isinstance(given, Mapping):
        raise UserError(f"{name} is {given!r}, expected its parameters")
    probability = given.get("probability", 1.0)
    if isinstance(probability, bool) or not isinstance(probability, int | float) or not 0 <= probability <= 1:
        raise UserError(f"{name}: probability is {probability!r}, expected 0 to 1")
    pairs = {str(key): _pair(f"{name}: {key}", value) for key, value in given.items() if key != "probability"}
    low = effect.check({key: low for key, (low, _) in pairs.items()})
    high = effect.check({key: high for key, (_, high) in pairs.items()})
    ranges = {key: Range(low[key], high[key], where=f"{name}: {key}") for key in low}
    for key, (lowest, highest) in ranges.items():
        if lowest != highest == float("inf"):
            raise UserError(f"{name}: {key} is [{lowest:g}, inf], expected a finite range to draw from")
        bound = effect.parameter(key).low
        if lowest != highest and lowest < bound:  # neutral, from where no log scale begins
            raise UserError(
                f"{name}: {key} is [{lowest:g}, {highest:g}], expected a range from {bound:g} on to draw from"
            )
    return EffectRange(float(probability), ranges)


def _pair(where: str, value: Any) -> tuple[Any, Any]:
    if not isinstance(value, Sequence) or isinstance(value, str):
        return value, value
    if len(value) != 2:
        raise UserError(f"{where} is {list(value)}, expected a number or [low, high]")
    return value[0], value[1]
