"""Configuration keys: a default, a comment and bounds each, said once in the dataclass that holds them.

`option` declares a key, `validate` checks every key of a configuration, `config_reference` writes them all down.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

from vision_s2r.errors import UserError, nearest

_OPTION = "option"


@dataclass(frozen=True)
class Option:
    """What may be said of one key; of a list or a mapping, of each of its elements."""

    comment: str
    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf  # as low, itself excluded
    below: float = math.inf  # as high, itself excluded
    choices: Sequence[str] = ()
    multiple: int = 0  # 0: any
    length: int = 0  # of a list; 0: any
    rising: bool = False
    unique: bool = False

    def check(self, key: str, value: Any) -> None:
        """UserError where `value` cannot be."""
        values = value if isinstance(value, list) else [value]
        for each in values if self.choices else ():
            if each not in self.choices:
                raise UserError(f"{key} = {each!r}: {nearest(str(each), filter(None, self.choices))}")
        if not all(map(self._within, values)) or (isinstance(value, list) and not self._shaped(value)):
            raise UserError(f"{key} = {value}: expected {self.expected(isinstance(value, list))}")

    def expected(self, many: bool = False) -> str:
        """What a value may be, in words; empty where it may be anything. `many`: of a list."""
        if self.choices:
            return " | ".join(each or '""' for each in self.choices)
        parts = [
            f"{self.length} values" if many and self.length else "",
            "rising" if many and self.rising else "",
            "each once" if many and self.unique else "",
            f"multiples of {self.multiple}" if self.multiple else "",
            " ".join(self._bounds()),
        ]
        return ", ".join(part for part in parts if part)

    def _bounds(self) -> Iterator[str]:
        if math.isfinite(self.low):
            yield f"{self.low:g} to" if math.isfinite(min(self.high, self.below)) else f"at least {self.low:g}"
        if math.isfinite(self.above):
            yield f"above {self.above:g}"
        if math.isfinite(self.high):
            yield f"{self.high:g}" if math.isfinite(self.low) else f"up to {self.high:g}"
        if math.isfinite(self.below):
            yield f"below {self.below:g}"

    def _within(self, value: Any) -> bool:
        if isinstance(value, list | dict):  # in a list, where OmegaConf lets them pass for numbers
            return self == Option(self.comment)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return True
        inside = self.low <= value <= self.high and (self.above < value or math.isinf(self.above))
        return (
            inside and (value < self.below or math.isinf(self.below)) and not (self.multiple and value % self.multiple)
        )

    def _shaped(self, values: list[Any]) -> bool:
        return (
            (not self.length or len(values) == self.length)
            and (not self.rising or values == sorted(values))
            and (not self.unique or len(set(values)) == len(values))
        )


def option(
    default: Any,
    comment: str,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    above: float = -math.inf,
    below: float = math.inf,
    choices: Sequence[str] = (),
    multiple: int = 0,
    length: int = 0,
    rising: bool = False,
    unique: bool = False,
) -> Any:
    """A field of a configuration. `default`: a value, copied for each instance, or the class of a part.

    `comment` says what it is, and its unit. Bounds and choices are as in `Option`; None is always allowed.
    """
    limits = Option(comment, low, high, above, below, choices, multiple, length, rising, unique)
    factory = default if isinstance(default, type) else lambda: deepcopy(default)
    return field(default_factory=factory, metadata={_OPTION: limits})


def declared(cfg: object) -> Iterator[tuple[str, Any, Option]]:
    """The keys of a configuration's own, not those of its parts: name, value, what may be said of it."""
    for each in fields(cfg):  # type: ignore[arg-type]  # a dataclass
        yield each.name, getattr(cfg, each.name), each.metadata[_OPTION]


def validate(cfg: object, where: str = "") -> None:
    """Check every key below a configuration. Raises UserError with the key below `where`, its value, what it may be."""
    for name, value, limits in declared(cfg):
        _validate(f"{where}.{name}" if where else name, value, limits)


def _validate(key: str, value: Any, limits: Option) -> None:
    if is_dataclass(value):
        validate(value, key)
    elif isinstance(value, Mapping):
        for name, element in value.items():
            _validate(f"{key}.{name}", element, limits)
    elif value is not None:
        limits.check(key, value)
