"""What the command line says of itself."""

import os
import shutil
import sys
import textwrap
from collections.abc import Iterator
from functools import partial

from vision_s2r.commands.keys import Group, Key, groups, keys
from vision_s2r.commands.table import COMMANDS, FAMILIES, Command

PROGRAM = "vision-s2r"
_LONGEST = 60  # characters of a value
_WIDTH = 100


def overview() -> str:
    """All commands, with a line each."""
    lines = [
        f"{_bold('Usage:')} {PROGRAM} COMMAND [KEY=VALUE …]",
        "",
        "Close, and diagnose, the gap between simulated and real robots that see.",
    ]
    for group in dict.fromkeys(command.group for command in COMMANDS.values()):
        listed = {}
        for command in COMMANDS.values():
            name = command.name.split()[0]
            if command.group == group:
                listed[name] = FAMILIES.get(name, command.help)
        lines += ["", _bold(f"{group}:"), *_table(listed)]
    other = {
        "completion": f'Completion for a shell: eval "$({PROGRAM} completion bash)", or zsh',
        "COMMAND --help": "What a command does, examples, choices and keys",
        "--version": "The version",
    }
    lines += ["", _bold("Other:"), *_table(other), "", _bold("Examples:")]
    return "\n".join([*lines, *_examples(COMMANDS["run"]), *_examples(COMMANDS["diagnose"])])


def family(name: str) -> str:
    """The commands that begin with this word."""
    members = {key.split()[1]: each.help for key, each in COMMANDS.items() if key.split()[0] == name}
    lines = [f"{_bold('Usage:')} {PROGRAM} {name} {'|'.join(members)} [KEY=VALUE …]"]
    return "\n".join([*lines, "", f"{FAMILIES[name]}.", "", _bold("Commands:"), *_table(members)])


def of(command: Command) -> str:
    """What a command does, examples, choices and keys."""
    lines = [f"{_bold('Usage:')} {PROGRAM} {command.name} [KEY=VALUE …]", "", f"{command.help}."]
    if command.examples:
        lines += ["", _bold("Examples:"), *_examples(command)]
    choices = {group.key: " | ".join(map(partial(_marked, group.chosen), group.options)) for group in _telling(command)}
    if choices:
        lines += ["", _bold("Choices:"), *_table(choices)]
    lines += ["", _bold("Keys:"), *_keys(keys(command)), "", _bold("Hydra's own:")]
    own = {
        "--multirun": "With KEY=A,B: one run after another",
        "--cfg job": "Print the whole configuration instead",
    }
    return "\n".join([*lines, *_table(own)])


def _telling(command: Command) -> list[Group]:
    """Where there is a choice; not those that another command is about (a rival's translator)."""
    asked = set(command.keys)
    every = not asked or "" in asked
    return [
        group
        for group in groups(command)
        if len(group.options) > 1 and (every or group.package in asked or "@" not in group.key)
    ]


def _marked(chosen: str, option: str) -> str:
    return _bold(f"[{option}]") if option == chosen else option


def _examples(command: Command) -> list[str]:
    start = f"  {PROGRAM} {command.name}"
    return [f"{start} {arguments}  {_dim(f'# {purpose}')}" for arguments, purpose in command.examples]


def _table(rows: dict[str, str]) -> list[str]:
    width = max(map(len, rows)) + 4
    lines = []
    for name, text in rows.items():
        first, *rest = textwrap.wrap(text, max(_width() - width, 30)) or [""]
        lines += [f"  {name:<{width - 2}}{first}", *(" " * width + line for line in rest)]
    return lines


def _keys(found: list[Key]) -> Iterator[str]:
    """A comment stands under the keys that share it."""
    comment = ""
    for key, following in zip(found, [*found[1:], None], strict=True):
        yield f"  {_bold(key.name)}{'.…' if key.value is None else '=' + _short(key.value)}"
        comment = key.comment or comment
        if following is None or following.comment:
            yield from textwrap.wrap(comment, _width() - 6, initial_indent=" " * 6, subsequent_indent=" " * 6)
            comment = ""


def _short(value: str) -> str:
    return value if len(value) <= _LONGEST else f"{value[: _LONGEST - 1]}…"


def _width() -> int:
    return min(shutil.get_terminal_size((_WIDTH, 24)).columns, _WIDTH)


def _bold(text: str) -> str:
    return _styled(text, 1)


def _dim(text: str) -> str:
    return _styled(text, 2)


def _styled(text: str, code: int) -> str:
    colours = sys.stdout.isatty() and "NO_COLOR" not in os.environ
    return f"\x1b[{code}m{text}\x1b[0m" if colours else text
