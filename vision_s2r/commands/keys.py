"""The keys of a command's configuration with their comments, from files: help and completion import nothing else."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from vision_s2r.commands.table import Command
from vision_s2r.paths import CONFIGS

TABLE = Path(__file__).with_name("keys.json")  # of config_reference: every key, its default, its comment
_OWN = ("defaults", "hydra")  # Hydra's, not the task's
_GLOBAL = "@package _global_"  # of a file whose keys land at the top
_NAMED = ".NAME."  # in keys below what the user names


@dataclass(frozen=True)
class Key:
    """One key, with its value where nothing else is given; that of a key that holds others is None."""

    name: str
    value: str | None
    comment: str


@dataclass(frozen=True)
class Group:
    """A choice of files: `camera=phone`."""

    key: str  # as it is typed: "camera", "grasp@baseline"
    package: str  # where its keys land: "camera", "baseline"
    chosen: str
    options: tuple[str, ...]


def keys(command: Command, every: bool = False) -> list[Key]:
    """What the command's help explains, or every key that it takes, in the order of the configuration."""
    found = _keys(command.config)
    if every or not command.keys:
        return found
    return [key for part in command.keys for key in found if _belongs(key, part, found)]


def _belongs(key: Key, part: str, found: list[Key]) -> bool:
    """Whether a key is in a part of the configuration, "" being what is at its top and in no part."""
    parts = {each.name for each in found if each.value is None and "." not in each.name}
    top = key.name.partition(".")[0]
    return key.name.startswith(f"{part}.") if part else top not in parts


def groups(command: Command) -> list[Group]:
    """The choices of the command's configuration, in its order."""
    return list(_groups(command.config))


def _groups(config: str) -> Iterator[Group]:
    for entry in _load(config).get("defaults", []):
        if isinstance(entry, str):  # another file below this one; a schema and _self_ are none
            yield from _groups(entry) if (CONFIGS / f"{entry}.yaml").exists() else ()
            continue
        ((key, chosen),) = entry.items()
        if key.startswith(("override ", "optional ")):
            continue
        group, _, package = key.partition("@")
        options = sorted(path.stem for path in (CONFIGS / group).glob("*.yaml"))
        yield Group(key, package or group, str(chosen), tuple(options))


@cache
def _keys(config: str) -> list[Key]:
    """Every key with the value that the files give it, which the usual choices name."""
    found = {name: Key(name, value, comment) for name, value, comment in _table(config)}
    for name, value in _set(config):
        if name in found and found[name].value is not None:
            found[name] = replace(found[name], value=value)
    return [key for key in found.values() if _NAMED not in key.name]


def _table(config: str) -> list[list[Any]]:
    """Names, defaults and comments of a configuration's own keys, and of those below it."""
    found = list(json.loads(TABLE.read_text(encoding="utf-8"))[config])
    for entry in _load(config).get("defaults", []):
        if isinstance(entry, str) and (CONFIGS / f"{entry}.yaml").exists():
            found += _table(entry)
    return found


def _set(config: str) -> Iterator[tuple[str, str]]:
    """What a file and its usual choices set: names and values."""
    for entry in _load(config).get("defaults", []):
        if isinstance(entry, str) and (CONFIGS / f"{entry}.yaml").exists():
            yield from _set(entry)
    for group in _groups(config):
        path = CONFIGS / group.key.partition("@")[0] / f"{group.chosen}.yaml"
        if _GLOBAL not in path.read_text(encoding="utf-8"):  # sizes of it all are no defaults
            yield from _leaves(_read(path), f"{group.package}.")
    yield from _leaves(_load(config), "")


def _leaves(content: dict[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    for name, value in content.items():
        if prefix or name not in _OWN:
            if isinstance(value, dict):
                yield from _leaves(value, f"{prefix}{name}.")
            text = yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, width=10**9, sort_keys=False)
            yield f"{prefix}{name}", text.removesuffix("...\n").strip()


def _load(name: str) -> dict[str, Any]:
    return _read(CONFIGS / f"{name}.yaml")


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    return content
