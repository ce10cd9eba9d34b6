"""The keys of a command's configuration with the comments over them, read from the files without Hydra."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import yaml

from vision_s2r.commands.table import Command
from vision_s2r.paths import CONFIGS

_OWN = ("defaults", "hydra")  # Hydra's, not the task's
_GLOBAL = "@package _global_"  # of a file whose keys land at the top


@dataclass(frozen=True)
class Key:
    """One key, with its value as the file has it; that of a key that holds others is None."""

    name: str
    value: str | None
    comment: str  # empty where it shares that of the key before it


@dataclass(frozen=True)
class Group:
    """A choice of files: `camera=phone`."""

    key: str  # as it is typed: "camera", "grasp@baseline"
    package: str  # where its keys land: "camera", "baseline"
    chosen: str
    options: tuple[str, ...]


def keys(command: Command, every: bool = False) -> list[Key]:
    """What the command's help explains, or every key that it takes, in the order of the files."""
    found = _sections(command.config)
    chosen = found if every or not command.keys else command.keys
    return [key for section in chosen for key in found[section]]


def groups(command: Command) -> list[Group]:
    """The choices of the command's configuration, in its order."""
    return list(_groups(command.config))


def _groups(config: str) -> Iterator[Group]:
    for entry in _load(config).get("defaults", []):
        if isinstance(entry, str):  # another file below this one; a schema and _self_ are none
            yield from _groups(entry) if (CONFIGS / f"{entry}.yaml").exists() else ()
            continue
        ((key, chosen),) = entry.items()
        if key.startswith("override "):
            continue
        group, _, package = key.partition("@")
        options = sorted(path.stem for path in (CONFIGS / group).glob("*.yaml"))
        yield Group(key, package or group, str(chosen), tuple(options))


@cache
def _sections(config: str) -> dict[str, list[Key]]:
    """Keys by the part of the configuration that they are in: "" for those at its top."""
    found: dict[str, list[Key]] = {"": []}
    for entry in _load(config).get("defaults", []):
        if isinstance(entry, str) and (CONFIGS / f"{entry}.yaml").exists():
            found |= _sections(entry)
    found[""] = [*_file(config, ""), *found[""]]
    for group in _groups(config):
        name = f"{group.key.partition('@')[0]}/{group.chosen}"
        if _GLOBAL in (CONFIGS / f"{name}.yaml").read_text(encoding="utf-8"):  # sizes of others' keys, and its own
            found[""] += [key for key in _file(name, "") if key.name.startswith(f"{group.package}.")]
        else:
            found[group.package] = list(_file(name, f"{group.package}."))
    return found


def _load(name: str) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load((CONFIGS / f"{name}.yaml").read_text(encoding="utf-8"))
    return content


def _file(name: str, prefix: str) -> Iterator[Key]:
    text = (CONFIGS / f"{name}.yaml").read_text(encoding="utf-8")
    root, lines = yaml.compose(text, yaml.SafeLoader), text.splitlines()
    lines[0] = ""  # says what the file is, not what its first key is
    for key, value in root.value if isinstance(root, yaml.MappingNode) else []:
        if key.value not in _OWN:
            yield from _keys(key, value, prefix, lines)


def _keys(key: yaml.Node, value: yaml.Node, prefix: str, lines: list[str]) -> Iterator[Key]:
    name, comment = f"{prefix}{key.value}", _comment(lines, key.start_mark.line)
    if not isinstance(value, yaml.MappingNode) or value.flow_style:
        plain = yaml.safe_load(yaml.serialize(value))
        shown = yaml.safe_dump(plain, default_flow_style=True, allow_unicode=True, width=10**9)
        yield Key(name, shown.removesuffix("...\n").strip(), comment)
        return
    if comment:
        yield Key(name, None, comment)
    for below, what in value.value:
        yield from _keys(below, what, f"{name}.", lines)


def _comment(lines: list[str], at: int) -> str:
    """The comment in the lines directly above line `at`."""
    first = at
    while first and lines[first - 1].lstrip().startswith("#"):
        first -= 1
    return " ".join(line.lstrip("# ") for line in lines[first:at])
