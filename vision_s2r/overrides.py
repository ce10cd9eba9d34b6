"""Overrides that add, +KEY=VALUE: Hydra adds keys that no schema has, and knows no type of a mapping's new element."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, OmegaConf, open_dict
from omegaconf.errors import OmegaConfBaseException

from vision_s2r.errors import UserError, nearest


class Element(NamedTuple):
    """What an override adds to a mapping of options, such as the rows of a table, or sets in one of its elements."""

    key: str  # of the mapping
    name: str
    kind: Any  # the element's schema
    value: dict[str, Any]


def split(schema: type, overrides: Sequence[str]) -> tuple[list[str], list[Element]]:
    """Overrides for Hydra, and elements of mappings of options that others add.

    Raises UserError where one adds a key that the schema has not, and hydra.errors.HydraException where it is none.
    """
    for_hydra, elements = [], []
    for override in overrides:
        element = _element(schema, override) if override.startswith("+") else None
        if element:
            elements.append(element)
        else:
            for_hydra.append(override)
    return for_hydra, elements


def add(cfg: DictConfig, element: Element) -> None:
    """Add an element to a composed configuration. Raises UserError where a value has another type."""
    mapping = OmegaConf.select(cfg, element.key)
    try:
        here = OmegaConf.to_container(mapping[element.name]) if element.name in mapping else {}
        found = OmegaConf.merge(OmegaConf.structured(element.kind), here, element.value)
    except OmegaConfBaseException as error:
        where = f"{element.key}.{element.name}.{getattr(error, 'full_key', None) or ''}"
        raise UserError(f"configuration key '{where}': {str(error).splitlines()[0]}") from error
    with open_dict(mapping):
        mapping[element.name] = found


def _element(schema: Any, override: str) -> Element | None:
    """The element that the override adds; None where it adds something else."""
    kind, parts = schema, override.lstrip("+").partition("=")[0].split(".")
    for place, part in enumerate(parts):
        if get_origin(kind) is dict:
            of = get_args(kind)[1]
            return _parsed(override, parts, place, of) if is_dataclass(of) else None
        # Alone, a part may be a group of configurations.
        kind = next((each for each in (kind, *get_args(kind)) if is_dataclass(each)), None)
        if kind is None or len(parts) == 1:
            return None
        _check(part, kind, parts[:place])
        kind = get_type_hints(kind)[part]
    return None


def _parsed(override: str, parts: list[str], place: int, kind: Any) -> Element:
    value = OverridesParser.create().parse_override(override.lstrip("+")).value()
    for part in reversed(parts[place + 1 :]):
        value = {part: value}
    where = parts[: place + 1]
    if not isinstance(value, dict):
        example = fields(kind)[0].name
        raise UserError(
            f"configuration key '{'.'.join(where)}' is {value!r}: expected options, such as {{{example}: …}}"
        )
    for part in value:
        _check(str(part), kind, where)
    return Element(".".join(parts[:place]), parts[place], kind, {str(part): each for part, each in value.items()})


def _check(part: str, kind: Any, where: list[str]) -> None:
    known = [each.name for each in fields(kind)]
    if part not in known:
        raise UserError(f"unknown configuration key '{'.'.join([*where, part])}': {nearest(part, known)}")
